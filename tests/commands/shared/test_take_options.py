"""What is said of takes: by options of all, by a manifest of one."""

from pathlib import Path

import pytest
from takes import take_source

from handclean.commands.shared.take_options import (
    TakeOptions,
    options_of,
    with_options,
)
from handclean.commands.table import COMMANDS
from handclean.errors import UsageError
from handclean.runner import manifest, plan
from handclean.runner.batch import Batch, Source


def test_a_line_of_a_manifest_beats_the_options(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("list.csv").write_text(
        "input,output,subject,side,marker_set\n"
        "a/t.c3d,there/x.csv,l.h5;r.h5,both,han19\n"
        "b/t.c3d,,,,\n"
    )
    told = TakeOptions(subjects=(Path("s.h5"),), side="left", marker_set="mine.toml")
    batch = Batch(
        inputs=(Path("c/t.c3d"),), manifest="list.csv", output="out", given=told
    )
    tasks = plan.mapping(batch, plan.lines_of(batch), COMMANDS["convert"])
    first, second, third = (options_of(task.sources[0]) for task in tasks)
    assert second.subjects == (Path("l.h5"), Path("r.h5"))
    assert (second.side, second.marker_set) == ("both", "han19")
    assert second.marker_set_file is None
    assert first == third == told
    assert third.marker_set_file == Path("mine.toml")


def test_a_side_that_is_none_names_its_line():
    said = r"^list\.csv, line 2: side should be left, right or both, not 'links'$"
    with pytest.raises(UsageError, match=said):
        TakeOptions().with_cells({"side": "links"}, "list.csv, line 2")


def test_a_list_of_failed_inputs_has_the_columns_it_always_had_and_a_reason():
    header = "input,output,subject,marker_set,side,reason\n"
    assert manifest.to_csv((), TakeOptions().columns) == header


def test_files_and_record_are_all_that_is_said():
    told = TakeOptions(
        subjects=(Path("l.h5"), Path("r.h5")), marker_set="my.toml", rate_hz=120.0
    )
    assert told.files() == {
        "subject 1": Path("l.h5"),
        "subject 2": Path("r.h5"),
        "marker_set": Path("my.toml"),
    }
    assert list(told.record()) == [
        "side", "rate_hz", "unit", "lenient", "believe_coordinates", "marker_set",
    ]  # fmt: skip
    assert {k: v for k, v in told.record().items() if v} == {"rate_hz": 120.0}
    assert TakeOptions(marker_set="han19").record()["marker_set"] == "han19"


def test_of_a_source_nothing_may_be_said_and_something_else_than_before():
    bare = Source(path=Path("a.c3d"))
    assert options_of(bare) == TakeOptions()
    assert with_options(bare, unit="mm") == take_source(path=bare.path, unit="mm")
    told = take_source(path=bare.path, unit="mm", side="left")
    assert options_of(with_options(told, unit=None)) == TakeOptions(side="left")
