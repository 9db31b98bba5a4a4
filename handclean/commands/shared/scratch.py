"""Arrays that grow on a disk while a long stream goes by."""

import tempfile
import weakref
from typing import Any

import numpy as np

from handclean.arrays import Floats


class Scratch:
    """Arrays that grow on a disk, in files that are gone with the process.

    Parameters
    ----------
    widths : columns of each array, by name.
    """

    def __init__(self, widths: dict[str, int]) -> None:
        self._widths = widths
        self._open = {
            name: tempfile.TemporaryFile(prefix="handclean-")  # noqa: SIM115
            for name in widths
        }
        weakref.finalize(self, _close, self._open)

    def add(self, **parts: Floats) -> None:
        """Append (t, ...) rows to arrays, by their names."""
        for name, values in parts.items():
            self._open[name].write(np.ascontiguousarray(values, dtype=np.float64).data)

    def arrays(self, frames: int) -> dict[str, Floats]:
        """Return the arrays, (T, ...); nothing more can be appended."""
        out: dict[str, Floats] = {}
        for name, file in self._open.items():
            file.flush()
            shape = (frames, self._widths[name])
            out[name] = np.memmap(file, dtype=np.float64, mode="r", shape=shape)
            file.close()
        return out


def _close(files: dict[str, Any]) -> None:
    for file in files.values():
        file.close()
