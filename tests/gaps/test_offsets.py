"""What is left over between markers and posture."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import oaconvolve
from scipy.spatial.transform import Rotation

from handclean.gaps.offsets import carry, convolved, kernel, left_over
from handclean.hand.model import bone_rotations, marker_positions


def test_left_overs_are_places_moved_on_the_bones(scenes, rng):
    from dataclasses import replace

    poses = scenes.waving(rng, 30)
    shift = rng.normal(scale=2e-3, size=scenes.model.at.shape)
    other = replace(scenes.model, at=scenes.model.at + shift)
    found = left_over(scenes.model, poses, marker_positions(other, poses))
    np.testing.assert_allclose(found, np.tile(shift, (30, 1, 1)), atol=1e-12)


def test_left_overs_do_not_depend_on_where_the_laboratory_is(scenes, rng):
    poses = scenes.waving(rng, 10)
    away = rng.normal(scale=1e-3, size=(10, len(scenes.labels), 3))
    places = marker_positions(scenes.model, poses) + away
    turn = Rotation.random(random_state=3)
    turned = poses.copy()
    turned[:, :3] = turn.apply(poses[:, :3]) + 1.0
    quaternion = turn * Rotation.from_quat(np.roll(poses[:, 3:7], -1, axis=1))
    turned[:, 3:7] = np.roll(quaternion.as_quat(), 1, axis=1)
    places_there = np.einsum("ij,tmj->tmi", turn.as_matrix(), places) + 1.0
    one = left_over(scenes.model, poses, places)
    two = left_over(scenes.model, turned, places_there)
    np.testing.assert_allclose(one, two, atol=1e-12)
    turns = bone_rotations(scenes.model.tree, poses)
    assert turns.shape[1] == len(scenes.model.tree.bones)


def test_a_constant_left_over_is_carried_unchanged(rng):
    local = np.tile(rng.normal(size=(2, 3)), (80, 1, 1))
    hidden = local.copy()
    hidden[30:50] = np.nan
    tells = np.where(np.isfinite(hidden[:, 0, 0]), 1.0, 0.0)
    found = carry(hidden, tells, 20)
    np.testing.assert_allclose(found.places, local, atol=1e-9)
    assert found.at(10) < 1e-12


def test_in_a_gap_left_overs_run_from_the_one_end_to_the_other():
    local = np.zeros((100, 1, 3))
    local[50:] = 1.0
    tells = np.ones(100)
    tells[40:60] = 0.0
    found = carry(local, tells, 20).places[:, 0, 0]
    assert np.all(np.diff(found[40:60]) > 0.0)
    assert found[40] < 0.05
    assert found[59] > 0.95
    assert found[49] + found[50] == pytest.approx(1.0, abs=0.02)


def test_frames_that_do_not_tell_have_no_say():
    local = np.zeros((60, 1, 3))
    local[20:40] = 7.0
    tells = np.ones(60)
    tells[20:40] = 0.0
    assert np.abs(carry(local, tells, 20).places).max() < 1e-9


def test_a_marker_nothing_tells_stays_where_the_model_has_it():
    local = np.full((50, 2, 3), np.nan)
    local[:, 0] = 0.001
    found = carry(local, np.ones(50), 10)
    np.testing.assert_array_equal(found.places[:, 1], 0.0)
    assert found.at(10) > 0.0


def test_noise_widens_the_kernel(rng):
    drift = np.cumsum(rng.normal(scale=1e-4, size=(3000, 2, 3)), axis=0)
    noise = rng.normal(scale=2e-3, size=drift.shape)
    quiet, loud = (
        carry(drift, np.ones(3000), 20),
        carry(drift + noise, np.ones(3000), 20),
    )
    assert quiet.width < loud.width
    assert quiet.at(20) < loud.at(20)


def test_the_kernel_falls_with_distance():
    weights = kernel(np.arange(10.0), 2.0)
    assert weights[0] == 1.0
    assert np.all(np.diff(weights) < 0.0)


@given(
    frames=st.integers(1, 3000),
    reach=st.integers(1, 400),
    columns=st.integers(1, 3),
    seed=st.integers(0, 10**6),
)
def test_columns_are_convolved_as_scipy_does_it(frames, reach, columns, seed):
    rng = np.random.default_rng(seed)
    series = rng.normal(size=(frames, columns))
    around = rng.uniform(size=2 * reach + 1)
    whole = [np.convolve(column, around) for column in series.T]
    right = np.array(whole).T[reach : reach + frames]
    np.testing.assert_allclose(convolved(series, around), right, atol=1e-10)
    assert convolved(series[:, :0], around).shape == (frames, 0)
    if frames >= len(around):
        same = oaconvolve(series, around[:, None], mode="same", axes=0)
        np.testing.assert_allclose(convolved(series, around), same, atol=1e-10)
