"""A hand set out for tracking: its target, tracker, poses and points."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig
from handclean.io.hdf5.prior import read_prior
from handclean.labels.settings import LabelConfig
from handclean.labels.target import TrackTarget, make_target
from handclean.labels.track.state import FrameSequence, new_state, start_stats
from handclean.labels.track.tracker import (
    Tracker,
    TrackSetup,
    make_tracker,
    track_setup,
)

RATE = 100.0  # [Hz]


@dataclass(frozen=True)
class Hand:
    """A template hand with 26 markers, as if it were calibrated to a millimetre."""

    target: TrackTarget
    setup: TrackSetup
    tracker: Tracker

    @property
    def markers(self):
        return len(self.target.sigma)

    def pose(self, flexion=0.3, place=(0.1, 0.2, 0.3)):
        """(7 + D,) every flexion hinge at the same share of its largest angle."""
        tree = self.target.model.tree
        pose = neutral_pose(tree)
        pose[:3] = place
        for d, name in enumerate(tree.hinges):
            if name.endswith("flexion"):
                pose[7 + d] = flexion * tree.limits[d, 1]
        return pose

    def points(self, poses):
        """(T, M, 3) [m] where poses (T, 7 + D) put the markers."""
        return marker_positions(self.target.model, np.atleast_2d(poses))

    def state(self, pose):
        state = new_state(self.markers, len(self.target.mean))
        state.pose[:] = pose
        state.last_pose[:] = pose
        return state

    def stats(self, unseen=None):
        unseen = np.zeros(self.markers, dtype=int) if unseen is None else unseen
        return start_stats(self.target, self.setup.rules, np.asarray(unseen))

    def finger(self, name):
        """(M,) markers on the finger that the first hinge so named is of."""
        hinges = self.target.model.tree.hinges
        at = next(d for d, hinge in enumerate(hinges) if hinge.startswith(name))
        return self.tracker.branch == self.tracker.hinge_branch[at]


def sequence_of(frames, previous=None):
    """Frames' points (P, 3) as a sequence, without paths unless they are given."""
    at = np.concatenate([np.zeros((0, 3)), *frames])
    start = np.concatenate([[0], np.cumsum([len(points) for points in frames])])
    previous = np.full(len(at), -1) if previous is None else previous
    return FrameSequence(at, start, previous)


@pytest.fixture(scope="session")
def hand():
    subject = template_subject(load_marker_set("maycock26"))
    target = make_target(subject, read_prior())
    sigma = np.full(len(target.sigma), 1e-3)
    target = replace(target, sigma=sigma, fixed_size=True)
    setup = track_setup(LabelConfig(), SolveConfig(), RATE)
    return Hand(target, setup, make_tracker(target, setup))


@pytest.fixture(scope="session")
def sequence():
    return sequence_of
