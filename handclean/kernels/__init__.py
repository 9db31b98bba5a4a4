"""Compiled loops over plain arrays: no checks, no input or output.

``jit`` is defined here and nowhere else. No ``fastmath``: it breaks NaN, and NaN is
our "missing". With ``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python.

Machine code is kept in the user's cache directory (``machine_code``), which also serves
installations that cannot be written to; ``NUMBA_CACHE_DIR`` overrides where. A wheel of
``make wheel`` brings it along.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from handclean.kernels.machine_code import (
    cache_directory,
    keep,
    known_numba,
    source_digest,
)

__all__ = ["cache_directory", "jit"]

_Function = TypeVar("_Function", bound=Callable[..., Any])
_njit: Any = numba.njit


def jit(function: _Function) -> _Function:
    """Compile a kernel on its first call, or load it from the cache."""
    if known_numba():
        compiled = _njit(function, error_model="numpy", no_cfunc_wrapper=True)
        if compiled is not function:  # it is with NUMBA_DISABLE_JIT
            keep(compiled)
    else:
        file = Path(function.__code__.co_filename).resolve()
        place = str(cache_directory() / source_digest(file))
        setattr(numba.config, "CACHE_DIR", place)  # noqa: B010
        compiled = _njit(function, error_model="numpy", cache=True)
    return cast(_Function, compiled)
