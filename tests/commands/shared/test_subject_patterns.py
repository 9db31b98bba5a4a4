"""``--subject-for``: the subject of each take by the take's place."""

from pathlib import Path

import pytest

from handclean.commands.shared.needs import Needs
from handclean.commands.shared.subject_patterns import filled, found
from handclean.commands.shared.take_options import TakeOptions
from handclean.errors import UsageError
from handclean.runner.batch import Batch


@pytest.fixture(autouse=True)
def places(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in (
        "d/S[1]/subject.h5",
        "d/S[1]/s_l.h5",
        "d/S[1]/s_r.h5",
        "subjects/S.h5",
    ):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text("")


@pytest.mark.parametrize(
    ("pattern", "place"),
    [
        ("{parent}/subject.h5", "d/S01/subject.h5"),
        ("{parent}/../{parent.name}.h5", "d/S01/../S01.h5"),
        ("{parent.parent}/all.h5", "d/all.h5"),
        ("subjects/{parent.parent.name}.h5", "subjects/d.h5"),
        ("{parent}/{stem}.subject.h5", "d/S01/t.labels.subject.h5"),
        ("{name}.h5", "t.labels.c3d.h5"),
        ("one.h5", "one.h5"),
    ],
)
def test_fields_are_of_the_take(pattern, place):
    assert filled(pattern, Path("d/S01/t.labels.c3d")) == Path(place)


def test_a_take_that_is_named_without_its_folder_has_one(tmp_path):
    assert filled("{parent}/s.h5", Path("t.c3d")) == Path("s.h5")
    assert filled("{parent.name}.h5", Path("t.c3d")) == Path(f"{tmp_path.name}.h5")
    assert filled("{parent.parent}/s.h5", Path("t.c3d")) == Path("../s.h5")
    assert filled("{parent.parent}/s.h5", Path("/t.c3d")) == Path("/s.h5")


def test_stars_are_of_the_pattern_not_of_the_folders():
    take = Path("d/S[1]/t.c3d")
    assert found("{parent}/subject.h5", take) == [Path("d/S[1]/subject.h5")]
    both = [Path("d/S[1]/s_l.h5"), Path("d/S[1]/s_r.h5")]
    assert found("{parent}/s_?.h5", take) == both
    assert found("{parent}/x*.h5", take) == []


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        (
            "{parnt}/s.h5",
            "--subject-for: no field is called 'parnt'; did you mean pare",
        ),
        ("{}/s.h5", "--subject-for: no field is called ''; known: "),
        ("{parent.__class__}", "no field is called 'parent.__class__'"),
        ("{parent/s.h5", "--subject-for '{parent/s.h5': should have a brace } for"),
        ("parent}/s.h5", "should have a brace } for every {"),
    ],
)
def test_a_pattern_that_is_none_is_refused(pattern, said):
    with pytest.raises(UsageError) as caught:
        found(pattern, Path("d/S01/t.c3d"))
    assert said in str(caught.value)


def test_a_take_has_the_subjects_that_the_patterns_find_for_it():
    told = TakeOptions(subject_for=("{parent}/s_l.h5", "{parent}/s_r.h5"))
    take = Path("d/S[1]/t.c3d")
    assert told.for_input(take).subjects == (
        Path("d/S[1]/s_l.h5"),
        Path("d/S[1]/s_r.h5"),
    )
    told.for_input(take).expect_found()
    missing = told.for_input(Path("d/S02/t.c3d"))
    assert missing.files() == {}
    said = r"^--subject-for '\{parent\}/s_l\.h5': there is no d/S02/s_l\.h5$"
    with pytest.raises(UsageError, match=said):
        missing.expect_found()


def test_what_a_manifest_says_comes_first():
    told = TakeOptions(subject_for=("{parent}/none.h5",))
    of_line = told.with_cells({"subject": "subjects/S.h5"}, "list.csv, line 2")
    assert of_line.for_input(Path("t.c3d")).subjects == (Path("subjects/S.h5"),)


def test_a_subject_for_all_and_a_pattern_for_each_contradict_each_other():
    told = TakeOptions(subjects=(Path("s.h5"),), subject_for=("{parent}/s.h5",))
    with pytest.raises(UsageError, match=r"^--subject-for: says for each take whose"):
        Needs()(Batch(given=told), [])
