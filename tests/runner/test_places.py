"""Nothing that is read is written, whichever way its path is spelt."""

import os
from pathlib import Path

import pytest
from boxes import RECORDS, Whose

from handclean.errors import UsageError
from handclean.runner import places
from handclean.runner.batch import Source, Task


@pytest.fixture(autouse=True)
def somewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("raw").mkdir()
    Path("raw/take.c3d").write_text("raw")


def task(*outputs, **parts):
    source = Source(path=Path("raw/take.c3d"), **parts)
    return Task(sources=(source,), outputs=tuple(map(Path, outputs)))


def symlink():
    os.symlink("raw/take.c3d", "way")


def hard_link():
    os.link("raw/take.c3d", "way")


def link_to_its_folder():
    os.symlink("raw", "folder")
    return "folder/take.c3d"


WAYS = [
    symlink,
    hard_link,
    link_to_its_folder,
    lambda: "raw/../raw//./take.c3d",
    lambda: "nowhere/../raw/take.c3d",
    lambda: os.path.abspath("raw/take.c3d"),
]


@pytest.mark.parametrize("way", WAYS)
def test_no_way_to_an_input_is_a_place_to_write_to(way):
    path = way() or "way"
    with pytest.raises(UsageError, match="is read as well as written"):
        places.expect_apart([task(path)], RECORDS)
    with pytest.raises(UsageError, match="also an input"):
        places.expect_unused(Path(path), [task("out.box")], RECORDS)


@pytest.mark.parametrize(
    "given",
    [
        {"given": Whose(who=(Path("other"),))},
        {"given": Whose(style="other.toml")},
        {"files": {"prior": Path("other")}},
    ],
    ids=str,
)
def test_no_file_that_is_read_is_a_place_to_write_to(given):
    name = "other.toml" if "other.toml" in str(given) else "other"
    Path(name).write_text("is read")
    for read in (name, f"{name}.made.json", "raw/take.c3d.made.json"):
        with pytest.raises(UsageError, match="is read as well as written"):
            places.expect_apart([task(read, **given)], RECORDS)
    with pytest.raises(UsageError, match="is read as well as written"):
        places.expect_apart([task("list.csv")], RECORDS, [Path("list.csv")])
    places.expect_apart([task("out.box", **given)], RECORDS)


def test_an_output_and_the_record_of_another_are_no_one_file():
    with pytest.raises(UsageError, match=r"a\.csv\.made\.json: would be written twice"):
        places.expect_apart([task("a.csv", "a.csv.made.json")], RECORDS)
    with pytest.raises(UsageError, match="written twice"):
        places.expect_apart([task("new/a.box"), task("new/../new/a.box")], RECORDS)


def test_names_that_differ_in_case_are_one_where_case_does_not_count(monkeypatch):
    tasks = [task("new/A.box"), task("new/a.box")]
    places.expect_apart(tasks, RECORDS)
    monkeypatch.setattr(places, "ignores_case", lambda folder: True)
    with pytest.raises(UsageError, match="written twice"):
        places.expect_apart(tasks, RECORDS)
    with pytest.raises(UsageError, match="written twice"):
        places.expect_apart([task("u\u0308.box"), task("\u00dc.box")], RECORDS)


def test_whether_case_counts_is_seen_by_names_that_are_there(monkeypatch, tmp_path):
    assert not places.ignores_case(tmp_path)
    assert not places.ignores_case(tmp_path / "raw")
    Path("RAW").mkdir()
    assert not places.ignores_case(tmp_path)
    Path("RAW").rmdir()
    exists, stat = os.path.samefile, os.stat

    def same(one, other):  # as on a disk that ignores case
        return exists(one, one) and str(one).casefold() == str(other).casefold()

    monkeypatch.setattr(os.path, "samefile", same)
    assert places.ignores_case(tmp_path)
    assert places.ignores_case(tmp_path / "raw")
    assert stat(tmp_path)
