"""Solving keeps what filling found, if it would find the same, and says if not."""

from dataclasses import replace

import numpy as np
import pytest
from takes import take_source
from told import texts

from handclean.commands.shared.choices import Filling, Solving
from handclean.commands.table import COMMANDS
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig
from handclean.io import files
from handclean.io.hdf5.prior import read_prior, write_prior
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Origin, Recording, trajectories
from handclean.runner import plan
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute

RATE, FRAMES = 100.0, 120
GAP = slice(50, 70)
SOLVING = Solving(solve=SolveConfig(), standard=False)


def made(command, settings, source, output):
    task = Task(sources=(source,), outputs=(output,), token=plan.token())
    report = execute(Work(command=COMMANDS[command], settings=settings), task)
    assert report.status == "done", report.error + report.trace
    return report


def waving(model):
    """(T, M, 3) [m] markers of a hand that opens and closes."""
    low, high = model.tree.limits.T
    swing = 0.5 + 0.35 * np.sin(2.0 * np.pi * np.arange(FRAMES)[:, None] / RATE)
    poses = np.zeros((FRAMES, 7 + len(low)))
    poses[:, 3], poses[:, 7:] = 1.0, low + swing * (high - low)
    noise = np.random.default_rng(3).normal(scale=2e-4, size=(FRAMES, 17, 3))
    return marker_positions(model, poses) + noise


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A subject, and a take of which a finger is hidden for a while, filled."""
    folder = tmp_path_factory.mktemp("bridged")
    subject = template_subject(load_marker_set("schroeder17"))
    write_subject(folder / "S.h5", replace(subject, calibrated=True))
    places = waving(subject.model)
    labels = subject.model.labels
    places[GAP, ["INDEX" in label for label in labels]] = np.nan
    take = Recording(rate=RATE, frames=FRAMES, markers=trajectories(places, labels))
    files.write(folder / "take.h5", take)
    source = take_source(path=folder / "take.h5", subjects=(folder / "S.h5",))
    filling = Filling(fill=FillConfig(), solve=SolveConfig())
    report = made("fill-gaps", filling, source, folder / "filled.h5")
    assert report.figures["filled"] > 0
    return folder


@pytest.fixture
def solve(folder, tmp_path):
    """Solve a take; return its motion, how many were kept, and what is said of that."""

    def go(path, settings=SOLVING, **given):
        given = {"subjects": (folder / "S.h5",), **given}
        output = tmp_path / f"{plan.token()}.h5"
        report = made("solve", settings, take_source(path=path, **given), output)
        told = [w for w in texts(report.remarks) if "solved anew" in w]
        (motion,) = files.read(output).motions.values()
        return motion, report.figures["kept"], told, output

    return go


def same(one, other):
    return all(
        np.array_equal(getattr(one, part), getattr(other, part), equal_nan=True)
        for part in ("translation", "rotation", "angles", "angles_sigma", "residual")
    ) and np.array_equal(one.trusted, other.trusted)


def test_what_filling_bridged_is_kept_and_kept_again(folder, solve):
    filled = files.read(folder / "filled.h5").motions["right"]
    plain, kept, told, _ = solve(folder / "take.h5")
    assert (kept, told) == (0, [])
    assert not same(plain, filled)
    path = folder / "filled.h5"
    for _ in range(2):
        motion, kept, told, path = solve(path)
        assert (kept, told) == (1, [])
        assert same(motion, filled)


def test_a_converted_session_is_still_what_was_filled(folder, solve, tmp_path):
    source = take_source(path=folder / "filled.h5")
    made("convert", None, source, tmp_path / "copy.h5")
    motion, kept, told, _ = solve(tmp_path / "copy.h5")
    assert (kept, told) == (1, [])
    assert same(motion, files.read(folder / "filled.h5").motions["right"])


@pytest.fixture
def other_subject(folder, tmp_path):
    """The same hand, except that one bone is a millimetre longer."""
    subject = template_subject(load_marker_set("schroeder17"))
    tree = subject.model.tree
    offsets = tree.offsets.copy()
    offsets[-1] *= 1.0 + 1e-3 / np.linalg.norm(offsets[-1])
    model = replace(subject.model, tree=replace(tree, offsets=offsets))
    path = tmp_path / "other.h5"
    write_subject(path, replace(subject, model=model, calibrated=True))
    return path


@pytest.fixture
def other_prior(tmp_path):
    path = tmp_path / "prior.h5"
    prior = read_prior()
    write_prior(path, replace(prior, mean=prior.mean + 1e-3))
    return path


def test_another_subject_prior_or_setting_starts_anew_and_it_is_said(
    folder, solve, other_subject, other_prior
):
    measured = folder / "take.h5"
    tighter = replace(SOLVING, solve=SolveConfig(prior_m=1e-3))
    for settings, given, why in (
        (SOLVING, {"subjects": (other_subject,)}, "another subject"),
        (SOLVING, {"files": {"prior": other_prior}}, "another prior"),
        (replace(SOLVING, standard=True), {}, "a prior"),
        (tighter, {}, "prior_m = 0.0005"),
    ):
        motion, kept, told, path = solve(folder / "filled.h5", settings, **given)
        assert kept == 0
        assert told == [
            f"right: its gaps were filled with {why}; it is solved anew, frame by "
            "frame, and nothing bridges them"
        ]
        assert same(motion, solve(measured, settings, **given)[0])
        assert solve(path, SOLVING)[1] == 0  # the bridges are no more


def test_the_template_is_known_by_its_marker_set(folder, solve, tmp_path):
    worn = {"subjects": (), "marker_set": "schroeder17"}
    source = take_source(path=folder / "take.h5", **worn)
    filling = Filling(fill=FillConfig(), solve=SolveConfig())
    made("fill-gaps", filling, source, tmp_path / "filled.h5")
    assert solve(tmp_path / "filled.h5", **worn)[1:3] == (1, [])
    _, kept, told, _ = solve(tmp_path / "filled.h5")
    assert (kept, len(told)) == (0, 1)


def changed(folder, path, change):
    take = files.read(folder / "filled.h5")
    files.write(path, change(take))
    return path


def moved(take, which):
    """The take with some of its samples moved by a tenth of a millimetre."""
    positions = take.markers.positions.copy()
    positions[which(take.markers)] += 1e-4
    return replace(take, markers=replace(take.markers, positions=positions))


def test_markers_that_were_changed_are_solved_anew(folder, solve, tmp_path):
    def one(markers):
        which = np.zeros(markers.origin.shape, dtype=bool)
        which[100, 3] = True
        return which

    path = changed(folder, tmp_path / "a.h5", lambda take: moved(take, one))
    _, kept, told, _ = solve(path)
    assert kept == 0
    assert "its markers were changed" in told[0]


def test_what_filled_a_take_has_to_be_on_record(folder, solve, tmp_path):
    path = changed(folder, tmp_path / "a.h5", lambda t: replace(t, provenance=()))
    _, kept, told, _ = solve(path)
    assert kept == 0
    assert "is not on record" in told[0]
    path = changed(folder, tmp_path / "b.h5", lambda t: replace(t, motions={}))
    _, kept, told, _ = solve(path)
    assert kept == 0
    assert "holds no posture" in told[0]


@pytest.mark.parametrize(
    "entry",
    [
        {"command": "fill-gaps"},
        {"command": ["fill-gaps"], "inputs": 3},
        {"command": "fill-gaps", "inputs": [4, {}, {"role": 7}], "settings": 5},
        {"command": "solve", "figures": "kept", "inputs": {}},
    ],
)
def test_a_record_of_other_hands_keeps_nothing(folder, solve, tmp_path, entry):
    path = changed(folder, tmp_path / "a.h5", lambda t: replace(t, provenance=(entry,)))
    _, kept, told, _ = solve(path)
    assert (kept, len(told)) == (0, 1)


def test_filled_samples_never_tell_where_a_hand_was(folder, solve, tmp_path):
    """Wherever they are, motions stay the same, kept or solved anew."""

    def filled(markers):
        return markers.origin == Origin.FILLED

    path = changed(folder, tmp_path / "a.h5", lambda take: moved(take, filled))
    kept, count, _, _ = solve(path)
    assert count == 1
    assert same(kept, files.read(folder / "filled.h5").motions["right"])
    standard = replace(SOLVING, standard=True)
    anew = solve(path, standard)[0]
    assert same(anew, solve(folder / "take.h5", standard)[0])
