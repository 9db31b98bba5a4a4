"""Paths led onto ends, and times to them, by numbers worked out by hand."""

import numpy as np

from handclean.gaps.family import ends
from handclean.gaps.family.table import BASELINES


def level(start, stop, bodies):
    """A take of ten frames in which a marker is at 1 before a gap and at 4 after."""
    whole = np.ones((10, 1, 3))
    whole[stop:] = 4.0
    return bodies.without(whole, (0, start, stop)), bodies.gap(0, start, stop)


def test_the_errors_at_both_ends_are_carried_linearly(bodies):
    tracks, gap = level(4, 6, bodies)
    path = np.full((4, 3), 2.0)
    found = ends.onto_ends(tracks, gap, path)
    np.testing.assert_allclose(found, [[2.0] * 3, [3.0] * 3], atol=1e-15)


def test_the_error_at_one_end_is_carried_as_it_is(bodies):
    for start, stop, left in ((7, 10, 1.0), (0, 3, 4.0)):
        tracks, gap = level(start, stop, bodies)
        assert len(ends.frames_of(tracks, gap)) == 4
        found = ends.onto_ends(tracks, gap, np.full((4, 3), 2.0))
        np.testing.assert_allclose(found, np.full((3, 3), left), atol=1e-15)


def test_times_to_the_ends(bodies):
    tracks, gap = level(4, 7, bodies)
    times = 100.0 * ends.away(tracks, gap)
    np.testing.assert_allclose(times, [3 / 4, 4 / 4, 3 / 4])
    times = 100.0 * ends.away(*level(7, 10, bodies))
    np.testing.assert_allclose(times, [1.0, 2.0, 3.0])
    times = 100.0 * ends.away(*level(0, 3, bodies))
    np.testing.assert_allclose(times, [3.0, 2.0, 1.0])


def test_the_table_names_each_filler_once():
    assert [baseline.name for baseline in BASELINES.values()] == list(BASELINES)
    causal = {name for name, baseline in BASELINES.items() if baseline.causal}
    assert causal == {"last", "average", "affine"}
    assert len({baseline.prepare for baseline in BASELINES.values()}) == len(BASELINES)
    assert all(0 < len(baseline.about) < 60 for baseline in BASELINES.values())
