"""What many takes cost beside the work: `-j`, shards, a Dask cluster.

"n takes" are copies of one sample, which `inspect` reads; what a take takes on the wall
beside its own work is the whole run less what all takes took, as the reports say, by
the processes that did them, per take. "shards" are two commands side by side. A
cluster is a scheduler and workers of one thread, as processes of this machine, started
before; its memory is the resident set of the scheduler and of a worker at the end of
a run, and the largest of the process in which the worker does takes.

"clean" cleans copies of one sample. "Killed" are runs of `convert` on two workers, one
of which, or whose scheduler, is killed when a third of the takes are done; "begun" is
how often Dask says that a take was begun, and what was begun twice was in the hands of
the worker that was killed. The same line again then does what is left.
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
PROGRAM = (sys.executable, "-m", "handclean")
INSPECT = ("inspect", "--json", "--manifest")
SUBJECT = ROOT / "sample_sessions" / "S01.subject.h5"
TAKES = counted("takes", 2000, quick=200, tiny=24)
FEWER = counted("takes by one process, and while memory is looked at", 500, 100, 24)
CLEANED = counted("takes that are cleaned", 40, quick=20, tiny=4)
KILLED = counted("takes of a run with a kill", 300, quick=100, tiny=24)
WORKERS = (1, 2, 4)
WITH_SEVERAL = 2
"""Commands side by side: the cores of this machine."""


def environment(**more):
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}


def begun(*words, folder, stdout=subprocess.PIPE):
    line = [*PROGRAM, *words]
    return subprocess.Popen(line, cwd=folder, env=environment(), stdout=stdout)


def run(lines, folder, takes):
    """[s] on the wall of command lines side by side, [s] of the takes in each."""
    begin = time.perf_counter()
    processes = [begun(*words, folder=folder) for words in lines]
    told = [process.communicate()[0] for process in processes]
    wall = time.perf_counter() - begin
    found = [[json.loads(line) for line in text.splitlines()] for text in told]
    assert sum(map(len, found)) == takes
    assert all(o["status"] == "done" for part in found for o in part)
    return wall, [sum(o["seconds"] for o in part) for part in found]


def row(way, lines, folder, at_a_time, takes=TAKES):
    """One row; ``at_a_time`` processes do takes."""
    wall, worked = run(lines, folder, takes)
    at_a_time = min(at_a_time, WITH_SEVERAL)
    beside = 1e3 * (wall - sum(worked) / at_a_time) / takes
    return {
        "way": way,
        "takes": takes,
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
    file = folder / f"scheduler.{len(list(folder.glob('scheduler.*')))}"
    processes = []

    def dask(*words):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--no-dashboard"],
            env=environment(
                DASK_TEMPORARY_DIRECTORY=str(folder),
                DASK_DISTRIBUTED__ADMIN__LOW_LEVEL_LOG_LENGTH=str(100 * TAKES),
            ),
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
    takes, manifest = (FEWER, "few.txt") if workers == 1 else (TAKES, "takes.txt")
    with cluster(workers, folder) as (file, processes):
        way = f"Dask, {workers} worker{'s' * (workers > 1)}"
        line = [*INSPECT, manifest, "--scheduler", str(file)]
        found = row(way, [line], folder, workers, takes)
        scheduler, worker = processes[0].pid, processes[1].pid
        # the processes of a run end with it, so another one is looked at on its way
        line = [*INSPECT, "few.txt", "--scheduler", str(file)]
        looked = begun(*line, folder=folder, stdout=subprocess.DEVNULL)
        most = 0.0
        while looked.poll() is None:
            with suppress(OSError):
                most = max([most, *map(resident_mb, children(worker))])
            time.sleep(0.05)
        memory = {
            "way": way,
            "takes": takes,
            "scheduler [MB]": f"{resident_mb(scheduler):.0f}",
            "worker [MB]": f"{resident_mb(worker):.0f}",
            "its process for takes [MB]": f"{most:.0f}",
        }
    return found, memory


def cleaned(folder):
    """Rows of `clean`: on two processes and on a cluster of two workers."""
    names = (folder / "takes.txt").read_text().splitlines()[:CLEANED]
    (folder / "some.txt").write_text("".join(f"{name}\n" for name in names))
    line = ["clean", "--json", "--manifest", "some.txt", "--subject", str(SUBJECT)]
    found = [
        row("-j 2", [[*line, "-o", "here", "-j", "2"]], folder, WITH_SEVERAL, CLEANED)
    ]
    with cluster(WITH_SEVERAL, folder) as (file, _):
        words = [*line, "-o", "there", "--scheduler", str(file)]
        way = f"Dask, {WITH_SEVERAL} workers"
        found.append(row(way, [words], folder, WITH_SEVERAL, CLEANED))
    return found


def killed(what, folder):
    """What is lost and done twice when a worker, or the scheduler, is killed."""
    names = (folder / "takes.txt").read_text().splitlines()[:KILLED]
    (folder / "killed.txt").write_text("".join(f"{name}\n" for name in names))
    out = f"out_{what}"
    line = ["convert", "--json", "--manifest", "killed.txt", "--format", ".csv"]
    line += ["-o", out, "--scheduler"]
    with cluster(WITH_SEVERAL, folder) as (file, processes):
        told = folder / f"told.{what}"
        with told.open("w") as stdout:  # a pipe that nobody reads would hold it up
            run_of = begun(*line, str(file), folder=folder, stdout=stdout)
        victim = processes[0] if what == "scheduler" else processes[1]
        while done_in(folder / out) < KILLED // 3:
            assert run_of.poll() is None
            time.sleep(0.01)
        os.killpg(victim.pid, signal.SIGKILL)
        run_of.wait()
        times = "-" if what == "scheduler" else str(times_begun(file))
    first = done_in(folder / out)
    again = begun(*line[:-1], folder=folder)
    rest = [json.loads(one) for one in again.communicate()[0].splitlines()]
    statuses = [json.loads(one)["status"] for one in told.read_text().splitlines()]
    return {
        "killed": what,
        "takes": KILLED,
        "exit status": run_of.returncode,
        "reported done": statuses.count("done"),
        "outputs": first,
        "begun": times,
        "done by the same line again": sum(o["status"] == "done" for o in rest),
        "lost": KILLED - done_in(folder / out),
    }


def done_in(folder):
    """How many outputs are there, whole."""
    return sum(1 for path in folder.glob("*.csv")) if folder.is_dir() else 0


def times_begun(file):
    """How often Dask's scheduler sent a take to a worker."""
    from distributed import Client

    def count(dask_scheduler=None):
        return sum(1 for one in dask_scheduler.transition_log if one[2] == "processing")

    with Client(scheduler_file=str(file), set_as_default=False) as client:
        return client.run_on_scheduler(count)


def rows():
    """Time beside the work by way, memory of a cluster, what a kill costs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        names = [f"t{number}.c3d" for number in range(TAKES)]
        shutil.copy(TAKE, folder / names[0])
        for other in names[1:]:
            os.link(folder / names[0], folder / other)
        for file, some in (("takes.txt", names), ("few.txt", names[:FEWER])):
            (folder / file).write_text("".join(f"{name}\n" for name in some))
        shards = [
            [*INSPECT, "takes.txt", "--shard", f"{part}/{WITH_SEVERAL}"]
            for part in range(1, WITH_SEVERAL + 1)
        ]
        ways = [
            row("-j 1", [[*INSPECT, "few.txt"]], folder, 1, FEWER),
            row("-j 2", [[*INSPECT, "takes.txt", "-j", "2"]], folder, 2),
            row(f"{WITH_SEVERAL} shards", shards, folder, WITH_SEVERAL),
        ]
        if importlib.util.find_spec("distributed") is None:
            absent("Dask")
            return {"inspect": ways}
        both = [on_cluster(count, folder) for count in WORKERS]
        return {
            "inspect": [*ways, *(time for time, _ in both)],
            "clean": cleaned(folder),
            "Memory, Dask": [memory for _, memory in both],
            "Killed": [killed(what, folder) for what in ("worker", "scheduler")],
        }


if __name__ == "__main__":
    for title, part in rows().items():
        print(title)
        for line in part:
            print("  ", line)
