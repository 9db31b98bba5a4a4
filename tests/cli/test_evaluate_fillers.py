"""``fill-gaps --evaluate`` as its users run it."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from handclean.cli import main as frame
from handclean.gaps.settings import METHODS, POSTURE_METHODS
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.io import files
from handclean.recording import Recording, trajectories

PER_FILLER = {
    "gaps", "refused", "unsure", "mean_mm", "last_mm", "within_sigma", "within_q95",
    "ratio", "ratio_95", "ratio_of_means", "ratio_of_means_95", "worse_than_1_25",
}  # fmt: skip


def waving(frames, seed):
    """A recording of a hand with dfki13's markers, with two gaps."""
    rng = np.random.default_rng(seed)
    model = template_subject(load_marker_set("dfki13")).model
    poses = np.tile(neutral_pose(model.tree), (frames, 1))
    t = np.arange(frames) / 60.0
    swing = rng.normal(scale=0.15, size=(3, poses.shape[1] - 7))
    poses[:, 7:] += np.sin(np.outer(t, [1.0, 1.7, 2.9])) @ swing
    low, high = model.tree.limits.T
    poses[:, 7:] = np.clip(poses[:, 7:], low, high)
    places = marker_positions(model, poses)
    places += rng.normal(scale=1e-4, size=places.shape)
    places[100:120, 3] = np.nan
    places[200:204, 5] = np.nan
    return Recording(
        rate=60.0, frames=frames, markers=trajectories(places, model.labels)
    )


@pytest.fixture(scope="module")
def takes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("takes")
    for number, name in enumerate(("a", "b")):
        files.write(folder / f"{name}.h5", waving(240, number))
    still = trajectories(np.zeros((3, 2, 3)), ("A", "B"))
    files.write(folder / "short.h5", Recording(rate=60.0, frames=3, markers=still))
    return folder


@pytest.fixture
def run(takes, tmp_path, monkeypatch, capfd):
    """Run the command; return status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        status = frame.main(["fill-gaps", "--evaluate", *map(str, words)])
        return status, *capfd.readouterr()

    return call


def test_one_take_is_judged_and_nothing_is_filled(run, takes, tmp_path):
    before = (takes / "a.h5").read_bytes()
    status, out, err = run(takes / "a.h5", "--method", "linear", "-o", "judged/")
    assert (status, err) == (0, "")
    assert (takes / "a.h5").read_bytes() == before
    assert all(len(line) < 100 for line in out.splitlines()[1:])
    assert "is best" in out.splitlines()[0]
    folder = tmp_path / "judged"
    assert {path.name for path in folder.iterdir() if "json" not in path.name} == {
        "evaluation.csv",
        "table.txt",
        "errors.png",
    }
    text = (folder / "table.txt").read_text()
    assert all(len(line) < 100 for line in text.splitlines())
    assert set(out.splitlines()[1:]) <= set(text.splitlines())
    assert (folder / "errors.png").read_bytes().startswith(b"\x89PNG")
    lines = (folder / "evaluation.csv").read_text().splitlines()
    rows = list(csv.DictReader(lines))
    assert {row["filler"] for row in rows} == {"ridge", "linear"}
    gaps = {(row["number"], row["markers"], row["first_frame"]) for row in rows}
    assert 2 * len(gaps) == len(rows)
    again, out, _ = run(takes / "a.h5", "--method", "linear", "-o", "judged/")
    assert again == 0
    assert "skipped" in out


def test_json_says_all_of_it_one_object_for_each_input(run, takes):
    words = (
        takes / "a.h5",
        takes / "b.h5",
        "--method",
        "pattern",
        "--json",
        "-o",
        "out/",
    )
    status, out, _ = run(*words)
    assert status == 0
    found = [json.loads(line) for line in out.splitlines()]
    assert [one["input"] for one in found] == [str(takes / f"{n}.h5") for n in "ab"]
    for one, name in zip(found, "ab", strict=True):
        assert one["status"] == "done"
        assert one["output"][0] == f"out/{name}/evaluation.csv"
        assert set(one["fillers"]) == {"ridge", "pattern"}
        for scores in one["fillers"].values():
            assert set(scores) == {*PER_FILLER, "gap_ms"}
        assert one["fillers"]["ridge"]["ratio"] == 1.0
        low, high = one["fillers"]["pattern"]["ratio_95"]
        assert low <= one["fillers"]["pattern"]["ratio"] <= high
        assert (
            sum(cell["fillers"]["ridge"]["gaps"] for cell in one["cells"])
            == (one["gaps"])
        )
        assert {cell["won_by"] for cell in one["cells"]} <= {"ridge", "pattern"}
        assert set(one["cells"][0]["fillers"]["ridge"]) == PER_FILLER
        assert one["best"] in one["fillers"]


def test_the_same_input_gives_the_same_bytes(run, takes, tmp_path):
    for name in ("one", "two"):
        plot = f"{name}.svg"
        words = "--method", "cubic", "-o", f"{name}/", "--plot", plot
        assert run(takes / "a.h5", *words)[0] == 0
    for file in ("evaluation.csv", "errors.png"):
        assert (tmp_path / "one" / file).read_bytes() == (
            tmp_path / "two" / file
        ).read_bytes()
    assert (tmp_path / "one.svg").is_file()


def test_fingers_are_hidden_where_a_marker_set_tells_them(run, takes):
    status, out, _ = run(
        takes / "a.h5", "--method", "last", "--marker-set", "dfki13", "--json"
    )
    assert status == 0
    patterns = {cell["pattern"] for cell in json.loads(out)["cells"]}
    assert patterns == {"1", "2", "3", "4", "finger", "own"}
    out = run(takes / "a.h5", "--method", "last", "--json")[1]
    assert "finger" not in {cell["pattern"] for cell in json.loads(out)["cells"]}


@pytest.mark.slow
def test_without_a_method_all_are_judged(run, takes):
    status, out, _ = run(takes / "a.h5", "--json")
    assert status == 0
    assert set(json.loads(out)["fillers"]) == set(METHODS) - set(POSTURE_METHODS)


def test_requirements_hold_for_figures(run, takes):
    words = takes / "a.h5", "--method", "last", "--require"
    assert run(*words, "best_mm<=1000")[0] == 0
    assert run(*words, "best_mm<=0.000001")[0] == 3


@pytest.mark.parametrize(
    ("words", "status", "wrong"),
    [
        (("short.h5",), 1, "short.h5: has no room for a gap to judge by"),
        (("none.h5",), 1, "none.h5: no such file"),
        (("a.h5", "-o", "x.h5"), 2, "x.h5: should be a folder"),
        (("a.h5", "--plot", "x.doc"), 2, "x.doc"),
        (("a.h5", "b.h5", "--plot", "x.png"), 2, "x.png: is one file for 2 inputs"),
        (("a.h5", "--method", "ridg"), 2, "method should be one of auto, take"),
        (("a.h5", "--method", "coupled"), 1, "follows the posture of a hand"),
        (("a.h5", "--format", ".c3d"), 2, "--format"),
        (("a.h5", "--require", "wost<=1"), 2, "wost"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_is_wrong_is_said_in_one_line(run, takes, words, status, wrong):
    given = [takes / word if word.endswith(".h5") and word != "x.h5" else word
             for word in words]  # fmt: skip
    found, out, err = run(*given)
    assert (found, out) == (status, "")
    assert wrong in err
    assert err.count("\n") == 1


def test_a_plot_without_evaluating_is_wrong(takes, capfd):
    words = ["fill-gaps", str(takes / "a.h5"), "-o", "x.h5", "--plot", "x.png"]
    assert frame.main(words) == 2
    assert "--plot: is for --evaluate" in capfd.readouterr().err


def test_columns_without_a_name_are_not_judged_nor_shift_the_names(run, tmp_path):
    take = waving(240, 0)
    loose = np.ones((240, 1, 3))
    loose[::2] += 0.1
    places = np.concatenate([loose, take.markers.positions], axis=1)
    labels = ("*1", *take.markers.labels)
    files.write(
        tmp_path / "loose.h5",
        Recording(rate=60.0, frames=240, markers=trajectories(places, labels)),
    )
    words = ["--method", "linear", "-o", "judged/", "--marker-set", "dfki13"]
    assert run("loose.h5", *words)[0] == 0
    with (tmp_path / "judged/evaluation.csv").open() as file:
        rows = list(csv.DictReader(file))
    fingers = [row["markers"].split() for row in rows if row["pattern"] == "finger"]
    assert fingers
    for names in fingers:
        assert len({name.split("_")[0] for name in names}) == 1
    assert not any("*1" in row["markers"] for row in rows)


def test_a_take_without_a_name_is_one_line(run, tmp_path):
    loose = trajectories(np.ones((240, 1, 3)), ("*1",))
    files.write(tmp_path / "loose.h5", Recording(rate=60.0, frames=240, markers=loose))
    status, _, err = run("loose.h5")
    assert status == 1
    assert "no labelled markers" in err


def test_frames_are_those_of_the_file(run, tmp_path):
    take = waving(240, 0)
    rows = []
    for first in (1, 501):
        numbered = replace(take, first_frame=first)
        files.write(tmp_path / f"{first}.h5", numbered)
        assert run(f"{first}.h5", "--method", "linear", "-o", f"at{first}/")[0] == 0
        with (tmp_path / f"at{first}/evaluation.csv").open() as file:
            rows.append(list(csv.DictReader(file)))
    for one, other in zip(*rows, strict=True):
        frames = int(one["last_frame"]) - int(one["first_frame"]) + 1
        assert frames == round(60.0 * float(one["length_s"])) or one["pattern"] == "own"
        for name in ("first_frame", "last_frame"):
            assert int(other[name]) == int(one[name]) + 500
    assert min(int(row["first_frame"]) for row in rows[0]) >= 2
