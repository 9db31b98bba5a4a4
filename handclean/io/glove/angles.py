"""Angle files of any length: a session whose motion is written a piece at a time."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats
from handclean.errors import Place
from handclean.io.hdf5 import seal
from handclean.io.hdf5.encode import LIBRARY, put, put_attrs, storage_of
from handclean.io.hdf5.parts import Part
from handclean.io.hdf5.session import write_session
from handclean.io.shared.writing import unwritable
from handclean.recording import Motion, Recording, trajectories

_BLOCK_FRAMES = 16_384
"""Frames written at a time (chosen)."""

Columns = Mapping[str, tuple[NDArray[Any], str]]
"""Arrays by name with their units; they may lie on a disk."""


def write_long(
    path: Path,
    take: Recording,
    name: str,
    hinges: tuple[str, ...],
    motion: Columns,
    tips: tuple[tuple[str, ...], Floats] | None = None,
) -> None:
    """Write a take without motion and add one, without ever holding it whole.

    Parameters
    ----------
    take : with skeletons, rate, frames and provenance, but no motion.
    name : of the motion; hinges : its D names.
    motion : "angles" (T, D) and what else of `Motion` there is.
    tips : names of P points and (T, P, 3) [m] where they are, or None.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    write_session(path, take)
    try:
        with h5py.File(path, "r+", libver=LIBRARY) as file:
            group = file.create_group("motion").create_group(name)
            put(group, Part(items={"names": list(hinges)}), Place(path))
            for key, (values, units) in sorted(motion.items()):
                _write(group, key, values, units)
            if tips is not None:
                labels, places = tips
                group = file.create_group("markers")
                own = {"labels": list(labels), "model": [name] * len(labels)}
                put(group, Part(items=own), Place(path))
                _write(group, "positions", places, "m")
        seal.renew(path)
    except OSError as error:
        raise unwritable(path, error) from None


def _write(group: h5py.Group, key: str, values: NDArray[Any], units: str) -> None:
    storage = storage_of(values)
    dataset = group.create_dataset(key, values.shape, values.dtype, **storage)
    for begin in range(0, len(values), _BLOCK_FRAMES):
        rows = slice(begin, begin + _BLOCK_FRAMES)
        dataset[rows] = values[rows]
    put_attrs(dataset, {"units": units})


def with_motion(
    take: Recording,
    name: str,
    hinges: tuple[str, ...],
    motion: Columns,
    tips: tuple[tuple[str, ...], Floats] | None = None,
) -> Recording:
    """Return the take with the motion in memory, for formats written at once."""
    parts = {key: np.array(values) for key, (values, _) in motion.items()}
    whole = replace(take, motions={name: Motion(names=hinges, **parts)})
    if tips is None:
        return whole
    labels, places = tips
    marked = trajectories(np.array(places), labels, model=(name,) * len(labels))
    return replace(whole, markers=marked)
