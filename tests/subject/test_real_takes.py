"""Hands learnt from recordings of real people, by the errors on what was kept aside."""

from dataclasses import replace

import numpy as np
import pytest
from told import texts

from handclean.errors import UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.io.files import read
from handclean.recording import trajectories
from handclean.subject.calibrate import calibrate, measure
from handclean.subject.settings import CalibrateConfig

pytestmark = pytest.mark.data

FEW = CalibrateConfig(frames=150)


def part(take, rows):
    markers = trajectories(take.markers.positions[rows], take.markers.labels)
    return replace(take, frames=len(markers.positions), markers=markers)


@pytest.fixture(scope="module")
def guitar(shared_data):
    return read(shared_data / "guitar" / "Pick1.csv", rate_hz=120.0, unit="mm")


@pytest.fixture(scope="module")
def glove(shared_data):
    return read(shared_data / "hand_embodiment" / "recording.tsv", unit="mm")


def test_a_guitarists_hand_is_learnt_to_half_a_millimetre(guitar):
    subject, report = calibrate([guitar], load_marker_set("xu19"), FEW)
    assert report.side == "right"
    assert 0.85 < report.size < 1.1
    assert report.heldout_kept_rms_m < 0.0005
    assert report.heldout_rms_m < 0.0007  # with the take's own wrong labels
    assert report.doubtful < 0.004
    assert subject.model.tree.bones[-1] == "forearm"
    assert "ring_dip_flexion" in report.poorly_moved  # R-D1 is seen in four frames
    assert any(words.startswith("R-C1 does not fit") for words in texts(report.remarks))


def test_a_guitarists_first_half_foretells_the_second_to_a_millimetre(guitar):
    middle = guitar.frames // 2
    first, second = part(guitar, slice(middle)), part(guitar, slice(middle, None))
    settings = replace(FEW, holdout=0.0)
    subject, _ = calibrate([first], load_marker_set("xu19"), settings)
    assert measure(subject, [second]).rms_m < 0.0010


def test_a_gloved_hand_is_learnt_to_half_a_millimetre(glove):
    take = part(glove, slice(0, None, 3))
    _, report = calibrate(
        [replace(take, rate=100.0 / 3.0)], load_marker_set("dfki13"), FEW
    )
    assert report.side == "right"
    assert 0.9 < report.size < 1.1
    assert report.heldout_rms_m < 0.0005
    assert report.camera_noise_m < 0.0003


@pytest.mark.parametrize("user", ["User1", "User2"])
def test_under_heavy_noise_little_more_than_the_noise_is_left(shared_data, user):
    paths = sorted((shared_data / "sig18" / user).rglob("*.trc"))[::12]
    takes = [read(path) for path in paths]
    subject, report = calibrate(takes, load_marker_set("han19"), FEW)
    markers, dofs = len(subject.model.labels), subject.model.tree.dofs
    free = np.sqrt(1.0 - dofs / (3 * markers))
    noise = np.sqrt(3.0) * report.camera_noise_m
    assert report.heldout_rms_m / free < 1.15 * noise
    assert report.side == "left"
    assert 0.9 < report.size < 1.1


def test_a_right_glove_is_refused_as_a_left_one(glove):
    few = part(glove, slice(0, None, 20))
    with pytest.raises(UsageError, match="shows a right hand, not a left one"):
        calibrate([few], load_marker_set("dfki13"), FEW, side="left")
