"""What a command cannot do without is found before the first input, once."""

from dataclasses import replace
from pathlib import Path

import pytest
from takes import take_batch

from handclean.commands.shared.choices import Cleaning, Filling, Solving
from handclean.commands.shared.take_options import TakeOptions, options_of
from handclean.commands.table import work_of
from handclean.errors import UsageError
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig
from handclean.io.hdf5.subject import write_subject
from handclean.labels.settings import LabelConfig
from handclean.runner import many

SOLVE = SolveConfig()
HAND = {
    "clean": Cleaning(label=LabelConfig(), fill=FillConfig(), solve=SOLVE),
    "label": LabelConfig(),
    "fill-gaps": Filling(fill=FillConfig(), solve=SOLVE),
    "solve": Solving(solve=SOLVE, standard=False),
}


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """A subject without markers, as of a scan, in the folder to work in."""
    monkeypatch.chdir(tmp_path)
    subject = template_subject(load_marker_set("han19"))
    path = Path("S.h5")
    none = slice(0, 0)
    model = subject.model
    write_subject(
        path,
        replace(
            subject,
            model=replace(model, labels=(), bone=model.bone[none], at=model.at[none]),
            marker_sigma=subject.marker_sigma[none],
        ),
    )
    return path


@pytest.mark.parametrize("command", HAND)
def test_a_subject_without_markers_is_found_before_the_first_input(command, bare):
    batch = take_batch(
        inputs=(Path("a.c3d"), Path("b.c3d")), output="o", subjects=(bare,)
    )
    with pytest.raises(UsageError) as caught:
        many.run(work_of(command, batch, HAND[command]), batch)
    right = "calibrate-hand markers --subject S.h5 finds them"
    assert str(caught.value) == f"S.h5: has no markers; {right}"


@pytest.mark.parametrize("command", HAND)
def test_a_subject_without_markers_of_a_manifest_fails_its_take_only(
    command, bare, small_take, capfd
):
    Path("list.csv").write_text(f"input,subject\n{small_take},S.h5\n")
    batch = take_batch(manifest="list.csv", output="o", json=True, unit="mm")
    assert many.run(work_of(command, batch, HAND[command]), batch) == 2
    out, err = capfd.readouterr()
    assert out.count("\n") == 1
    assert "S.h5: has no markers; calibrate-hand markers --subject S.h5" in err


def test_a_row_without_a_subject_where_others_have_one_names_take_and_line(
    bare, small_take, capfd
):
    rows = f"input,subject,output\n{small_take},S.h5,1.h5\n{small_take},,2.h5\n"
    Path("list.csv").write_text(rows)
    batch = take_batch(manifest="list.csv", output="o", json=True, unit="mm")
    assert many.run(work_of("label", batch, HAND["label"]), batch) == 2
    _, second, *_ = capfd.readouterr().err.splitlines()
    assert second.startswith("a.csv: --subject: is missing; ")
    assert second.endswith(" (list.csv, line 3)")


@pytest.fixture
def small_take(bare):
    """A take, small and of no use."""
    Path("a.csv").write_text("frame,time,A_x,A_y,A_z\n0,0.0,1,2,3\n1,0.01,1,2,3\n")
    return "a.csv"


@pytest.mark.parametrize("command", sorted(set(HAND) - {"fill-gaps"}))
def test_a_missing_subject_is_wrong_usage_once_and_before_the_first_input(
    command, tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    batch = take_batch(inputs=(Path("a.c3d"), Path("b.c3d")), output="o")
    with pytest.raises(UsageError, match=r"^--subject: is missing"):
        many.run(work_of(command, batch, HAND[command]), batch)
    assert capfd.readouterr() == ("", "")


def test_a_missing_marker_set_is_found_before_a_calibration_reads_anything(tmp_path):
    batch = take_batch(inputs=(tmp_path / "none.c3d",), output="S.h5")
    with pytest.raises(UsageError, match=r"^--marker-set: is missing"):
        many.reduce(work_of("calibrate-hand markers", batch), batch)


def a_subject(name, markers=slice(None), side=None):
    """Write a template subject with some markers of han19."""
    subject = template_subject(load_marker_set("han19"), side or "")
    model = subject.model
    model = replace(
        model,
        labels=model.labels[markers],
        bone=model.bone[markers],
        at=model.at[markers],
    )
    sigma = subject.marker_sigma[markers]
    write_subject(Path(name), replace(subject, model=model, marker_sigma=sigma))
    return Path(name)


def a_set(name, count):
    rows = [
        f'[[marker]]\nlabel = "M{n}"\nbone = "hand"\nat = [{5 * n}, 40, 25]\n'
        for n in range(count)
    ]
    Path(name).write_text("\n".join(['side = "right"', *rows]))
    return name


@pytest.mark.parametrize("command", HAND)
@pytest.mark.parametrize("count", [1, 3, 4])
@pytest.mark.parametrize("kind", ["subject", "marker set"])
def test_labelling_needs_four_markers(command, count, kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    worn = (
        {"subjects": (a_subject("S.h5", slice(0, count)),)}
        if kind == "subject"
        else {"marker_set": a_set("few.toml", count)}
    )
    batch = take_batch(inputs=(Path("none.c3d"),), output="o", **worn)
    work = work_of(command, batch, HAND[command])
    if count < 4 and command in ("clean", "label"):
        with pytest.raises(UsageError, match=f"has {count} markers?; labelling needs"):
            many.run(work, batch)
    else:
        assert many.run(work, batch) == 1  # there is no such file


def test_a_row_of_a_manifest_with_too_few_markers_fails_alone(
    tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("frame,time,A_x,A_y,A_z\n0,0.0,1,2,3\n1,0.01,1,2,3\n")
    a_set("few.toml", 2)
    Path("list.csv").write_text("input,marker_set\na.csv,few.toml\n")
    batch = take_batch(manifest="list.csv", output="o", unit="mm")
    assert many.run(work_of("clean", batch, HAND["clean"]), batch) == 2
    err = capfd.readouterr().err
    assert "few.toml: has 2 markers; labelling needs 4" in err
    assert "RuntimeWarning" not in err


@pytest.mark.parametrize("command", HAND)
def test_a_marker_set_that_the_subject_does_not_wear_is_wrong_usage(
    command, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    subject = a_subject("S.h5")
    batch = take_batch(inputs=(Path("no.c3d"),), output="o", subjects=(subject,))
    for name, is_worn in (("maycock26", False), ("han19", True)):
        told = replace(options_of(batch), marker_set=name)
        given = replace(batch, given=told)
        work = work_of(command, given, HAND[command])
        if is_worn:
            assert many.run(work, given) == 1  # there is no such file
        else:
            with pytest.raises(UsageError, match=r"S\.h5 has han19; a subject knows"):
                many.run(work, given)


def test_both_sides_need_a_subject_each(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    left, right = a_subject("L.h5", side="left"), a_subject("R.h5", side="right")
    batch = take_batch(inputs=(Path("no.c3d"),), output="o", side="both")
    one = replace(batch, given=TakeOptions(side="both", subjects=(right,)))
    with pytest.raises(UsageError, match=r"--side both: .* a right hand only"):
        many.run(work_of("solve", one, HAND["solve"]), one)
    two = replace(batch, given=TakeOptions(side="both", subjects=(right, left)))
    assert many.run(work_of("solve", two, HAND["solve"]), two) == 1  # no such file


@pytest.mark.parametrize("command", ["convert", *HAND])
@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"marker_set": "maycock27"}, "--marker-set: no marker set is called"),
        ({"marker_set": "none.toml"}, "--marker-set none.toml: no such file"),
        ({"subjects": (Path("none.h5"),)}, "--subject none.h5: no such file"),
        ({"subjects": (Path("in"),)}, "--subject in: is a folder"),
        ({"subjects": (Path("in/a.txt"),)}, "--subject in/a.txt: "),
        ({"files": {"prior": Path("none.h5")}}, "--prior none.h5: no such file"),
        ({"files": {"prior": Path("in/a.txt")}}, "--prior in/a.txt: "),
    ],
    ids=str,
)
def test_a_wrong_hand_is_wrong_usage_before_anything_is_done(
    command, given, said, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    for name in "ab":
        Path(f"in/{name}.txt").write_text("one")
    inputs = (Path("in/a.txt"), Path("in/b.txt"))
    batch = take_batch(inputs=inputs, output="out", **given)
    with pytest.raises(UsageError) as caught:
        many.run(work_of(command, batch, HAND.get(command)), batch)
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)
    assert not Path("out").exists()


def test_what_is_wrong_with_a_row_of_a_manifest_names_its_take_and_its_line(
    small_take, capfd
):
    rows = "input,subject,output\na.csv,,1.h5\na.csv,none.h5,2.h5\n"
    Path("l.csv").write_text(rows)
    batch = take_batch(manifest="l.csv", unit="mm")
    assert many.run(work_of("convert", batch), batch) == 1
    err = capfd.readouterr().err
    assert err.startswith("a.csv: none.h5: no such file (l.csv, line 3)\n")
