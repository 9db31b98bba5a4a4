"""What of a scan is the hand, and which way its normals look."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from handclean.arrays import Bools, Floats
from handclean.errors import HandcleanError
from handclean.hand.surface import Surface, vertex_normals
from handclean.numerics.cloud import (
    clusters,
    crowded,
    plane_normals,
    thinned,
    turned_along,
)
from handclean.remarks import Remark, remark
from handclean.subject.scan.alignment import Aligned
from handclean.subject.scan.cloud import Cloud, Scan
from handclean.subject.scan.settings import ScanConfig
from handclean.subject.scan.skin_color import is_like, is_skin

NEIGHBOUR_POINTS = 12
"""Points around one that normals and lonely points are told from (chosen)."""

LEAST_SCAN_POINTS = 500
"""Points that a hand is fitted to at least (chosen)."""

HAND_REACH_SHARE = 0.45
"""Points farther from every landmark than this share of their spread are not looked at:
no part of a hand is (chosen)."""

NEAR_LANDMARK_SHARE = 0.04
"""A part of the scan is of the hand if a landmark is so near, by the same share
(chosen)."""

LEAST_SKIN_SHARE, LEAST_LANDMARK_POINTS = 0.8, 30
"""Share of the points at landmarks whose color must be skin's by the rule for it to be
used, and how many points must be there for that to be told (chosen)."""

DISAGREEING_NORMALS_SHARE = 0.25
"""Share of normals against the template's from which on they are not believed
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """A scan without what is not the hand.

    Attributes
    ----------
    scan : with points that are left.
    points, colored, lonely, apart : how many there were, were left out for their color,
        for being far from others, and for not hanging together with a landmark.
    remarks : what its owner should know.
    """

    scan: Scan
    points: int
    colored: int
    lonely: int
    apart: int
    remarks: tuple[Remark, ...]


def prepared(scan: Scan, marks: Floats, settings: ScanConfig) -> Prepared:
    """Leave out what is not the hand.

    Parameters
    ----------
    marks : (N, 3) [m] the landmarks.

    Raises
    ------
    HandcleanError
        If too few points are left.
    """
    total = len(scan.points)
    remarks: list[Remark] = []
    known = np.asarray(np.isfinite(scan.points).all(axis=1))
    if not known.all():
        remarks.append(
            remark(
                "missing",
                f"{(~known).sum()} points without a place (NaN) are left out",
                points=int((~known).sum()),
            )
        )
        scan = scan.only(known)
    _expect_enough(scan, "a scan of a hand has")
    size = float(np.linalg.norm(np.ptp(marks, axis=0)))
    scan = scan.only(cKDTree(marks).query(scan.points)[0] < HAND_REACH_SHARE * size)
    _expect_enough(scan, "around its landmarks a scan of a hand has")
    looked_at = len(scan.points)
    if scan.colors is None:
        remarks.append(
            remark(
                "left-out",
                "the scan has no colors: points that are not skin stay in it",
            )
        )
    elif settings.skin:
        skin, guessed = _skin(scan, marks, 0.5 * NEAR_LANDMARK_SHARE * size)
        remarks += guessed
        scan = scan.only(skin)
        _expect_enough(scan, "with --skin a scan of a hand has")
    colored = looked_at - len(scan.points)
    scan = scan.only(thinned(scan.points, settings.points))
    kept = crowded(scan.points, NEIGHBOUR_POINTS, settings.lonely)
    lonely = int((~kept).sum())
    scan = scan.only(kept)
    label = clusters(scan.points, settings.gap_m)
    away, nearest = cKDTree(scan.points).query(marks)
    mine = np.unique(label[nearest[away < NEAR_LANDMARK_SHARE * size]])
    kept = np.isin(label, mine)
    apart = int((~kept).sum())
    scan = scan.only(kept)
    _expect_enough(scan, "of the hand itself a scan has")
    return Prepared(
        scan=scan,
        points=total,
        colored=colored,
        lonely=lonely,
        apart=apart,
        remarks=tuple(remarks),
    )


def _expect_enough(scan: Scan, what: str) -> None:
    if len(scan.points) < LEAST_SCAN_POINTS:
        raise HandcleanError(
            f"scan: {len(scan.points)} points are left; {what} {LEAST_SCAN_POINTS} "
            "or more"
        )


def _skin(scan: Scan, marks: Floats, near: float) -> tuple[Bools, list[Remark]]:
    """(P,) which points are of the color of skin, and a remark if that is a guess."""
    assert scan.colors is not None
    skin = is_skin(scan.colors)
    at_marks = cKDTree(marks).query(scan.points)[0] < near
    if (
        at_marks.sum() < LEAST_LANDMARK_POINTS
        or skin[at_marks].mean() >= LEAST_SKIN_SHARE
    ):
        return skin, []
    share = 100 * float(skin[at_marks].mean())
    text = (
        f"{share:.0f} % of the points at the landmarks have a color that the rule for "
        "skin knows: colors like theirs count as skin instead"
    )
    skin = is_like(scan.colors, scan.colors[at_marks])
    return skin, [remark("left-out", text, percent=share)]


def oriented(
    scan: Scan, vertices: Floats, surface: Surface
) -> tuple[Cloud, tuple[Remark, ...]]:
    """Give every point a unit normal that looks out of the skin.

    Parameters
    ----------
    vertices : (V, 3) [m] of the surface, roughly aligned with the scan.

    Returns
    -------
    The cloud, and what its owner should know.
    """
    nearest = cKDTree(vertices).query(scan.points)[1]
    outwards = vertex_normals(vertices, surface.faces)[nearest]
    if scan.normals is None:
        normals = turned_along(plane_normals(scan.points, NEIGHBOUR_POINTS), outwards)
        said = "the scan has no normals: planes through its points stand in for them"
        return Cloud(points=scan.points, normals=normals), (remark("missing", said),)
    size = np.linalg.norm(scan.normals, axis=1)
    known = np.isfinite(size) & (size > 0.0)
    normals = np.where(known[:, None], scan.normals, 0.0)
    normals = normals / np.where(known, size, 1.0)[:, None]
    remarks: list[Remark] = []
    if not known.all():
        remarks.append(
            remark(
                "missing",
                f"{(~known).sum()} points have no normal: planes stand in for it",
            )
        )
        planes = turned_along(plane_normals(scan.points, NEIGHBOUR_POINTS), outwards)
        normals = np.where(known[:, None], normals, planes)
    against = np.einsum("pk,pk->p", normals, outwards)[known] < 0.0
    share = float(against.mean()) if known.any() else 0.0
    if share > 1.0 - DISAGREEING_NORMALS_SHARE:
        remarks.append(
            remark("implausible", "the scan's normals look into the hand: turned round")
        )
        normals = -normals
    elif share > DISAGREEING_NORMALS_SHARE:
        remarks.append(
            remark(
                "implausible",
                f"{100 * share:.0f} % of the scan's normals look into the hand: those "
                "are turned round",
            )
        )
        normals = turned_along(normals, outwards)
    return Cloud(points=scan.points, normals=normals), tuple(remarks)


def nearby(cloud: Cloud, aligned: Aligned, far_m: float) -> Cloud:
    """Leave out points farther than ``far_m`` from the aligned skin, and the forearm.

    The template ends behind the wrist; what lies beyond its end would pull the end.
    """
    surface, pose = aligned.template.surface, aligned.pose
    kept = cKDTree(aligned.vertices()).query(cloud.points)[0] <= far_m
    turn = Rotation.from_quat(pose[[4, 5, 6, 3]])
    along = turn.inv().apply(cloud.points - pose[:3])[:, 1]
    kept &= along >= surface.vertices[:, 1].min()
    return replace(cloud, points=cloud.points[kept], normals=cloud.normals[kept])
