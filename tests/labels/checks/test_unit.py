"""A wrong unit of length is told by how far points are apart, wherever they are."""

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.labels.checks.unit import markers_unit_hint


@pytest.fixture(scope="module")
def model():
    return template_subject(load_marker_set("maycock26")).model


@pytest.mark.parametrize("away", [0.0, 3.0, -40.0])
def test_a_hand_may_be_anywhere(model, away):
    places = marker_positions(model, np.tile(neutral_pose(model.tree), (8, 1)))
    assert markers_unit_hint(places + away, model) == ""


@pytest.mark.parametrize("away", [0.0, 3.0])
@pytest.mark.parametrize("size", [1e-3, 0.1, 10.0, 1e3])
def test_a_hand_in_another_unit_is_asked_about(model, size, away):
    places = marker_positions(model, np.tile(neutral_pose(model.tree), (8, 1)))
    assert "is the unit right? (--unit)" in markers_unit_hint(
        size * (places + away), model
    )


def test_too_few_markers_tell_nothing(model):
    places = 1e3 * marker_positions(model, np.tile(neutral_pose(model.tree), (8, 1)))
    places[:, 3:] = np.nan
    assert markers_unit_hint(places, model) == ""
