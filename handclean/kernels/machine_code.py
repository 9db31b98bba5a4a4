"""Machine code of kernels: kept in files, and compiled once, not in each caller.

numba puts the code of all kernels that a kernel calls into that kernel, and optimises
it again there: of the labeller, whose kernels call each other ten levels deep, each
part was compiled up to ten times. Here a kernel whose code is longer than
``SEPARATE_BYTES`` is compiled by itself, and its callers hold its name only. So a file
also says which kernels its code calls; they are loaded first.

Files lie in two folders. What a wheel brings along is in the package (``SHIPPED``) and
made for any processor of its kind; it is looked at first. What is compiled here is made
for this processor and goes to the user's cache (``cache_directory``).

A file holds one kernel for one signature. Its name is a digest of all that decides the
code: numba, Python, processor, flags of the compiler, the source of the kernel's module
and of all modules that one imports. So files are never out of date, and may be copied
to another folder or machine. A file begins with the digest of the rest: nothing is
loaded that it does not fit.

This stands on parts of numba that are not public: ``Dispatcher._cache``,
``CompileResult._reduce`` and ``CodeLibrary._shared_module``, in the versions of
``KNOWN``. With any other numba, kernels are compiled and kept by numba itself.
"""

import fcntl
import hashlib
import importlib
import os
import pickle
import platform
import re
import sys
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite.binding as llvm
import numba
from numba.core import serialize
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.types import unliteral

KNOWN = ("0.68",)
"""Versions of numba whose inner parts are those used here."""

SEPARATE_BYTES = 32 * 1024
"""[bytes] of machine code above which a kernel is compiled by itself. Chosen: from 1
byte to 32 KiB the time to compile is the same within 10 %, and below it small kernels
would lose being built into their callers."""

MADE_BY = "made_by.txt"
"""File in ``SHIPPED`` that says what made it."""

GENERIC = "generic"
"""What numba calls a processor of which nothing is asked but the architecture. On the
machine of RESULTS.md this costs no time in any command ("machine_code")."""

LONGEST_WAIT_S = 120.0
"""[s] how long to wait for another process to compile a kernel, before it is compiled
here as well (chosen: ten times what the longest takes)."""

_dumps: Callable[[Any], bytes] = serialize.dumps
_rebuild: Callable[..., Any] = CompileResult._rebuild

_MAGIC = b"handclean machine code 1\n"
_PACKAGE = Path(__file__).parents[1]
SHIPPED = _PACKAGE / "data" / "machine_code"
"""Folder of the machine code in a wheel; a checkout has none."""

_IMPORT = re.compile(
    r"^(?:from|import) handclean([.\w]*)(?: import (?:\(([^)]*)\)|([^(#\n]*)))?", re.M
)

Types = tuple[Any, ...]


class Call(NamedTuple):
    """A kernel that is compiled by itself, as machine code names it."""

    module: str
    kernel: str
    types: Types
    symbol: str


class Kept(NamedTuple):
    """What a file holds."""

    types: Types
    calls: tuple[Call, ...]
    symbols: tuple[str, ...]
    """Names that the code defines and Python or other kernels ask for."""
    separate: bool
    result: Any
    """What numba makes a ``CompileResult`` from."""


def known_numba() -> bool:
    """Say whether this numba is one whose inner parts are known."""
    return numba.__version__.rsplit(".", 1)[0] in KNOWN


def cache_directory() -> Path:
    """Where the machine code of all kernels is kept."""
    if named := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(named)
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "handclean"


def _file(name: str) -> Path | None:
    """File of a module of this package, by its name after ``handclean``."""
    path = _PACKAGE.joinpath(*(part for part in name.split(".") if part))
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        if file.is_file():
            return file
    return None


@cache
def _source(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """Digest of a file, and files of this package that it imports."""
    content = file.read_bytes()
    found = []
    for module, block, line in _IMPORT.findall(content.decode("utf-8")):
        inner = [f"{module}.{name.strip()}" for name in (block or line).split(",")]
        found += [_file(name) for name in (module, *inner)]
    paths = tuple(path for path in found if path is not None)
    return hashlib.sha256(content).digest(), paths


@cache
def source_digest(file: Path) -> str:
    """Digest of a module and of all it imports from this package."""
    seen, todo = {file}, [file]
    while todo:
        new = set(_source(todo.pop())[1]) - seen
        seen |= new
        todo += new
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(seen):
        digest.update(_source(path)[0])
    return digest.hexdigest()[:16]


@cache
def _compiler(magic: tuple[str, ...]) -> str:
    """What of Python, processor and flags decides the code."""
    config: Any = numba.config
    flags = [config.BOUNDSCHECK, config.OPT, config.LOOP_VECTORIZE]
    flags += [config.SLP_VECTORIZE, config.DEBUGINFO_DEFAULT, SEPARATE_BYTES]
    return repr((sys.implementation.cache_tag, magic, flags))


_damaged: set[Path] = set()
"""Files of ``SHIPPED`` that did not fit their digest."""


def made_by(folder: Path) -> str:
    """Numba that made a folder of machine code that ships; "" if there is none."""
    try:
        return (folder / MADE_BY).read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def why_compiled() -> str:
    """Say why machine code that ships is not used; "" if none ships, or it is used."""
    shipped = made_by(SHIPPED)
    if shipped and shipped != maker():
        return (
            f"the machine code that ships is made by {shipped}, and this is {maker()}"
        )
    if _damaged:
        file = min(_damaged)
        return f"{file}: does not fit its digest; install handclean anew"
    return ""


def maker() -> str:
    """What makes machine code here: numba, Python, kind of processor."""
    python = ".".join(map(str, sys.version_info[:2]))
    return f"numba {numba.__version__}, Python {python}, {platform.machine()}"


_kernels: dict[tuple[str, str], Any] = {}
"""All kernels, by module and name."""

_separate: dict[str, tuple[str, str, Types]] = {}
"""Kernels compiled by themselves, by the names that machine code has for them."""


def keep(kernel: Any) -> None:
    """Keep the machine code of a kernel in files.

    Parameters
    ----------
    kernel : what ``numba.njit`` returned.
    """
    function = kernel.py_func
    _kernels[function.__module__, function.__qualname__] = kernel
    kernel._cache = KernelFiles(function)
    template = kernel.get_call_template

    def plain_template(args: Types, kws: dict[str, Any]) -> Any:
        return template(tuple(map(unliteral, args)), kws)

    # While numba infers types, a variable that begins at 0 is that literal, for which
    # a kernel it is given to would be compiled as well.
    kernel.get_call_template = plain_template


class KernelFiles(_Cache):
    """The files of one kernel; numba asks it before and after it compiles."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """Folder of the files of this user."""
        return str((cache_directory() / self._name((), ("", "", ""))).parent)

    def _name(self, types: Types, magic: tuple[str, ...]) -> str:
        """Name of a file in either folder."""
        function = self._function
        source = source_digest(Path(function.__code__.co_filename).resolve())
        named = f"{function.__module__}.{function.__qualname__}"
        what = f"{named}{types}{_compiler(magic)}"
        digest = hashlib.sha256(what.encode()).hexdigest()[:20]
        return f"{source}/{function.__name__}-{digest}.nbc"

    def load_overload(self, sig: Types, target_context: Any) -> Any:
        """Return the kernel compiled for some types, or None."""
        if not self._enabled:
            return None
        target_context.refresh()
        magic = target_context.codegen().magic_tuple()
        shipped = SHIPPED / self._name(sig, (magic[0], GENERIC, ""))
        for place in (shipped, cache_directory() / self._name(sig, magic)):
            kept = _read(place)
            if kept is not None and kept.types == sig:
                return _load(kept, target_context)
        if shipped.exists():
            _damaged.add(shipped)
        place = cache_directory() / self._name(sig, magic)
        if not _turns.take(place):
            return None
        kept = _read(place)
        if kept is None or kept.types != sig:
            return None
        _turns.give_back(place)
        return _load(kept, target_context)

    def save_overload(self, sig: Types, data: Any) -> None:
        """Write a kernel compiled for some types, where the folder can be written."""
        if not self._enabled or data.library.has_dynamic_globals or data.lifted:
            return
        content = _dumps(_taken(sig, data))
        place = cache_directory() / self._name(sig, data.codegen.magic_tuple())
        try:
            _write(place, content)
        except OSError:
            return
        finally:
            _turns.give_back(place)

    def enable(self) -> None:
        """Use files."""
        self._enabled = True

    def disable(self) -> None:
        """Use no files."""
        self._enabled = False

    def flush(self) -> None:
        """Do nothing: a file is never out of date."""


class Turns:
    """Lets one process compile a kernel while the others wait for its file.

    A process that compiles a kernel may wait for one that this one calls, and never
    for one that calls it; so no two wait for each other. The locks are bytes of one
    file, as locks of that kind work on network file systems, too; they end with their
    process.
    """

    def __init__(self) -> None:
        self._files: dict[Path, int] = {}

    def take(self, place: Path) -> bool:
        """Take the turn to make a file; say whether another process had it before."""
        waited = False
        until = time.monotonic() + LONGEST_WAIT_S
        while time.monotonic() < until:
            try:
                file = self._file(place)
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, _byte_of(place))
            except (BlockingIOError, PermissionError):
                waited = True
                time.sleep(0.02)
            except OSError:  # no such locks here
                break
            else:
                break
        return waited

    def give_back(self, place: Path) -> None:
        """Let the next process have the turn."""
        with suppress(OSError):
            fcntl.lockf(self._file(place), fcntl.LOCK_UN, 1, _byte_of(place))

    def _file(self, place: Path) -> int:
        folder = place.parents[1]
        if folder not in self._files:
            folder.mkdir(parents=True, exist_ok=True)
            self._files[folder] = os.open(
                folder / "compiling.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666
            )
        return self._files[folder]


_turns = Turns()


def _byte_of(place: Path) -> int:
    digest = hashlib.sha256(str(place).encode()).digest()
    return int.from_bytes(digest[:4]) & 0x7FFFFFFF


def _read(place: Path) -> Kept | None:
    """Read a file; return None if there is none, or if it is damaged."""
    try:
        content = place.read_bytes()
    except OSError:
        return None
    head = len(_MAGIC) + 32
    inside = memoryview(content)[head:]
    if content[:head] != _MAGIC + hashlib.sha256(inside).digest():
        return None
    kept = pickle.loads(inside)
    return Kept(*kept)


def _write(place: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = place.with_name(f"{place.name}.{uuid.uuid4().hex[:16]}")
    try:
        with beside.open("xb") as file:
            file.write(_MAGIC + hashlib.sha256(content).digest())
            file.write(content)
        beside.replace(place)
    except OSError:
        beside.unlink(missing_ok=True)
        raise


def _taken(types: Types, result: Any) -> tuple[Any, ...]:
    """Return what a file holds of a compiled kernel; hide the code of a long one."""
    library, about = result.library, result.fndesc
    module = library._final_module
    names = [f.name for f in module.functions if f.is_declaration]
    calls = tuple(Call(*_separate[name], name) for name in names if name in _separate)
    separate = (about.modname, about.qualname) in _kernels and (
        len(library._get_compiled_object()) > SEPARATE_BYTES
    )
    if separate:
        empty = llvm.parse_assembly("declare void @handclean_nothing()")
        empty.triple, empty.data_layout = module.triple, module.data_layout
        library._shared_module = empty  # what callers are given of the code
        _separate[about.mangled_name] = about.modname, about.qualname, types
    symbols = (
        about.mangled_name,
        about.llvm_cpython_wrapper_name,
        about.llvm_cfunc_wrapper_name,
    )
    return tuple(Kept(types, calls, symbols, separate, result._reduce()))


def _load(kept: Kept, target_context: Any) -> Any:
    """Make a kernel usable, and those it calls before it."""
    for call in kept.calls:
        importlib.import_module(call.module)
        kernel = _kernels.get((call.module, call.kernel))
        if kernel is None:
            return None
        kernel.compile(call.types)
        called = kernel.overloads[call.types]
        address = called.library.get_pointer_to_function(called.fndesc.mangled_name)
        llvm.add_symbol(call.symbol, address)
        _separate[call.symbol] = call.module, call.kernel, call.types
    target_context.codegen()._engine._defined_symbols.update(kept.symbols)
    result = _rebuild(target_context, *kept.result)
    if kept.separate:
        about = result.fndesc
        _separate[about.mangled_name] = about.modname, about.qualname, kept.types
    return result
