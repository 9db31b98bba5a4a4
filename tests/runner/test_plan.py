"""Which input becomes which output."""

import os
from pathlib import Path

import pytest
from boxes import Whose, tally
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import UsageError
from handclean.runner import plan
from handclean.runner.batch import Batch

COMMAND = tally((".h5", ".c3d", ".csv"))


@pytest.fixture(autouse=True)
def somewhere_empty(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def outputs(*names, **options):
    batch = Batch(inputs=tuple(map(Path, names)), **options)
    tasks = plan.mapping(batch, plan.lines_of(batch), COMMAND)
    return [str(task.outputs[0]) for task in tasks]


def refusal(*names, **options):
    with pytest.raises(UsageError) as caught:
        outputs(*names, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_one_input_may_have_a_file_for_its_output():
    assert outputs("a b/tä.c3d", output="out/ü.H5") == ["out/ü.H5"]
    assert outputs("t.c3d", output="out.csv", format=".c3d") == ["out.csv"]


@pytest.mark.parametrize("output", ["out", "out/", "out.d/", "2024.05.01/"])
def test_one_input_may_have_a_folder_for_its_output(output):
    assert outputs("a/t.c3d", output=output) == [f"{output.rstrip('/')}/t.h5"]


def test_a_folder_that_is_there_is_a_folder_whatever_its_name():
    Path("out.h5").mkdir()
    assert outputs("t.c3d", output="out.h5") == ["out.h5/t.h5"]


def test_inputs_keep_their_path_below_their_common_parent():
    names = ["x/S01/t1.c3d", "x/S02/t1.c3d", "x/S02/b/t1.c3d"]
    assert outputs(*names, output="out", format=".csv") == [
        "out/S01/t1.csv",
        "out/S02/t1.csv",
        "out/S02/b/t1.csv",
    ]
    assert outputs("S01/a.c3d", "S01/b.c3d", output="o") == ["o/a.h5", "o/b.h5"]


def test_only_the_last_suffix_is_replaced():
    assert outputs("a.labels.c3d", "b", output="o") == ["o/a.labels.h5", "o/b.h5"]


@given(
    names=st.lists(
        st.lists(st.sampled_from(["a", "b c", "ü", ".."]), min_size=1, max_size=4),
        min_size=2,
        max_size=6,
    )
)
def test_different_inputs_of_one_suffix_never_meet_and_stay_in_the_folder(names):
    paths = {
        os.path.abspath("/".join(["d", "d", "d", "d", *n])) + ".c3d" for n in names
    }
    if len(paths) < 2:
        return
    places = outputs(*sorted(paths), output="out")
    assert len(set(places)) == len(paths)
    assert all(os.path.normpath(place) == place for place in places)
    assert all(place.startswith("out/") for place in places)


def test_a_collision_names_both_inputs():
    said = refusal("a/t.c3d", "a/t.trc", output="out")
    assert said == "out/t.h5: would be written twice, from a/t.c3d and from a/t.trc"
    assert "written twice" in refusal("t.c3d", "./t.c3d", output="out")


def test_an_output_is_never_an_input():
    assert "read as well as written" in refusal("t.h5", output="t.h5")
    assert "read as well as written" in refusal("a.h5", "b.h5", output=".")
    assert "read as well as written" in refusal(
        "t.c3d", output="s.h5", given=Whose(who=(Path("./s.h5"),))
    )


def test_an_output_is_no_input_by_another_name_either():
    Path("t.c3d").write_bytes(b"1")
    Path("link.c3d").symlink_to("t.c3d")
    os.link("t.c3d", "hard.c3d")
    for name in ("link.c3d", "hard.c3d"):
        assert "read as well as written" in refusal("t.c3d", output=name)
        assert "read as well as written" in refusal(name, output="t.c3d")


def test_what_cannot_be_a_place_is_refused():
    assert refusal("t.c3d").startswith("-o: is missing")
    assert "did you mean .c3d?" in refusal("t.trc", output="out.c3")
    assert "out.h5: is one file for 2 inputs" in refusal("a", "b", output="out.h5")
    assert "did you mean .c3d?" in refusal("a", "b", output="out", format=".c3")
    assert refusal(output="out").startswith("inputs: there are none")


def test_a_manifest_line_may_name_its_output_and_what_else_is_said_of_it():
    Path("list.csv").write_text(
        "input,output,who,mood,style\n"
        "a/t.c3d,there/x.csv,l.h5;r.h5,good,plain\n"
        "b/t.c3d,,,,\n"
    )
    own = Whose(who=(Path("s.h5"),), mood="fair", style="mine.ini")
    batch = Batch(
        inputs=(Path("c/t.c3d"),), manifest="list.csv", output="out", given=own
    )
    tasks = plan.mapping(batch, plan.lines_of(batch), COMMAND)
    assert [str(task.outputs[0]) for task in tasks] == [
        "out/c/t.h5",
        "there/x.csv",
        "out/b/t.h5",
    ]
    first, second, third = (task.sources[0] for task in tasks)
    who = (Path("l.h5"), Path("r.h5"))
    assert second.given == Whose(who=who, mood="good", style="plain")
    assert (first.given, third.given) == (own, own)
    assert list(second.reads) == ["input", "who 1", "who 2"]
    assert third.reads["style"] == Path("mine.ini")


def test_a_line_that_says_what_cannot_be_is_named():
    Path("list.csv").write_text("input,mood\na.c3d,bad\n")
    batch = Batch(manifest="list.csv", output="out", given=Whose())
    with pytest.raises(UsageError, match=r"^list\.csv, line 2: mood should be good"):
        plan.mapping(batch, plan.lines_of(batch), COMMAND)


def test_reducing_wants_one_file():
    lines = plan.lines_of(Batch(inputs=(Path("a.h5"), Path("b.h5"))))
    task = plan.reducing(Batch(output="s.h5"), lines, tally((".h5",)))
    assert len(task.sources) == 2
    assert task.outputs == (Path("s.h5"),)
    for output in (None, "s", "s.c3d", "a.h5"):
        with pytest.raises(UsageError):
            plan.reducing(Batch(output=output), lines, tally((".h5",)))
    with pytest.raises(UsageError, match="lists no takes"):
        plan.reducing(Batch(output="s.h5"), (), (".h5",))


def in_folders(*names, beside=(), **options):
    batch = Batch(inputs=tuple(map(Path, names)), **options)
    lines = plan.lines_of(batch)
    tasks = plan.in_folders(batch, lines, tally(()), ("a.csv", "b.png"), beside)
    return [[str(path) for path in task.outputs] for task in tasks]


def test_files_of_fixed_names_have_a_folder_for_each_of_several_inputs():
    assert in_folders("x/t.c3d") == [[]]
    assert in_folders("x/t.c3d", output="out/") == [["out/a.csv", "out/b.png"]]
    assert in_folders("x/S1/t.c3d", "x/S2/t.c3d", output="o") == [
        ["o/S1/t/a.csv", "o/S1/t/b.png"],
        ["o/S2/t/a.csv", "o/S2/t/b.png"],
    ]
    assert in_folders("t.c3d", beside=[Path("p.svg")]) == [["p.svg"]]


@pytest.mark.parametrize(
    ("names", "options", "wrong"),
    [
        (("t.c3d",), {"output": "o.csv"}, "o.csv: should be a folder"),
        (("a.c3d", "b.c3d"), {"beside": [Path("p.svg")]}, "one file for 2 inputs"),
        (("t.c3d", "t.trc"), {"output": "o"}, "t.trc"),
        (("a.csv",), {"output": "."}, "is read as well as written"),
    ],
)
def test_files_of_fixed_names_need_a_place_of_their_own(names, options, wrong):
    with pytest.raises(UsageError, match=wrong):
        in_folders(*names, **options)
