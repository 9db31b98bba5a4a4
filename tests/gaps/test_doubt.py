"""Sigma is learnt from pseudo-gaps: 68 and 95 % lie where it says."""

import numpy as np
import pytest

from handclean.gaps.doubt import BORROWED_68, learn, quantiles
from handclean.gaps.pseudo import Kind, PseudoGap
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Path, Tracks

TRACKS = Tracks(positions=np.zeros((5000, 2, 3)), rate=100.0, bones=np.full(2, -1))


def tried(rng, kind, count, scale, frames=20, heavy=False):
    """Pseudo-gaps whose errors are ``scale`` times what their paths say."""
    pairs = []
    for n in range(count):
        gap = Gap(column=0, start=10 + n, stop=10 + n + frames)
        one = PseudoGap(
            gap=gap, hidden=np.array([True, False]), start=gap.start, stop=gap.stop
        )
        spread = rng.uniform(1e-3, 4e-3, frames)
        error = rng.normal(size=(frames, 3))
        if heavy:
            error = rng.standard_t(3, size=(frames, 3))
        pairs.append((one, Path(scale * spread[:, None] * error, spread)))
    return {kind: pairs}


@pytest.mark.parametrize("heavy", [False, True])
def test_sigma_and_q95_hold_what_they_say(rng, heavy):
    kind = Kind(0.2, 2)
    found = learn(TRACKS, tried(rng, kind, 200, 0.5, heavy=heavy))
    inside, within = [], []
    for one, path in tried(rng, kind, 200, 0.5, heavy=heavy)[kind]:
        sigma = found[kind].q68 * path.spread[:, None]
        off = np.abs(path.places - TRACKS.positions[one.gap.start : one.gap.stop, 0])
        inside.append(off <= sigma)
        within.append(off <= found[kind].q95 * sigma)
    assert np.mean(inside) == pytest.approx(0.68, abs=0.02)
    assert np.mean(within) == pytest.approx(0.95, abs=0.01)
    assert (found[kind].q95 > 2.3) == heavy


def test_a_kind_with_few_gaps_leans_on_all(rng):
    many, few = Kind(0.2, 2), Kind(1.0, 2)
    pairs = tried(rng, many, 100, 1.0) | tried(rng, few, 2, 8.0)
    found = learn(TRACKS, pairs)
    assert found[many].q68 == pytest.approx(1.0, rel=0.1)
    ratios = {
        kind: [np.abs(path.places) / path.spread[:, None] for _, path in part]
        for kind, part in pairs.items()
    }
    own, usual = quantiles(ratios[few])[0], quantiles(ratios[many] + ratios[few])[0]
    expected = np.exp((2 * np.log(own) + BORROWED_68 * np.log(usual)) / 6)
    assert found[few].q68 == pytest.approx(expected)
    assert found[few].gaps == 2


def test_every_gap_counts_alike_whatever_its_length():
    short, long = np.full((10, 3), 1.0), np.full((1000, 3), 9.0)
    assert quantiles([*[short] * 19, long])[0] == pytest.approx(1.0)


def test_of_what_was_never_tried_nothing_is_known(rng):
    assert learn(TRACKS, {Kind(1.0, 2): []}) == {}
    one = tried(rng, Kind(0.2, 2), 3, 1.0)
    assert set(learn(TRACKS, one | {Kind(1.0, 2): []})) == set(one)
