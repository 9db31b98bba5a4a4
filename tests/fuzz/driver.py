"""Fuzz what reads files: damaged inputs in, nothing but `HandcleanError` out.

By hand, from the project's folder::

    python -m tests.fuzz.driver                          # lists the readers
    python -m tests.fuzz.driver readers_h5.session -n 20000
    python -m tests.fuzz.driver readers_h5.session --first 1234 -n 1 --keep here

``make slow`` runs a few hundred of every reader (``test_fuzz.py``).

A reader is added by an entry of ``READERS`` (see `tests.fuzz.inputs.Reader`) in a
module ``tests/fuzz/readers_*.py``::

    READERS = {"trc": Reader(read=read_all, seeds=write_seeds, mutators=TEXT)}

Inputs are numbered: the same number, seed and seeds give the same bytes. They are read
500 in a child process, one after another. Reported are

- any exception that is no `HandcleanError`, warnings included, and a child that dies,
- more than 5 s of processor time, that of the child's own children included,
- more than 50 MB and 20 times the file above what the child had before,
- an input over which the child says nothing for 60 s (it is killed).

What is reported stands, as it is found, on one line each; the exit status is 1 if there
is any. ``--keep`` saves these inputs in a folder.
"""

import argparse
import contextlib
import json
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from queue import Empty, Queue
from typing import Any

from tests.fuzz.batch import reader_of
from tests.fuzz.inputs import damaged

ROOT = Path(__file__).parents[2]
BATCH = 500
LONGEST = 5.0
"""[s] of processor time."""
SILENT = 60.0
"""[s] after which a child is killed."""


def most(size: int) -> int:
    """[bytes] that an input of some size may take."""
    return 50 * 10**6 + 20 * size


def names() -> list[str]:
    """All readers there are."""
    found = []
    for path in sorted(Path(__file__).parent.glob("readers_*.py")):
        readers = import_module(f"tests.fuzz.{path.stem}").READERS
        found += [f"{path.stem}.{name}" for name in readers]
    return found


def fuzz(
    name: str, count: int, *, seed: int = 0, first: int = 0, keep: Path | None = None
) -> tuple[list[str], dict[str, Any]]:
    """Read damaged inputs; return what is wrong, a line each, and figures."""
    wrong: list[str] = []
    worst = {"inputs": 0, "read": 0, "seconds": 0.0, "bytes": 0}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "seeds").mkdir()
        reader_of(name).seeds(Path(folder, "seeds"))
        for number, found in _results(name, folder, first, count, seed):
            worst["inputs"] += 1
            worst["read"] += bool(found.get("read"))
            for key in ("seconds", "bytes"):
                worst[key] = max(worst[key], found.get(key, 0))
            if fault := _judged(found):
                wrong.append(f"{name} {number} (seed {seed}): {fault}")
                print(wrong[-1], found.get("trace", ""), file=sys.stderr, flush=True)
                if keep is not None:
                    _keep(name, folder, number, seed, keep)
    return wrong, worst


def _judged(found: dict[str, Any]) -> str:
    if "fault" in found:
        return str(found["fault"])
    if found["seconds"] > LONGEST:
        return f"{found['seconds']:.1f} s of processor time"
    if found["bytes"] > most(found["size"]):
        return f"{found['bytes'] / 1e6:.0f} MB for {found['size']} bytes"
    return ""


def _results(
    name: str, folder: str, first: int, count: int, seed: int
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Go through the inputs; a child that hangs or dies is replaced by another."""
    at, end = first, first + count
    while at < end:
        stop = min(end, at + BATCH)
        command = [sys.executable, "-m", "tests.fuzz.batch", name, folder]
        command += [str(at), str(stop - at), str(seed)]
        with _child(command) as say:
            while at < stop:
                begun, result = say(), say()
                if begun is None:
                    raise RuntimeError(f"{name}: no batch can be started at {at}")
                yield at, result if isinstance(result, dict) else _gone(result)
                at += 1
                if not isinstance(result, dict):
                    break


def _gone(result: object) -> dict[str, Any]:
    return {"fault": "the process died" if result is None else str(result)}


@contextlib.contextmanager
def _child(command: list[str]) -> Iterator[Callable[[], object]]:
    """Start a batch; yields what reads its next line: None if it ended."""
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    lines: Queue[str] = Queue()

    def follow() -> None:
        for line in process.stdout or ():
            lines.put(line)
        lines.put("")

    thread = threading.Thread(target=follow, daemon=True)
    thread.start()

    def say() -> object:
        try:
            line = lines.get(timeout=SILENT)
        except Empty:
            return f"says nothing for {SILENT:.0f} s"
        if line.startswith("{"):
            return json.loads(line)
        return line.strip() or None

    try:
        yield say
    finally:
        process.kill()
        process.wait()
        thread.join(10)
        process.stdout.close()


def _keep(name: str, folder: str, number: int, seed: int, where: Path) -> None:
    where.mkdir(parents=True, exist_ok=True)
    paths = sorted(p for p in Path(folder, "seeds").iterdir() if p.is_file())
    contents = [path.read_bytes() for path in paths]
    content = damaged(reader_of(name), contents, number, seed)
    suffix = paths[number % len(paths)].suffix
    (where / f"{name}-{seed}-{number}{suffix}").write_bytes(content)
    for path in paths:
        shutil.copy(path, where)


def main() -> int:
    """Fuzz from the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("readers", nargs="*", help="as listed without any; or 'all'")
    parser.add_argument("-n", "--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    if not given.readers:
        print("\n".join(names()))
        return 0
    any_wrong = False
    for name in names() if given.readers == ["all"] else given.readers:
        wrong, worst = fuzz(
            name, given.count, seed=given.seed, first=given.first, keep=given.keep
        )
        any_wrong |= bool(wrong)
        print(
            f"{name}: {worst['inputs']} inputs, {worst['read']} read, "
            f"{len(wrong)} faults, at most {worst['seconds']:.2f} s and "
            f"{worst['bytes'] / 1e6:.0f} MB",
            flush=True,
        )
    return int(any_wrong)


if __name__ == "__main__":
    sys.exit(main())
