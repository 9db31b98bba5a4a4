"""The step of `tally`, with a kernel that its process has to compile."""

import numba
from tally import FIGURES, tally

__all__ = ["FIGURES", "compiled"]


def compiled(source, settings):
    numba.config.DISABLE_JIT = 0
    numba.njit(lambda x: x + 1)(1)
    return tally(source, settings)
