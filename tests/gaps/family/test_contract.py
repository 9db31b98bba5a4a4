"""The contract every filler of the family keeps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from handclean.arrays import runs
from handclean.gaps.family.table import BASELINES
from handclean.gaps.tracks import Refused

every = pytest.mark.parametrize("name", BASELINES)
causal = pytest.mark.parametrize("name", [n for n, b in BASELINES.items() if b.causal])
bridging = pytest.mark.parametrize(
    "name", [n for n, b in BASELINES.items() if not b.causal]
)

NEED_BOTH_ENDS = {"linear", "cubic", "c1", "spline"}
FRAMES = 150


def usual(whole):
    return np.linalg.norm(np.diff(whole, axis=0), axis=2).max()


def expect_a_path_or_a_reason(fill, gap):
    reason = ""
    try:
        places, spread = fill(gap)
    except Refused as refused:
        reason = str(refused)
    if reason:
        assert len(reason) > 10
        assert not reason.endswith(".")
        return
    assert places.shape == (gap.frames, 3)
    assert spread.shape == (gap.frames,)
    assert np.isfinite(places).all()
    assert np.isfinite(spread).all()
    assert (spread > 0.0).all()


@st.composite
def some_gaps(draw, markers=8):
    """(marker, start, stop) of a few gaps; others may be hidden with it."""
    found = []
    for _ in range(draw(st.integers(1, 5))):
        start = draw(st.integers(0, FRAMES - 2))
        stop = min(start + draw(st.integers(1, 60)), FRAMES)
        found.append((draw(st.integers(0, markers - 1)), start, stop))
    return found


@every
@given(gaps=some_gaps(), seed=st.integers(0, 50))
def test_a_take_is_filled_or_refused_and_never_changed(bodies, name, gaps, seed):
    whole = bodies.whole(np.random.default_rng(seed), FRAMES, noise=1e-4)
    tracks = bodies.without(whole, *gaps)
    before = tracks.positions.copy()
    fill = BASELINES[name].prepare(tracks)
    for marker in range(8):
        for start, stop in runs(~tracks.seen[:, marker]):
            expect_a_path_or_a_reason(fill, bodies.gap(marker, start, stop))
    np.testing.assert_array_equal(
        tracks.positions.view(np.uint64), before.view(np.uint64)
    )


@every
def test_the_same_take_is_filled_by_the_same_bytes(bodies, name, rng):
    tracks = bodies.without(bodies.whole(rng, FRAMES), (3, 60, 80))
    paths = [BASELINES[name].prepare(tracks)(bodies.gap(3, 60, 80)) for _ in range(2)]
    for one, two in zip(*paths, strict=True):
        np.testing.assert_array_equal(one, two)


@every
@given(seed=st.integers(0, 50))
@settings(max_examples=10)
def test_a_take_moved_as_a_whole_is_filled_alike(bodies, name, seed):
    rng = np.random.default_rng(seed)
    whole = bodies.whole(rng, FRAMES)
    turn, shift = Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    gap = bodies.gap(3, 60, 80)
    path, moved = (
        BASELINES[name].prepare(bodies.without(places, (3, 60, 80)))(gap)
        for places in (whole, whole @ turn.T + shift)
    )
    np.testing.assert_allclose(moved.places, path.places @ turn.T + shift, atol=1e-9)
    np.testing.assert_allclose(moved.spread, path.spread, rtol=1e-6)


@bridging
def test_a_path_begins_and_ends_where_the_marker_was_measured(bodies, name, rng):
    whole = bodies.whole(rng, FRAMES, pace=60)
    whole[70:, 3] += 0.1  # [m] it slid in the gap
    tracks = bodies.without(whole, (3, 60, 80))
    places = BASELINES[name].prepare(tracks)(bodies.gap(3, 60, 80)).places
    joined = np.concatenate([whole[59:60, 3], places, whole[80:81, 3]])
    steps = np.linalg.norm(np.diff(joined, axis=0), axis=1)
    others = usual(np.delete(whole, 3, axis=1))
    assert steps[[0, -1]].max() < 2.0 * others + 0.15 * (0.1 * np.sqrt(3.0))


@causal
def test_a_causal_filler_reads_nothing_that_comes_later(bodies, name, rng):
    whole = bodies.whole(rng, FRAMES)
    other = whole.copy()
    other[70:] += rng.normal(size=other[70:].shape)
    other[72:, 5:] = np.nan
    one, two = (
        BASELINES[name].prepare(bodies.without(x, (3, 60, 90)))(bodies.gap(3, 60, 90))
        for x in (whole, other)
    )
    np.testing.assert_array_equal(one.places[:10], two.places[:10])
    np.testing.assert_array_equal(one.spread[:10], two.spread[:10])
    after = whole.copy()
    after[90:] = rng.normal(size=after[90:].shape)
    three = BASELINES[name].prepare(bodies.without(after, (3, 60, 90)))(
        bodies.gap(3, 60, 90)
    )
    np.testing.assert_array_equal(one.places, three.places)
    np.testing.assert_array_equal(one.spread, three.spread)


@every
def test_doubt_is_least_beside_what_is_measured(bodies, name, rng):
    tracks = bodies.without(bodies.whole(rng, FRAMES), (3, 60, 81))
    spread = BASELINES[name].prepare(tracks)(bodies.gap(3, 60, 81)).spread
    if BASELINES[name].causal:
        assert (np.diff(spread) > 0.0).all()
    else:
        np.testing.assert_allclose(spread, spread[::-1], rtol=1e-9)
        assert (np.diff(spread[:11]) > 0.0).all()


@every
@pytest.mark.parametrize(("start", "stop"), [(0, 20), (130, 150)])
def test_ends_of_a_take_are_filled_by_those_that_can(bodies, name, rng, start, stop):
    whole = bodies.whole(rng, FRAMES, bend=0.001)
    gap, tracks = bodies.gap(3, start, stop), bodies.without(whole, (3, start, stop))
    fill = BASELINES[name].prepare(tracks)
    if name in NEED_BOTH_ENDS or (BASELINES[name].causal and start == 0):
        with pytest.raises(Refused, match=r"reaches the (start|end) of the take"):
            fill(gap)
        return
    places, spread = fill(gap)
    near, away = (-1, 20) if start == 0 else (0, 129)
    assert np.linalg.norm(places[near] - whole[away, 3]) < 2.0 * usual(whole)
    assert spread[near] == spread.min()
    if name not in ("last", "average", "pattern"):
        assert np.linalg.norm(places - whole[start:stop, 3], axis=1).max() < 0.02


def short(rng):
    return rng.normal(scale=0.01, size=(20, 6, 3)), ([2], 8, 12)


def alone(rng):
    return rng.normal(scale=0.01, size=(100, 1, 3)), ([0], 40, 50)


def nothing_seen(rng):
    return rng.normal(scale=0.01, size=(100, 6, 3)), (list(range(6)), 40, 50)


def frozen(rng):
    whole = rng.normal(scale=0.01, size=(100, 6, 3))
    whole[:, [2, 4]] = whole[0, [2, 4]]
    return whole, ([2], 40, 50)


def all_frozen(rng):
    return np.tile(rng.normal(size=(1, 6, 3)), (100, 1, 1)), ([2], 40, 50)


def twice(rng):
    whole = rng.normal(scale=0.01, size=(100, 6, 3))
    whole[:, 3], whole[:, 5] = whole[:, 2], whole[:, 1]
    return whole, ([2], 40, 50)


def all_one(rng):
    return np.tile(rng.normal(size=(100, 1, 3)), (1, 6, 1)), ([2], 40, 50)


def on_a_line(rng):
    ahead = rng.normal(size=(100, 6, 1))
    return ahead * np.array([1.0, 2.0, 3.0]), ([2], 40, 50)


def never_together(rng):
    whole = rng.normal(scale=0.01, size=(100, 6, 3))
    whole[:40, [0, 1, 3, 4, 5]] = np.nan
    return whole, ([2], 40, 100)


def hardly_seen(rng):
    whole = rng.normal(scale=0.01, size=(100, 6, 3))
    whole[4:, 2] = np.nan
    return whole, ([2], 4, 100)


def never_seen(rng):
    return rng.normal(scale=0.01, size=(100, 6, 3)), ([2], 0, 100)


def jumps(rng):
    whole = rng.normal(scale=0.01, size=(100, 6, 3))
    whole[50:] += 1e6
    return whole, ([2], 40, 60)


@every
@pytest.mark.parametrize(
    "bad",
    [
        short,
        alone,
        nothing_seen,
        frozen,
        all_frozen,
        twice,
        all_one,
        on_a_line,
        never_together,
        hardly_seen,
        never_seen,
        jumps,
    ],
)
def test_odd_takes_are_filled_or_refused_with_a_reason(bodies, name, rng, bad):
    whole, (hidden, start, stop) = bad(rng)
    tracks = bodies.without(whole, (hidden, start, stop))
    fill = BASELINES[name].prepare(tracks)
    expect_a_path_or_a_reason(fill, bodies.gap(hidden[0], start, stop))


@every
def test_a_marker_never_seen_stays_open(bodies, name, rng):
    whole, (hidden, start, stop) = never_seen(rng)
    fill = BASELINES[name].prepare(bodies.without(whole, (hidden, start, stop)))
    with pytest.raises(Refused, match="missing in all of the take"):
        fill(bodies.gap(2, start, stop))
