"""The marker sets of the recordings that calibration was developed on."""

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.template import template


@pytest.mark.parametrize(
    ("name", "count", "side"),
    [
        ("han19", 19, "left"),
        ("xu19", 19, "right"),
        ("xu19_left", 19, "left"),
        ("dfki13", 13, "right"),
    ],
)
def test_sets_fit_the_template_and_say_where_places_come_from(name, count, side):
    markers = load_marker_set(name)
    assert (len(markers.labels), markers.side) == (count, side)
    assert markers.source.startswith("reconstructed")
    assert "calibrating" in markers.source
    model = markers.on(template(side, forearm=markers.forearm))
    assert model.labels == markers.labels
    assert np.abs(model.at).max() < 0.06


def test_both_hands_of_the_guitar_set_are_mirror_images():
    right, left = load_marker_set("xu19"), load_marker_set("xu19_left")
    assert [label.replace("R-", "L-") for label in right.labels] == list(left.labels)
    assert right.bones == left.bones
    np.testing.assert_array_equal(right.at, left.at)
    assert right.forearm


def test_every_segment_of_the_guitarists_fingers_carries_one_marker():
    bones = [b for b in load_marker_set("xu19").bones if b not in ("hand", "forearm")]
    assert len(bones) == len(set(bones)) == 15
