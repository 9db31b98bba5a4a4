"""Compiled loops over plain arrays: no checks, no input or output.

``jit`` is defined here and nowhere else. No ``fastmath``: it breaks NaN, and NaN is
our "missing". With ``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python.

Machine code is cached. numba notices a change in the file of a function, but not one
in a function it calls from another file; so the cache lives in a folder named after
all of the package's source, in the user's cache directory (which also serves
installations that cannot be written to). ``NUMBA_CACHE_DIR`` overrides it: on cluster
nodes set it to a local disk.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba


def _cache_directory() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        source = path.read_bytes()
        if b"jit" in source:
            digest.update(source)
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return str(Path(home) / "handclean" / digest.hexdigest()[:16])


if not getattr(numba.config, "CACHE_DIR", ""):
    setattr(numba.config, "CACHE_DIR", _cache_directory())  # noqa: B010

_Function = TypeVar("_Function", bound=Callable[..., Any])


def jit(function: _Function) -> _Function:
    """Compile a kernel on its first call, or load it from the cache."""
    compiled = numba.njit(function, cache=True, error_model="numpy")
    return cast(_Function, compiled)
