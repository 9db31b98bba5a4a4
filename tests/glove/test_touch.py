"""Inverse kinematics of touching fingertips: equations 2 to 6."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import UsageError
from handclean.glove import reach, touch
from handclean.glove.definitions import load_glove
from handclean.hand.template import template

GLOVE = load_glove("cyberglove18")
TREE = GLOVE.hand.tree(template("right", forearm=True))


@pytest.fixture
def chains():
    return reach.chains_of(GLOVE, TREE, ["thumb", "index"])


def near_touch(rng, count=20):
    """(T, R') [rad] poses in which thumb and index are about to touch."""
    pose = {
        "thumb_cmc_abduction": 42, "thumb_cmc_flexion": 15, "thumb_mcp_flexion": 20,
        "thumb_ip_flexion": 25, "index_mcp_flexion": 48, "index_pip_flexion": 50,
        "index_middle_abduction": 4,
    }  # fmt: skip
    start = np.array([pose.get(row.rotation, 5.0) for row in GLOVE.measured])
    return np.radians(start + rng.normal(0.0, 4.0, (count, len(start))))


def test_the_slope_of_a_tip_is_its_derivative(chains, rng):
    for chain in chains:
        angles = rng.normal(0.3, 0.2, (2, len(chain.columns)))
        _, slopes = reach.tip_and_slope(chain, angles)
        for v in range(len(chain.columns)):
            step = np.zeros(len(chain.columns))
            step[v] = 1e-6
            ahead, _ = reach.tip_and_slope(chain, angles + step)
            behind, _ = reach.tip_and_slope(chain, angles - step)
            expected = (ahead - behind) / 2e-6
            np.testing.assert_allclose(slopes[:, :, v], expected, atol=1e-8)


def test_dips_move_with_the_pips_that_they_follow(chains):
    index = chains[1]
    names = [GLOVE.measured[c].rotation for c in index.columns]
    assert names == ["index_mcp_flexion", "index_pip_flexion", "index_middle_abduction"]
    dip = TREE.hinges.index("index_dip_flexion")
    pip = index.columns[names.index("index_pip_flexion")]
    assert index.couple[dip, pip] == pytest.approx(2 / 3, abs=1e-4)


def test_a_tip_reaches_an_aim_that_its_finger_can_reach(chains, rng):
    for chain in chains:
        span = chain.high - chain.low
        share = rng.uniform(0.35, 0.65, (10, len(span)))
        there, _ = reach.tip_and_slope(chain, chain.low + share * span)
        start = (
            chain.low + np.clip(share + rng.normal(0, 0.08, share.shape), 0, 1) * span
        )
        angles, tips, _ = reach.reach(chain, start, there)
        assert np.linalg.norm(tips - there, axis=1).max() < 5e-5
        again, _ = reach.tip_and_slope(chain, angles)
        np.testing.assert_allclose(again, tips, atol=1e-12)


def test_what_the_aim_leaves_free_is_pulled_to_mid_range(chains, rng):
    thumb = chains[0]  # four rotations for three coordinates
    span = thumb.high - thumb.low
    start = thumb.low + rng.uniform(0.1, 0.9, (30, len(span))) * span
    middle = 0.5 * (thumb.low + thumb.high)
    aim, _ = reach.tip_and_slope(thumb, 0.7 * start + 0.3 * middle)
    off = {}
    for stiff in (0.0, 0.02):
        angles, _, _ = reach.reach(replace(thumb, stiff=stiff), start, aim)
        off[stiff] = ((angles - middle) ** 2).sum(axis=1)
    assert np.mean(off[0.02] < off[0.0]) > 0.9


def test_joints_beyond_their_range_hardly_go_further(chains, rng, monkeypatch):
    thumb = chains[0]
    span = thumb.high - thumb.low
    start = thumb.high + 0.02 * span * np.ones((30, 4))
    goal = thumb.high + rng.uniform(-0.6, 0.4, (30, 4)) * span
    aim, _ = reach.tip_and_slope(thumb, goal)
    beyond = {}
    for suppress in (1.0, 0.1):
        monkeypatch.setattr(reach, "_OUTWARD_STEP_FACTOR", suppress)
        angles, _, _ = reach.reach(thumb, start, aim)
        beyond[suppress] = np.maximum(angles - thumb.high, 0.0).sum(axis=1)
    assert beyond[0.1].mean() < 0.95 * beyond[1.0].mean()
    assert np.mean(beyond[0.1] <= beyond[1.0] + 1e-3) > 0.75


def test_tips_meet_where_their_angles_are_most_probable(chains, rng):
    start = near_touch(rng)
    sigma = touch.start_sigma(GLOVE)
    met = touch.meet(GLOVE, chains, start, sigma)
    assert np.mean(met.apart < 5e-5) > 0.9
    index = chains[1].columns
    tips, _ = reach.tip_and_slope(chains[1], met.rotations[:, index])
    thumb, _ = reach.tip_and_slope(chains[0], met.rotations[:, chains[0].columns])
    good = met.apart < 5e-5
    assert np.linalg.norm(tips - thumb, axis=1)[good].max() < 1e-4
    for _ in range(3):  # elsewhere nearby they would be less probable
        aim = met.place + rng.normal(0.0, 2e-3, met.place.shape)
        cost, apart = np.zeros(len(start)), np.zeros(len(start))
        for chain in chains:
            m, s = start[:, chain.columns], sigma[chain.columns]
            angles, ends, _ = reach.reach(chain, m, aim)
            cost += 0.5 * (((angles - m) / s) ** 2).sum(axis=1)
            apart = np.maximum(apart, np.linalg.norm(ends - aim, axis=1))
        both = good & (apart < 5e-5)
        assert np.mean(cost[both] > met.cost[both] - 0.05) > 0.8


def test_fingers_that_do_not_touch_are_not_known(chains, rng):
    met = touch.meet(GLOVE, chains, near_touch(rng, 3), touch.start_sigma(GLOVE))
    names = [row.rotation for row in GLOVE.measured]
    assert np.isnan(met.rotations[:, names.index("ring_pip_flexion")]).all()
    assert np.isfinite(met.rotations[:, names.index("index_pip_flexion")]).all()


def test_touching_takes_two_fingers_that_exist():
    with pytest.raises(UsageError, match="two or more"):
        reach.chains_of(GLOVE, TREE, ["thumb"])
    with pytest.raises(UsageError, match="'pinky'"):
        reach.chains_of(GLOVE, TREE, ["thumb", "pinky"])
