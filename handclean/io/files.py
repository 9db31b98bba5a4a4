"""One door to all formats: read, write and inspect by suffix.

What a reader found odd (see `handclean.io.shared.reading`) is a remark of the take, and
stays with it through every later step.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from handclean.errors import UsageError
from handclean.hand.surface import Surface
from handclean.io.finite import only_finite
from handclean.io.formats import (
    BY_SUFFIX,
    TAKES_WRITTEN,
    by_suffix,
    chosen,
    function,
)
from handclean.io.hdf5 import seal
from handclean.io.keeps import lost
from handclean.io.shared.reading import with_remarks
from handclean.io.shared.unread import refuse_unread
from handclean.io.takes import reading_of
from handclean.recording import Recording
from handclean.remarks import Remark, of_file


def read(
    path: Path | str,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
    believe_coordinates: bool = False,
) -> Recording:
    """Read a take of any format.

    Parameters
    ----------
    rate_hz : [Hz] for formats that do not say (``--rate``).
    unit : of lengths, mm, cm or m, for formats that do not say (``--unit``); it is
        taken where the file says another, and a remark says so.
    lenient : save what can be saved of a file that was cut off.
    believe_coordinates : of a C3D that marks every point as missing.

    Raises
    ------
    FileError
        If the file cannot be read as what its suffix says.
    UsageError
        If rate or unit are needed and not given, or the rate contradicts the file by
        more than 0.1 %.
    """
    given = {
        "rate_hz": rate_hz,
        "unit": unit,
        "lenient": lenient,
        "believe_coordinates": believe_coordinates,
    }
    with seal.tolerated(lenient) as broken:
        reading = reading_of(Path(path), given)
    remarks = of_file(Path(path), (*broken, *reading.remarks))
    return replace(reading.recording, remarks=remarks)


def write(
    path: Path | str,
    recording: Recording,
    *,
    suffix: str = "",
    surfaces: Mapping[str, Surface] | None = None,
    unnamed: bool = False,
    bvh_up: str = "+y",
) -> tuple[Remark, ...]:
    """Write a take to exactly this path.

    What is no finite number is written as unknown, see `handclean.io.finite`.

    Parameters
    ----------
    surfaces : skins of hands by the name of their motion, for a format that shows them
        (``.glb``); the template's for the others.
    suffix : the format, such as ``.c3d``; default: the path's. A caller that writes to
        a temporary name and renames it says the format here.
    unnamed : write points without a name into a TRC, too.
    bvh_up : axis that points up in a BVH.

    Returns
    -------
    what the format cannot hold or how it was met

    Raises
    ------
    FileError
        If there is nothing of what the format holds, or the file cannot be written.
    """
    path = Path(path)
    wanted = check_suffix(path, suffix)
    format_ = BY_SUFFIX[wanted]
    recording = only_finite(recording)
    given = {"surfaces": surfaces, "unnamed": unnamed, "bvh_up": bvh_up}
    more = function(format_.write)(path, recording, **chosen(format_, given)) or ()
    return (*lost(recording, wanted, unnamed=unnamed), *more)


def check_suffix(path: Path | str, suffix: str = "") -> str:
    """Return the format in which ``path`` would be written, as ``.c3d`` or the like.

    Raises
    ------
    UsageError
        If there is no such format.
    """
    wanted = "." + (suffix or Path(path).suffix).lower().removeprefix(".")
    if wanted not in TAKES_WRITTEN:
        known = " ".join(TAKES_WRITTEN)
        raise UsageError(
            f"no format is called '{wanted}'; writable: {known}", where=path
        )
    return wanted


def inspect(
    path: Path | str,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    believe_coordinates: bool = False,
) -> dict[str, Any]:
    """Return what is in a file and what is odd about it, as plain JSON values.

    A file that is cut off or does not say its rate or unit is read as far as it goes;
    that is a remark here, not an error. ``traps`` are the texts of the remarks.

    Raises
    ------
    FileError
        If the file cannot be read at all.
    UsageError
        If an option contradicts it.
    """
    path = Path(path)
    wanted = by_suffix(path)
    if wanted is None:
        refuse_unread(path, " ".join(BY_SUFFIX))
    given = {
        "rate_hz": rate_hz,
        "unit": unit,
        "believe_coordinates": believe_coordinates,
    }
    with seal.tolerated(True) as broken:
        about: dict[str, Any] = function(wanted.inspect)(path, **chosen(wanted, given))
    return with_remarks(about, broken)
