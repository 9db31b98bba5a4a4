"""Things to label and solve that are no hands, and takes of them, for several tests."""

from dataclasses import replace

import numpy as np
from people import as_take
from scipy.spatial.transform import Rotation

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import Model, marker_positions
from handclean.hand.subject import Subject, template_subject
from handclean.recording import Points, Recording
from handclean.tree import JointTree

NOISE = 2e-4
"""[m] of the markers per axis."""


def tree_of(rng, branches, depth, hinges=1):
    """A root with branches of so many bones each, and hinges on each bone."""
    parents, offsets, hinge_bone = [-1], [np.zeros(3)], []
    for branch in range(branches):
        turn = 2.0 * np.pi * branch / branches
        for level in range(depth):
            away = [0.09 * np.cos(turn), 0.09 * np.sin(turn), 0.01 * branch]
            offsets.append(np.array(away) if level == 0 else np.array([0.0, 0.05, 0.0]))
            parents.append(0 if level == 0 else len(parents) - 1)
            hinge_bone += [len(parents) - 1] * hinges
    axes = rng.normal(size=(len(hinge_bone), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    names = tuple(f"b{b}" for b in range(len(parents)))
    return JointTree(
        kind="rigid",
        side="",
        bones=names,
        joints=names,
        parents=np.array(parents),
        offsets=np.array(offsets),
        hinges=tuple(f"h{d}" for d in range(len(hinge_bone))),
        hinge_bone=np.array(hinge_bone, dtype=np.int64),
        axes=axes.reshape(-1, 3),
        limits=np.tile([-0.7, 0.7], (len(hinge_bone), 1)),
        subject="thing",
    )


def thing(rng, branches, depth, hinges=1, markers=3):
    """A tree with some markers on each bone, five on its root."""
    tree = tree_of(rng, branches, depth, hinges)
    count = [5] + [markers] * (len(tree.bones) - 1)
    bone = np.repeat(np.arange(len(tree.bones)), count)
    at = rng.uniform(-0.02, 0.02, size=(len(bone), 3))
    at[:5] *= 2.0
    return Subject(
        name="thing",
        model=Model(
            tree=tree,
            labels=tuple(f"m{m}" for m in range(len(bone))),
            bone=bone,
            at=at,
        ),
        marker_set="thing",
        marker_sigma=np.full(len(bone), 2.0 * NOISE),
    )


def hand():
    """The template as if somebody had measured it."""
    one = template_subject(load_marker_set("maycock26"))
    known = np.full(len(one.model.labels), 2.0 * NOISE)
    return replace(one, marker_sigma=known, calibrated=True)


KINDS = {
    "hand": lambda rng: hand(),
    "rigid body": lambda rng: thing(rng, 0, 0),
    "two bones": lambda rng: thing(rng, 1, 1),
    "60 hinges": lambda rng: thing(rng, 5, 6, 2),
}
"""What kernels have to bear, small and large."""


def moving(rng, tree, frames=60, rate=100.0):
    """(T, 7 + D) poses of something that turns in a hand, its hinges with it."""
    time = np.arange(frames)[:, None] / rate
    low, high = tree.limits.T
    wave = np.sin(2 * np.pi * (0.5 * time + rng.random(len(low))))
    poses = np.zeros((frames, 7 + len(low)))
    poses[:, 7:] = 0.5 * (low + high) + 0.25 * (high - low) * wave
    poses[:, :3] = 0.1 * np.sin(time + np.arange(3.0))
    turns = Rotation.from_rotvec(time * rng.normal(size=3) + rng.normal(size=3))
    poses[:, 3:7] = turns.as_quat()[:, [3, 0, 1, 2]]
    return poses


def seen_of(rng, subject, poses, gaps=True):
    """(T, M, 3) [m] its markers with noise; every fourth is missing for a while."""
    seen = marker_positions(subject.model, poses)
    seen += rng.normal(scale=NOISE, size=seen.shape)
    if gaps:
        middle = len(seen) // 2
        seen[middle - 4 : middle + 4, ::4] = np.nan
    return seen


def named(seen, subject, rate=100.0):
    """The take with labels."""
    return as_take(seen, subject.model.labels, rate=rate)


def nameless(rng, seen, rate=100.0):
    """The take without labels, its points in any order."""
    frame, marker = np.nonzero(np.isfinite(seen[:, :, 0]))
    order = np.lexsort((rng.random(len(frame)), frame))
    points = Points(
        frame=frame[order].astype(np.int32),
        source=np.full(len(frame), -1, dtype=np.int32),
        positions=seen[frame, marker][order],
    )
    return Recording(rate=rate, frames=len(seen), unlabelled=points)
