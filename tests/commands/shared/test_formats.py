"""What the runner asks about files: their kind, and the record that an h5 carries."""

import json
from pathlib import Path

import h5py
import pytest
from takes import take_batch, take_source

from handclean.api import glove_files
from handclean.commands.shared.choices import Converting
from handclean.commands.shared.formats import FORMATS, RECORDINGS, RECORDS
from handclean.commands.table import COMMANDS, work_of
from handclean.errors import FileError
from handclean.io.hdf5 import prior, session, subject
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Part
from handclean.io.hdf5.provenance import provenance_item
from handclean.runner import many

KINDS = {
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
    made = {c.makes[".h5"] for c in COMMANDS.values() if ".h5" in c.makes}
    assert made == {kind.removeprefix("handclean ") for kind in KINDS}
    for command in COMMANDS.values():
        assert set(command.makes) <= set(command.suffixes)


@pytest.mark.parametrize("name", sorted(KINDS))
def test_an_h5_is_of_the_kind_it_says(name):
    write_h5(Path("a.h5"), name, Part())
    assert FORMATS.kind(Path("a.h5")) == name.removeprefix("handclean ")
    assert FORMATS.kind(Path("none.h5")) == ""
    Path("b.h5").write_bytes(Path("a.h5").read_bytes()[:100])
    assert FORMATS.kind(Path("b.h5")) == ""


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
    assert FORMATS.kind(Path(name)) == kind


@pytest.mark.parametrize("held", ["{}", 3, ["no json"], ["[1]"], ["3"], [3], None])
def test_a_record_inside_that_is_none_counts_as_none(held):
    with h5py.File("a.h5", "w") as file:
        if held is None:
            file.create_group("provenance")
        else:
            file["provenance"] = held
    assert RECORDS.of(Path("a.h5")) == ()
    Path("b.h5").write_bytes(Path("a.h5").read_bytes()[:100])
    assert RECORDS.of(Path("b.h5")) == ()


@pytest.fixture
def convert(capfd):
    """Convert a take; return the exit status and the JSON object of it."""
    Path("a.csv").write_text("frame,time,A_x,A_y,A_z\n0,0.0,1,2,3\n1,0.01,1,2,3\n")

    def go(output, settings=None, **options):
        batch = take_batch(
            inputs=(Path("a.csv"),), output=output, json=True, unit="mm", **options
        )
        status = many.run(work_of("convert", batch, settings), batch)
        return status, json.loads(capfd.readouterr().out)

    return go


def change_a_value(path):
    with h5py.File(path, "r+") as file:
        file["markers/positions"][...] += 1.0


def append(path):
    with path.open("ab") as file:
        file.write(b"more")


@pytest.mark.parametrize("edit", [change_a_value, append])
def test_an_h5_that_was_edited_is_no_longer_handcleans(convert, edit):
    output = Path("out.h5")
    assert convert("out.h5")[0] == 0
    assert convert("out.h5")[1]["status"] == "skipped"
    edit(output)
    before = output.read_bytes()
    for settings in (None, Converting(unnamed=True)):
        status, done = convert("out.h5", settings)
        assert status == 1
        assert "--overwrite replaces it" in done["error"]
    assert output.read_bytes() == before
    assert convert("out.h5", overwrite=True)[0] == 0
    assert Path("out.h5~").read_bytes() == before
    assert convert("out.h5")[1]["status"] == "skipped"


def test_an_h5_without_a_seal_is_made_anew(convert):
    convert("out.h5")
    with h5py.File("out.h5", "r+") as file:
        del file["sha256"]
    assert convert("out.h5")[1]["status"] == "done"
    assert convert("out.h5")[1]["status"] == "skipped"


@pytest.mark.parametrize("overwrite", [False, True])
def test_an_h5_that_handclean_did_not_make_is_kept(convert, overwrite):
    with h5py.File("out.h5", "w") as file:
        file["mine"] = 1
    before = Path("out.h5").read_bytes()
    status, done = convert("out.h5", overwrite=overwrite)
    if not overwrite:
        assert status == 1
        assert "--overwrite replaces it" in done["error"]
        assert Path("out.h5").read_bytes() == before
        return
    assert status == 0
    assert done["warnings"] == ["the out.h5 that stood there is kept as out.h5~"]
    assert Path("out.h5~").read_bytes() == before
    assert convert("out.h5")[1]["status"] == "skipped"


@pytest.mark.parametrize("overwrite", [False, True])
def test_no_subject_is_replaced_by_a_session(convert, overwrite):
    entry = {"command": "calibrate-hand markers", "inputs": []}
    write_h5(Path("S01.h5"), subject.FORMAT, Part(items=provenance_item([entry])))
    before = Path("S01.h5").read_bytes()
    status, done = convert("S01.h5", overwrite=overwrite)
    assert status == 2
    assert done["error"] == (
        "S01.h5: is a subject, which a session never replaces; "
        "-o should name another place"
    )
    assert Path("S01.h5").read_bytes() == before
    assert sorted(map(str, Path().iterdir())) == ["S01.h5", "a.csv"]


def test_a_broken_seal_is_an_error_unless_somebody_is_lenient():
    write_h5(Path("S01.h5"), subject.FORMAT, Part())
    for lenient in (False, True):
        source = take_source(path=Path("a.csv"), lenient=lenient)
        with FORMATS.reading([source]) as broken:
            append(Path("S01.h5"))
            if not lenient:
                with pytest.raises(FileError, match="is damaged or was edited"):
                    read_h5(Path("S01.h5"), subject.FORMAT)
            else:
                read_h5(Path("S01.h5"), subject.FORMAT)
        assert len(broken) == lenient


def test_the_usual_inputs_are_takes_and_most_are_c3d():
    assert FORMATS.usual[0] == ".c3d"
    assert set(FORMATS.usual) == set(RECORDINGS)
    assert RECORDINGS[0] == ".h5"
