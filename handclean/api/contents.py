"""What is in a file of any kind, a glove's too, as plain values by name."""

from importlib import import_module
from pathlib import Path
from typing import Any

from handclean.io import files
from handclean.io.hdf5 import seal
from handclean.io.shared.reading import with_remarks

OF_GLOVES = ("handclean glove samples", "handclean glove calibration")
"""Formats of which `handclean.api.glove_contents` tells more."""


def contents_of(
    path: Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    believe_coordinates: bool = False,
) -> dict[str, Any]:
    """Return what is in a file and what is odd about it, as plain JSON values.

    A file that is cut off or does not say its rate or unit is read as far as it goes;
    that is a remark here, not an error.

    Parameters
    ----------
    rate_hz : [Hz] for formats that do not say.
    unit : of lengths, mm, cm or m, for formats that do not say.
    believe_coordinates : of a C3D that marks every point as missing.

    Raises
    ------
    FileError
        If the file cannot be read at all.
    UsageError
        If an option contradicts it.
    """
    about = files.inspect(
        path, rate_hz=rate_hz, unit=unit, believe_coordinates=believe_coordinates
    )
    if about["format"] in OF_GLOVES:  # late, as it takes half a second
        inspect_glove = import_module("handclean.api.glove_contents").inspect_glove
        with seal.tolerated(True) as broken:
            found = inspect_glove(path, about)
        about = with_remarks(found, broken)
    if "parts" not in about and "markers" in about:
        about["marker_count"] = len(about["markers"])
    about["trap_count"] = len(about.setdefault("traps", []))
    return about
