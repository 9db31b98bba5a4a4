"""How well a hand fits its scan, as figures and as remarks."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from handclean.hand.template import distal_length, template
from handclean.numerics.triangles import closest
from handclean.remarks import Remark, remark
from handclean.subject.scan.alignment import Aligned
from handclean.subject.scan.cloud import Cloud
from handclean.subject.scan.nonrigid import Registered
from handclean.subject.scan.prepare import Prepared
from handclean.subject.scan.rebuild import Rebuilt
from handclean.tree import JointTree

MOST_MEASURED_POINTS = 30_000
"""Points that the distance of scan and skin is measured at, at most (chosen)."""


POOR_FIT_M = 0.002
"""[m] mean distance from which on a fit is remarked on (chosen)."""


POOR_COVERAGE_SHARE = 0.6
"""Share of the skin with points of the scan below which it is remarked on (chosen)."""


@dataclass(frozen=True, kw_only=True)
class ScanReport:
    """Figures and plain remarks about a hand from a scan.

    Attributes
    ----------
    side : of the hand; size : its length against the template's.
    points : of the scan; points_used : of the hand.
    left_out_color, left_out_lonely, left_out_apart : points that are not the hand's.
    landmarks : how many there were.
    aligned_landmark_m, aligned_fit_m : [m] RMS distance of landmarks, and of skin with
        a counterpart, once the template was aligned.
    landmarks_away_m : [m] by landmark: distance from it once the template was aligned,
        before its shape was fitted.
    landmark_m : [m] RMS distance of landmarks in the end.
    fit_mean_m, fit_p95_m, fit_max_m : [m] distance of the hand's points from the skin.
    covered : share of the skin's vertices with points of the scan.
    lengths_m : [m] by joint: distance from the joint before it.
    remarks : what its owner should know.
    """

    side: str
    size: float
    points: int
    points_used: int
    left_out_color: int
    left_out_lonely: int
    left_out_apart: int
    landmarks: int
    aligned_landmark_m: float
    aligned_fit_m: float
    landmarks_away_m: Mapping[str, float]
    landmark_m: float
    fit_mean_m: float
    fit_p95_m: float
    fit_max_m: float
    covered: float
    lengths_m: Mapping[str, float]
    remarks: tuple[Remark, ...] = field(default=())


def report_on(
    aligned: Aligned,
    registered: Registered,
    found: Rebuilt,
    ready: Prepared,
    cloud: Cloud,
    remarks: tuple[Remark, ...],
    landmarks_away: Mapping[str, float],
) -> ScanReport:
    """Judge a fit.

    Parameters
    ----------
    aligned, registered, found, ready : what the steps of the fit found.
    cloud : the scan's points that are the hand's.
    remarks : of earlier steps, which come after those on what was left out.
    landmarks_away : [m] by name, from the aligned template's to where they were set.
    """
    tree, surface = found.tree, found.surface
    step = -(-len(cloud.points) // MOST_MEASURED_POINTS)
    away = closest(registered.vertices, surface.faces, cloud.points[::step]).distance
    covered = len(registered.pairs.rows) / len(surface.vertices)
    pairs, last = registered.pairs, registered.stages[-1]
    before = aligned.vertices()[pairs.rows] - pairs.places
    fit_mean = float(away.mean())
    more: list[Remark] = []
    if fit_mean > POOR_FIT_M:
        more.append(
            remark(
                "fit",
                f"the skin lies {1e3 * fit_mean:.1f} mm from the scan in the mean: are "
                "the landmarks right?",
                fit_mean_m=fit_mean,
            )
        )
    if covered < POOR_COVERAGE_SHARE:
        more.append(
            remark(
                "unseen",
                f"the scan shows {100 * covered:.0f} % of the skin: the rest is "
                "guessed",
                covered=covered,
            )
        )
    lengths = {
        tree.joints[b]: float(np.linalg.norm(tree.offsets[b]))
        for b in range(1, len(tree.bones))
    }
    return ScanReport(
        side=tree.side,
        size=_length(found) / _template_length(aligned.template.tree),
        points=ready.points,
        points_used=len(cloud.points),
        left_out_color=ready.colored,
        left_out_lonely=ready.lonely,
        left_out_apart=ready.apart,
        landmarks=len(aligned.template.landmarks),
        aligned_landmark_m=aligned.landmark_m,
        aligned_fit_m=float(np.sqrt(np.mean(np.sum(before**2, axis=1)))),
        landmarks_away_m=landmarks_away,
        landmark_m=last.landmark_m,
        fit_mean_m=fit_mean,
        fit_p95_m=float(np.percentile(away, 95.0)),
        fit_max_m=float(away.max()),
        covered=covered,
        lengths_m=lengths,
        remarks=(*ready.remarks, *remarks, *more),
    )


def _length(found: Rebuilt) -> float:
    """[m] from the wrist along the middle finger to its tip."""
    chain = [b for b, n in enumerate(found.tree.bones) if n.startswith("middle_")]
    bones = np.linalg.norm(found.tree.offsets[chain], axis=1).sum()
    return float(bones) + found.tips["middle"]


def _template_length(tree: JointTree) -> float:
    """[m] the same of the template of size 1."""
    start = template(tree.side or "right")
    chain = [b for b, n in enumerate(start.bones) if n.startswith("middle_")]
    bones = np.linalg.norm(start.offsets[chain], axis=1).sum()
    return float(bones) + distal_length(start, "middle")
