"""Run every benchmark and write the tables, with hardware and versions.

``python tests/bench/run.py [NAME ...]`` runs ``bench_NAME.py`` for each name, all when
none is given, each in a process of its own, and replaces their sections of RESULTS.md;
the others stay as they were. A benchmark has ``rows()``: a list of flat dicts, a dict
of such lists by title, or text.
"""

import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
RESULTS = HERE / "RESULTS.md"
PACKAGES = ("numpy", "scipy", "numba", "h5py", "c3d", "ezc3d")
HEAD = """# Measured

Written by `make bench`; every table says on what. Machines are noisy: compare rows of
one table, not numbers of two.
"""


def processor():
    """The processor's name, as the system gives it."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        found = re.search(r"model name\s*:\s*(.+)", info.read_text())
        if found:
            return found[1].strip()
    return platform.processor() or platform.machine()


def circumstances(seconds):
    """One line: date, machine, versions."""
    versions = []
    for name in PACKAGES:
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue
    return (
        f"{time.strftime('%Y-%m-%d')}, {processor()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, {', '.join(versions)}; "
        f"took {seconds:.0f} s."
    )


def table(rows):
    """Rows as a Markdown table; a row may lack columns."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(columns) + " |", "|" + " --- |" * len(columns)]
    for row in rows:
        cells = (str(row.get(key, "")).replace("|", "/") for key in columns)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def measured(name):
    """The section of one benchmark."""
    code = (
        f"import json, sys, bench_{name} as m; r = m.rows(); "
        "sys.stdout.write('\\n@@' + json.dumps([m.__doc__, r], default=float) + '\\n')"
    )
    path = os.pathsep.join(filter(None, (str(HERE), os.environ.get("PYTHONPATH"))))
    begin = time.monotonic()
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
        },
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("@@")]
    if done.returncode or not lines:
        raise SystemExit(f"bench_{name}.py failed with status {done.returncode}")
    text, rows = json.loads(lines[-1][2:])
    parts = [f"## {name}", "", text.strip(), ""]
    if isinstance(rows, str):
        parts += [rows.strip(), ""]
        rows = {}
    tables = rows if isinstance(rows, dict) else {"": rows}
    for title, part in tables.items():
        parts += [f"**{title}**", ""] if title else []
        parts += [table(part), ""]
    parts.append(f"*{circumstances(time.monotonic() - begin)}*")
    return "\n".join(parts)


def sections(text):
    """The sections of an earlier RESULTS.md by name."""
    found = re.split(r"^## (\w+)$", text, flags=re.MULTILINE)
    return {
        name: f"## {name}{body.rstrip()}"
        for name, body in zip(found[1::2], found[2::2], strict=True)
    }


def main(names):
    """Measure and write."""
    known = sorted(path.stem[6:] for path in HERE.glob("bench_*.py"))
    for name in names:
        if name not in known:
            raise SystemExit(f"no benchmark is called '{name}'; known: {known}")
    kept = sections(RESULTS.read_text()) if RESULTS.is_file() else {}
    for name in names or known:
        sys.stderr.write(f"bench {name} ...\n")
        kept[name] = measured(name)
        body = "\n\n".join(kept[key] for key in sorted(kept))
        RESULTS.write_text(f"{HEAD}\n{body}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
