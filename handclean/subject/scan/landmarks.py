"""Named landmarks on the scan: are they the template's, and do they fit the scan?"""

from collections.abc import Collection, Mapping

import numpy as np
from scipy.spatial import cKDTree

from handclean.arrays import Floats
from handclean.errors import HandcleanError, UnknownNameError
from handclean.remarks import Remark, remark

OFF_SCAN_SHARE = 0.1
"""A landmark farther from the scan than this share of their spread is not on it
(chosen)."""

OTHER_PLACE_SHARE = 0.12
"""A landmark farther from the aligned template's than this share is another place
(chosen)."""

FAR_LANDMARK_M = 0.014
"""[m] of a hand of the template's size: a landmark farther from the aligned template's
is remarked on. Of 11 simulated people the farthest of 20 was 4 to 11 mm away; of two
neighbours exchanged, where `OTHER_PLACE_SHARE` had let them pass, one was 9 to 34."""

EXCHANGED_SQUARE_SHARE, PICKING_ERROR_M = 0.5, 0.004
"""Two landmarks are exchanged if that leaves less than this share of their squared
distances, [m] and these are not as small as people pick them anyway (chosen)."""


def checked(
    marked: Mapping[str, Floats], known: Collection[str], least: int
) -> tuple[tuple[str, ...], Floats, tuple[str, ...]]:
    """Put the landmarks of a scan in the template's order.

    Parameters
    ----------
    marked : (3,) [m] by name.
    known : the template's names.
    least : how many are needed.

    Returns
    -------
    The N names that are there, (N, 3) [m] where, and the names that are missing.

    Raises
    ------
    UnknownNameError
        If a name is none of the template's.
    HandcleanError
        If there are too few.
    """
    for name in marked:
        if name not in known:
            raise UnknownNameError("landmarks", "landmark", name, known)
    names = tuple(name for name in known if name in marked)
    missing = tuple(name for name in known if name not in marked)
    if len(names) < least:
        raise HandcleanError(
            f"landmarks: {len(names)} of {len(known)} are given, {least} or more are "
            f"needed; missing: {', '.join(missing)}"
        )
    return names, np.array([marked[name] for name in names]).reshape(-1, 3), missing


def expect_on(names: tuple[str, ...], places: Floats, points: Floats) -> None:
    """Expect landmarks on the scan.

    Parameters
    ----------
    places : (N, 3) [m]; points : (P, 3) [m] of the scan.

    Raises
    ------
    HandcleanError
        If most are far from it (another unit or frame), or one is.
    """
    away = cKDTree(points).query(places)[0]
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    extent = float(np.linalg.norm(np.subtract(*np.percentile(points, [98, 2], axis=0))))
    limit = OFF_SCAN_SHARE * max(size, 1e-12)
    far = away > limit
    if far.mean() > 0.5 or size > 3.0 * extent:
        raise HandcleanError(
            f"landmarks: they lie {1e3 * np.median(away):.3g} mm from the scan and "
            f"span {1e3 * size:.3g} mm where it spans {1e3 * extent:.3g} mm; they "
            "should be in the scan's own coordinates and unit"
        )
    if far.any():
        worst = int(np.argmax(away))
        raise HandcleanError(
            f"landmarks: {names[worst]} lies {1e3 * away[worst]:.3g} mm from the scan; "
            "is it in the scan's coordinates?"
        )


def expect_alike(names: tuple[str, ...], places: Floats, template: Floats) -> None:
    """Expect landmarks about where the template has them.

    Parameters
    ----------
    places, template : (N, 3) [m] on the scan, and on the template aligned with them.

    Raises
    ------
    HandcleanError
        If one is elsewhere, such as one of two that were exchanged.
    """
    away = np.linalg.norm(places - template, axis=1)
    worst = int(np.argmax(away))
    if away[worst] > OTHER_PLACE_SHARE * np.linalg.norm(np.ptp(places, axis=0)):
        near = names[int(np.argmin(np.linalg.norm(template - places[worst], axis=1)))]
        like = f"; it is nearer to {near}" if near != names[worst] else ""
        raise HandcleanError(
            f"landmarks: {names[worst]} lies {1e3 * away[worst]:.0f} mm from where the "
            f"others let expect it{like}; is it named right?"
        )


def doubtful(
    names: tuple[str, ...], places: Floats, template: Floats, size: float
) -> tuple[Remark, ...]:
    """Remark on landmarks that are far from where the aligned template has them.

    Parameters
    ----------
    places, template : (N, 3) [m] on the scan, and on the template aligned with it.
    size : of the hand against the template's.
    """
    doubts = []
    away = np.linalg.norm(places[:, None] - template, axis=2)  # mark by vertex
    own = np.diag(away)
    now = own[:, None] ** 2 + own**2
    other = away**2 + away.T**2
    better = (other < EXCHANGED_SQUARE_SHARE * now) & (
        now > 2 * (PICKING_ERROR_M * size) ** 2
    )
    for one, two in np.argwhere(np.triu(better, 1)).tolist():
        doubts.append(f"{names[one]} and {names[two]} would fit better exchanged")
    for n in np.argsort(-own).tolist():
        if own[n] > FAR_LANDMARK_M * size and not better[n].any():
            doubts.append(f"{names[n]} lies {1e3 * own[n]:.0f} mm from where it should")
    if not doubts:
        return ()
    text = f"landmarks: {', '.join(doubts)}; are they named right?"
    return (remark("fit", text),)
