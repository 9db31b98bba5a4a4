"""How far one subject is from another: bone lengths, joints and markers.

Where the root's frame lies on a hand, and what posture has zero angles, is nobody's
measure. Differences of frames or angles therefore do not count: the test's hand takes
the posture of the reference's that brings joints and common markers nearest (inverse
kinematics), once flat and once half closed, and what is left are the differences.
Bone lengths, the distances from one joint of a finger to the next, need no posture.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats
from handclean.errors import HandcleanError
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.subject import Subject
from handclean.ik.solve import solve_markers
from handclean.report.comparison import MM_PER_M, Spread, spread_of
from handclean.tree import POSE_HEAD

FLEXED_SHARES = (0.0, 0.4)
"""[-] the postures, as shares of how far each hinge bends (chosen)."""

BEYOND_LIMITS_RAD = 0.5
"""[rad] how far the test's angles may leave the reference's limits (chosen)."""


@dataclass(frozen=True, kw_only=True)
class SubjectComparison:
    """What two subjects differ in.

    Attributes
    ----------
    lengths : [m] by joint: distance from the joint before it, reference and test.
    joints, markers : [m] by name: how far it is from where the reference has it.
    missing, extra : markers only the reference, only the test has.
    """

    lengths: dict[str, tuple[float, float]]
    joints: dict[str, float]
    markers: dict[str, float]
    missing: tuple[str, ...]
    extra: tuple[str, ...]

    def figures(self) -> dict[str, float]:
        """Everything as flat names and numbers, in millimetres."""
        found: dict[str, float] = {}
        for name, spread in self._spreads().items():
            if spread.count:
                found[f"{name}_mean_mm"] = MM_PER_M * spread.mean
                found[f"{name}_max_mm"] = MM_PER_M * spread.most
        for joint, (before, after) in self.lengths.items():
            found[f"length.{joint}_mm"] = MM_PER_M * (after - before)
        for kind, rows in (("joint", self.joints), ("marker", self.markers)):
            for name, distance in rows.items():
                found[f"{kind}.{name}_mm"] = MM_PER_M * distance
        found["missing"] = float(len(self.missing))
        found["extra"] = float(len(self.extra))
        return found

    def in_text(self) -> str:
        """Return the comparison as lines of text, tables in columns."""
        names = [*self.lengths, *self.joints, *self.markers, "all markers"]
        width = max(map(len, names))
        lines = [f"{'[mm]':<{width}}  {'reference':>9} {'test':>9} {'differs':>8}"]
        for joint, pair in self.lengths.items():
            cells = f"{MM_PER_M * pair[0]:>9.2f} {MM_PER_M * pair[1]:>9.2f}"
            lines.append(
                f"{joint:<{width}}  {cells} {MM_PER_M * (pair[1] - pair[0]):>+8.2f}"
            )
        spreads = self._spreads()
        for kind, rows in (("joint", self.joints), ("marker", self.markers)):
            if not rows:
                continue
            lines += ["", f"{kind + 's [mm]':<{width}}  {'away':>9}"]
            lines += [
                f"{n:<{width}}  {MM_PER_M * away:>9.2f}" for n, away in rows.items()
            ]
            mean = MM_PER_M * spreads[kind].mean
            lines.append(f"{'all ' + kind + 's':<{width}}  {mean:>9.2f}")
        for word, some in (("missing", self.missing), ("extra", self.extra)):
            if some:
                lines += ["", f"{word} in the test: {', '.join(some)}"]
        return "\n".join(lines)

    def _spreads(self) -> dict[str, Spread]:
        lengths = np.array([after - before for before, after in self.lengths.values()])
        return {
            "length": spread_of(lengths),
            "joint": spread_of(np.array(list(self.joints.values()))),
            "marker": spread_of(np.array(list(self.markers.values()))),
        }


def compare_subjects(reference: Subject, test: Subject) -> SubjectComparison:
    """Compare a subject with a reference.

    Raises
    ------
    HandcleanError
        If they are of two sides or kinds, or their joints are not the same.
    """
    old, new = reference.model, test.model
    for what in ("kind", "side", "joints", "hinges"):
        if getattr(old.tree, what) != getattr(new.tree, what):
            told = [getattr(m.tree, what) for m in (new, old)]
            if isinstance(told[0], str):
                told = [f"{words or 'neither side'}" for words in told]
                wrong = f"the test's {what} is {told[0]}, the reference's {told[1]}"
            else:
                wrong = f"test and reference have other {what}"
            raise HandcleanError(f"comparison: {wrong}; both should be one hand")
    both = [label for label in old.labels if label in new.labels]
    joints, markers = _distances(old.selected(both), new.selected(both))
    return SubjectComparison(
        lengths={
            old.tree.joints[b]: (
                float(np.linalg.norm(old.tree.offsets[b])),
                float(np.linalg.norm(new.tree.offsets[b])),
            )
            for b in range(1, len(old.tree.bones))
            if old.tree.parents[b] > 0
        },
        joints=dict(zip(old.tree.joints[1:], joints.tolist(), strict=True)),
        markers=dict(zip(both, markers.tolist(), strict=True)),
        missing=tuple(label for label in old.labels if label not in both),
        extra=tuple(label for label in new.labels if label not in both),
    )


def _distances(old: Model, new: Model) -> tuple[Floats, Floats]:
    """(J,), (M,) [m] how far joints and markers are apart, RMS over the postures."""
    limits = old.tree.limits
    poses = np.tile(neutral_pose(old.tree), (len(FLEXED_SHARES), 1))
    for pose, share in zip(poses, FLEXED_SHARES, strict=True):
        pose[POSE_HEAD:] = np.clip(share * limits[:, 1], limits[:, 0], limits[:, 1])
    targets = marker_positions(_with_joints(old), poses)
    loose = limits + np.array([-BEYOND_LIMITS_RAD, BEYOND_LIMITS_RAD])
    model = _with_joints(replace(new, tree=replace(new.tree, limits=loose)))
    found = solve_markers(model, targets)
    away = targets - marker_positions(model, found.poses)
    distance = np.sqrt(np.mean(np.sum(away**2, axis=2), axis=0))
    count = len(old.tree.joints) - 1
    return distance[:count], distance[count:]


def _with_joints(model: Model) -> Model:
    """Return the model with a marker on each joint but the root before its own."""
    bones = np.arange(1, len(model.tree.bones))
    return Model(
        tree=model.tree,
        labels=(*(f"joint {name}" for name in model.tree.joints[1:]), *model.labels),
        bone=np.concatenate([bones, model.bone]),
        at=np.vstack([np.zeros((len(bones), 3)), model.at]),
    )
