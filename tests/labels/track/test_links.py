"""Points are linked to paths where that is clear, and links lead the assignment."""

import numpy as np
import pytest

from handclean.labels.points import Cloud
from handclean.labels.settings import LabelConfig
from handclean.labels.track.links import (
    LINK_COST_OFFSET,
    MAX_LINK_COST,
    MIN_TRUST,
    TRUST_SHARE,
    add_link_costs,
    learn_link_trust,
    path_links,
)
from handclean.labels.track.state import FrameSequence, PairCosts, new_state

RATE = 100.0
X = np.array([1.0, 0.0, 0.0])


def cloud_of_frames(frames, columns=None):
    """A cloud of frames' points, in the order they are given."""
    sizes = [len(points) for points in frames]
    at = np.concatenate(frames)
    column = np.full(len(at), -1) if columns is None else np.concatenate(columns)
    return Cloud(
        start=np.concatenate([[0], np.cumsum(sizes)]),
        at=at,
        frame=np.repeat(np.arange(len(frames)), sizes).astype(np.int32),
        column=column.astype(np.int32),
        residual=None,
        cameras=None,
    )


def links(frames, columns=None, use="auto"):
    return path_links(cloud_of_frames(frames, columns), LabelConfig(columns=use), RATE)


def marching(frames=6):
    """Two points 5 cm apart go 2 mm a frame; the second comes first in odd ones."""
    two = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]])
    paths = [two + np.array([0.0, 0.002 * t, 0.0]) for t in range(frames)]
    return [points[::-1] if t % 2 else points for t, points in enumerate(paths)]


def test_points_are_linked_to_where_they_go_whatever_their_order():
    after, before = links(marching())
    np.testing.assert_array_equal(after[:10], [3, 2, 5, 4, 7, 6, 9, 8, 11, 10])
    np.testing.assert_array_equal(before[2:], [1, 0, 3, 2, 5, 4, 7, 6, 9, 8])
    assert (before[:2] == -1).all()
    assert (after[10:] == -1).all()


def test_a_point_that_two_could_be_is_linked_to_neither():
    frames = [np.array([[0.0, 0.0, 0.0]]), np.array([[2e-3, 0, 0], [-2e-3, 0, 0]])]
    after, _ = links([*frames, frames[0]])
    assert after[0] == -1


def test_a_point_that_jumps_is_not_linked():
    near, far = 0.005, 0.02  # more and less than 60 m/s^2 does in a frame, and 1 mm
    one = np.zeros((1, 3))
    assert links([one, one + near * X, one])[0][0] == 1
    assert links([one, one + far * X, one])[0][0] == -1


def test_columns_are_believed_where_points_in_them_move_like_one():
    numbers = [np.array([7, 9])[:: -1 if t % 2 else 1] for t in range(6)]
    meeting = marching()
    meeting[3] = (
        meeting[3] * np.array([0.02, 1.0, 1.0]) - 5e-4 * X
    )  # half a mm each way
    assert links(meeting, numbers, "ignore")[0][4] == -1
    assert links(meeting, numbers, "use")[0][4] == 7
    np.testing.assert_array_equal(links(marching(), numbers)[0], links(marching())[0])


def test_a_column_that_jumps_to_another_path_is_cut():
    numbers = [np.array([7, 9])[:: -1 if t % 2 else 1] for t in range(40)]
    numbers[20:] = [column[::-1] for column in numbers[20:]]  # exchanged from 20 on
    frames = marching(40)
    np.testing.assert_array_equal(links(frames, numbers)[0], links(frames)[0])


def test_columns_that_are_no_paths_are_not_believed():
    wrong = [np.array([7, 9]) for _ in range(6)]  # each column jumps by 5 cm
    np.testing.assert_array_equal(links(marching(), wrong)[0], links(marching())[0])


def linked(trust, previous=(4, -1, 6), last_row=(4, 5, -1), unseen=(0, 0, 2)):
    """Costs of three markers and three points, of which two have a path, by links."""
    state = new_state(3, 1)
    state.last_row[:] = last_row
    state.progress.link_trust = trust
    pairs = PairCosts(np.zeros((3, 3)), np.full(3, 20.0))
    add_link_costs(np.array(previous), pairs, state, np.array(unseen))
    return pairs.pair


def test_a_link_favours_its_marker_and_no_other():
    weight = 2.0 * np.log(0.95 / 0.05) - LINK_COST_OFFSET
    expected = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, 0]])  # no row is of point 2
    np.testing.assert_allclose(linked(0.95), weight * expected)


def test_links_that_are_often_wrong_count_for_nothing():
    assert not linked(0.85).any()
    assert linked(0.9).any()


def test_links_that_are_always_right_overrule_a_gate():
    state = new_state(1, 1)
    state.last_row[:] = 4
    state.progress.link_trust = 0.999
    pairs = PairCosts(np.full((1, 1), np.inf), np.array([20.0]))
    add_link_costs(np.array([4]), pairs, state, np.zeros(1, dtype=int))
    weight = min(2.0 * np.log(0.999 / 0.001) - LINK_COST_OFFSET, MAX_LINK_COST)
    np.testing.assert_allclose(pairs.pair, 20.0 - 0.5 * MAX_LINK_COST - weight)


@pytest.mark.parametrize(("chosen", "right"), [(0, 1.0), (1, 0.0)])
def test_trust_follows_how_often_links_are_right(chosen, right):
    sequence = FrameSequence(
        np.zeros((4, 3)), np.array([0, 2, 4]), np.array([-1, -1, 1, -1])
    )
    state = new_state(1, 1)
    state.last_row[:], state.chosen[:], state.weight[:] = 1, chosen, 1.0
    before = state.progress.link_trust
    learn_link_trust(1, sequence, state)
    expected = before + TRUST_SHARE * (right - before)
    assert state.progress.link_trust == pytest.approx(expected)
    assert state.last_row[0] == 2 + chosen
    for _ in range(2000):
        state.last_row[:] = 1
        learn_link_trust(1, sequence, state)
    limit = 1.0 - MIN_TRUST if right else MIN_TRUST
    assert state.progress.link_trust == pytest.approx(limit, rel=1e-3)


def test_a_marker_without_a_point_has_no_row():
    sequence = FrameSequence(np.zeros((1, 3)), np.array([0, 1]), np.array([-1]))
    state = new_state(1, 1)
    state.last_row[:], state.weight[:] = 0, 0.0
    learn_link_trust(0, sequence, state)
    assert state.last_row[0] == -1
