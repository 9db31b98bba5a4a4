"""Run benchmarks and write their tables, with commit, hardware and versions.

``python tests/bench/run.py [--quick] [NAME ...]`` runs ``bench_NAME.py`` for each name,
all when none is given, each in a process of its own, and replaces their sections of
RESULTS.md; the others stay as they were. ``--full``, the default, is what README's
figures are of; ``--quick`` gives the same rows of fewer trials in 20 minutes, and every
section says so; ``--tiny`` only sees whether everything runs, and writes nothing.

A benchmark has ``rows()``: a list of flat dicts, a dict of such lists by title, or
text; `measuring` is how it says what it counted and what was not there. A section is
put into RESULTS.md when it ends, under a lock, so that two runs keep both sections.
"""

import argparse
import contextlib
import fcntl
import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import measuring
import tables

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RESULTS = HERE / "RESULTS.md"
PACKAGES = ("numpy", "scipy", "numba", "h5py", "c3d", "ezc3d")
MEASURED = ("handclean", "tests/bench", "pyproject.toml", "requirements-lock.txt")
"""Where a change makes the tree another one than the commit's."""

QUICK = "A quick run: fewer trials, less certain figures."
HEAD = """# Measured

Written by `make bench`; every table says at which commit and on what. Machines are
noisy: compare rows of one table, not numbers of two.
"""


def processor():
    """The processor's name, as the system gives it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        found = re.search(r"model name\s*:\s*(.+)", info.read_text())
        if found:
            return found[1].strip()
    return platform.processor() or platform.machine()


def git(*words):
    """What git says of this tree, or None."""
    try:
        done = subprocess.run(
            ["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()


def commit():
    """The commit that is measured, and whether the tree is another than its."""
    name = git("rev-parse", "--short=10", "HEAD")
    if not name:
        return "no commit known"
    results = f":!{RESULTS.relative_to(ROOT)}" if RESULTS.is_relative_to(ROOT) else ""
    changed = git("status", "--porcelain", "--", *MEASURED, *filter(None, [results]))
    return f"commit {name}" + (" with changes not committed" if changed else "")


def circumstances(at, seconds):
    """One line: date, commit, machine, versions."""
    versions = []
    for name in PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions.append(f"{name} {importlib.metadata.version(name)}")
    return (
        f"{time.strftime('%Y-%m-%d')}, {at}, {processor()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {', '.join(versions)}; "
        f"took {seconds:.0f} s."
    )


def ran(name, mode):
    """What a benchmark gives: its text, rows, counts, and what was not there."""
    code = (
        f"import json, sys, measuring, bench_{name} as m; r = m.rows(); "
        "o = [m.__doc__, r, measuring.counts(), measuring.ABSENT]; "
        "sys.stdout.write('\\n@@' + json.dumps(o, default=float) + '\\n')"
    )
    path = os.pathsep.join(filter(None, (str(HERE), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
        env={
            **os.environ,
            "PYTHONPATH": path,
            "OPENBLAS_NUM_THREADS": "1",
            "OMP_NUM_THREADS": "1",
            measuring.VARIABLE: mode,
        },
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("@@")]
    if done.returncode or not lines:
        return None
    return json.loads(lines[-1][2:])


def body(text, rows, counts, mode):
    """A section without its heading and circumstances."""
    parts = [text.strip(), ""]
    if mode != "full":
        parts += [QUICK, ""]
    if counts:
        parts += [f"Counts: {counts}.", ""]
    if isinstance(rows, str):
        parts += [rows.strip(), ""]
        rows = {}
    for title, part in (rows if isinstance(rows, dict) else {"": rows}).items():
        if part:
            parts += [f"**{title}**", ""] if title else []
            parts += [tables.written(part), ""]
    return "\n".join(parts)


def measured(name, mode="full"):
    """The section of one benchmark, and what was not there; None if it failed."""
    at, begin = commit(), time.monotonic()
    given = ran(name, mode)
    if given is None:
        return None
    text, rows, counts, missing = given
    seconds = time.monotonic() - begin
    if at != commit():
        at += ", which changed meanwhile"
    section = f"## {name}\n\n{body(text, rows, counts, mode)}"
    return f"{section}\n*{circumstances(at, seconds)}*", missing


def with_earlier(section, missing, earlier):
    """A section with those tables of the earlier one that have what is missing."""
    if not missing:
        return section
    kept = tables.kept(tables.groups(earlier), missing)
    names = ", ".join(missing)
    parts = [section, "", f"Not there this time: {names}."]
    if kept:
        parts[-1] += " The tables that have it are those of an earlier run:"
        parts += ["", *kept]
    return "\n".join(parts)


def sections(text):
    """The sections of an earlier RESULTS.md by name."""
    found = re.split(r"^## (\w+)$", text, flags=re.MULTILINE)
    return {
        name: f"## {name}{body.rstrip()}"
        for name, body in zip(found[1::2], found[2::2], strict=True)
    }


@contextlib.contextmanager
def locked(folder):
    """Hold a folder's lock; another run waits meanwhile."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def put(name, section, missing, results=RESULTS):
    """Replace one section of the file, whatever others wrote since it was begun."""
    with locked(results.parent):
        kept = sections(results.read_text()) if results.is_file() else {}
        kept[name] = with_earlier(section, missing, kept.get(name, ""))
        text = f"{HEAD}\n" + "\n\n".join(kept[key] for key in sorted(kept)) + "\n"
        with tempfile.NamedTemporaryFile(
            "w", dir=results.parent, prefix=".RESULTS", delete=False
        ) as file:
            file.write(text)
        os.chmod(file.name, 0o644)
        os.replace(file.name, results)


def arguments(given):
    """Which benchmarks, and how much."""
    known = sorted(path.stem[6:] for path in HERE.glob("bench_*.py"))
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[0])
    how = parser.add_mutually_exclusive_group()
    for mode in measuring.MODES:
        how.add_argument(f"--{mode}", dest="mode", action="store_const", const=mode)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(known))
    found = parser.parse_args(given)
    for name in found.names:
        if name not in known:
            parser.error(f"no benchmark is called '{name}'; known: {', '.join(known)}")
    return found.names or known, found.mode or "full"


def main(given):
    """Measure and write; 1 if a benchmark failed."""
    names, mode = arguments(given)
    failed = []
    for name in names:
        sys.stderr.write(f"bench {name} ... ")
        sys.stderr.flush()
        begun = time.monotonic()
        found = measured(name, mode)
        sys.stderr.write(f"{time.monotonic() - begun:.0f} s\n")
        if found is None:
            failed.append(name)
        elif mode == "tiny":
            sys.stdout.write(f"{with_earlier(*found, '')}\n\n")
        else:
            put(name, *found)
    if failed:
        sys.stderr.write(f"failed, their sections as before: {', '.join(failed)}\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
