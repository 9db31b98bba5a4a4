"""Which joints missing markers leave open."""

import numpy as np
import pytest

from handclean.gaps.decided import decide
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig

NOISE_M = SolveConfig().prior_m


def open_hinges(model, poses, hidden, follows=False, expected=()):
    """Hinges that hiding some markers, expected apart from others, leaves open."""
    frames, markers = len(poses), len(model.labels)
    seen = np.ones((frames, markers), dtype=bool)
    hoped = seen.copy()
    for label in hidden:
        seen[:, model.labels.index(label)] = False
    for label in expected:  # hidden for so long that nobody expects them
        seen[:, model.labels.index(label)] = False
        hoped[:, model.labels.index(label)] = False
    noise = np.full(markers, NOISE_M)
    found = decide(model, poses, seen, hoped, noise, NOISE_M, follows=follows)
    assert np.all(found.affected == found.affected[0])
    names = np.array(model.tree.hinges)[found.affected[0]]
    return set(names.tolist()), bool(found.root[0]), found


@pytest.fixture
def bent(scenes):
    """A half closed hand: no joint is straight, none at a limit."""
    model = scenes.model
    poses = np.zeros((3, 7 + len(model.tree.hinges)))
    poses[:, 3] = 1.0
    flexes = np.array(["flexion" in name for name in model.tree.hinges])
    poses[:, 7:] = np.where(flexes, 0.5, 0.0)
    return model, poses


def test_nothing_hidden_opens_nothing(bent):
    model, poses = bent
    hinges, root, found = open_hinges(model, poses, [])
    assert hinges == set()
    assert not root
    assert np.isfinite(found.sigma).all()


def test_a_hidden_tip_opens_its_last_joint_only(bent):
    hinges, root, found = open_hinges(*bent, ["R_INDEX_TIP"])
    assert hinges == {"index_dip_flexion"}
    assert not root
    assert np.isnan(found.sigma[0, bent[0].tree.hinges.index("index_dip_flexion")])


def test_markers_further_out_decide_the_chain_of_a_hidden_one(bent):
    assert open_hinges(*bent, ["R_INDEX_PROX"])[0] == set()


def test_a_wholly_hidden_finger_opens_all_its_joints_and_no_others(bent):
    hidden = ["R_RING_TIP", "R_RING_MID", "R_RING_PROX"]
    hinges, root, _ = open_hinges(*bent, hidden)
    assert hinges == {name for name in bent[0].tree.hinges if "ring" in name}
    assert not root


def test_with_fewer_than_three_markers_everything_is_open(bent):
    model, poses = bent
    hinges, root, _ = open_hinges(model, poses, model.labels[2:])
    assert len(hinges) == len(model.tree.hinges)
    assert root


def test_a_marker_nobody_expects_opens_nothing(bent):
    hinges, _, found = open_hinges(*bent, [], expected=["R_INDEX_TIP"])
    assert hinges == set()
    assert np.isnan(found.sigma[0, bent[0].tree.hinges.index("index_dip_flexion")])


def test_joints_of_the_subspace_are_affected_with_others(bent):
    model = template_subject(load_marker_set("schroeder8")).model
    ring = {name for name in model.tree.hinges if "ring" in name}  # has no marker
    alone = open_hinges(model, bent[1], ["R_LITTLE_TIP"])[0]
    linked = open_hinges(model, bent[1], ["R_LITTLE_TIP"], follows=True)[0]
    assert not ring & alone
    assert ring <= linked
    assert alone < linked


def test_hidden_markers_of_a_redundant_bone_open_nothing(bent):
    assert open_hinges(*bent, ["R_HAND_IN"])[:2] == (set(), False)


def test_a_finger_that_jumps_while_one_of_its_markers_is_missing_is_affected(bent):
    from handclean.gaps.decided import doubt_jumps

    model, _ = bent
    frames, pip = 60, model.tree.hinges.index("index_pip_flexion")
    poses = np.tile(bent[1][:1], (frames, 1))
    poses[20:40, 7 + pip] -= 1.0  # the other elbow
    seen = np.ones((frames, len(model.labels)), dtype=bool)
    expected = seen.copy()
    noise = np.full(len(model.labels), NOISE_M)
    for label, is_affected in (("R_INDEX_PROX", True), ("R_RING_PROX", False)):
        missing = seen.copy()
        missing[20:40, model.labels.index(label)] = False
        found = decide(model, poses, missing, expected, noise, NOISE_M, follows=False)
        doubted = doubt_jumps(found, model, poses, missing, expected)
        assert not found.affected[:, pip].any()
        assert doubted.affected[20:40, pip].all() == is_affected
        assert not doubted.affected[:20].any()
        assert not doubted.affected[40:].any()


def test_a_limb_is_what_hangs_on_the_hand_by_one_joint(scenes):
    from handclean.gaps.decided import same_finger

    model = scenes.model
    fingers = same_finger(model)
    for m, label in enumerate(model.labels):
        finger = label.split("_")[1].lower()
        want = [name.startswith(finger) for name in model.tree.hinges]
        np.testing.assert_array_equal(fingers[m], want)


def test_a_joint_is_lost_where_a_marker_is_missing_that_nobody_expects(bent):
    """And where the take never shows one that tells of it, it is as known as ever."""
    model, poses = bent
    tip = model.labels.index("R_INDEX_TIP")
    dip = model.tree.hinges.index("index_dip_flexion")
    noise = np.full(len(model.labels), NOISE_M)
    for hidden, lost in (
        (slice(1, 3), [False, True, True]),
        (slice(0, 3), [False] * 3),
    ):
        seen = np.ones((3, len(model.labels)), dtype=bool)
        seen[hidden, tip] = False
        found = decide(model, poses, seen, seen, noise, NOISE_M, follows=False)
        assert found.lost[:, dip].tolist() == lost
        assert not found.lost[:, np.arange(len(model.tree.hinges)) != dip].any()
        assert not found.affected.any()
    expected = np.ones_like(seen)
    found = decide(model, poses, seen, expected, noise, NOISE_M, follows=False)
    assert found.affected[:, dip].all()
    assert not found.lost.any()
