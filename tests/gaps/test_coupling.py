"""Paths that follow the joints that are known."""

import numpy as np
import pytest

from handclean.gaps.coupling import couple
from handclean.gaps.fill import fill
from handclean.gaps.min_acceleration import EndFit
from handclean.gaps.runs import Gap
from handclean.gaps.settings import FillConfig

FIT = EndFit(order=2, frames=5)


def wobble(rng, frames):
    """A movement no path could foresee."""
    steps = np.convolve(rng.normal(size=frames), np.hanning(15), mode="same")
    return np.cumsum(steps) * 0.01


@pytest.fixture
def joints(rng):
    """Three joints that move as one, and one that does not."""
    shared = wobble(rng, 1500)
    return np.column_stack([shared, 0.5 * shared, 2.0 * shared, wobble(rng, 1500)])


def test_a_joint_that_moves_with_others_is_guessed_from_them(joints):
    known = np.ones(joints.shape, dtype=bool)
    known[700:730, 0] = False
    gap = Gap(column=0, start=700, stop=730)
    coupling = couple(joints, known, 50, FIT)
    more, left = coupling.guess(joints, known, gap, FIT, 10)
    from handclean.gaps.min_acceleration import bridge
    from handclean.gaps.runs import Cluster

    path = bridge(joints[:, [0]], known[:, 0], Cluster(gaps=(gap,)), FIT, 10)[0].path
    alone = np.abs(path[:, 0] - joints[700:730, 0]).max()
    together = np.abs(path[:, 0] + more - joints[700:730, 0]).max()
    assert together < 0.35 * alone
    assert left < 0.2


def test_a_joint_that_moves_alone_is_left_on_its_path(joints):
    known = np.ones(joints.shape, dtype=bool)
    known[700:730, 3] = False
    gap = Gap(column=3, start=700, stop=730)
    more, left = couple(joints, known, 50, FIT).guess(joints, known, gap, FIT, 10)
    assert np.abs(more).max() < 0.2 * np.abs(joints[:, 3]).max()
    assert left > 0.7


def test_what_is_added_to_a_path_vanishes_at_its_ends(joints):
    known = np.ones(joints.shape, dtype=bool)
    known[700:740, 0] = False
    gap = Gap(column=0, start=700, stop=740)
    more, _ = couple(joints, known, 50, FIT).guess(joints, known, gap, FIT, 10)
    assert abs(more[0]) < 0.05 * np.abs(more).max()
    assert abs(more[-1]) < 0.05 * np.abs(more).max()


def test_without_known_joints_nothing_is_added(joints):
    known = np.ones(joints.shape, dtype=bool)
    known[700:730] = False
    gap = Gap(column=0, start=700, stop=730)
    more, left = couple(joints, known, 50, FIT).guess(joints, known, gap, FIT, 10)
    np.testing.assert_array_equal(more, np.zeros(30))
    assert left == 1.0


def test_a_take_too_short_to_learn_from_adds_nothing(joints):
    known = np.ones((40, 4), dtype=bool)
    known[15:25, 0] = False
    gap = Gap(column=0, start=15, stop=25)
    more, left = couple(joints[:40], known, 50, FIT).guess(
        joints[:40], known, gap, FIT, 10
    )
    np.testing.assert_array_equal(more, np.zeros(10))
    assert left == 1.0


def test_fingers_that_close_together_tell_of_each_other(scenes, rng):
    poses = np.zeros((1200, 7 + len(scenes.model.tree.hinges)))
    poses[:, 3] = 1.0
    flexes = np.array(["flexion" in name for name in scenes.model.tree.hinges])
    closing = 0.8 + 0.35 * np.clip(wobble(rng, 1200), -2.0, 2.0)
    poses[:, 7:] = np.outer(closing, np.where(flexes, 0.5, 0.0))
    whole, noisy = scenes.take(poses), scenes.take(poses, 1e-4, rng)
    hidden = [label for label in scenes.labels if "INDEX" in label]
    gaps = [(hidden, start, start + 45) for start in range(100, 1100, 200)]
    take = scenes.without(noisy, *gaps)
    error = {}
    for method in ("min-acceleration", "coupled"):
        found = fill(
            take, scenes.subject, settings=FillConfig(method=method, max_sigma_m=1.0)
        )[0]
        away = found.markers.positions - whole.markers.positions
        new = found.markers.origin == 2
        error[method] = np.linalg.norm(away, axis=2)[new].mean()
        assert new.sum() == 45 * 3 * 5
    assert error["coupled"] < 0.6 * error["min-acceleration"]
