"""Markers that are frozen, swapped or moved for a while are named, and no others."""

from dataclasses import replace

import numpy as np
import pytest
from people import exercise, true_hand

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.bad_markers import misfits, suspects
from handclean.ik.take import solve
from handclean.recording import Recording, trajectories

NOISE = 3e-4
FRAMES = 120


@pytest.fixture
def hand(rng):
    """A subject known to its noise, and (T, M, 3) of its markers."""
    markers = load_marker_set("maycock26")
    model = true_hand(rng, markers, markers.side, 1.0)
    places = marker_positions(model, exercise(rng, model.tree, FRAMES, 50.0))
    subject = replace(
        template_subject(markers),
        model=model,
        marker_sigma=np.full(len(model.labels), np.sqrt(2.0) * NOISE),
        calibrated=True,
    )
    return subject, places + rng.normal(scale=NOISE, size=places.shape)


def solved(subject, places):
    markers = trajectories(places, subject.model.labels)
    return solve(Recording(rate=50.0, frames=FRAMES, markers=markers), subject)


def found(subject, places):
    residual = solved(subject, places).motions["right"].residual
    return suspects(subject, places, residual)


def test_nothing_is_said_of_a_take_that_fits(hand):
    assert found(*hand) is None


def test_a_marker_that_is_elsewhere_is_named_with_its_frames(hand):
    subject, places = hand
    at = subject.model.labels.index("R_INDEX_TIP")
    places[30:50, at] += [0.0, 0.05, 0.05]
    result = found(subject, places)
    assert result.labels == ("R_INDEX_TIP",)
    assert set(result.frames) <= set(range(30, 50))
    assert len(result.frames) > 15
    assert result.residual_m > 4.0 * result.usual_m
    take = replace(solved(subject, places), first_frame=995)
    (one,) = misfits(take, subject, "right", places)
    said = one.text
    first, last = 995 + result.frames[[0, -1]]
    assert f"in {len(result.frames)} frames from {first} to {last}, " in said
    assert "without R_INDEX_TIP" in said
    assert one.where.frames == (first, last)
    assert (one.where.model, one.where.marker) == ("right", "R_INDEX_TIP")
    assert "\n" not in said


def test_two_markers_that_change_names_are_named(hand):
    subject, places = hand
    pair = [subject.model.labels.index(f"R_{name}_TIP") for name in ("INDEX", "RING")]
    places[40:80, pair] = places[40:80, pair[::-1]]
    result = found(subject, places)
    assert set(result.labels) == {"R_INDEX_TIP", "R_RING_TIP"}


def test_few_odd_frames_and_takes_that_never_fit_blame_no_marker(hand):
    subject, places = hand
    short, at = places.copy(), subject.model.labels.index("R_INDEX_TIP")
    short[30:33, at] += 0.05
    assert found(subject, short) is None
    assert found(subject, 1.3 * places) is None
