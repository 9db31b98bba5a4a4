"""What kind of file stands somewhere, and what commands make."""

from pathlib import Path

import pytest

from handclean.cli.main import COMMANDS
from handclean.commands.shared import glove_files
from handclean.errors import UsageError
from handclean.io.hdf5 import prior, session, subject
from handclean.io.hdf5.file import write_h5
from handclean.io.hdf5.parts import Part
from handclean.runner import kinds

FORMATS = {
    session.FORMAT,
    subject.FORMAT,
    prior.FORMAT,
    glove_files.SAMPLES,
    glove_files.CALIBRATION,
}


@pytest.fixture(autouse=True)
def somewhere_empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_what_commands_make_are_kinds_that_files_have():
    made = {kind for (_, suffix), kind in kinds.MADE_BY.items() if suffix == ".h5"}
    assert made == FORMATS
    assert {command for command, _ in kinds.MADE_BY} < set(COMMANDS)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_an_h5_is_of_the_kind_it_says(name):
    write_h5(Path("a.h5"), name, Part())
    assert kinds.kind_of(Path("a.h5")) == name
    assert kinds.kind_of(Path("none.h5")) == ""
    Path("b.h5").write_bytes(Path("a.h5").read_bytes()[:100])
    assert kinds.kind_of(Path("b.h5")) == ""


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("a.toml", "[[marker]]\nlabel = 'A'", "marker set"),
        ("a.toml", "[[bone]]\nname = 'a'\n[[marker]]\nlabel = 'A'", "joint tree"),
        ("a.toml", "[[rotation]]\nname = 'a'", "description of a glove"),
        ("a.toml", "index_tip = [1, 2, 3]", "list of landmarks"),
        ("a.toml", "[solve]\niterations = 3", "TOML file of another kind"),
        ("a.toml", "[solve", ""),
        ("a.toml", "", ""),
        ("a.csv", "input,output\na.c3d,", "manifest"),
        ("a.csv", "# handclean readings {}\n", "file of a glove's readings"),
        ("a.csv", "time,A_x,A_y,A_z\n", "table"),
        ("a.csv", "", "table"),
        ("a.C3D", "", "C3D"),
    ],
)
def test_other_files_are_told_by_what_is_in_them(name, text, kind):
    Path(name).write_text(text)
    assert kinds.kind_of(Path(name)) == kind


def test_a_file_is_replaced_only_by_one_of_its_kind():
    write_h5(Path("S01.h5"), subject.FORMAT, Part())
    called = Path("x/S01.h5")
    kinds.expect_same(Path("S01.h5"), subject.FORMAT, called)
    kinds.expect_same(Path("S01.h5"), "", called)
    said = r"^x/S01\.h5: is a subject, which a session never replaces"
    with pytest.raises(UsageError, match=said):
        kinds.expect_same(Path("S01.h5"), session.FORMAT, called)
