"""How long commands take to begin: import, help, a warm start, compiling all kernels.

Seconds on the wall, the best of some runs, and of processors. "A sample" is `clean` of
a take of `sample_sessions`, 26 markers, with the subject beside it; "compile" is
`handclean warm` with an empty cache and two processes. "From the wheel" is the first
run of a user who has no cache, with the machine code that `make wheel` would ship.
"nothing" is the start of Python itself, which every row holds.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from measuring import counted

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_sessions"
LABELLED = SAMPLES / "S01_001_thumb_4_finger.labelled.c3d"
FROM_THE_WHEEL = """
from pathlib import Path
from handclean.kernels import machine_code
machine_code.SHIPPED = Path({cache!r})
from handclean.cli.main import program
program()
"""
RUNS = counted("runs of which the fastest counts", 7, quick=5)
COLD = counted("compilations of all kernels", 1, quick=1, tiny=0)


def spent(words, folder, cache=None, run=("-m", "handclean")):
    """[s] on the wall and of processors that a command line takes."""
    extra = {} if cache is None else {"NUMBA_CACHE_DIR": str(cache)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    subprocess.run(
        [sys.executable, *run, *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **extra},
        capture_output=True,
        check=True,
    )
    wall = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, used


def row(name, words, folder, runs=RUNS, **given):
    wall, used = min(spent(words, folder, **given) for _ in range(runs))
    return {"command": name, "wall [s]": f"{wall:.2f}", "processor [s]": f"{used:.2f}"}


def rows():
    """One row per command."""
    take = SAMPLES / "S01_001_thumb_4_finger.c3d"
    subject = SAMPLES / "S01.subject.h5"
    clean = ["clean", take, "-o", "out.h5", "--subject", subject, "--overwrite"]
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "handclean", "warm"],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            check=True,
        )
        table = [
            row("nothing, in Python", [], folder, run=("-c", "")),
            row("import handclean", [], folder, run=("-c", "import handclean")),
            row("handclean --help", ["--help"], folder),
            row("handclean label --help", ["label", "--help"], folder),
            row("handclean inspect, a sample", ["inspect", take], folder),
            row("handclean clean, a sample", clean, folder),
        ]
        solve = ["solve", LABELLED, "-o", "out.h5", "--subject", subject, "--overwrite"]
        for n in range(COLD):
            cache = Path(folder) / f"cache {n}"
            os.environ["NUMBA_CPU_NAME"] = "generic"
            table.append(row("compile", ["warm"], folder, runs=1, cache=cache))
            del os.environ["NUMBA_CPU_NAME"]
            for name, words in (("clean", clean), ("solve", solve)):
                table.append(
                    row(
                        f"handclean {name}, the first run from the wheel",
                        words,
                        folder,
                        cache=Path(folder) / "none yet",
                        run=("-c", FROM_THE_WHEEL.format(cache=str(cache))),
                    )
                )
    return table


if __name__ == "__main__":
    for line in rows():
        print(line)
