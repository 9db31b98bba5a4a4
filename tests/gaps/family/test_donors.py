"""Which markers are donors, against what a plain count of frames says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handclean.gaps.family import donors
from handclean.gaps.family.donors import Donors
from handclean.gaps.tracks import Refused


@given(seed=st.integers(0, 500), often=st.floats(0.0, 1.0))
@settings(max_examples=60)
def test_frames_show_all_donors_and_no_donor_could_be_added(bodies, seed, often):
    rng = np.random.default_rng(seed)
    seen = rng.random((300, 12)) < np.append(1.0, rng.uniform(often, 1.0, 11))
    positions = np.where(seen[:, :, None], rng.normal(size=(300, 12, 3)), np.nan)
    through = rng.random(12) < 0.8
    through[0] = False
    found = Donors(bodies.tracks(positions))
    least = max(150, donors.LEAST_FRAMES)
    if (seen[:, through].sum(axis=0) >= least).sum() < 3:
        with pytest.raises(Refused):
            found.group(0, through)
        return
    try:
        markers, frames = found.group(0, through)
    except Refused as refused:
        assert "too few frames" in str(refused)  # noqa: PT017
        return
    assert through[markers].all()
    shown = seen[:, 0] & seen[:, markers].all(axis=1)
    np.testing.assert_array_equal(frames, np.flatnonzero(shown))
    assert len(frames) >= least
    for other in np.setdiff1d(np.flatnonzero(through), markers):
        assert (shown & seen[:, other]).sum() < least


def test_the_marker_seen_most_together_with_the_hidden_one_is_first(bodies, rng):
    seen = np.ones((300, 6), dtype=bool)
    seen[:140, 4] = seen[160:, 5] = False  # 4 and 5 exclude each other
    positions = np.where(seen[:, :, None], rng.normal(size=(300, 6, 3)), np.nan)
    markers, frames = Donors(bodies.tracks(positions)).group(0, np.arange(6) > 0)
    assert markers.tolist() == [1, 2, 3, 4]
    assert frames.tolist() == list(range(140, 300))


def test_frames_are_counted_for_more_markers_than_a_word_has_bits(bodies, rng):
    positions = rng.normal(size=(100, 150, 3))
    positions[10:20, 149] = np.nan
    found = Donors(bodies.tracks(positions))
    markers, frames = found.group(0, np.isin(np.arange(150), [1, 70, 149]))
    assert markers.tolist() == [1, 70, 149]
    assert len(frames) == 90
