"""A target's branches and ranks, and rules that mean the same at every rate."""

import numpy as np
import pytest

from handclean.ik.settings import SolveConfig
from handclean.labels.settings import LabelConfig
from handclean.labels.track.tracker import track_setup


def rules(rate, **settings):
    return track_setup(LabelConfig(**settings), SolveConfig(), rate).rules


def test_every_finger_is_a_branch_and_its_outermost_marker_has_rank_0(hand):
    tree, tracker = hand.target.model.tree, hand.tracker
    for finger in ("thumb", "index", "middle", "ring", "little"):
        rows = np.flatnonzero(hand.finger(finger))
        assert sorted(tracker.rank[rows]) == list(range(len(rows)))
        straight = hand.points(hand.pose(0.0))[0]
        far = np.linalg.norm(straight - hand.pose()[:3], axis=1)
        assert tracker.rank[rows[np.argmax(far[rows])]] == 0
    names = [name.split("_")[0] for name in tree.hinges]
    pairs = set(zip(names, tracker.hinge_branch.tolist(), strict=True))
    assert len(pairs) == len(set(names)) == len(set(tracker.hinge_branch))


def test_rules_scale_with_the_frame_rate():
    slow, fast = rules(50.0), rules(200.0)
    for name in ("drift_m", "max_turn_rad", "usual_turn_rad"):
        assert getattr(slow, name) == pytest.approx(4.0 * getattr(fast, name))
    assert fast.lost_after == pytest.approx(4.0 * slow.lost_after)
    assert slow.min_error_m > fast.min_error_m > 2e-4


def test_more_ghosts_make_no_point_cheaper():
    few, many = rules(100.0), rules(100.0, ghosts_per_hand=2.5)
    for name in ("seen_price", "unseen_price"):
        less = getattr(few, name) - getattr(many, name)
        assert less == pytest.approx(2.0 * np.log(10.0))
    assert few.seen_price - few.unseen_price == pytest.approx(2 * np.log(99.0 / 0.03))
