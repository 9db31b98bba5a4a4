"""What was followed is this hand only if it shows most of its markers at some time."""

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.io.hdf5.prior import read_prior
from handclean.labels.checks.evidence import MANY_MARKERS_FRAMES, unproven
from handclean.labels.label import label
from handclean.recording import Points, Recording

MARKERS, PATIENCE = 20, 5


def doubted(count):
    count = np.asarray(count)
    return unproven(count, count > 0, MARKERS, PATIENCE)


def test_nearly_all_markers_in_one_frame_prove_a_stretch():
    assert not doubted([6] * 30 + [18] + [6] * 30).any()
    assert doubted([6] * 30 + [17] + [6] * 30).all()


def test_most_markers_on_end_prove_a_stretch():
    assert not doubted([6] * 30 + [12] * MANY_MARKERS_FRAMES + [6] * 30).any()
    assert doubted([6] * 30 + [12] * (MANY_MARKERS_FRAMES - 1) + [6] * 30).all()
    assert doubted([11] * 200).all()
    assert doubted([12] * (MANY_MARKERS_FRAMES - 1)).all()


def test_each_stretch_is_proven_by_itself_and_short_absences_end_none():
    proven, short, long = [18] * 10, [0] * PATIENCE, [0] * (PATIENCE + 1)
    assert not doubted(proven + short + [6] * 10).any()
    found = doubted(proven + long + [6] * 10)
    np.testing.assert_array_equal(found, np.arange(len(found)) >= 16)


def test_nothing_followed_is_nothing_doubted():
    assert not doubted([0] * 10).any()
    assert len(doubted([])) == 0


@pytest.mark.parametrize("still", [True, False])
def test_points_of_other_things_are_refused(still, rng):
    """Twenty points that stand, or walk at random, in a cube of 0.3 m."""
    subject = template_subject(load_marker_set("maycock26"))
    places = np.tile(rng.uniform(-0.15, 0.15, (1, 20, 3)), (30, 1, 1))
    if not still:
        places += np.cumsum(rng.normal(scale=2e-3, size=places.shape), axis=0)
    points = Points(
        frame=np.repeat(np.arange(30), 20).astype(np.int32),
        source=np.tile(np.arange(20), 30).astype(np.int32),
        positions=places.reshape(-1, 3),
    )
    take = Recording(rate=100.0, frames=30, unlabelled=points)
    with pytest.raises(HandcleanError, match="the hand of") as caught:
        label(take, subject, prior=read_prior())
    assert "\n" not in str(caught.value)
