"""What many takes cost beside the work: `-j`, shards, a Dask cluster.

"n takes" are copies of one sample, which `inspect` reads; what a take takes on the wall
beside its own work is the whole run less what all takes took, as the reports say, by
the processes that did them, per take. "shards" are two commands side by side. A
cluster is a scheduler and workers of one thread, as processes of this machine, started
before; its memory is the resident set of the scheduler and of a worker at the end of
a run, and the largest of the process in which the worker does takes.
"""

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path

from measuring import absent, counted

ROOT = Path(__file__).parents[2]
TAKE = ROOT / "sample_sessions" / "S01_001_thumb_4_finger.c3d"
COMMAND = (sys.executable, "-m", "handclean", "inspect", "--json", "--manifest")
TAKES = counted("takes", 1000, quick=200, tiny=24)
WITH_SEVERAL = 2
"""Commands side by side, and most workers of a cluster: the cores of this machine."""


def environment(**more):
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}


def begun(*words, folder, stdout=subprocess.PIPE):
    line = [*COMMAND, *words]
    return subprocess.Popen(line, cwd=folder, env=environment(), stdout=stdout)


def run(lines, folder):
    """[s] on the wall of command lines side by side, [s] of the takes in each."""
    begin = time.perf_counter()
    processes = [begun(*words, folder=folder) for words in lines]
    told = [process.communicate()[0] for process in processes]
    wall = time.perf_counter() - begin
    found = [[json.loads(line) for line in text.splitlines()] for text in told]
    assert sum(map(len, found)) == TAKES
    assert all(o["status"] == "done" for part in found for o in part)
    return wall, [sum(o["seconds"] for o in part) for part in found]


def row(way, lines, folder, at_a_time):
    """One row; ``at_a_time`` processes do takes."""
    wall, worked = run(lines, folder)
    beside = 1e3 * (wall - sum(worked) / at_a_time) / TAKES
    return {
        "way": way,
        "wall [s]": f"{wall:.1f}",
        "work of takes [s]": f"{sum(worked):.1f}",
        "beside it, a take [ms]": f"{beside:.1f}",
    }


def resident_mb(pid):
    """[MB] of memory that a process has."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1e3
    return float("nan")


def children(pid):
    """Processes that a process started and that do Python's work."""
    found = Path(f"/proc/{pid}/task").glob("*/children")
    pids = [int(word) for path in found for word in path.read_text().split()]
    named = {p: Path(f"/proc/{p}/cmdline").read_bytes() for p in pids}
    return [p for p, line in named.items() if b"resource_tracker" not in line]


@contextmanager
def cluster(workers, folder):
    """Start a scheduler and workers; give the scheduler's file and all processes."""
    file = folder / f"scheduler.{workers}"
    processes = []

    def dask(*words):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--no-dashboard"],
            env=environment(DASK_TEMPORARY_DIRECTORY=str(folder)),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        processes.append(process)

    try:
        dask("scheduler", "--port", "0", "--scheduler-file", str(file))
        while not file.is_file():
            time.sleep(0.1)
        for _ in range(workers):
            dask("worker", "--nthreads", "1", "--no-nanny", "--scheduler-file", file)
        wait_for(file, workers)
        yield file, processes
    finally:
        for process in processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def wait_for(file, workers):
    from distributed import Client

    with Client(scheduler_file=str(file), set_as_default=False) as client:
        client.wait_for_workers(workers)


def on_cluster(workers, folder):
    """Rows of a cluster with so many workers: time and memory."""
    with cluster(workers, folder) as (file, processes):
        line = ["takes.txt", "--scheduler", str(file)]
        found = row(
            f"Dask, {workers} worker{'s' * (workers > 1)}", [line], folder, workers
        )
        scheduler, worker = processes[0].pid, processes[1].pid
        # the processes of a run end with it, so another one is looked at on its way
        looked = begun(*line, folder=folder, stdout=subprocess.DEVNULL)
        most = 0.0
        while looked.poll() is None:
            with suppress(OSError):
                most = max([most, *map(resident_mb, children(worker))])
            time.sleep(0.05)
        memory = {
            "way": found["way"],
            "scheduler [MB]": f"{resident_mb(scheduler):.0f}",
            "worker [MB]": f"{resident_mb(worker):.0f}",
            "its process for takes [MB]": f"{most:.0f}",
        }
    return found, memory


def rows():
    """Time beside the work by way, and memory of a cluster."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        names = [f"t{number}.c3d" for number in range(TAKES)]
        shutil.copy(TAKE, folder / names[0])
        for other in names[1:]:
            os.link(folder / names[0], folder / other)
        (folder / "takes.txt").write_text("".join(f"{name}\n" for name in names))
        shards = [
            ["takes.txt", "--shard", f"{part}/{WITH_SEVERAL}"]
            for part in range(1, WITH_SEVERAL + 1)
        ]
        ways = [
            row("-j 1", [["takes.txt"]], folder, 1),
            row("-j 2", [["takes.txt", "-j", "2"]], folder, 2),
            row(f"{WITH_SEVERAL} shards", shards, folder, WITH_SEVERAL),
        ]
        if importlib.util.find_spec("distributed") is None:
            absent("Dask")
            return {"Time": ways}
        both = [on_cluster(count, folder) for count in (1, WITH_SEVERAL)]
        return {
            "Time": [*ways, *(time for time, _ in both)],
            "Memory, Dask": [memory for _, memory in both],
        }


if __name__ == "__main__":
    for title, part in rows().items():
        print(title)
        for line in part:
            print("  ", line)
