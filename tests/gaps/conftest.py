"""Hands that move as they are told, with gaps where they are told."""

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.recording import Recording, trajectories
from handclean.tree import POSE_HEAD

RATE = 100.0


class Scenes:
    """Takes of the template hand with schroeder17's markers."""

    rate = RATE

    def __init__(self):
        self.subject = template_subject(load_marker_set("schroeder17"))
        self.model = self.subject.model
        self.labels = self.model.labels

    def waving(self, rng, frames, root=True):
        """(T, 7 + D) poses of a hand that opens and closes and turns, smoothly."""
        tree, t = self.model.tree, np.arange(frames) / RATE
        low, high = tree.limits.T
        middle, room = 0.5 * (low + high), 0.5 * (high - low)
        poses = np.zeros((frames, POSE_HEAD + len(tree.hinges)))
        phase = rng.uniform(0.0, 2.0 * np.pi, len(tree.hinges))
        pace = rng.uniform(0.3, 1.0, len(tree.hinges))
        swing = np.sin(2.0 * np.pi * pace * t[:, None] + phase)
        poses[:, POSE_HEAD:] = middle + 0.35 * room * swing
        poses[:, 3] = 1.0
        if root:
            angle = 0.4 * np.sin(2.0 * np.pi * 0.4 * t)
            poses[:, 3], poses[:, 5] = np.cos(angle), np.sin(angle)
            poses[:, :3] = 0.1 * np.sin(np.outer(t, [1.0, 2.0, 3.0]))
        return poses

    def take(self, poses, noise=0.0, rng=None, model=None):
        """A take in which every marker is seen all the time."""
        places = marker_positions(model or self.model, poses)
        if noise:
            places = places + rng.normal(scale=noise, size=places.shape)
        markers = trajectories(places, self.labels)
        return Recording(rate=RATE, frames=len(poses), markers=markers)

    def column(self, label):
        return self.labels.index(label)

    def without(self, take, *gaps):
        """The take with gaps: (label or labels, start, stop)."""
        from dataclasses import replace

        positions = take.markers.positions.copy()
        origin = take.markers.origin.copy()
        for labels, start, stop in gaps:
            for label in [labels] if isinstance(labels, str) else labels:
                positions[start:stop, self.column(label)] = np.nan
                origin[start:stop, self.column(label)] = 0
        markers = replace(take.markers, positions=positions, origin=origin)
        return replace(take, markers=markers)


@pytest.fixture(scope="session")
def scenes():
    return Scenes()
