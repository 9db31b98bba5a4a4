"""Readings, samples, and what may be wrong with them."""

import numpy as np
import pytest
from told import texts

from handclean.errors import FileError, HandcleanError, UnknownNameError
from handclean.glove import readings, samples
from handclean.glove.definitions import load_glove
from handclean.glove.gloves import with_coupling
from handclean.glove.poses import key_pose

GLOVE = load_glove("generic14")


def made(count=40, kind=samples.FK, glove=GLOVE, seed=0):
    rng = np.random.default_rng(seed)
    values = rng.uniform(50, 150, (count, len(glove.sensors)))
    targets = rng.normal(size=(count, len(glove.hand.rotations)))
    return samples.make_samples(glove, values, targets, kind, f"group {seed}", "S01")


def test_columns_are_found_by_name_in_any_order():
    names = ("extra", *reversed(GLOVE.sensors))
    places = readings.columns("take.csv", GLOVE, names, len(names))
    values = np.arange(len(names), dtype=float)[None]
    found = readings.arranged(values, places)[0]
    assert [names[int(k)] for k in found] == list(GLOVE.sensors)


def test_a_sensor_that_nothing_needs_may_be_missing():
    glove = load_glove("cyberglove18")
    names = tuple(name for name in glove.sensors if name != "PALM_ARCH")
    places = readings.columns("take.csv", glove, names, len(names))
    found = readings.arranged(np.zeros((3, len(names))), places)
    assert np.isnan(found[:, glove.sensors.index("PALM_ARCH")]).all()
    assert readings.usable(glove, found + 50.0).all()


def test_a_missing_sensor_and_a_wrong_count_are_named():
    names = tuple(name for name in GLOVE.sensors if name != "I_PIP")
    with pytest.raises(FileError, match=r"take\.csv: has no sensor I_PIP"):
        readings.columns("take.csv", GLOVE, names, 13)
    with pytest.raises(FileError, match=r"has 15 columns.*generic14 has 14"):
        readings.columns("take.csv", GLOVE, (), 15)


def test_dead_saturated_and_blank_sensors_are_named_in_a_line_each():
    values = np.random.default_rng(0).uniform(50, 150, (100, 14))
    assert readings.remarks(GLOVE, values) == ()
    values[:, 3] = 77.0
    values[10:20, 5] = 255.0
    values[4, 6] = np.nan
    blank, stuck, still = texts(readings.remarks(GLOVE, values))
    assert "1 frames" in blank
    assert GLOVE.sensors[6] in blank
    assert f"{GLOVE.sensors[5]} saturated in 10 %" in stuck
    assert f"{GLOVE.sensors[3]} never changed" in still
    assert np.flatnonzero(~readings.usable(GLOVE, values)).tolist() == [
        4,
        *range(10, 20),
    ]


def test_a_sensor_of_two_rotations_names_neither():
    five = load_glove("generic5")
    with pytest.raises(UnknownNameError, match="INDEX"):
        samples.of_hold(five, {"INDEX": 0.5}, 3)
    held = samples.of_hold(five, {"index_pip_flexion": 0.5}, 3)
    assert np.isfinite(held).sum() == 3


def test_unusable_frames_are_no_samples():
    values = np.full((5, 14), 100.0)
    values[1, 2], values[3, 0] = np.nan, 255.0
    targets = np.zeros((5, len(GLOVE.hand.rotations)))
    targets[4] = np.nan
    assert len(samples.make_samples(GLOVE, values, targets, 0, "x").readings) == 2


def test_rescaling_puts_the_ends_of_the_range_at_the_ends():
    ends = {name: (20.0 + k, 220.0 - k) for k, name in enumerate(GLOVE.sensors)}
    glove = with_coupling(GLOVE, {}, ends, "test")
    values = np.array([list(v) for v in zip(*ends.values(), strict=True)])
    found = readings.rescaled(glove, values)
    for k, row in enumerate(glove.measured):
        expected = glove.hand.ranges[glove.hand.index(row.rotation)]
        np.testing.assert_allclose(found[:, k], expected)
    with pytest.raises(FileError, match="examine"):
        readings.rescaled(GLOVE, values)


def test_a_key_pose_tells_all_rotations_and_a_widget_one():
    pose = samples.of_pose(GLOVE.hand, key_pose("fist"), 3)
    assert pose.shape == (3, len(GLOVE.hand.rotations))
    assert np.isfinite(pose).all()
    assert np.degrees(pose[0, GLOVE.hand.index("middle_pip_flexion")]) == pytest.approx(
        98
    )
    held = samples.of_hold(GLOVE, {"IM_ABD": 0.3}, 2)
    known = np.flatnonzero(np.isfinite(held[0]))
    assert known.tolist() == [GLOVE.hand.index("index_middle_abduction")]
    with pytest.raises(UnknownNameError, match="IM_ABD"):
        samples.of_hold(GLOVE, {"IM_ADB": 0.3}, 2)


def test_merging_keeps_samples_kinds_and_groups():
    fk, ik = made(seed=1), made(kind=samples.IK, seed=2)
    both = samples.merged([fk, ik])
    np.testing.assert_array_equal(both.readings[:40], fk.readings)
    np.testing.assert_array_equal(both.kind, [0] * 40 + [1] * 40)
    assert [both.groups[g] for g in both.group[[0, -1]]] == ["group 1", "group 2"]
    assert both.subject == "S01"


def test_samples_of_two_gloves_do_not_mix():
    with pytest.raises(HandcleanError, match=r"generic14.*cyberglove18"):
        samples.merged([made(), made(glove=load_glove("cyberglove18"))])


@pytest.mark.parametrize(("count", "most"), [(10, 3), (7, 7), (5, 0), (1000, 999)])
def test_spread_rows_rise_from_the_first_to_the_last(count, most):
    rows = samples.spread(count, most)
    assert len(rows) == (min(count, most) or count)
    assert rows[0] == 0
    assert rows[-1] == count - 1
    assert np.all(np.diff(rows) > 0)
