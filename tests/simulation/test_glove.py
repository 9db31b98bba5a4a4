"""A simulated glove: the paper's behaviour, and known truth."""

import numpy as np
import pytest

from handclean.errors import UnknownNameError
from handclean.glove import claims
from handclean.glove.definitions import load_glove
from handclean.glove.poses import key_poses
from handclean.glove.samples import of_hold
from handclean.simulation import glove_motions as motions
from handclean.simulation.glove import simulate_glove, takes_of
from handclean.simulation.glove_hardware import LARGEST_READING, make_hardware
from handclean.simulation.glove_sensors import GLOVES
from handclean.simulation.settings import SimulateConfig


@pytest.fixture(scope="module")
def session():
    return simulate_glove(SimulateConfig(seed=3), 0, key_poses())


def by_name(session):
    return {take.name: take for take in session.takes}


def test_a_session_is_what_it_lists(session):
    assert [take.name for take in session.takes] == list(takes_of("cyberglove18"))
    assert all(t.readings.shape == (len(t.times), 18) for t in session.takes)


def test_readings_are_whole_numbers_of_the_converter(session):
    for take in session.takes:
        assert np.all(take.readings == np.rint(take.readings))
        assert 0.0 <= take.readings.min() <= take.readings.max() <= LARGEST_READING


def test_the_same_seed_and_number_give_the_same_session(session):
    again = simulate_glove(SimulateConfig(seed=3, trials=4), 0, key_poses())
    other = simulate_glove(SimulateConfig(seed=4), 0, key_poses())
    for one, two, three in zip(session.takes, again.takes, other.takes, strict=True):
        np.testing.assert_array_equal(one.readings, two.readings)
        assert not np.array_equal(one.readings, three.readings)


def test_fingertips_that_touch_are_together(session):
    for finger in motions.LONG:
        take = by_name(session)[f"w1/touch-thumb-{finger}"]
        apart = motions.tip_distance(session.wearer, finger, take.angles)
        assert np.quantile(apart, 0.9) < 1e-3
        moved = np.ptp(take.angles, axis=0)
        assert moved.max() > np.radians(10.0)


def test_widgets_hold_their_rotation(session):
    hinges = session.wearer.tree.hinges
    take = by_name(session)["w1/hold-index_middle_abduction+20"]
    held = take.angles[:, hinges.index("index_mcp_abduction")]
    assert np.ptp(held) < 1e-12
    assert np.degrees(held[0]) == pytest.approx(20.0, abs=2.0)
    take = by_name(session)["w1/hold-ring_little_abduction+20"]
    ring, little = (
        take.angles[:, hinges.index(f"{f}_mcp_abduction")] for f in ("ring", "little")
    )
    assert np.ptp(ring - little) < 1e-12
    assert np.degrees(ring - little)[0] == pytest.approx(20.0, abs=2.0)


def test_key_poses_are_taken_nearly(session):
    hinges = session.wearer.tree.hinges
    for name, pose in key_poses().items():
        take = by_name(session).get(f"w1/pose-{name}-1")
        if take is None:
            continue
        known = [h for h in pose if not h.endswith(("dip_flexion", "mcp_abduction"))]
        found = take.angles.mean(axis=0)[[hinges.index(h) for h in known]]
        off = np.degrees(found - [pose[h] for h in known])
        assert np.abs(off).max() < 5.0


def test_noise_is_1_degree_in_the_mean_and_3_at_most():
    hardware = make_hardware("cyberglove18", np.random.default_rng(1))
    hinges = ("index_pip_flexion",)
    angles = np.linspace(0.2, 1.5, 20_000)[:, None]
    clean = hardware.readings(hinges, angles, None)
    noisy = hardware.readings(hinges, angles, np.random.default_rng(2))
    k = [s.name for s in hardware.sensors].index("I_PIP")
    back = np.interp(noisy[:, k], clean[:, k], angles[:, 0])
    off = np.degrees(np.abs(back - angles[:, 0]))[500:-500]
    assert off.mean() == pytest.approx(1.1, abs=0.15)
    assert off.max() < 4.0  # 3, and half a step of the converter


def test_a_sensors_curve_is_no_line_and_rises():
    hardware = make_hardware("cyberglove22", np.random.default_rng(1))
    for hinge, sensor in (("index_pip_flexion", "I_PIP"), ("thumb_ip_flexion", "T_IP")):
        angles = np.linspace(0.0, 1.2, 200)
        k = [s.name for s in hardware.sensors].index(sensor)
        values = hardware.readings((hinge,), angles[:, None], None)[:, k]
        assert np.all(np.diff(values) > 0.0)
        line = np.polyval(np.polyfit(angles, values, 1), angles)
        assert np.abs(values - line).max() > 0.01 * np.ptp(values)


def test_flexion_stretches_abduction_sensors():
    hardware = make_hardware("cyberglove18", np.random.default_rng(1))
    names = [s.name for s in hardware.sensors]
    hinges = ("middle_mcp_flexion",)
    still, bent = hardware.readings(hinges, np.array([[0.0], [1.4]]), None)
    change = np.abs(bent - still) / hardware.span
    assert change[names.index("MR_ABD")] > 0.5
    assert change[names.index("IM_ABD")] > 0.3
    assert change[names.index("RP_ABD")] < 0.12
    assert change[names.index("T_IP")] < 0.12


def test_another_donning_reads_a_little_differently(session):
    one = by_name(session)["w1/pose-flat-1"].readings.mean(axis=0)
    two = by_name(session)["w2/pose-flat-1"].readings.mean(axis=0)
    assert 0.1 < np.abs(one - two).mean() < 8.0


@pytest.mark.parametrize("glove", GLOVES)
def test_every_glove_can_be_worn(glove):
    made = simulate_glove(SimulateConfig(glove=glove, donnings=1), 0, key_poses())
    assert made.takes[0].readings.shape[1] == len(GLOVES[glove])
    for take in made.takes:
        if take.moved:
            own = [made.sensors.index(name) for name in take.moved]
            assert np.all(np.ptp(take.readings[:, own], axis=0) > 10.0), take.name


def test_a_glove_that_does_not_exist_is_named():
    with pytest.raises(UnknownNameError, match="cyberglove18"):
        simulate_glove(SimulateConfig(glove="cyberglove19"), 0, key_poses())


def test_the_left_hand_mirrors_the_right(session):
    left = simulate_glove(SimulateConfig(seed=3, side="left"), 0, key_poses())
    assert left.wearer.tree.side == "left"
    for one, two in zip(session.takes, left.takes, strict=True):
        assert one.name == two.name
        np.testing.assert_allclose(two.angles, one.angles, atol=1e-9)
        assert np.mean(two.readings != one.readings) < 1e-3
    np.testing.assert_array_equal(
        left.wearer.tips.at, session.wearer.tips.at * [-1.0, 1.0, 1.0]
    )
    apart = [
        motions.tip_distance(left.wearer, finger, by_name(left)[name].angles)
        for finger in motions.LONG
        for name in (f"w1/touch-thumb-{finger}",)
    ]
    assert np.quantile(apart, 0.9) < 1e-3


@pytest.mark.parametrize("name", GLOVES)
def test_widgets_hold_what_the_glove_measures(name):
    glove = load_glove(name)
    held = [take[8:] for take in takes_of(name) if "/hold-" in take]
    for rotation in {take[: max(take.rfind("+"), take.rfind("-"))] for take in held}:
        claims.expect_measured(name, glove, of_hold(glove, {rotation: 0.0}, 1)[0])
    counts = {"cyberglove18": 25, "cyberglove22": 25, "generic14": 15, "generic5": 0}
    assert len(held) == counts[name] + 2 * (counts[name] > 0)


def test_widgets_that_are_left_out_change_no_other_recording(session):
    settings = SimulateConfig(seed=3, glove="generic14")
    other = by_name(simulate_glove(settings, 0, key_poses()))
    assert "w1/hold-wrist_flexion+0" not in other
    for finger in motions.LONG:
        name = f"w1/touch-thumb-{finger}"
        np.testing.assert_array_equal(other[name].angles, by_name(session)[name].angles)
