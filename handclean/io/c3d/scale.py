"""Which scale holds where the header of a C3D file and POINT:SCALE disagree.

Integer samples times the scale are coordinates, so a take is as large as the scale
makes it. The parameters are believed, as other programs believe them, unless what they
say cannot be and what the header says can:

1. They put the points outside any room: farther apart, or farther from the laboratory's
   origin, than cameras see; or all in one spot.
2. They make an adult about half as large as adults are, or smaller, or far too large.
   What is an adult's, names tell (`handclean.io.shared.adult_size`).

Samples that are floats are in the file's unit whatever the scale is; it is for their
residuals, and the parameters' is taken.
"""

from dataclasses import replace

import numpy as np

from handclean.arrays import Floats
from handclean.io.c3d.samples import Coding, placed, valid
from handclean.io.c3d.structure import Structure
from handclean.io.shared.adult_size import Size, size_of
from handclean.remarks import Remark, remark

_MEASURED_FRAMES = 200
"""So many frames are measured, evenly through the take (chosen)."""

_EXTENT_M = (0.02, 30.0)
"""[m] how far apart points of a take are, and how far from the laboratory's origin
(chosen)."""

_ADULT_SIZE_RATIOS = (0.6, 1.7)
"""[-] smallest and largest adult against the middle one (chosen)."""


def settle_scale(structure: Structure, metres: float) -> tuple[Coding, list[Remark]]:
    """Return how samples are coded, and a remark if the file states two scales.

    Parameters
    ----------
    metres : value of the file's unit of length.

    Raises
    ------
    FileError
        If samples are integers and there is no scale.
    """
    coding = structure.coding(metres)
    said = structure.head.section.numbers("POINT", "SCALE")[:1].tolist()
    other = structure.head.header.scale
    if (
        not structure.points
        or not said
        or np.isclose(said[0], other, rtol=1e-5, atol=0)
    ):
        return coding, []
    line = f"scale: the parameters say {said[0]:g}, the header {other:g}; "
    if coding.scale == abs(other):
        return coding, [remark("unit", line + "the header's was taken")]
    if coding.is_float:
        return coding, [
            remark("unit", line + "the parameters' was taken, for residuals")
        ]
    if not 0 < other < np.inf:
        return coding, [remark("unit", line + "the parameters' was taken")]
    taken, why = _judged(structure, coding, abs(other) / coding.scale)
    who = "parameters'" if taken == 1.0 else "header's"
    coding = replace(coding, scale=taken * coding.scale)
    return coding, [remark("unit", f"{line}the {who} was taken{why}")]


def _judged(structure: Structure, coding: Coding, factor: float) -> tuple[float, str]:
    """Return by what to multiply the parameters' scale, 1 or ``factor``, and why."""
    labels, points = _measured(structure, coding)
    low, high = _ends(points)
    size = size_of(labels, points)
    if (wrong := _misfit(low, high, size, 1.0)) and not _misfit(
        low, high, size, factor
    ):
        return factor, f", since with the parameters' {wrong}"
    return 1.0, ""


def _misfit(low: Floats, high: Floats, size: Size, factor: float) -> str:
    """Say why points cannot be so large; "" if they can."""
    apart = factor * float((high - low).max())
    far = factor * float(np.abs([low, high]).max())
    if apart > _EXTENT_M[1] or far > _EXTENT_M[1]:
        return f"points are {max(apart, far):.3g} m away, outside any room"
    if apart < _EXTENT_M[0]:
        return f"all points are within {1e3 * apart:.2g} mm"
    smallest, largest = _ADULT_SIZE_RATIOS
    ratio = factor * size.ratio
    if not smallest <= ratio <= largest and np.isfinite(size.ratio):
        return f"{size.words} is {factor * size.length:.2g} m"
    return ""


def _measured(structure: Structure, coding: Coding) -> tuple[list[str], Floats]:
    """Labels of places, and (T, M, 3) [m] in some frames, NaN where missing."""
    labels, outputs = structure.head.labels(structure.points), structure.head.outputs()
    columns = [n for n, label in enumerate(labels) if label not in outputs]
    count = min(_MEASURED_FRAMES, len(structure.frames))
    rows = np.linspace(0, len(structure.frames) - 1, count).astype(np.intp)
    words = structure.frames[rows, : 4 * structure.points]
    numbers = coding.numbers(words.reshape(count, -1, 4)[:, columns])
    points = np.where(
        (valid(numbers) & placed(numbers))[..., None],
        numbers[..., :3] * coding.step,
        np.nan,
    )
    return [labels[n] for n in columns], points


def _ends(points: Floats) -> tuple[Floats, Floats]:
    """(3,) [m] where points are, without the outermost; NaN if there are none."""
    there = points[np.isfinite(points).all(axis=2)]
    if not len(there):
        return np.full(3, np.nan), np.full(3, np.nan)
    low, high = np.percentile(there, (1, 99), axis=0)
    return low, high
