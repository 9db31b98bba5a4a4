"""Fillers that follow one other marker, or the others of a rigid body."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from handclean.gaps.family import pattern, rigid
from handclean.gaps.tracks import Refused, Tracks


def on_bodies(positions, bones, *gaps):
    hidden = positions.copy()
    for markers, start, stop in gaps:
        hidden[start:stop, markers] = np.nan
    return Tracks(positions=hidden, rate=100.0, bones=np.array(bones))


def test_pattern_follows_a_marker_that_is_carried_along(bodies, rng):
    whole = rng.normal(size=(1, 4, 3)) + rng.normal(size=(60, 1, 3))
    fill = pattern.prepare(bodies.without(whole, (1, 20, 45)))
    np.testing.assert_allclose(
        fill(bodies.gap(1, 20, 45)).places, whole[20:45, 1], atol=1e-12
    )


def test_pattern_prefers_its_own_body_then_the_nearest(bodies, rng):
    whole = rng.normal(size=(60, 4, 3))
    whole[:, :, 0] += [0.0, 30.0, 20.0, 10.0]
    gap = bodies.gap(0, 20, 45)
    share = np.arange(1, 26)[:, None] / 26.0

    def donor(bones):
        path = pattern.prepare(on_bodies(whole, bones, (0, 20, 45)))(gap).places
        off = whole[[19, 45], 0, None] - whole[[19, 45]]
        led = (1.0 - share[:, None]) * off[0] + share[:, None] * off[1]
        away = np.abs(whole[20:45] + led - path[:, None]).max(axis=(0, 2))
        assert away.min() < 1e-12
        return int(away.argmin())

    assert donor([0, 1, 1, 1]) == 3
    assert donor([0, 0, 0, 1]) == 2
    assert donor([-1, -1, -1, -1]) == 3


def test_pattern_at_an_end_of_the_take_keeps_its_offset(bodies, rng):
    whole = rng.normal(size=(60, 2, 3))
    path = pattern.prepare(bodies.without(whole, (0, 0, 20)))(bodies.gap(0, 0, 20))
    expected = whole[:20, 1] + (whole[20, 0] - whole[20, 1])
    np.testing.assert_allclose(path.places, expected, atol=1e-12)


def turned_body(rng, frames=60):
    """(T, 5, 3) a rigid body that turns, unevenly, and is carried."""
    rest = rng.normal(scale=0.05, size=(5, 3))
    keys = Rotation.from_rotvec(rng.normal(size=(4, 3)))
    turns = Slerp([0.0, 20.0, 40.0, 60.0], keys)(np.arange(float(frames))).as_matrix()
    return np.einsum("tij,mj->tmi", turns, rest) + rng.normal(size=(frames, 1, 3))


@pytest.mark.parametrize(("start", "stop"), [(0, 25), (20, 45), (40, 60)])
def test_a_rigid_body_gives_its_hidden_marker_exactly(bodies, rng, start, stop):
    whole = turned_body(rng)
    fill = rigid.prepare(on_bodies(whole, [7] * 5, (2, start, stop)))
    path = fill(bodies.gap(2, start, stop)).places
    np.testing.assert_allclose(path, whole[start:stop, 2], atol=1e-9)


def test_rigid_blends_the_paths_from_both_ends(bodies, rng):
    whole = turned_body(rng)
    whole[30:, 2] += 0.01  # it slid: the donors did not
    path = rigid.prepare(on_bodies(whole, [7] * 5, (2, 20, 45)))(
        bodies.gap(2, 20, 45)
    ).places
    before, after = (
        rigid.prepare(on_bodies(whole, [7] * 5, (2, first, stop)))(
            bodies.gap(2, first, stop)
        ).places[cut]
        for first, stop, cut in ((20, 60, slice(0, 25)), (0, 45, slice(20, 45)))
    )
    share = np.arange(1, 26)[:, None] / 26.0
    expected = (1.0 - share) * before + share * after
    np.testing.assert_allclose(path, expected, atol=1e-12)


def test_why_a_rigid_fill_is_refused(bodies, rng):
    whole = turned_body(rng)
    gap = bodies.gap(2, 20, 45)

    def reason(bones, *gaps, take=whole):
        with pytest.raises(Refused) as refused:
            rigid.prepare(on_bodies(take, bones, (2, 20, 45), *gaps))(gap)
        return str(refused.value)

    assert "fewer than three" in reason([0, 0, 0, 1, 1])
    assert "fewer than three" in reason([0] * 5, ([0, 1], 30, 31))
    assert "not known" in reason([-1] * 5)
    line = np.linspace(0.0, 0.1, 5)[:, None] + np.zeros((60, 5, 3))
    assert "one line" in reason([0] * 5, take=line)
