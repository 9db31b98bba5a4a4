"""How large the points of a take are against those of an adult, by their names.

Only names tell what points are of: segments of a body (``RSHO`` to ``RELB``, ``R.Knee``
to ``R.Ankle``), the markers of a set that ships, or a hand's fingers. Markers sit
beside joints and people differ, so that a ratio is good to a third or so, which tells
a wrong unit or scale, not a child from an adult.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats
from handclean.hand.marker_set import load_marker_set, shipped
from handclean.hand.surface import rest_joints
from handclean.hand.template import HAND_LENGTH_M, bone_places, template

_SEGMENT_LENGTH_M = {
    ("shoulder", "elbow"): 0.31,
    ("elbow", "wrist"): 0.26,
    ("shoulder", "hip"): 0.48,
    ("hip", "knee"): 0.44,
    ("knee", "ankle"): 0.41,
    ("heel", "toe"): 0.21,
}
"""[m] from marker to marker on one side of an adult (chosen: rounded, good to a
third)."""

_PARTS = {
    "shoulder": r"sho(ulder)?|shld|acr(omion)?",
    "elbow": r"elb(ow)?",
    "wrist": r"wri(st)?|wr[ab]",
    "hip": r"hip|asis?|gtr|troch(anter)?",
    "knee": r"knee?",
    "ankle": r"ank(le)?",
    "heel": r"heel?",
    "toe": r"toe",
}

_SIDE = r"(?P<{}>left|right|l|r)"

_BODY = {
    part: re.compile(
        rf"(?:{_SIDE.format('before')}[ ._-]*)?(?:{name})"
        rf"(?:[ ._-]*{_SIDE.format('after')})?"
    )
    for part, name in _PARTS.items()
}

_FINGER = re.compile(r"thumb|index|middle|ring|little|pinky")

_LEAST_MARKERS = 5
"""So many markers of a hand tell its size (chosen)."""

_MOST_MARKERS = 64
"""So many markers are measured, at most (chosen)."""


class Size(NamedTuple):
    """How large something is.

    Attributes
    ----------
    ratio : against an adult's; NaN where no name tells.
    words : what was measured, such as "right shoulder to elbow".
    length : [m] of that.
    """

    ratio: float
    words: str
    length: float


UNKNOWN = Size(np.nan, "", np.nan)


def size_of(labels: Sequence[str], positions: Floats) -> Size:
    """Compare points with an adult's.

    Parameters
    ----------
    labels : M names.
    positions : (T, M, 3) [m], NaN where missing.
    """
    bare = [label.rpartition(":")[2].strip().casefold() for label in labels]
    seen = np.array(np.isfinite(positions).all(axis=2).any(axis=0))
    columns = {name: m for m, name in reversed(list(enumerate(bare))) if seen[m]}
    for measure in (_body, _hand_of_a_set, _fingers):
        if found := measure(columns, positions):
            middle = sorted(found, key=lambda size: size.ratio)[len(found) // 2]
            return middle._replace(ratio=float(np.median([s.ratio for s in found])))
    return UNKNOWN


def _apart(positions: Floats, one: int, other: int) -> float:
    """[m] middle distance of two points; NaN where they are never there together."""
    away = np.linalg.norm(positions[:, one] - positions[:, other], axis=1)
    away = away[np.isfinite(away)]
    return float(np.median(away)) if len(away) else np.nan


def _known(sizes: list[Size]) -> list[Size]:
    """Those of points that are there and apart: two in one place tell no size."""
    return [size for size in sizes if 0.0 < size.ratio < np.inf]


def _body(columns: dict[str, int], positions: Floats) -> list[Size]:
    """Sizes of a body's segments."""
    at: dict[tuple[str, str], int] = {}
    for name, column in columns.items():
        for part, pattern in _BODY.items():
            found = pattern.fullmatch(name)
            if found and bool(found["before"]) != bool(found["after"]):
                side = (found["before"] or found["after"])[0]
                at.setdefault((side, part), column)
    sizes = []
    for (one, other), adult in _SEGMENT_LENGTH_M.items():
        for side, called in (("l", "left"), ("r", "right")):
            if (side, one) in at and (side, other) in at:
                length = _apart(positions, at[side, one], at[side, other])
                words = f"{called} {one} to {other}"
                sizes.append(Size(length / adult, words, length))
    return _known(sizes)


def _hand_of_a_set(columns: dict[str, int], positions: Floats) -> list[Size]:
    """Sizes by neighbouring markers of the set that most of a hand's are of."""
    hands: dict[str, dict[str, int]] = defaultdict(dict)
    for name, column in columns.items():
        hands[name[:1] if _sideless(name) != name else ""][_sideless(name)] = column
    best: list[Size] = []
    for name in shipped():
        called, places = _of_set(name)
        for hand in hands.values():
            rows = [n for n, label in enumerate(called) if label in hand]
            if len(rows) >= max(_LEAST_MARKERS, len(best) + 1):
                at = [hand[called[n]] for n in rows]
                best = _neighbours(places[rows], positions[:, at], hand, at) or best
    return best


@cache
def _of_set(name: str) -> tuple[list[str], Floats]:
    """Sideless names of a set's markers, and (M, 3) [m] where a flat hand has them."""
    markers = load_marker_set(name)
    tree = template("left", forearm=markers.forearm)
    rest = rest_joints(tree)[[tree.bone(bone) for bone in markers.bones]]
    places = rest + bone_places(tree, list(markers.bones), markers.at)
    return [_sideless(label.casefold()) for label in markers.labels], places


def _neighbours(
    places: Floats, positions: Floats, hand: dict[str, int], at: list[int]
) -> list[Size]:
    away = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(away, np.inf)
    names = {column: name for name, column in hand.items()}
    sizes = []
    for n, nearest in enumerate(away.argmin(axis=1).tolist()):
        length = _apart(positions, n, nearest)
        words = f"'{names[at[n]]}' to '{names[at[nearest]]}'"
        sizes.append(Size(length / float(away[n, nearest]), words, length))
    return _known(sizes)


def _sideless(name: str) -> str:
    return re.sub(r"^[lr][_-]", "", name)


def _fingers(columns: dict[str, int], positions: Floats) -> list[Size]:
    """Sizes of hands whose fingers are named, by how far apart their points get."""
    hands: dict[str, list[int]] = defaultdict(list)
    for name, column in columns.items():
        if found := _FINGER.search(name):
            hands[name[: found.start()]].append(column)
    sizes = []
    for named in hands.values():
        hand = named[:_MOST_MARKERS]
        points = positions[:, hand]
        whole = points[np.isfinite(points).all(axis=2).sum(axis=1) >= _LEAST_MARKERS]
        if len(hand) >= _LEAST_MARKERS and len(whole):
            away = np.linalg.norm(whole[:, :, None] - whole[:, None], axis=3)
            length = float(np.percentile(np.nanmax(away, axis=(1, 2)), 95))
            sizes.append(Size(length / HAND_LENGTH_M, "a hand, at its widest,", length))
    return _known(sizes)
