import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from handclean.subject.scan.cloud import Pairs
from handclean.subject.scan.nonrigid import NO_PAIRS, Registration, falling


@pytest.fixture
def egg():
    mesh = trimesh.creation.icosphere(subdivisions=3)
    return np.array(mesh.vertices) * [0.02, 0.05, 0.015], np.array(mesh.faces)


def marks_at(places, rows):
    return Pairs(rows=np.asarray(rows), places=places[rows])


ROWS = np.arange(0, 642, 40)


def test_a_rigid_motion_costs_nothing(egg):
    """A mesh that was only moved stays moved, and its energy is zero."""
    at, faces = egg
    turn = Rotation.from_rotvec([0.9, -0.7, 0.8])
    moved = turn.apply(at) + np.array([0.01, 0.02, 0.03])
    work = Registration(at, faces, marks_at(moved, ROWS), 0.1)
    work.vertices = moved.copy()
    for stiffness in (1.0, 1e-4, 1e-8):
        work.relax(stiffness, 1.0, None)
        np.testing.assert_allclose(work.vertices, moved, atol=1e-9)
        assert work.stages[-1].after < 1e-15


def test_landmarks_that_turned_turn_the_mesh(egg):
    at, faces = egg
    moved = Rotation.from_rotvec([0.2, -0.1, 0.25]).apply(at)
    work = Registration(at, faces, marks_at(moved, ROWS), 0.1)
    for stiffness in falling(1.0, 1e-6, 3):
        work.relax(float(stiffness), 1.0, None)
    np.testing.assert_allclose(work.vertices, moved, atol=3e-4)


def test_every_solution_lowers_the_energy(egg, rng):
    at, faces = egg
    moved = at * [1.2, 0.9, 1.1] + rng.normal(scale=0.001, size=at.shape)
    work = Registration(at, faces, marks_at(moved, ROWS), 0.1)
    everywhere = marks_at(moved, np.arange(0, 642, 2))
    for stiffness in falling(1.0, 1e-8, 1):
        work.relax(float(stiffness), 1.0, lambda *_: everywhere)
    for stage in work.stages:
        assert stage.after <= stage.before * (1.0 + 1e-9)


def test_turns_with_the_same_factors_settle(egg):
    at, faces = egg
    moved = at * [1.2, 0.9, 1.1]
    work = Registration(at, faces, marks_at(moved, ROWS), 0.1)
    states = []
    for _ in range(12):
        work.relax(1e-6, 1.0, None, turns=1)
        states.append(work.vertices)
    steps = np.linalg.norm(np.diff(states, axis=0), axis=(1, 2))
    assert steps[-1] < 0.01 * steps[0]


def test_without_data_the_mesh_stays_where_it_is(egg):
    at, faces = egg
    work = Registration(at, faces, marks_at(at, ROWS), 0.1)
    for stiffness in (1.0, 1e-6):
        work.relax(stiffness, 1.0, lambda *_: NO_PAIRS)
    np.testing.assert_allclose(work.vertices, at, atol=1e-9)


def test_softer_skin_comes_nearer_to_its_places(egg, rng):
    at, faces = egg
    moved = at + 0.001 * np.sin(at[:, [1]] / 0.01) * [0.0, 0.0, 1.0]
    everywhere = marks_at(moved, np.arange(642))
    left = []
    for stiffness in (1e-4, 1e-6, 1e-8):
        work = Registration(at, faces, marks_at(moved, ROWS), 0.1)
        work.relax(stiffness, 1.0, lambda *_: everywhere)
        left.append(work.stages[-1].fit_m)
    assert left[0] > 2.0 * left[1] > 4.0 * left[2]


def test_the_unit_of_length_does_not_matter(egg):
    """A hand ten times as large, told to be so, deforms ten times as much."""
    at, faces = egg
    moved = at * [1.2, 0.9, 1.1]
    found = []
    for size in (1.0, 10.0):
        marks = marks_at(size * moved, ROWS)
        work = Registration(size * at, faces, marks, 0.1 * size)
        work.relax(1e-4, 1.0, None)
        found.append(work.vertices / size)
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)


def test_parts_without_pairs_are_carried_along(egg):
    """Half of an egg is seen, moved; the other half follows."""
    at, faces = egg
    shift = np.array([0.0, 0.0, 0.004])
    seen = np.flatnonzero(at[:, 0] > 0.0)
    pairs = marks_at(at + shift, seen)
    work = Registration(at, faces, marks_at(at + shift, ROWS[:2]), 0.1)
    for stiffness in falling(1.0, 1e-6, 1):
        work.relax(float(stiffness), 1.0, lambda *_: pairs)
    np.testing.assert_allclose(work.vertices, at + shift, atol=2e-4)


def test_the_schedule_falls_evenly_from_start_to_end():
    values = falling(1.0, 1e-6, 2)
    assert len(values) == 13
    assert values[0] == 1.0
    assert values[-1] == pytest.approx(1e-6)
    np.testing.assert_allclose(values[1:] / values[:-1], 10**-0.5)
    np.testing.assert_array_equal(falling(1e-8, 1e-8, 3), [1e-8])
