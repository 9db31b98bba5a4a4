"""Gaps filled without a hand, and what is never read back as evidence."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

import handclean as hc
from handclean.errors import HandcleanError
from handclean.recording import Origin, Recording, trajectories


@pytest.fixture
def body(rng):
    """(T, 6, 3) six markers that move together, as those of a knee may."""
    t = np.arange(600) / 100.0
    swing = np.stack([np.sin(1.1 * t), np.cos(0.7 * t), np.sin(0.5 * t + 1.0)], axis=1)
    rest = rng.uniform(-0.1, 0.1, (6, 3))
    loose = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])[:, None]
    return rest + swing[:, None] * (0.2 + 0.1 * loose * rest)


def take_of(places, *gaps, labels=tuple("ABCDEF")):
    positions = places.copy()
    for column, start, stop in gaps:
        positions[start:stop, column] = np.nan
    return Recording(
        rate=100.0, frames=len(places), markers=trajectories(positions, labels)
    )


def test_no_subject_is_needed(body, tmp_path):
    take = take_of(body, (2, 100, 160), (4, 300, 320))
    filled = hc.fill_gaps(take)
    new = filled.markers.origin == Origin.FILLED
    assert new.sum() == 80
    assert filled.motions == {}
    away = np.abs(filled.markers.positions - body)[new]
    assert away.max() < 2e-3
    assert np.isfinite(filled.markers.sigma[new]).all()
    (tmp_path / "a folder").mkdir()
    path = tmp_path / "a folder" / "t.h5"
    hc.write(filled, path)
    with h5py.File(path) as file:
        table = file["markers/sigma"].attrs["q95"]
    np.testing.assert_array_equal(table, filled.markers.q95)
    assert np.all(np.diff(table[:, 0]) > 0.0)
    assert np.all(table[:, 1] >= 1.0)
    np.testing.assert_array_equal(hc.read(path).markers.q95, table)


def test_a_posture_needs_a_hand(body):
    with pytest.raises(HandcleanError, match="follows the posture of a hand"):
        hc.fill_gaps(take_of(body, (2, 100, 160)), method="coupled")


def test_points_without_a_name_are_no_gaps(body):
    labels = ("A", "B", "C", "D", "E", "*5")
    filled = hc.fill_gaps(take_of(body, (5, 100, 160), labels=labels))
    assert not (filled.markers.origin == Origin.FILLED).any()
    assert filled.provenance[-1]["figures"]["gaps"] == 0


def test_filled_samples_are_never_read_back_as_evidence():
    trial = hc.simulate("free", duration_s=3.0, rate_hz=60.0, ghosts_per_s=0.0)[0]
    filled = hc.fill_gaps(trial.labelled, trial.subject)
    new = filled.markers.origin == Origin.FILLED
    assert new.any()
    moved = filled.markers.positions.copy()
    moved[new] += 0.05
    elsewhere = replace(filled, markers=replace(filled.markers, positions=moved))
    for step in (hc.solve, hc.fill_gaps):
        one, two = step(filled, trial.subject), step(elsewhere, trial.subject)
        angles = [take.motions["right"].angles for take in (one, two)]
        np.testing.assert_array_equal(angles[0], angles[1])


@pytest.mark.parametrize(
    "spoil",
    [
        lambda places: places[:20],
        lambda places: places[:, :1],
        lambda places: np.where(np.arange(600)[:, None, None] < 3, places, np.nan),
        lambda places: np.repeat(places[:, :1], 6, axis=1),
        lambda places: np.broadcast_to(places[:1], places.shape).copy(),
    ],
    ids=["short", "one marker", "hardly seen", "duplicates", "frozen"],
)
@pytest.mark.parametrize("method", ["auto", "take"])
def test_takes_that_tell_little_give_an_answer_or_a_reason(body, spoil, method):
    places = spoil(body)
    take = take_of(places, (0, 5, 15), labels=tuple("ABCDEF")[: places.shape[1]])
    filled = hc.fill_gaps(take, method=method)
    new = filled.markers.origin == Origin.FILLED
    assert np.isfinite(filled.markers.positions[new]).all()
    assert np.isfinite(filled.markers.sigma[new]).all()
    gaps = [event for event in filled.events if event.marker == "A"]
    assert gaps
    for event in gaps:
        assert ("filled by" in event.text) or ("left open, " in event.text)
