"""A Dask cluster does what workers of this machine do, whoever dies meanwhile.

Its scheduler and workers are processes of their own, as they are on a real one.
"""

import csv
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from boxes import Whose, tally
from processes import is_alive, processes

from handclean.errors import UsageError
from handclean.runner import cluster, many
from handclean.runner.batch import Batch
from handclean.runner.command import Work
from handclean.runner.process import Surroundings, start

ROOT = Path(__file__).parents[2]
FAKES = Path(__file__).parent / "fakes"
PATIENCE_S = 120.0
"""[s] after which a process counts as stuck, on a machine that has much else to do."""

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


def wait_until(told, process=None):
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if told():
            return
        assert process is None or process.poll() is None, process.communicate()
        time.sleep(0.05)
    pytest.fail("it never happened")


class LocalCluster:
    """A scheduler and workers of one thread, as processes of a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.file = str(folder / "scheduler.file")
        self.processes = []
        self.scheduler = self.dask("scheduler", "--port", "0", "--host", "127.0.0.1")
        wait_until(Path(self.file).is_file, self.scheduler)
        self.address = json.loads(Path(self.file).read_text())["address"]

    def dask(self, *words, path=""):
        paths = [*filter(None, [path]), ROOT, FAKES]
        line = [sys.executable, "-m", "dask", *words, "--scheduler-file", self.file]
        with (self.folder / f"{words[0]}.log").open("a") as log:
            process = subprocess.Popen(
                [*line, "--no-dashboard"],
                cwd=self.folder,
                env={
                    **os.environ,
                    "PYTHONPATH": os.pathsep.join(map(str, paths)),
                    "DASK_TEMPORARY_DIRECTORY": str(self.folder),
                },
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self.processes.append(process)
        return process

    def workers(self, count, *words, path=""):
        """Start workers, each with a nanny that starts it again when it is killed."""
        line = ["worker", "--nthreads", "1", "--host", "127.0.0.1"]
        return [self.dask(*line, *words, path=path) for _ in range(count)]

    def end(self):
        """Kill all of it, also what nannies started."""
        for process in self.processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@contextmanager
def started(folder, workers):
    found = LocalCluster(folder)
    try:
        found.workers(workers)
        wait_until(lambda: not workers or count_workers(found) == workers)
        yield found
    finally:
        found.end()


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A cluster that tests leave as it is."""
    with started(tmp_path_factory.mktemp("cluster"), workers=2) as found:
        yield found


@pytest.fixture
def own(tmp_path_factory):
    """A cluster that a test may damage."""
    with started(tmp_path_factory.mktemp("cluster"), workers=2) as found:
        yield found


@pytest.fixture
def program(folder):
    """Start ``handclean tally`` as a process."""
    with processes() as start:

        def go(*words):
            line = [sys.executable, FAKES / "tallying.py", "tally", *words]
            return start(line, env={**os.environ, "PYTHONPATH": str(ROOT)})

        yield go


def files(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }


def without_times(objects):
    return [{**o, "seconds": 0} for o in objects]


def test_it_gives_the_same_bytes_reports_list_and_status_as_jobs(
    shared, inputs, run, monkeypatch
):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    paths = inputs(
        S01__a="fine odd",
        S01__b="wrong read",
        S02__c="killed",
        d="exit",
        e="bug",
        f="memory",
        g="full",
        h="lossy",
        i="unfit",
        k="evil",
    )
    asked = {"output": "out", "format": ".csv", "given": Whose(mood="good")}
    paths += (Path("in/none.txt"),)
    told = []
    for way in ({"jobs": 2}, {"scheduler": shared.address}):
        status, objects, err = run(*paths, failed=Path("f.csv"), **asked, **way)
        failed = Path("f.csv").read_text()
        told.append((status, without_times(objects), err, failed, files("out")))
        shutil.rmtree("out")
    assert told[0] == told[1]
    assert told[0][0] == 1
    assert "killed (SIGKILL)" in told[0][1][2]["error"]


def test_what_jobs_made_is_skipped_and_one_input_goes_there_too(shared, inputs, run):
    paths = inputs(a="one", b="two")
    run(*paths, output="out", jobs=2)
    given = {"output": "out", "scheduler": shared.file}
    status, objects, _ = run(*paths, **given)
    assert (status, [o["status"] for o in objects]) == (0, ["skipped", "skipped"])
    (path,) = inputs(c="orphan pids 0")
    assert run(path, output="c.box", scheduler=shared.file)[0] == 0
    assert int(Path("pids").read_text()) != os.getpid()


@pytest.mark.parametrize("quiet", [False, True])
def test_the_first_worker_that_compiles_kernels_is_told_of(shared, inputs, run, quiet):
    paths = inputs(a="one", b="two", c="three", d="four")
    given = {"output": "out", "scheduler": shared.address, "quiet": quiet}
    status, _, err = run(*paths, command=tally(step="compiled"), **given)
    assert status == 0
    told = r"worker tcp://[\d.:]+: compiling kernels \.\.\.\n4 done\n"
    assert re.fullmatch("" if quiet else told, err)


def test_fail_fast_and_shards_mean_what_they_always_mean(shared, inputs, run):
    paths = inputs(a="one", b="wrong", c="one", d="one")
    given = {"output": "out", "scheduler": shared.address}
    status, objects, _ = run(*paths, fail_fast=True, jobs=1, **given)
    assert status == 1
    assert [o["status"] for o in objects] == ["done", "failed", "failed", "failed"]
    assert "not begun" in objects[2]["error"]
    status, objects, _ = run(*paths, shard="2/2", **given)
    assert [o["input"] for o in objects] == ["in/b.txt", "in/d.txt"]


def test_jobs_limit_how_many_are_done_at_a_time(shared, inputs, run, monkeypatch):
    most = []
    begin = cluster._Batch._begin

    def counted(batch, *given):
        begin(batch, *given)
        most.append(len(batch.state.begun))

    monkeypatch.setattr(cluster._Batch, "_begin", counted)
    monkeypatch.setenv("SLURM_CPUS_PER_TASK", "1")
    paths = inputs(a="slow 0.3", b="slow 0.3", c="slow 0.3", d="slow 0.3")
    run(*paths, output="out", scheduler=shared.address, jobs=1)
    assert max(most) == 1
    run(*paths, output="again", scheduler=shared.address)
    assert max(most) == 2


def test_takes_of_a_lost_worker_are_done_again(own, inputs, run):
    paths = inputs(a="orphan tried 1", b="slow 0.2", c="one")
    status, objects, _ = run(*paths, output="out", scheduler=own.address)
    assert status == 0
    assert [o["status"] for o in objects] == ["done"] * 3
    first, second = Path("tried").read_text().split()
    assert first != second
    wait_until(lambda: not is_alive(first))
    assert not [name for name in files("out") if "handclean" in name]


def test_a_take_that_kills_its_worker_twice_is_failed(own, inputs, run):
    paths = inputs(a="one", b="orphan tried 99", c="slow 0.2", d="two")
    given = {"failed": Path("f.csv"), "scheduler": own.address}
    status, objects, _ = run(*paths, output="out", **given)
    assert status == 1
    assert [o["status"] for o in objects] == ["done", "failed", "done", "done"]
    assert objects[1]["error"].startswith("in/b.txt: 2 workers were lost with it")
    assert len(Path("tried").read_text().split()) == 2
    (row,) = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert row["input"] == "in/b.txt"


def test_when_the_scheduler_is_lost_what_is_done_stays(own, inputs, program):
    paths = inputs(a="one", b="until go begun", c="linger lingers")
    process = program(
        *paths, "-o", "out", "--scheduler", own.address, "--json", "--failed", "f.csv",
        "--format", "csv",
    )  # fmt: skip
    for name in ("begun", "lingers"):  # so that the first has been reported
        wait_until(lambda name=name: Path(name).exists() and files(".")[name], process)
    own.scheduler.kill()
    out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    objects = [json.loads(line) for line in out.splitlines()]
    assert [o["status"] for o in objects] == ["done", "failed", "failed"]
    lost = f"not known to be done, as the scheduler {own.address} was lost"
    assert [o["error"] for o in objects[1:]] == [
        f"{path}: {lost}" for path in paths[1:]
    ]
    assert "Traceback" not in err
    assert sorted(files("out")) == ["a.csv", "a.csv.made.json"]
    rows = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert [row["input"] for row in rows] == ["in/b.txt", "in/c.txt"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_cancels_what_is_being_done(shared, inputs, program, run, number):
    paths = inputs(a="one", b="linger lingers", c="linger lingers2", d="one")
    process = program(
        *paths, "-o", "out", "--scheduler", shared.address, "--format", "csv",
        "--failed", "f.csv",
    )  # fmt: skip
    for name in ("lingers", "lingers2"):
        wait_until(lambda name=name: Path(name).exists() and files(".")[name], process)
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + number
    assert out == "in/a.txt -> out/a.csv: 1 words\n"
    assert err == f"interrupted by {number.name}\n"
    for name in ("lingers", "lingers2"):
        assert not is_alive(Path(name).read_text())
    assert sorted(files(".")) == [
        "f.csv", "in/a.txt", "in/b.txt", "in/c.txt", "in/d.txt", "lingers",
        "lingers2", "out/a.csv", "out/a.csv.made.json",
    ]  # fmt: skip
    rows = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert [row["input"] for row in rows] == [str(path) for path in paths[1:]]
    given = {"output": "out", "format": ".csv", "seed": None}
    _, objects, _ = run(*paths[::3], scheduler=shared.address, **given)
    assert [o["status"] for o in objects] == ["skipped", "done"]


def test_a_run_that_is_killed_leaves_nothing_running(shared, inputs, program):
    paths = inputs(a="linger lingers", b="one")
    process = program(
        *paths, "-o", "out", "--scheduler", shared.address, "--format", "csv"
    )
    wait_until(lambda: Path("lingers").exists() and files(".")["lingers"], process)
    process.kill()
    process.communicate()
    wait_until(lambda: not is_alive(Path("lingers").read_text()))
    wait_until(lambda: not list(Path().rglob(".handclean*")))


def test_workers_with_another_handclean_are_named_and_get_nothing(
    own, inputs, run, tmp_path_factory
):
    others = tmp_path_factory.mktemp("others")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "handclean", others / "handclean", ignore=ignored)
    with (others / "handclean" / "errors.py").open("a") as file:
        file.write("# other code\n")
    none = tmp_path_factory.mktemp("none")
    (none / "handclean.py").write_text("raise ImportError")
    for path in (others, none):
        own.workers(1, "--no-nanny", path=path)
    wait_until(lambda: count_workers(own) == 4)
    paths = inputs(**dict.fromkeys("abcdef", "slow 0.1"))
    status, objects, err = run(*paths, output="out", scheduler=own.address)
    assert (status, {o["status"] for o in objects}) == (0, {"done"})
    said = [line for line in err.splitlines() if line.startswith("worker ")]
    assert len(said) == 2
    assert any("with other code (digest " in line for line in said)
    assert any("has no handclean, or one that knows no clusters" in s for s in said)


def count_workers(own):
    from distributed import Client

    with Client(own.address, set_as_default=False) as client:
        return len(client.nthreads())


def test_where_no_worker_has_this_handclean_nothing_is_begun(
    tmp_path_factory, inputs, run
):
    none = tmp_path_factory.mktemp("none")
    (none / "handclean.py").write_text("raise ImportError")
    paths = inputs(a="one", b="two")
    with started(tmp_path_factory.mktemp("cluster"), workers=0) as found:
        found.workers(1, "--no-nanny", path=none)
        wait_until(lambda: count_workers(found) == 1)
        said = r"^--scheduler tcp.*: worker tcp.* has no handclean.*install the same"
        with pytest.raises(UsageError, match=said):
            run(*paths, output="out", scheduler=found.address)
    assert not Path("out").exists()


def test_without_workers_it_waits_but_not_for_ever(
    tmp_path_factory, inputs, run, monkeypatch
):
    monkeypatch.setattr(cluster, "WORKERLESS_S", 2.0)
    paths = inputs(a="one", b="two")
    with started(tmp_path_factory.mktemp("cluster"), workers=0) as found:
        status, objects, err = run(*paths, output="out", scheduler=found.address)
    assert status == 1
    assert err.splitlines()[0].endswith("has no workers yet; waiting for some")
    assert [o["error"] for o in objects] == [
        f"{path}: not done, as the cluster has had no worker for 2 s" for path in paths
    ]


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://127.0.0.1:1", "no scheduler of Dask answers there"),
        ("tls://127.0.0.1:1", "no scheduler of Dask answers there"),
        ("nonsense://127.0.0.1:1", "no protocol is called 'nonsense'; known: "),
        ("in/a.txt", "is no file that a scheduler of Dask wrote"),
        ("tcp://127.0.0.1:SILENT", "no scheduler of Dask answers there"),
    ],
)
def test_a_scheduler_that_does_not_answer_is_one_line(
    inputs, run, monkeypatch, address, said
):
    monkeypatch.setattr(cluster.on_worker.dask_client, "CONNECTS_WITHIN_S", 1.0)
    silent = socket.create_server(("127.0.0.1", 0))  # what is there is no scheduler
    address = address.replace("SILENT", str(silent.getsockname()[1]))
    paths = inputs(a="one", b="two")
    with pytest.raises(UsageError) as caught:
        run(*paths, output="out", failed=Path("f.csv"), scheduler=address)
    silent.close()
    assert str(caught.value).startswith(f"--scheduler {address}: {said}")
    assert "\n" not in str(caught.value)
    assert sorted(files(".")) == ["in/a.txt", "in/b.txt"]


def test_without_dask_it_says_what_installs_it(inputs, run, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"needs Dask; 'pip install handclean\[clust"):
        run(*inputs(a="one"), output="a.box", scheduler="tcp://127.0.0.1:1")


def test_a_machine_without_the_folder_says_so(inputs, folder):
    (path,) = inputs(a="one")
    batch = Batch(inputs=(path,), output="a.box")
    (task,) = many.plan.mapping(batch, many.plan.lines_of(batch), tally())
    process = start(Work(command=tally()), surroundings=Surroundings(folder="/none"))
    try:
        process.send(task)
        report = process.answer(task)
    finally:
        process.end()
    assert report.status == "failed"
    assert report.error.startswith("in/a.txt: ")
    assert "cannot go to /none: no such file or directory; workers of a" in report.error


def test_only_what_is_asked_to_imports_dask(folder):
    Path("a.trc").write_text("")
    code = (
        "import sys; from handclean.cli.main import main; main(sys.argv[1:]); "
        "sys.stderr.write(str([m for m in sys.modules if m in "
        "('dask', 'distributed', 'tornado')]))"
    )
    for words in (["--help"], ["clean", "--help"], ["inspect", "-q", "a.trc", "a.trc"]):
        done = subprocess.run(
            [sys.executable, "-c", code, *words],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        assert done.stderr.endswith("[]"), (words, done.stderr)
