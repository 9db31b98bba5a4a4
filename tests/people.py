"""People who are not the template, and what cameras see of them; for several tests."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.hand.marker_set import MarkerSet, load_marker_set
from handclean.hand.model import Model, marker_positions
from handclean.hand.template import template
from handclean.recording import Recording, trajectories


@dataclass(frozen=True)
class Person:
    """A true hand, how it moved, and the take of it."""

    set: MarkerSet
    model: Model
    poses: Any
    take: Recording


def true_hand(rng, markers, side, size):
    """A hand that differs from the template as people's do."""
    model = markers.on(template(side, forearm=markers.forearm))
    tree = model.tree
    offsets, axes = size * tree.offsets, tree.axes.copy()
    for b in range(1, len(offsets)):
        if tree.parents[b] == 0:
            offsets[b] += rng.normal(scale=0.003, size=3)
        else:
            offsets[b] *= 1.0 + 0.05 * rng.normal()
    for d, axis in enumerate(axes):
        tilt = 0.05 * np.cross(axis, rng.normal(size=3))
        axes[d] = Rotation.from_rotvec(tilt).apply(axis)
    tree = replace(tree, offsets=offsets, axes=axes, scale=size)
    at = size * model.at + rng.normal(scale=0.003, size=model.at.shape)
    return replace(model, tree=tree, at=at)


def exercise(rng, tree, frames, rate):
    """(T, 7 + D) every joint through most of its range, slowly and apart."""
    t = np.arange(frames) / rate
    poses = np.zeros((frames, 7 + len(tree.hinges)))
    for d, (low, high) in enumerate(tree.limits):
        wave = np.sin(2 * np.pi * rng.uniform(0.2, 0.7) * t + rng.uniform(0, 6.3))
        wave += np.sin(2 * np.pi * rng.uniform(0.2, 0.7) * t + rng.uniform(0, 6.3))
        middle = 0.5 * (low + high)
        poses[:, 7 + d] = middle + 0.2 * (high - low) * wave
    for k in range(3):
        poses[:, k] = 0.2 * np.sin(2 * np.pi * 0.1 * (k + 1) * t)
    turns = np.column_stack([np.sin(0.3 * t), np.cos(0.2 * t), 0.5 * t])
    poses[:, 3:7] = Rotation.from_rotvec(turns).as_quat()[:, [3, 0, 1, 2]]
    return poses


def as_take(positions, labels, rate=50.0, **parts):
    markers = trajectories(positions, tuple(labels), **parts)
    return Recording(rate=rate, frames=len(positions), markers=markers)


def person(seed, name="maycock26", side="", size=1.0, frames=500, noise=0.0002):
    """Make a person and a labelled take of them, one sample in twenty missing."""
    rng = np.random.default_rng(seed)
    markers = load_marker_set(name)
    model = true_hand(rng, markers, side or markers.side, size)
    poses = exercise(rng, model.tree, frames, 50.0)
    seen = marker_positions(model, poses)
    seen += rng.normal(scale=noise, size=seen.shape)
    seen[rng.random(seen.shape[:2]) < 0.05] = np.nan
    return Person(markers, model, poses, as_take(seen, model.labels))


def lengths(tree):
    """[m] of the fingers' segments."""
    inner = np.flatnonzero(tree.parents > 0)
    return np.linalg.norm(tree.offsets[inner], axis=1)
