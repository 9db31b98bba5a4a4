"""An output appears whole or not at all, and its record knows it again."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from boxes import RECORDS, tally
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.runner import outputs, standing
from handclean.runner import provenance as record
from handclean.runner.batch import Source, Task
from handclean.runner.command import Work
from handclean.runner.outcome import Outcome
from handclean.runner.records import digest
from handclean.runner.standing import State

TALLY = tally()
WORK = Work(command=TALLY)
BEGUN = {"command": "c", "version": "1", "settings": {}, "inputs": [], "seed": 0}
BEGUN |= {"warnings": [], "remarks": []}


def task(*names):
    return Task(
        sources=(Source(path=Path("in")),), outputs=tuple(map(Path, names)), token="t"
    )


def put(text):
    return lambda path, provenance: path.write_text(text) and None


@pytest.fixture(autouse=True)
def somewhere_empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)


def test_a_step_may_have_several_outputs():
    made = Outcome(line="", writers=(put("a"), put("b")), history=({"command": "b"},))
    outputs.write(task("x/a.csv", "y/b.trc"), made, BEGUN, TALLY)
    assert Path("x/a.csv").read_text() == "a"
    assert Path("y/b.trc").read_text() == "b"
    assert RECORDS.of(Path("y/b.trc")) == ({"command": "b"}, BEGUN)
    assert standing.state(Path("x/a.csv"), BEGUN, WORK) == State.SAME


def test_if_one_of_several_outputs_fails_none_appears():
    def fail(path, provenance):
        path.write_text("half")
        raise FileError(path, "is full")

    made = Outcome(line="", writers=(put("a"), fail))
    with pytest.raises(HandcleanError, match=r"x/b\.csv: is full"):
        outputs.write(task("x/a.csv", "x/b.csv"), made, BEGUN, TALLY)
    assert os.listdir() == []


def test_a_machine_that_stops_between_record_and_output_leaves_no_false_output(
    monkeypatch,
):
    once = Outcome(line="", writers=(put("old"),))
    outputs.write(task("a.csv"), once, BEGUN, TALLY)
    replace, moved = os.replace, []

    def stop_after_one(source, target):
        if moved:
            raise KeyboardInterrupt
        moved.append(target)
        replace(source, target)

    monkeypatch.setattr(os, "replace", stop_after_one)
    with pytest.raises(KeyboardInterrupt):
        outputs.write(
            task("a.csv"), Outcome(line="", writers=(put("new"),)), BEGUN, TALLY
        )
    assert standing.state(Path("a.csv"), BEGUN, WORK) == State.MISSING


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"sha256": "x"}', '{"sha256": 1, "provenance": []}', "\xff"],
)
def test_a_record_that_is_none_counts_as_none(content):
    Path("a.csv").write_text("text")
    Path("a.csv.made.json").write_text(content, encoding="latin-1")
    assert RECORDS.of(Path("a.csv")) == ()


def test_names_of_inputs_and_times_do_not_matter_to_a_record():
    one = {**BEGUN, "inputs": [{"role": "input", "name": "a", "sha256": "1"}]}
    two = {**BEGUN, "inputs": [{"role": "input", "name": "b", "sha256": "1"}]}
    assert record.same({**one, "made": "now"}, {**two, "made": "then"})
    two["inputs"][0]["sha256"] = "2"
    assert not record.same(one, two)


def test_the_time_of_a_record_is_that_of_the_source_date(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    assert record.made_at() == "2023-11-14T22:13:20+00:00"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(UsageError, match="SOURCE_DATE_EPOCH"):
        record.made_at()


def test_a_digest_is_of_a_regular_file_only():
    os.mkfifo("pipe")
    Path("folder").mkdir()
    for name, said in [
        ("pipe", "is not a regular file"),
        ("folder", "is a folder"),
        ("none", "no such file"),
        ("x" * 300, "cannot be read: file name too long"),
    ]:
        with pytest.raises(FileError, match=f"{name}: {said}"):
            digest(Path(name))


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@given(value=plain)
def test_plain_values_survive_json(value):
    made = record.plain(value)
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    assert record.plain(made) == made


def test_numbers_of_numpy_become_plain():
    given = {"a": np.float64(0.5), "b": np.arange(3), "c": (np.bool_(True), np.nan)}
    assert record.plain(given) == {"a": 0.5, "b": [0, 1, 2], "c": [True, None]}
    assert record.plain(float("-inf")) == "-inf"
    with pytest.raises(TypeError):
        record.plain(object())
