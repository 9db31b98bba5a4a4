"""What a command cannot do without is found before the first input, once."""

from dataclasses import replace
from pathlib import Path

import pytest

from handclean.errors import UsageError
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig
from handclean.io.subject import write_subject
from handclean.labels.settings import LabelConfig
from handclean.pipeline import many
from handclean.pipeline.batch import Batch, Work
from handclean.pipeline.choices import Cleaning, Filling, Solving

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
    batch = Batch(inputs=(Path("a.c3d"), Path("b.c3d")), output="o", subjects=(bare,))
    with pytest.raises(UsageError) as caught:
        many.run(Work.of(command, batch, HAND[command]), batch)
    right = "calibrate-hand markers --subject S.h5 finds them"
    assert str(caught.value) == f"S.h5: has no markers; {right}"


@pytest.mark.parametrize("command", HAND)
def test_a_subject_without_markers_of_a_manifest_fails_its_take_only(
    command, bare, small_take, capfd
):
    Path("list.csv").write_text(f"input,subject\n{small_take},S.h5\n")
    batch = Batch(manifest="list.csv", output="o", json=True, unit="mm")
    assert many.run(Work.of(command, batch, HAND[command]), batch) == 2
    out, err = capfd.readouterr()
    assert out.count("\n") == 1
    assert "S.h5: has no markers; calibrate-hand markers --subject S.h5" in err


def test_a_row_without_a_subject_where_others_have_one_names_take_and_line(
    bare, small_take, capfd
):
    rows = f"input,subject,output\n{small_take},S.h5,1.h5\n{small_take},,2.h5\n"
    Path("list.csv").write_text(rows)
    batch = Batch(manifest="list.csv", output="o", json=True, unit="mm")
    assert many.run(Work.of("label", batch, HAND["label"]), batch) == 2
    _, second, *_ = capfd.readouterr().err.splitlines()
    assert second.startswith("a.csv: --subject: is missing; ")
    assert second.endswith(" (list.csv, line 3)")


@pytest.fixture
def small_take(bare):
    """A take, small and of no use."""
    Path("a.csv").write_text("frame,time,A_x,A_y,A_z\n0,0.0,1,2,3\n1,0.01,1,2,3\n")
    return "a.csv"


@pytest.mark.parametrize("command", HAND)
def test_a_missing_subject_is_wrong_usage_once_and_before_the_first_input(
    command, tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    batch = Batch(inputs=(Path("a.c3d"), Path("b.c3d")), output="o")
    with pytest.raises(UsageError, match=r"^--subject: is missing"):
        many.run(Work.of(command, batch, HAND[command]), batch)
    assert capfd.readouterr() == ("", "")


def test_a_missing_marker_set_is_found_before_a_calibration_reads_anything(tmp_path):
    batch = Batch(inputs=(tmp_path / "none.c3d",), output="S.h5")
    with pytest.raises(UsageError, match=r"^--marker-set: is missing"):
        many.reduce(Work.of("calibrate-hand markers", batch), batch)
