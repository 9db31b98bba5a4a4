"""Compiled loops over plain arrays: no checks, no input or output.

``jit`` is defined here and nowhere else. No ``fastmath``: it breaks NaN, and NaN is
our "missing". With ``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python.

Machine code is cached. numba notices a change in the file of a function, but not one
in a function it calls from another file; so each module's kernels lie in a folder named
after its source and that of all modules it imports, in the user's cache directory
(which also serves installations that cannot be written to). ``NUMBA_CACHE_DIR``
overrides where: on cluster nodes set it to a local disk.
"""

import hashlib
import os
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(
    r"^(?:from|import) handclean([.\w]*)(?: import (?:\(([^)]*)\)|([^(#\n]*)))?", re.M
)


def _file(name: str) -> Path | None:
    """File of a module of this package, by its name after ``handclean``."""
    path = _PACKAGE.joinpath(*(part for part in name.split(".") if part))
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        if file.is_file():
            return file
    return None


@cache
def _imported(file: Path) -> tuple[Path, ...]:
    """Files of this package that one of them imports."""
    found = []
    for module, block, line in _IMPORT.findall(file.read_text(encoding="utf-8")):
        inner = [f"{module}.{name.strip()}" for name in (block or line).split(",")]
        found += [_file(name) for name in (module, *inner)]
    return tuple(path for path in found if path is not None)


@cache
def _digest(file: Path) -> str:
    """Hash of a file and all it imports from this package."""
    seen, todo = {file}, [file]
    while todo:
        new = set(_imported(todo.pop())) - seen
        seen |= new
        todo += new
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(seen):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Where the machine code of all kernels is kept."""
    if named := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(named)
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "handclean"


_Function = TypeVar("_Function", bound=Callable[..., Any])


def jit(function: _Function) -> _Function:
    """Compile a kernel on its first call, or load it from the cache."""
    file = Path(function.__code__.co_filename).resolve()
    setattr(numba.config, "CACHE_DIR", str(cache_directory() / _digest(file)))  # noqa: B010
    compiled = numba.njit(function, cache=True, error_model="numpy")
    return cast(_Function, compiled)
