"""``make wheel``: puts machine code into a wheel, so that nothing is compiled.

Run as ``python -m handclean.factory.wheel WHEEL FOLDER``, with a wheel made of these
sources. The new wheel is for this version of Python and this platform, for any
processor of its kind, and asks for the numba that made the code: with another one,
kernels are compiled as from a checkout.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numba

from handclean.kernels import machine_code

INSIDE = machine_code.SHIPPED.relative_to(machine_code.SHIPPED.parents[2])
"""Folder of the machine code within a wheel."""

_REQUIRES_NUMBA = re.compile(r"^Requires-Dist: numba\b[^;\n]*", re.MULTILINE)


def compile_generic(folder: Path) -> None:
    """Compile every kernel into a folder, for any processor of this kind."""
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": machine_code.GENERIC,
        "NUMBA_CACHE_DIR": str(folder),
    }
    _run(["handclean", "warm"], environment)
    (folder / machine_code.MADE_BY).write_text(f"{machine_code.maker()}\n")


def with_machine_code(wheel: Path, code: Path, folder: Path) -> Path:
    """Write a wheel with machine code inside; return its path.

    Parameters
    ----------
    wheel : one without machine code, for any Python.
    code : folder that `compile_generic` filled.
    folder : where to write the new one.
    """
    with tempfile.TemporaryDirectory() as room:
        _run(["wheel", "unpack", str(wheel), "--dest", room])
        [tree] = Path(room).iterdir()
        shutil.copytree(code, tree / INSIDE)
        [metadata] = tree.glob("*.dist-info/METADATA")
        said = metadata.read_text(encoding="utf-8")
        said, count = _REQUIRES_NUMBA.subn(
            f"Requires-Dist: numba=={numba.__version__}", said
        )
        if count != 1:
            raise ValueError(
                f"{wheel}: should ask for numba once, and does {count} times"
            )
        metadata.write_text(said, encoding="utf-8")
        _run(["wheel", "pack", str(tree), "--dest-dir", room])
        [packed] = Path(room).glob("*.whl")
        tags = ["--python-tag", _python(), "--abi-tag", _python()]
        tags += ["--platform-tag", _platform(), "--remove"]
        _run(["wheel", "tags", *tags, str(packed)])
        [tagged] = Path(room).glob("*.whl")
        folder.mkdir(parents=True, exist_ok=True)
        made = folder / tagged.name
        made.write_bytes(tagged.read_bytes())
    return made


def _python() -> str:
    return f"cp{sys.version_info.major}{sys.version_info.minor}"


def _platform() -> str:
    return re.sub(r"[-.]", "_", sysconfig.get_platform())


def _run(line: list[str], environment: Mapping[str, str] | None = None) -> None:
    subprocess.run([sys.executable, "-m", *line], env=environment, check=True)


def main() -> None:
    """Do what the module says."""
    wheel, folder = map(Path, sys.argv[1:])
    with tempfile.TemporaryDirectory() as room:
        code = Path(room, "machine_code")
        compile_generic(code)
        made = with_machine_code(wheel, code, folder)
    sys.stdout.write(f"{made}: {made.stat().st_size / 1e6:.1f} MB\n")


if __name__ == "__main__":
    main()
