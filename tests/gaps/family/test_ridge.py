"""Ridge regression against thirty plain lines, and what they do not have."""

import numpy as np
import pytest

from handclean.gaps.family import donors, ridge
from handclean.gaps.tracks import Refused


def plain(x, hidden, first, stop):
    """Oracle: the whole take in mm, an intercept, all hidden markers at once."""
    frames, markers, _ = x.shape
    others = np.setdiff1d(np.arange(markers), hidden)
    turned, turns, shifts = [], [], []
    for here in x:
        a, b = here[others].mean(axis=0), x[0, others].mean(axis=0)
        u, _, vt = np.linalg.svd((here[others] - a).T @ (x[0, others] - b))
        u[:, 2] *= np.sign(np.linalg.det(u @ vt))
        turns.append(u @ vt)
        shifts.append(b - a @ turns[-1])
        turned.append(here @ turns[-1] + shifts[-1])
    local = np.array(turned)
    rows = np.hstack([local[:, others].reshape(frames, -1), np.ones((frames, 1))])
    train = np.r_[0:first, stop:frames]
    penalty = 0.05 * len(train) * np.diag(np.r_[np.ones(rows.shape[1] - 1), 0.0])
    square = rows[train].T @ rows[train] + penalty
    places = local[:, hidden].reshape(frames, -1)
    weights = np.linalg.solve(square, rows[train].T @ places[train])
    guess = (rows @ weights).reshape(frames, len(hidden), 3)
    back = [(g - s) @ r.T for g, r, s in zip(guess, turns, shifts, strict=True)]
    path = np.array(back)
    share = (np.arange(1, stop - first + 1) / (stop - first + 1))[:, None, None]
    off = x[[first - 1, stop]][:, hidden] - path[[first - 1, stop]]
    return path[first:stop] + (1.0 - share) * off[0] + share * off[1]


@pytest.mark.parametrize("hidden", [[3], [1, 4, 6]])
def test_ridge_is_the_plain_script(bodies, rng, hidden):
    whole = bodies.whole(rng, 200, noise=1e-4)
    tracks = bodies.without(whole, (hidden, 80, 110))
    fill = ridge.prepare(tracks)
    expected = 1e-3 * plain(1e3 * whole, hidden, 80, 110)
    for n, marker in enumerate(hidden):
        path = fill(bodies.gap(marker, 80, 110)).places
        np.testing.assert_allclose(path, expected[:, n], atol=1e-9)


def test_gaps_elsewhere_do_not_matter_where_nothing_of_them_is_needed(bodies, rng):
    """Frames with gaps are left out, as if the take had been cut together there."""
    whole = bodies.whole(rng, 300, noise=1e-4)
    tracks = bodies.without(whole, (3, 80, 110), (5, 200, 230), (3, 250, 300))
    path = ridge.prepare(tracks)(bodies.gap(3, 80, 110)).places
    cut = np.delete(whole, np.r_[200:230, 250:300], axis=0)
    expected = 1e-3 * plain(1e3 * cut, [3], 80, 110)
    np.testing.assert_allclose(path, expected[:, 0], atol=1e-9)


def test_a_marker_that_is_hidden_in_part_of_the_gap_is_no_donor(bodies, rng):
    whole = bodies.whole(rng, 200, noise=1e-4)
    tracks = bodies.without(whole, (3, 80, 110), (5, 100, 105), (6, 79, 80))
    path = ridge.prepare(tracks)(bodies.gap(3, 80, 110)).places
    keep = np.setdiff1d(np.arange(8), [5, 6])
    expected = 1e-3 * plain(1e3 * whole[:, keep], [3], 80, 110)
    np.testing.assert_allclose(path, expected[:, 0], atol=1e-9)


def test_a_donor_that_is_hardly_ever_seen_is_left_out(bodies, rng):
    whole = bodies.whole(rng, 300, noise=1e-4)
    hidden = (3, 80, 110), (5, 0, 60), (5, 130, 300)
    path = ridge.prepare(bodies.without(whole, *hidden))(bodies.gap(3, 80, 110)).places
    others = np.delete(whole, 5, axis=1)
    expected = 1e-3 * plain(1e3 * others, [3], 80, 110)
    np.testing.assert_allclose(path, expected[:, 0], atol=1e-9)


def test_a_rule_is_learnt_once_for_a_marker_and_its_donors(bodies, rng, monkeypatch):
    learnt = []
    honest = ridge.ridge_slopes

    def counted(seen, places):
        learnt.append(seen.shape[1])
        return honest(seen, places)

    monkeypatch.setattr(ridge, "ridge_slopes", counted)
    whole = bodies.whole(rng, 600)
    gaps = [(3, start, start + 5) for start in range(20, 220, 20)]
    tracks = bodies.without(whole, *gaps, (4, 300, 310), ([3, 4], 400, 410))
    fill = ridge.prepare(tracks)
    for gap in [*gaps, (4, 300, 310), (3, 400, 410), (4, 400, 410)]:
        fill(bodies.gap(*gap))
    assert learnt == [7, 7, 6, 6]  # donors of 3, of 4, and of both without the other


def test_a_long_take_is_learnt_from_so_many_frames(bodies, rng, monkeypatch):
    learnt = []
    honest = ridge.ridge_slopes

    def counted(seen, places):
        learnt.append(len(seen))
        return honest(seen, places)

    monkeypatch.setattr(ridge, "ridge_slopes", counted)
    rest, walk = rng.normal(size=(1, 5, 3)), rng.normal(scale=1e-3, size=(12000, 5, 3))
    fill = ridge.prepare(bodies.without(rest + walk, (3, 80, 110)))
    fill(bodies.gap(3, 80, 110))
    assert learnt == [donors.MOST_FRAMES]


def test_more_frames_than_are_learnt_from_are_spread_evenly():
    frames = np.arange(5, 105)
    assert donors.spread_evenly(frames, 100) is frames
    assert donors.spread_evenly(frames, 4).tolist() == [5, 38, 71, 104]


def test_why_a_gap_stays_open(bodies, rng):
    whole = bodies.whole(rng, 100)

    def reason(*gaps, take=whole):
        with pytest.raises(Refused) as refused:
            ridge.prepare(bodies.without(take, *gaps))(bodies.gap(3, 40, 50))
        return str(refused.value)

    rest = [m for m in range(8) if m != 3]
    assert reason((list(range(8)), 40, 50)) == "no other marker is seen throughout"
    assert reason((rest[2:], 40, 50), (3, 40, 50)).startswith("fewer than three")
    assert "30 frames" in reason((3, 0, 30), (3, 40, 50), (3, 60, 100))
    assert "together" in reason((rest, 0, 39), (rest, 51, 100), (3, 40, 50))
    line = whole * 0.0 + np.linspace(0.0, 0.1, 8)[:, None]
    assert "one line" in reason((3, 40, 50), take=line)
