"""Lengths in a wrong unit are told by how large the hand would be."""

from dataclasses import replace

import numpy as np
import pytest
from takes import take_source
from told import texts

from handclean.api.verdicts import doubts
from handclean.commands.fill_gaps import fill_gaps
from handclean.commands.shared.choices import Filling, Solving
from handclean.commands.solve import solve as solve_step
from handclean.errors import TAKE, HandcleanError
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig
from handclean.ik.take import solve
from handclean.io import files
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Recording, trajectories


@pytest.mark.parametrize("factor", [1.0, 1e3, 1e-3])
def test_solving_in_a_wrong_unit_asks_for_the_unit(factor):
    subject = template_subject(load_marker_set("maycock26"), "right")
    subject = replace(subject, marker_sigma=np.full(26, 5e-4), calibrated=True)
    poses = np.tile(neutral_pose(subject.model.tree), (12, 1))
    places = factor * marker_positions(subject.model, poses)
    take = Recording(
        rate=100.0, frames=12, markers=trajectories(places, subject.model.labels)
    )
    solved = solve(take, subject, name="right")
    found = doubts(solved, {"right": subject})
    if factor == 1.0:
        assert found == ()
    else:
        assert f"{factor:.3g} times as far apart as this subject's" in found[0].text
        assert "is the unit right? (--unit)" in found[1].text


def filling(source):
    return fill_gaps(source, Filling(fill=FillConfig(), solve=SolveConfig()))


def solving(source):
    return solve_step(source, Solving(solve=SolveConfig(), standard=False))


@pytest.fixture
def hand(tmp_path, rng):
    """A subject's file, and what writes its take in some unit, among other markers."""
    subject = template_subject(load_marker_set("maycock26"), "right")
    subject = replace(subject, marker_sigma=np.full(26, 5e-4), calibrated=True)
    write_subject(tmp_path / "s.h5", subject)
    poses = np.tile(neutral_pose(subject.model.tree), (40, 1))
    poses[:, :3] = [0.3, 0.2, 1.0]
    places = marker_positions(subject.model, poses)
    places += rng.normal(scale=2e-4, size=places.shape)
    body = rng.uniform(-1.0, 1.0, size=(5, 3)) + np.zeros((40, 5, 3))
    labels = (*subject.model.labels, *(f"BODY{n}" for n in range(5)))

    def write(factor, some=slice(None)):
        path = tmp_path / "take.c3d"
        markers = trajectories(factor * np.hstack([places, body]), labels)
        markers.positions[20:24, some][:, 3] = np.nan
        files.write(path, Recording(rate=100.0, frames=40, markers=markers))
        return {"path": path, "subjects": (tmp_path / "s.h5",), "target": ".h5"}

    return write


@pytest.mark.parametrize("step", [solving, filling])
@pytest.mark.parametrize(
    ("factor", "right", "says"),
    [(1e3, "mm", "m"), (1e-3, "m", "mm"), (0.1, "cm", "mm")],
)
def test_no_step_goes_on_where_no_frame_fits_for_the_unit(
    hand, step, factor, right, says
):
    given = hand(factor)
    with pytest.raises(HandcleanError, match=r"no frame fits .*\(--unit\)"):
        step(take_source(**given))
    if says == "mm":  # as a C3D of ours does
        done = step(take_source(**given, unit=right))
        taken = f"--unit {right} is taken, though the file says mm"
        assert [w for w in texts(done.remarks) if "--unit" in w] == [taken]
    with pytest.raises(HandcleanError, match="no frame fits"):
        step(take_source(**given, unit={"mm": "m", "m": "cm", "cm": "m"}[right]))


@pytest.mark.parametrize("step", [solving, filling])
def test_a_subject_far_larger_than_the_take_fits_no_frame(hand, tmp_path, step):
    given = hand(1.0)
    subject = template_subject(load_marker_set("maycock26"), "right")
    at = subject.model.at.copy()
    at[3] += 1e6  # [m]
    subject = replace(subject, model=replace(subject.model, at=at))
    write_subject(tmp_path / "s.h5", subject)
    with pytest.raises(HandcleanError, match="no frame fits") as caught:
        step(take_source(**given))
    assert caught.value.where == TAKE


@pytest.mark.parametrize("step", [solving, filling])
@pytest.mark.parametrize("most", [0, 1, 2, 3])
def test_a_hand_is_nowhere_unless_a_frame_shows_three_of_its_markers(
    hand, tmp_path, step, most
):
    given = hand(1.0)
    take = files.read(given["path"])
    places = take.markers.positions.copy()
    places[:, :26][:, most:] = np.nan  # those of the body stay
    take = replace(take, markers=trajectories(places, take.markers.labels))
    files.write(tmp_path / "few.h5", replace(take, parameters={}))
    given["path"] = tmp_path / "few.h5"
    if most == 3:
        assert "nan" not in step(take_source(**given)).line
        return
    with pytest.raises(HandcleanError) as caught:
        step(take_source(**given))
    assert caught.value.where == TAKE
    assert str(caught.value.at("few.h5")) == (
        "few.h5: "
        + (
            "none of the markers of 'template' is in sight in any frame",
            "no frame shows more than 1 marker of 'template'",
            "no frame shows more than 2 markers of 'template'",
        )[most]
        + "; 3 or more say where a hand is"
    )


@pytest.mark.parametrize("step", [solving, filling])
def test_of_two_hands_the_one_that_is_never_seen_is_told(hand, tmp_path, step):
    given = hand(1.0)
    take = files.read(given["path"])
    other = template_subject(load_marker_set("maycock26"), "left")
    labels = tuple(f"O_{label}" for label in other.model.labels)
    other = replace(other, name="other", marker_sigma=np.full(26, 5e-4))
    other = replace(other, model=replace(other.model, labels=labels))
    write_subject(tmp_path / "o.h5", other)
    places = np.hstack([take.markers.positions, np.full((40, 26, 3), np.nan)])
    markers = trajectories(places, (*take.markers.labels, *labels))
    files.write(tmp_path / "two.h5", replace(take, markers=markers, parameters={}))
    given["path"] = tmp_path / "two.h5"
    given["subjects"] = (tmp_path / "s.h5", tmp_path / "o.h5")
    told = (
        "left: none of the markers of 'other' is in sight in any frame: it has no pose"
    )
    assert [w for w in texts(step(take_source(**given)).remarks) if "sight" in w] == [
        told
    ]


@pytest.mark.parametrize("step", [solving, filling])
def test_a_hand_of_its_size_among_other_markers_is_taken_as_it_is(hand, step):
    assert not [w for w in texts(step(take_source(**hand(1.0))).remarks) if "unit" in w]
