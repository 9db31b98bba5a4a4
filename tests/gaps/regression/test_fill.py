"""Gaps filled from the take's own markers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.gaps.pseudo import PseudoGap, filled
from handclean.gaps.regression import process
from handclean.gaps.regression.covariance import Scale, covariance, own_variance
from handclean.gaps.regression.fill import MOST_FEATURES, pretended, regression
from handclean.gaps.regression.process import (
    choose,
    guess,
    half_solved,
    rows_at,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Refused


def error(path, truth, gap):
    away = path.places - truth[gap.start : gap.stop, gap.column]
    return float(np.linalg.norm(away, axis=1).mean())


def test_a_fingertip_follows_the_other_finger(bending, tracks_of):
    gap = Gap(column=5, start=1000, stop=1120)
    path = regression(tracks_of(bending, (5, 1000, 1120)))(gap)
    ends = bending[[999, 1120], 5]
    line = np.linspace(ends[0], ends[1], 122)[1:-1]
    straight = np.linalg.norm(line - bending[1000:1120, 5], axis=1).mean()
    assert error(path, bending, gap) < 1.5e-3
    assert error(path, bending, gap) < 0.1 * straight
    assert np.all(path.spread > 0.0)


def test_measured_ends_are_met_without_a_step(bending, tracks_of):
    gap = Gap(column=4, start=700, stop=760)
    path = regression(tracks_of(bending, (4, 700, 760)))(gap)
    joined = np.vstack([bending[697:700, 4], path.places, bending[760:763, 4]])
    usual = np.abs(np.diff(bending[:, 4], 2, axis=0)).max(axis=0)
    bends = np.abs(np.diff(joined, 2, axis=0))
    assert np.all(bends[:5] <= 1.5 * usual)
    assert np.all(bends[-5:] <= 1.5 * usual)


def test_what_was_measured_in_a_pseudo_gap_is_not_looked_at(bending, tracks_of):
    hidden = np.zeros(8, dtype=bool)
    hidden[[4, 5]] = True
    gap = Gap(column=5, start=1500, stop=1560)
    one = PseudoGap(gap=gap, hidden=hidden, start=1500, stop=1560)
    quick = pretended(regression(tracks_of(bending)), [one])[0]
    slow = filled(regression, tracks_of(bending), [one])[0]
    assert np.linalg.norm(quick.places - slow.places, axis=1).max() < 1e-4
    np.testing.assert_allclose(quick.spread, slow.spread, rtol=0.1)


def test_moving_the_take_moves_the_fill(bending, tracks_of, turned):
    gap = Gap(column=7, start=400, stop=430)
    here = regression(tracks_of(bending, (7, 400, 430)))(gap)
    there = regression(tracks_of(turned(bending), (7, 400, 430)))(gap)
    np.testing.assert_allclose(there.places, turned(here.places), atol=1e-7)
    np.testing.assert_allclose(there.spread, here.spread, rtol=1e-4)


@pytest.mark.parametrize(("start", "stop"), [(0, 90), (2310, 2400)])
def test_a_gap_with_one_end_is_filled(bending, tracks_of, start, stop):
    gap = Gap(column=5, start=start, stop=stop)
    path = regression(tracks_of(bending, (5, start, stop)))(gap)
    held = bending[stop if start == 0 else start - 1, 5]
    away = np.linalg.norm(held - bending[start:stop, 5], axis=1).mean()
    assert error(path, bending, gap) < 0.2 * away


def test_a_gap_longer_than_what_is_learnt_at_once(bending, tracks_of):
    """A marker that fell off; as many frames are guessed in parts as in one."""
    gap = Gap(column=5, start=1000, stop=2400)
    take = tracks_of(bending, (5, 1000, 2400))
    path = regression(take)(gap)
    assert path.places.shape == (1400, 3)
    assert error(path, bending, gap) < 6e-3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(process, "AT_ONCE", 10**6)
        whole = regression(take)(gap)
    np.testing.assert_allclose(path.places, whole.places, atol=1e-9)
    np.testing.assert_allclose(path.spread, whole.spread, rtol=1e-6)


def test_markers_with_gaps_of_their_own_still_tell(bending, tracks_of):
    cuts = [(6, start, start + 40) for start in range(50, 2300, 150)]
    gap = Gap(column=7, start=1000, stop=1060)
    whole = regression(tracks_of(bending, (7, 1000, 1060)))(gap)
    parts = regression(tracks_of(bending, (7, 1000, 1060), *cuts))(gap)
    assert error(parts, bending, gap) < 2.0 * error(whole, bending, gap) + 2e-4


def test_a_marker_hidden_in_the_same_few_frames_tells_nothing(bending, tracks_of):
    gap = Gap(column=5, start=1000, stop=1005)
    both = regression(tracks_of(bending, (5, 1000, 1005), (4, 1000, 1005)))
    always, features = both._features(gap, np.zeros(8, dtype=bool))
    assert 4 not in features
    assert set(always) == set(features)


def test_markers_far_from_rigid_do_not_tell_where_there_are_many(bending, tracks_of):
    rng = np.random.default_rng(12)
    drift = np.cumsum(rng.normal(scale=2e-3, size=(2400, 20, 3)), axis=0)
    crowd = np.concatenate([bending, 0.5 + drift], axis=1)
    gap = Gap(column=5, start=1000, stop=1120)
    take = regression(tracks_of(crowd, (5, 1000, 1120)))
    path = take(gap)
    ((_, _, always, features),) = take.windows
    assert len(np.frombuffer(features, dtype=np.int64)) == MOST_FEATURES
    assert set(range(8)) - {5} <= set(np.frombuffer(always, dtype=np.int64).tolist())
    assert error(path, crowd, gap) < 2e-3


def test_residuals_are_as_large_as_is_likely(bending, tracks_of):
    """A rule that is linear leaves none; postures that bend the rule leave some."""
    rng = np.random.default_rng(13)
    mixed = np.einsum("mn,tni->tmi", rng.dirichlet(np.ones(8), 3), bending)
    linear = np.concatenate([bending, mixed], axis=1)
    gap = Gap(column=9, start=1000, stop=1060)
    take = regression(tracks_of(linear, (9, 1000, 1060)))
    assert error(take(gap), linear, gap) < 1e-3
    far = np.linalg.norm(bending[:, 5] - bending[:, 0], axis=1)
    curled = bending.copy()
    curled[:, 7] = bending[:, 3] + 0.02 * np.sin(400.0 * far)[:, None]
    bent = regression(tracks_of(curled, (7, 1000, 1060)))
    bent(Gap(column=7, start=1000, stop=1060))
    assert take.residuals[9] < bent.residuals[7]


def test_too_little_to_learn_from_is_refused(bending, tracks_of):
    few = tracks_of(bending, (3, 25, 2400))
    with pytest.raises(Refused, match="too few frames"):
        regression(few)(Gap(column=3, start=25, stop=2400))
    alone = tracks_of(bending[:, :3], (0, 100, 120))
    with pytest.raises(Refused, match="three other markers"):
        regression(alone)(Gap(column=0, start=100, stop=120))


def test_rows_to_learn_from(bending):
    posture = bending.reshape(len(bending), -1)
    known = np.ones(2400, dtype=bool)
    known[1000:1120] = False
    chosen = choose(posture, slice(1000, 1120), known, 1.0)
    assert np.all(np.diff(chosen) > 0)
    assert not np.any((chosen >= 1000) & (chosen < 1120))
    near = np.r_[960:1000, 1120:1160]
    assert np.isin(near, chosen).all()
    most = process.ALIKE + process.SPREAD + 2 * process.NEAR
    assert len(chosen) <= most
    few = np.ones(300, dtype=bool)
    few[100:120] = False
    assert len(choose(posture[:300], slice(100, 120), few, 1.0)) == 280


def test_the_guess_is_the_textbooks(bending, tracks_of):
    """Rasmussen and Williams 2006, equations 2.25 and 2.26, with an inverse."""
    gap = Gap(column=5, start=1000, stop=1040)
    take = regression(tracks_of(bending, (5, 1000, 1040)))
    take(gap)
    window, scales = next(iter(take.windows.values()))
    inside = slice(1000 - window.first, 1040 - window.first)
    found = guess(window, scales, inside, window.known, 120.0)
    learn = choose(scales.posture, inside, window.known, 1.0)
    here = rows_at(window, scales, learn, 1.0)
    there = rows_at(window, scales, np.arange(inside.start, inside.stop), 1.0)
    scale = Scale(there.slow.mean(axis=0), scales.variance, 1.0)
    noise = 2.0 * window.noise + process.EXTRA_NOISE_M2
    square = covariance(here, here, scale) + noise * np.eye(len(learn))
    inverse = np.linalg.inv(square)
    cross = covariance(here, there, scale)
    mean = window.target[learn].mean(axis=0)
    off = window.target[learn] - mean
    np.testing.assert_allclose(found.places, mean + cross.T @ inverse @ off, atol=1e-7)
    left = own_variance(there, scale)
    left = left - np.einsum("ng,nm,mg->g", cross, inverse, cross) + noise
    usual = np.einsum("ni,nm,mi->", off, inverse, off) / off.size
    np.testing.assert_allclose(found.deviation**2, left * usual, rtol=1e-3)


@given(st.integers(1, 40), st.integers(1, 30), st.integers(0, 999))
def test_half_solving_is_a_triangular_solve(size, more, seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(scale=0.02, size=(size, size))
    square = root @ root.T + 3e-9 * np.eye(size)
    rows = rng.normal(scale=0.02, size=(more, size))
    expected = np.linalg.solve(np.linalg.cholesky(square), rows.T).T
    found = half_solved(np.tril(square), rows, 3e-9)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, atol=1e-7 * scale)
