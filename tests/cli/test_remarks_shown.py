"""What is worth telling of a take is on the console, in --json and in the session."""

import json
from pathlib import Path

import numpy as np
import pytest

from handclean.cli.main import main
from handclean.io import files
from handclean.recording import Recording, trajectories
from handclean.remarks import from_json

FIRST = 995


@pytest.fixture(autouse=True)
def odd(tmp_path, monkeypatch):
    """A TRC in which several things are odd."""
    monkeypatch.chdir(tmp_path)
    positions = np.arange(180.0).reshape(30, 2, 3) / 50 + 0.1
    markers = trajectories(positions, ("A", "B"))
    take = Recording(rate=100.0, frames=30, first_frame=FIRST, markers=markers)
    files.write("odd.trc", take)
    lines = Path("odd.trc").read_text().splitlines()
    lines[0] = lines[0].replace("handclean", "other")
    cells = lines[10].split("\t")
    lines[10] = "\t".join([*cells[:2], "0", "0", "0", *cells[5:]])
    text = "\n".join(lines).replace("X1\tY1", "X0\tY0", 1)
    Path("odd.trc").write_text(text + "\n")


def told(line, capfd):
    """Exit status, the object on stdout, and the warnings on stderr."""
    status = main([*line, "--json"])
    out, err = capfd.readouterr()
    found = [text for text in err.splitlines() if ": warning: " in text]
    return status, json.loads(out), found


def test_every_remark_of_a_take_is_shown_in_all_three(capfd):
    status, found, said = told(["convert", "odd.trc", "-o", "a.h5"], capfd)
    remarks = [from_json(one) for one in found["remarks"]]
    assert status == 0
    assert [(one.kind, one.text) for one in remarks] == [
        ("header", "coordinates are counted from X0 instead of X1"),
        ("missing", "1 samples at (0, 0, 0) count as missing"),
    ]
    assert remarks[1].data == {"samples": 1}
    assert {one.where.file for one in remarks} == {Path("odd.trc")}
    assert found["warnings"] == [one.text for one in remarks]
    assert said == [f"odd.trc: warning: {one.text}" for one in remarks]
    take = files.read("a.h5")
    events = [(e.kind, e.text, e.start, e.stop) for e in take.events]
    assert events == [(one.kind, one.text, 0, take.frames) for one in remarks]
    assert take.remarks == ()  # a session was told of before
    kept = take.provenance[-1]
    assert kept["warnings"] == found["warnings"]
    assert kept["remarks"] == found["remarks"]


def test_a_rerun_tells_the_same_and_a_session_stays_as_it_is(capfd):
    first = told(["convert", "odd.trc", "-o", "a.h5"], capfd)
    again = told(["convert", "odd.trc", "-o", "a.h5"], capfd)
    assert again[1]["status"] == "skipped"
    assert again[1]["remarks"] == first[1]["remarks"]
    assert again[2] == first[2]
    _, found, said = told(["convert", "a.h5", "-o", "b.h5"], capfd)
    assert found["remarks"] == said == []
    assert files.read("b.h5").events == files.read("a.h5").events


def test_a_command_that_fails_shows_what_it_had_met(capfd):
    status, found, said = told(["convert", "odd.trc", "-o", "a.mot"], capfd)
    assert (status, found["status"]) == (1, "failed")
    assert [one["kind"] for one in found["remarks"]] == ["header", "missing"]
    assert found["warnings"] == [one["text"] for one in found["remarks"]]
    assert said == [f"odd.trc: warning: {text}" for text in found["warnings"]]


def test_inspect_has_the_whole_remarks_beside_its_traps(capfd):
    status, found, _ = told(["inspect", "odd.trc"], capfd)
    assert status == 0
    assert found["traps"] == [one["text"] for one in found["remarks"]]
    assert [one["kind"] for one in found["remarks"]][:2] == ["header", "missing"]


def test_of_several_files_each_is_named(capfd):
    Path("more.trc").write_text(Path("odd.trc").read_text())
    _, found, said = told(["compare", "odd.trc", "more.trc"], capfd)
    names = [one["where"]["file"] for one in found["remarks"]]
    assert names == ["odd.trc"] * 2 + ["more.trc"] * 2
    for one, text in zip(found["remarks"], found["warnings"], strict=True):
        assert text == f"{one['where']['file']}: {one['text']}"
    assert len(said) == 4
