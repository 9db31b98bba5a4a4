"""``--recursive``: which files stand for a folder, and where their outputs belong."""

import errno
import os
from pathlib import Path

import pytest
from boxes import Whose, tally

from handclean.errors import UsageError
from handclean.runner import plan
from handclean.runner.batch import Batch


@pytest.fixture(autouse=True)
def somewhere_empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def write(*names):
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text("one")


def planned(*names, **options):
    """Inputs and outputs of the tasks for inputs of these names."""
    options = {"recursive": True, "output": "out", **options}
    batch = Batch(inputs=tuple(map(Path, names)), **options)
    command = tally()
    tasks = plan.mapping(batch, plan.lines_of(batch, command.reads), command)
    return {str(task.sources[0].path): str(task.outputs[0]) for task in tasks}


def test_a_folder_stands_for_the_files_below_it_in_the_order_of_their_names():
    write("raw/b.TXT", "raw/a.txt", "raw/c/d/e.txt", "raw/c/a.box", "raw/no.doc")
    found = planned("raw", "x.txt")
    assert list(found) == ["raw/a.txt", "raw/b.TXT", "raw/c/a.box", "raw/c/d/e.txt",
                           "x.txt"]  # fmt: skip
    assert found["raw/c/d/e.txt"] == "out/raw/c/d/e.box"


def test_the_place_of_an_output_does_not_depend_on_what_else_is_in_the_folder():
    write("raw/S01/a.txt")
    assert planned("raw") == {"raw/S01/a.txt": "out/S01/a.box"}
    write("raw/S02/a.txt")
    assert planned("raw")["raw/S01/a.txt"] == "out/S01/a.box"
    assert planned("./raw/")["raw/S01/a.txt"] == "out/S01/a.box"
    Path("raw/S01/deep").mkdir()
    os.chdir("raw/S01/deep")
    assert planned("..")["../a.txt"] == "out/a.box"


def test_a_file_in_a_folder_has_no_file_for_its_output():
    write("raw/a.txt")
    with pytest.raises(UsageError, match=r"is one file for the files of a folder; -o"):
        planned("raw", output="out.box")


def test_hidden_files_outputs_and_what_is_read_beside_the_inputs_are_left_out():
    names = ["a", "who", "list", "failed", "prior", ".hidden", ".git/x", "out/a"]
    write(*(f"d/{name}.txt" for name in names))
    Path("d/list.txt").write_text("d/a.txt\n")
    found = planned(
        "d",
        output="d/out",
        given=Whose(who=(Path("d/who.txt"),)),
        files={"prior": Path("d/prior.txt")},
        failed=Path("d/failed.txt"),
        config=Path("d/list.txt"),
    )
    assert list(found) == ["d/a.txt"]


def test_what_a_pattern_finds_for_an_input_is_no_input():
    write("d/S01/a.txt", "d/S01/who.txt", "d/S02/a.txt", "d/S02/who.txt")
    found = planned("d", given=Whose(who_for="who.txt"))
    assert list(found) == ["d/S01/a.txt", "d/S02/a.txt"]


def test_a_folder_of_a_manifest_stands_for_its_files_with_what_its_line_says():
    write("d/S01/a.txt", "d/S01/b.txt")
    Path("list.csv").write_text("input,mood\nd/S01,good\n")
    batch = Batch(manifest="list.csv", recursive=True, given=Whose())
    lines = plan.lines_of(batch, [".txt"])
    assert [(str(line.input), line.cells, line.at) for line in lines] == [
        ("d/S01/a.txt", {"mood": "good"}, "list.csv, line 2"),
        ("d/S01/b.txt", {"mood": "good"}, "list.csv, line 2"),
    ]


def test_links_are_followed_but_not_in_circles():
    write("far/S01/a.txt")
    Path("raw").mkdir()
    Path("raw/S01").symlink_to("../far/S01")
    Path("far/S01/back").symlink_to("../../raw")
    assert list(planned("raw")) == ["raw/S01/a.txt"]


def test_a_folder_without_files_is_a_mistake():
    write("raw/a.doc")
    said = r"^raw: has no file below it that the command reads \(\.box \.txt\)$"
    with pytest.raises(UsageError, match=said):
        planned("raw")


def test_a_folder_that_cannot_be_read_is_named(monkeypatch):
    """The system says so here, as to root every folder is readable."""
    write("raw/S01/a.txt")
    scan = os.scandir

    def forbidden(folder):
        if Path(folder) == Path("raw/S01"):
            raise PermissionError(errno.EACCES, "Permission denied", str(folder))
        return scan(folder)

    monkeypatch.setattr(os, "scandir", forbidden)
    with pytest.raises(UsageError, match=r"^raw/S01: cannot be read: permission"):
        planned("raw")


def test_without_it_a_folder_stays_what_it_is():
    write("raw/a.txt")
    assert list(planned("raw", recursive=False)) == ["raw"]
