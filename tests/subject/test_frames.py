"""Which frames are learnt from, which are kept aside; only measured samples count."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from people import as_take

from handclean.errors import HandcleanError, UnknownNameError
from handclean.recording import Numbering, Recording
from handclean.subject.frames import (
    LEAST_FRAMES,
    Frames,
    camera_noise,
    farthest,
    gather,
    kept_aside,
    thinned,
    usable,
)

LABELS = ("a", "b", "c", "d", "e")


def some(rng, counts, rate=50.0):
    return [as_take(rng.normal(size=(n, 5, 3)), LABELS, rate) for n in counts]


def test_takes_are_strung_together_in_the_order_of_the_labels(rng):
    takes = some(rng, (4, 3))
    frames = gather(takes, ("d", "b"))
    np.testing.assert_array_equal(frames.take, [0, 0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(frames.frame, [0, 1, 2, 3, 0, 1, 2])
    want = takes[1].markers.positions[2, [3, 1]]
    np.testing.assert_array_equal(frames.targets[-1], want)


@pytest.mark.parametrize("origin", [0, 2, 3])
def test_what_was_not_measured_is_not_taken_whatever_stands_there(rng, origin):
    (take,) = some(rng, (6,))
    origins = np.ones((6, 5), dtype=np.uint8)
    origins[2, 1] = origin
    take = as_take(take.markers.positions, LABELS, origin=origins)
    frames = gather([take], LABELS)
    assert not frames.seen[2, 1]
    np.testing.assert_array_equal(frames.targets[2, 1], 0.0)
    assert frames.seen.sum() == 29


def test_a_name_that_a_take_lacks_is_an_error_with_a_suggestion(rng):
    take = as_take(rng.normal(size=(4, 2, 3)), ("R_INDEX_TIP", "R_HAND_IN"))
    with pytest.raises(
        UnknownNameError, match="'R_INDX_TIP'; did you mean R_INDEX_TIP"
    ):
        gather([take], ("R_INDX_TIP",))


def test_of_several_takes_the_one_that_lacks_a_name_is_named(rng):
    good, bad = some(rng, (3,))[0], as_take(rng.normal(size=(3, 1, 3)), ("z",))
    with pytest.raises(UnknownNameError, match=r"^take 2: no marker is called 'a'"):
        gather([good, bad], ("a",))


def test_no_take_and_a_take_without_labels_are_errors():
    with pytest.raises(HandcleanError, match="no take"):
        gather([], LABELS)
    with pytest.raises(HandcleanError, match="no labelled markers"):
        gather([Recording(rate=100.0, frames=3)], LABELS)


def test_frames_with_too_few_markers_are_of_no_use(rng):
    frames = gather(some(rng, (40,)), LABELS)
    frames.seen[:30, 1:] = False
    assert len(usable(frames)) == 10
    frames.seen[30, 1:] = False
    with pytest.raises(HandcleanError) as caught:
        usable(frames)
    want = f"9 of 40 frames hold 4 or more of the 5 markers; {LEAST_FRAMES} or more"
    assert want in str(caught.value)
    assert "\n" not in str(caught.value)


@given(
    counts=st.lists(st.integers(1, 400), min_size=1, max_size=5),
    share=st.sampled_from([0.1, 0.2, 0.34, 0.5]),
)
def test_about_the_share_is_kept_aside_in_blocks(counts, share):
    total = sum(counts)
    frames = Frames(
        targets=np.zeros((total, 1, 3)),
        seen=np.ones((total, 1), dtype=bool),
        take=np.repeat(np.arange(len(counts)), counts),
        frame=np.concatenate([np.arange(n) for n in counts]),
        rates=(50.0,) * len(counts),
        numberings=(Numbering(1),) * len(counts),
    )
    aside = kept_aside(frames, share, 0.5)
    edges = 1 + int(np.sum(aside[1:] != aside[:-1]))
    assert edges <= 2 * (total / 25 + 2 * round(1 / share) + len(counts))
    if total >= 200 and len(counts) == 1:
        assert 0.5 * share < aside.mean() < 2.0 * share
    if total >= 2 * round(1 / share) * len(counts):
        assert 0 < aside.sum() < total


def test_nothing_is_kept_aside_when_nothing_should_be(rng):
    frames = gather(some(rng, (40,)), LABELS)
    assert not kept_aside(frames, 0.0, 1.0).any()


def test_thinning_keeps_the_ends_and_never_repeats(rng):
    frames = gather(some(rng, (100,)), LABELS)
    rows = thinned(frames, 30)
    assert rows[0] == 0
    assert rows[-1] == 99
    assert len(set(rows.tolist())) == 30
    np.testing.assert_array_equal(thinned(frames, 200), np.arange(100))


@given(seed=st.integers(0, 1000), count=st.integers(1, 30))
def test_chosen_points_are_far_from_each_other_and_near_all_others(seed, count):
    points = np.random.default_rng(seed).normal(size=(40, 3))
    rows, left = farthest(points, count, 0.3)
    apart = np.linalg.norm(points[rows][:, None] - points[rows], axis=2)
    apart += 1e9 * np.eye(len(rows))
    nearest = np.linalg.norm(points[:, None] - points[rows], axis=2).min(axis=1)
    assert nearest.max() == pytest.approx(left)
    assert len(rows) == count or left <= 0.3
    assert apart.min() >= min(left, 1e9)
    assert apart.min() > 0.3 or len(rows) == 1


def test_frames_that_are_alike_are_chosen_once():
    points = np.repeat(np.arange(5.0), 20)[:, None]
    rows, left = farthest(points, 50, 0.5)
    assert len(rows) == 5
    assert left == 0.0


def test_camera_noise_is_found_under_smooth_motion(rng):
    t = np.arange(2000) / 100.0
    smooth = 0.1 * np.sin(2 * np.pi * 1.5 * t)[:, None, None] * np.ones((5, 3))
    noisy = smooth + rng.normal(scale=0.0004, size=smooth.shape)
    noisy[rng.random(noisy.shape[:2]) < 0.1] = np.nan
    found = camera_noise(gather([as_take(noisy, LABELS, 100.0)], LABELS))
    assert found == pytest.approx(0.0004, rel=0.05)


def test_without_five_frames_in_a_row_no_camera_noise_is_known(rng):
    positions = rng.normal(size=(40, 5, 3))
    positions[::3] = np.nan
    assert camera_noise(gather([as_take(positions, LABELS)], LABELS)) == 0.0
