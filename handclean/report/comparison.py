"""What a comparison says, as numbers and as text.

The numbers inside are in metres and radians; figures and text are in millimetres and
degrees.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from handclean.arrays import Floats
from handclean.remarks import Remark

MM_PER_M = 1e3
"""Millimetres of a metre."""

DEG_PER_RAD = 180.0 / math.pi
"""Degrees of a radian."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Absolute differences in numbers; NaN where there are none (but count).

    Attributes
    ----------
    count : how many.
    mean, deviation, median, p95, most : in the unit of what differs.
    """

    count: int
    mean: float
    deviation: float
    median: float
    p95: float
    most: float


def spread_of(values: Floats) -> Spread:
    """Sum up absolute differences; those that are NaN do not count."""
    there = np.abs(values[np.isfinite(values)])
    if len(there) == 0:
        nan = float("nan")
        return Spread(count=0, mean=nan, deviation=nan, median=nan, p95=nan, most=nan)
    return Spread(
        count=len(there),
        mean=float(np.mean(there)),
        deviation=float(np.std(there)),
        median=float(np.median(there)),
        p95=float(np.percentile(there, 95.0)),
        most=float(np.max(there)),
    )


@dataclass(frozen=True, kw_only=True)
class LabelScore:
    """How well samples are labelled.

    Attributes
    ----------
    correct, labelled, expected : samples labelled as in the reference, labelled at all,
        labelled in the reference.
    swapped : labelled samples that are another marker's; ghosts : that are nobody's.
    swaps : stretches of swapped samples.
    identity : what told which sample is which, "source" or "position".
    """

    correct: int
    labelled: int
    expected: int
    swapped: int
    ghosts: int
    swaps: int
    identity: str

    @property
    def precision(self) -> float:
        """Share of the labelled samples that are labelled right."""
        return self.correct / self.labelled if self.labelled else float("nan")

    @property
    def recall(self) -> float:
        """Share of the reference's samples that are labelled right."""
        return self.correct / self.expected if self.expected else float("nan")

    @property
    def f1(self) -> float:
        """Harmonic mean of precision and recall."""
        total = self.labelled + self.expected
        return 2.0 * self.correct / total if total else float("nan")


@dataclass(frozen=True, kw_only=True)
class MarkerErrors:
    """Distances of markers [m].

    Attributes
    ----------
    measured, filled : of samples the test measured, filled.
    by_marker : the same by label: measured, filled.
    within_one, within_two : share of filled samples within one, two sigma, axis by
        axis; NaN where no sigma is known.
    """

    measured: Spread
    filled: Spread
    by_marker: Mapping[str, tuple[Spread, Spread]]
    within_one: float
    within_two: float


@dataclass(frozen=True, kw_only=True)
class MotionErrors:
    """Differences of two motions.

    Attributes
    ----------
    angles : [rad] of all joint angles in all frames.
    by_hinge : [rad] the same by hinge.
    translation, rotation : [m], [rad] of the root; None where one has no root.
    """

    angles: Spread
    by_hinge: Mapping[str, Spread]
    translation: Spread | None
    rotation: Spread | None


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What two takes differ in.

    Attributes
    ----------
    frames : how many were compared.
    labels, markers : None where one of the takes has no labelled markers.
    motions : by name.
    missing, extra : markers and hinges that only the reference, only the test has.
    remarks : what to know when reading the numbers.
    """

    frames: int
    labels: LabelScore | None = None
    markers: MarkerErrors | None = None
    motions: Mapping[str, MotionErrors] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    remarks: tuple[Remark, ...] = ()

    def figures(self) -> dict[str, float]:
        """Everything as flat names and numbers, in millimetres and degrees.

        Figures of motions begin with ``angles_`` and ``root_``; where several motions
        were compared, each has its own, with its name and a dot before. What has no
        value (errors of filled samples when there are none) is left out.
        """
        found = {"frames": float(self.frames)}
        if self.labels is not None:
            found |= _of_labels(self.labels)
        if self.markers is not None:
            found |= _of_spread("measured", "mm", self.markers.measured, MM_PER_M)
            found |= _of_spread("filled", "mm", self.markers.filled, MM_PER_M)
            found["filled_within_1_sigma"] = self.markers.within_one
            found["filled_within_2_sigma"] = self.markers.within_two
        for name, motion in self.motions.items():
            before = f"{name}." if len(self.motions) > 1 else ""
            found |= _of_motion(before, motion)
        if len(self.motions) > 1:
            found["angles_mean_deg"] = _mean_of(list(self.motions.values()))
        found["missing"] = float(len(self.missing))
        found["extra"] = float(len(self.extra))
        return {name: value for name, value in found.items() if not math.isnan(value)}


def _of_labels(score: LabelScore) -> dict[str, float]:
    counts = ("correct", "labelled", "expected", "swapped", "ghosts", "swaps")
    shares = ("precision", "recall", "f1")
    return {name: float(getattr(score, name)) for name in (*shares, *counts)}


def _of_spread(name: str, unit: str, spread: Spread, scale: float) -> dict[str, float]:
    return {
        f"{name}_samples": float(spread.count),
        f"{name}_mean_{unit}": scale * spread.mean,
        f"{name}_median_{unit}": scale * spread.median,
        f"{name}_p95_{unit}": scale * spread.p95,
        f"{name}_max_{unit}": scale * spread.most,
    }


def _of_motion(before: str, motion: MotionErrors) -> dict[str, float]:
    found = {
        f"{before}angles_mean_deg": DEG_PER_RAD * motion.angles.mean,
        f"{before}angles_sd_deg": DEG_PER_RAD * motion.angles.deviation,
        f"{before}angles_p95_deg": DEG_PER_RAD * motion.angles.p95,
        f"{before}angles_max_deg": DEG_PER_RAD * motion.angles.most,
    }
    for hinge, spread in motion.by_hinge.items():
        found[f"{before}{hinge}_deg"] = DEG_PER_RAD * spread.mean
    parts = ("translation", "mm", MM_PER_M), ("rotation", "deg", DEG_PER_RAD)
    for part, unit, scale in parts:
        spread = getattr(motion, part)
        if spread is not None:
            found[f"{before}root_{part}_mean_{unit}"] = scale * spread.mean
            found[f"{before}root_{part}_p95_{unit}"] = scale * spread.p95
            found[f"{before}root_{part}_max_{unit}"] = scale * spread.most
    return found


def _mean_of(motions: list[MotionErrors]) -> float:
    """[degrees] mean difference of all angles of all motions."""
    counts = [motion.angles.count for motion in motions]
    sums = [m.angles.mean * m.angles.count for m in motions if m.angles.count]
    return DEG_PER_RAD * sum(sums) / sum(counts) if sum(counts) else float("nan")


def in_text(comparison: Comparison) -> str:
    """Return the comparison as lines of text, tables in columns."""
    parts = [f"{comparison.frames} frames compared"]
    if comparison.labels is not None:
        parts.append(_label_text(comparison.labels))
    if comparison.markers is not None:
        parts.append(_marker_text(comparison.markers))
    for name, motion in comparison.motions.items():
        parts.append(_motion_text(name, motion))
    for word, names in (("missing", comparison.missing), ("extra", comparison.extra)):
        if names:
            parts.append(f"{word} in the test: {', '.join(names)}")
    return "\n\n".join(parts)


def _label_text(score: LabelScore) -> str:
    return (
        f"labels     precision {score.precision:.4f}  recall {score.recall:.4f}  "
        f"F1 {score.f1:.4f}   (told by {score.identity})\n"
        f"           {score.correct} of {score.expected} right, {score.ghosts} ghosts, "
        f"{score.swapped} swapped in {score.swaps} stretches"
    )


def _marker_text(errors: MarkerErrors) -> str:
    rows = [("all", errors.measured, errors.filled)]
    rows += [(label, *spreads) for label, spreads in errors.by_marker.items()]
    width = max(len(name) for name, _, _ in rows)
    head = f"{'samples':>8} {'mean':>7} {'median':>7} {'95 %':>7} {'max':>7}"
    lines = [
        f"{'[mm]':<{width}}  {'measured':^40}  {'filled':^40}",
        f"{'marker':<{width}}  {head}  {head}",
    ]
    for name, measured, filled in rows:
        lines.append(f"{name:<{width}}  {_cells(measured)}  {_cells(filled)}")
    if errors.within_one == errors.within_one:
        lines.append(
            f"filled samples, per axis, within one sigma {errors.within_one:.1%}, "
            f"within two {errors.within_two:.1%}"
        )
    return "\n".join(lines)


def _cells(spread: Spread) -> str:
    if spread.count == 0:
        return f"{0:>8}" + 4 * f" {'-':>7}"
    numbers = (spread.mean, spread.median, spread.p95, spread.most)
    cells = "".join(f" {MM_PER_M * number:>7.3f}" for number in numbers)
    return f"{spread.count:>8}{cells}"


def _motion_text(name: str, motion: MotionErrors) -> str:
    rows = [("all angles", motion.angles), *motion.by_hinge.items()]
    width = max(len(hinge) for hinge, _ in rows)
    lines = [
        f"motion {name}",
        f"{'[deg]':<{width}}  {'mean':>8} {'sd':>8} {'95 %':>8} {'max':>8}",
    ]
    for hinge, spread in rows:
        numbers = (spread.mean, spread.deviation, spread.p95, spread.most)
        cells = " ".join(f"{DEG_PER_RAD * number:>8.4f}" for number in numbers)
        lines.append(f"{hinge:<{width}}  {cells}")
    for part, unit, scale in (
        ("translation", "mm", MM_PER_M),
        ("rotation", "deg", DEG_PER_RAD),
    ):
        spread = getattr(motion, part)
        if spread is not None:
            lines.append(
                f"root {part}: mean {scale * spread.mean:.4f}, "
                f"95 % {scale * spread.p95:.4f}, max {scale * spread.most:.4f} {unit}"
            )
    return "\n".join(lines)
