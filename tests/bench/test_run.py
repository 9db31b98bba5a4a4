"""RESULTS.md: what is measured now is written, what cannot be measured is kept."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest

HERE = Path(__file__).parent
BENCHMARKS = sorted(path.stem[6:] for path in HERE.glob("bench_*.py"))


def module(name):
    """A module of this folder, as `run.py` would import it."""
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@pytest.fixture(scope="module")
def tables():
    return module("tables")


@pytest.fixture
def run(monkeypatch, tables):
    monkeypatch.syspath_prepend(str(HERE))
    return module("run")


@pytest.fixture
def results(tmp_path):
    return tmp_path / "RESULTS.md"


LINE = "2026-01-02, commit 0123456789, a processor, 2 cores; took 1 s."
OURS = [{"solver": "handclean", "frames/s": 100}]
PEERS = [{"solver": "pymomentum GN", "frames/s": 40}, {"solver": "mink", "frames/s": 2}]


def section(run, rows, line=LINE, name="ik"):
    return f"## {name}\n\n{run.body('Text.', rows, '', 'full')}\n*{line}*"


def test_a_table_comes_back_as_it_was_written(tables):
    rows = [{"": "a", "x": "1", "y": ""}, {"": "", "x": "2 | 3", "y": "z"}]
    text = f"## name\n\n**A title**\n\n{tables.written(rows)}\n\n*{LINE}*"
    (group,) = tables.groups(text)
    (table,) = group.tables
    assert (table.title, group.line) == ("A title", LINE)
    assert table.rows == [
        {"": "a", "x": "1", "y": ""},
        {"": "", "x": "2 / 3", "y": "z"},
    ]


def test_peers_that_are_not_there_stay_as_they_were(run, results):
    run.put("ik", section(run, [*OURS, *PEERS]), [], results)
    run.put("ik", section(run, OURS, "2026-02-02, commit 1; took 2 s."), [], results)
    assert "mink" not in results.read_text()  # they were there, and are no more

    run.put("ik", section(run, [*OURS, *PEERS]), [], results)
    again = section(run, OURS, "2026-02-02, commit 1; took 2 s.")
    run.put("ik", again, ["pymomentum", "mink"], results)
    now, earlier = run.tables.groups(results.read_text())
    assert [row["solver"] for row in now.tables[0].rows] == ["handclean"]
    assert [row["solver"] for row in earlier.tables[0].rows] == [
        "handclean",  # beside them, since only rows of one run compare
        "pymomentum GN",
        "mink",
    ]
    assert now.line.startswith("2026-02-02")
    assert earlier.line == LINE
    assert "Not there this time: pymomentum, mink." in results.read_text()


def test_what_is_kept_is_kept_again_and_goes_when_it_is_measured(run, results):
    run.put("ik", section(run, [*OURS, *PEERS]), [], results)
    for day in (1, 2, 3):
        line = f"2026-03-0{day}, commit {day}; took 2 s."
        run.put("ik", section(run, OURS, line), ["pymomentum", "mink"], results)
    text = results.read_text()
    assert text.count("| mink |") == 1
    assert text.count(LINE) == 1
    assert "commit 2;" not in text
    assert text.count(run.tables.KEPT) == 1

    some = [*OURS, PEERS[0]]
    run.put(
        "ik", section(run, some, "2026-04-01, commit 4; took 2 s."), ["mink"], results
    )
    now, earlier = run.tables.groups(results.read_text())
    assert "pymomentum GN" in {row["solver"] for row in now.tables[0].rows}
    assert "mink" in {row["solver"] for row in earlier.tables[0].rows}

    run.put("ik", section(run, [*OURS, *PEERS]), [], results)
    assert run.tables.KEPT not in results.read_text()


def test_a_whole_section_without_its_recordings_keeps_its_tables(run, results):
    real = {"dfki13": [{"gap": 1}], "simulated": [{"gap": 2}]}
    run.put("gaps", section(run, real, name="gaps"), [], results)
    run.put(
        "gaps",
        section(run, {"simulated": [{"gap": 3}]}, "2026-05-05, x; took 1 s.", "gaps"),
        ["dfki13"],
        results,
    )
    now, earlier = run.tables.groups(results.read_text())
    assert [t.title for t in now.tables] == ["simulated"]
    assert [t.title for t in earlier.tables] == [f"{run.tables.KEPT}: dfki13"]


def test_two_runs_at_once_keep_both_sections(run, results):
    names = [f"n{k}" for k in range(12)]
    results.write_text(run.HEAD)
    threads = [
        threading.Thread(
            target=run.put, args=(name, section(run, OURS, name=name), [], results)
        )
        for name in names
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(run.sections(results.read_text())) == set(names)
    assert [path.name for path in results.parent.iterdir()] == [results.name]


def test_a_run_waits_for_the_lock_of_another_process(run, results):
    code = (
        "import fcntl, os, sys, time;"
        f"h = os.open({str(results.parent)!r}, os.O_RDONLY);"
        "fcntl.flock(h, fcntl.LOCK_EX); print('held', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with other:
        assert other.stdout.readline() == "held\n"
        mine = threading.Thread(
            target=run.put, args=("ik", section(run, OURS), [], results)
        )
        mine.start()
        mine.join(0.3)
        assert mine.is_alive()
        assert not results.exists()
        other.stdin.close()
        mine.join(10)
    assert results.exists()


def test_a_benchmark_that_fails_leaves_its_section(run, monkeypatch, results):
    run.put("ik", section(run, OURS), [], results)
    before = results.read_text()
    monkeypatch.setattr(run, "measured", lambda name, mode: None)
    assert run.main(["ik"]) == 1
    assert results.read_text() == before


def test_a_section_says_commit_and_whether_the_tree_was_changed(run, tmp_path):
    def git(*words):
        subprocess.run(["git", "-C", str(tmp_path), *words], check=True)

    run.ROOT, run.RESULTS = tmp_path, tmp_path / "tests" / "bench" / "RESULTS.md"
    assert run.commit() == "no commit known"
    git("init", "-q")
    run.RESULTS.parent.mkdir(parents=True)
    code = tmp_path / "handclean" / "code.py"
    code.parent.mkdir()
    code.write_text("1")
    who = ("-c", "user.name=n", "-c", "user.email=e")
    git("add", "-A")
    git(*who, "commit", "-qm", "one")
    assert re.fullmatch(r"commit [0-9a-f]{10}", run.commit())
    run.RESULTS.write_text("new")  # what a run itself writes
    (tmp_path / "notes.txt").write_text("not measured")
    assert "changes" not in run.commit()
    code.write_text("2")
    assert run.commit().endswith(" with changes not committed")


@pytest.mark.parametrize("mode", ["full", "quick", "tiny"])
def test_counts_stand_beside_the_full_ones(mode):
    code = (
        "import measuring as m;"
        "print(m.counted('seeds', 3, quick=2), m.counts(), sep=';')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(HERE), "HANDCLEAN_BENCH": mode},
        capture_output=True,
        text=True,
        check=True,
    )
    assert (
        done.stdout
        == {
            "full": "3;seeds 3\n",
            "quick": "2;seeds 2 instead of 3\n",
            "tiny": "1;seeds 1 instead of 3\n",
        }[mode]
    )


def test_a_quick_section_says_that_it_is_one(run):
    assert "A quick run" in run.body("Text.", OURS, "seeds 1 instead of 3", "quick")
    assert "A quick run" not in run.body("Text.", OURS, "seeds 3", "full")


def test_names_of_conditions_are_true():
    code = (
        "import json, bench_accuracy as b; from dataclasses import asdict;"
        "print(json.dumps([b.CONDITIONS, asdict(b.SimulateConfig())]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": f"{HERE}{os.pathsep}{HERE.parents[1]}"},
        capture_output=True,
        text=True,
        check=True,
    )
    conditions, usual = json.loads(done.stdout)
    assert conditions["as usual"][1] == {}
    ghosts = {"ghosts_per_s", "impostors_per_s"}
    for name, of in (
        ("ghosts x 4", ghosts),
        ("dropouts x 4", {"dropouts_per_s"}),
        ("both x 4", {*ghosts, "dropouts_per_s"}),
    ):
        assert conditions[name][1] == {key: 4.0 * usual[key] for key in of}
        assert all(usual[key] > 0.0 for key in of)


def test_every_section_says_when_and_at_which_commit(run):
    for name, text in run.sections(run.RESULTS.read_text()).items():
        found = run.tables.groups(text)
        assert found, name
        for group in found:
            assert re.search(r"commit [0-9a-f]{7,}", group.line), name


@pytest.mark.slow
@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_benchmark_runs(name):
    done = subprocess.run(
        [sys.executable, str(HERE / "run.py"), "--tiny", name],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert f"## {name}" in done.stdout
