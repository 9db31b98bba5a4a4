"""The posture through gaps: angles, root, and markers that follow."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.gaps import fill as filling
from handclean.gaps.hand import bridge_hand, follower
from handclean.gaps.posture import SolvedTake, bridge_posture
from handclean.gaps.refine import Targets
from handclean.gaps.runs import Gap, Limits, seen_in
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import Solution, solve_markers
from handclean.recording import Origin

BRIDGED = FillConfig(method="coupled", max_sigma_m=1.0)


def fill(take, subject, settings=BRIDGED):
    """Fill by the bridged posture alone, however far off to expect it."""
    return filling.fill(take, subject, settings=settings)


INDEX = ("R_INDEX_TIP", "R_INDEX_MID", "R_INDEX_PROX")


def hinges_of(scenes, word):
    return [d for d, n in enumerate(scenes.model.tree.hinges) if word in n]


def angle_between(a, b):
    """(T,) [rad] of two rows of quaternions, w first."""
    turns = [Rotation.from_quat(np.roll(q, -1, axis=1)) for q in (a, b)]
    return (turns[0].inv() * turns[1]).magnitude()


def test_a_wholly_hidden_finger_moves_on_smoothly(scenes, rng):
    poses = scenes.waving(rng, 120)
    take = scenes.without(scenes.take(poses), (INDEX, 50, 75))
    filled, _ = fill(take, scenes.subject)
    angles = filled.motions["right"].angles
    index = hinges_of(scenes, "index")
    assert np.abs(angles - poses[:, 7:])[:, index].max() < np.radians(2.0)
    others = [d for d in range(angles.shape[1]) if d not in index]
    assert np.abs(angles - poses[:, 7:])[:, others].max() < np.radians(0.05)
    away = filled.markers.positions - scenes.take(poses).markers.positions
    assert np.linalg.norm(away, axis=2).max() < 2e-3


def test_velocities_of_angles_do_not_jump_at_the_ends_of_a_gap(scenes, rng):
    poses = scenes.waving(rng, 120)
    take = scenes.without(scenes.take(poses), (INDEX, 50, 75))
    angles = fill(take, scenes.subject)[0].motions["right"].angles
    index = hinges_of(scenes, "index")
    usual = np.abs(np.diff(poses[:, 7:], 2, axis=0)[:, index]).max()
    jumps = np.abs(np.diff(angles, 2, axis=0)[:, index])
    assert jumps.max() < 3.0 * usual


def test_where_markers_decide_the_posture_is_the_solved_one(scenes, rng):
    take = scenes.without(
        scenes.take(scenes.waving(rng, 80), 2e-4, rng), ("R_INDEX_TIP", 30, 50)
    )
    found = fill(take, scenes.subject)[0].motions["right"]
    solved = solve_markers(scenes.model, take.markers.positions).poses
    whole = np.ones(80, dtype=bool)
    whole[30:50] = False
    np.testing.assert_array_equal(found.poses[whole], solved[whole])
    ring = hinges_of(scenes, "ring")
    away = found.angles[:, ring] - solved[:, 7:][:, ring]
    assert np.abs(away).max() < np.radians(0.3)


def test_a_visible_tip_drives_the_chain_of_a_hidden_inner_marker(scenes, rng):
    poses = scenes.waving(rng, 100)
    poses[40:60, 7 + hinges_of(scenes, "index_pip")[0]] += 0.4 * np.hanning(20)
    whole = scenes.take(poses)
    take = scenes.without(whole, ("R_INDEX_MID", 36, 64))
    filled, _ = fill(take, scenes.subject)
    away = filled.markers.positions - whole.markers.positions
    assert np.linalg.norm(away, axis=2).max() < 5e-4  # a path could not know the bend


def test_angles_stay_within_their_limits(scenes):
    rng = np.random.default_rng(2)
    poses = scenes.waving(rng, 120)
    flexion = hinges_of(scenes, "index_pip")[0]
    high = scenes.model.tree.limits[flexion, 1]
    t = np.arange(120)
    poses[:, 7 + flexion] = np.minimum(0.03 * t, high)  # closes until it cannot
    stop = int(high / 0.03)
    take = scenes.without(scenes.take(poses), (INDEX, stop - 15, stop + 15))
    angles = fill(take, scenes.subject)[0].motions["right"].angles
    low, high = scenes.model.tree.limits.T
    assert np.all(angles >= low - 1e-12)
    assert np.all(angles <= high + 1e-12)


def test_a_hand_that_vanishes_comes_back_where_its_motion_leads(scenes):
    frames, t = 100, np.arange(100) / scenes.rate
    poses = np.zeros((frames, 7 + len(scenes.model.tree.hinges)))
    half = 0.5 * (0.4 + 2.5 * t)  # turns steadily, about an axis askew
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    poses[:, 3], poses[:, 4:7] = np.cos(half), np.sin(half)[:, None] * axis
    poses[:, :3] = np.outer(t, [0.3, -0.2, 0.1])
    flexes = np.array(["flexion" in name for name in scenes.model.tree.hinges])
    poses[:, 7:] = np.where(flexes, 0.3 + 0.5 * t[:, None], 0.1)
    whole = scenes.take(poses)
    take = scenes.without(whole, (scenes.labels, 40, 60))
    filled, figures = fill(take, scenes.subject)
    motion = filled.motions["right"]
    assert figures.filled == 17
    assert motion.trusted.all()
    np.testing.assert_allclose(motion.translation, poses[:, :3], atol=1e-5)
    assert angle_between(motion.rotation, poses[:, 3:7]).max() < 1e-4
    away = filled.markers.positions - whole.markers.positions
    assert np.linalg.norm(away, axis=2).max() < 2e-3


def test_with_two_markers_left_they_are_still_followed(scenes, rng):
    poses = scenes.waving(rng, 100)
    whole = scenes.take(poses)
    stay = ("R_HAND_IN", "R_MIDDLE_PROX")
    gone = [label for label in scenes.labels if label not in stay]
    take = scenes.without(whole, (gone, 40, 60))
    filled, _ = fill(take, scenes.subject)
    motion = filled.motions["right"]
    assert motion.trusted.all()
    assert np.nanmax(motion.residual[40:60]) < 1e-3
    away = filled.markers.positions - whole.markers.positions
    assert np.linalg.norm(away, axis=2).max() < 8e-3


def test_turning_the_laboratory_turns_what_is_filled(scenes, rng):
    whole = scenes.take(scenes.waving(rng, 80), 2e-4, rng)
    gaps = (INDEX, 30, 50), ("R_HAND_OUT", 40, 60)
    take = scenes.without(whole, *gaps)
    turn = Rotation.random(random_state=7)
    places = np.einsum("ij,tmj->tmi", turn.as_matrix(), take.markers.positions) + 3.0
    turned = replace(take, markers=replace(take.markers, positions=places))
    one = fill(take, scenes.subject)[0].markers
    two = fill(turned, scenes.subject)[0].markers
    want = np.einsum("ij,tmj->tmi", turn.as_matrix(), one.positions) + 3.0
    np.testing.assert_allclose(two.positions, want, atol=2e-5)


def test_the_order_of_markers_does_not_matter(scenes, rng):
    whole = scenes.take(scenes.waving(rng, 80), 2e-4, rng)
    take = scenes.without(whole, (INDEX, 30, 50))
    order = rng.permutation(17)
    markers = take.markers
    shuffled = replace(
        markers,
        positions=markers.positions[:, order],
        origin=markers.origin[:, order],
        labels=tuple(markers.labels[n] for n in order),
    )
    one = fill(take, scenes.subject)[0].markers.positions
    two = fill(replace(take, markers=shuffled), scenes.subject)[0].markers.positions
    np.testing.assert_array_equal(two, one[:, order])


def test_a_left_hand_is_filled_as_the_right_one_in_the_mirror(scenes, rng):
    marker_set = load_marker_set("schroeder17")
    left = template_subject(marker_set, "left")
    take = scenes.without(
        scenes.take(scenes.waving(rng, 80), 2e-4, rng), (INDEX, 30, 50)
    )
    mirror = np.array([-1.0, 1.0, 1.0])
    places = take.markers.positions * mirror
    mirrored = replace(take, markers=replace(take.markers, positions=places))
    one, two = fill(take, scenes.subject)[0], fill(mirrored, left)[0]
    np.testing.assert_allclose(
        two.markers.positions, one.markers.positions * mirror, atol=2e-5
    )
    np.testing.assert_allclose(
        two.motions["left"].angles, one.motions["right"].angles, atol=1e-3
    )


def test_a_wrong_model_makes_no_steps(scenes, rng):
    larger = template_subject(load_marker_set("schroeder17"), length_m=0.20)
    whole = scenes.take(scenes.waving(rng, 100))
    take = scenes.without(whole, (("R_HAND_IN", "R_INDEX_TIP", "R_RING_PROX"), 40, 60))
    filled, _ = fill(take, larger)
    usual = np.linalg.norm(np.diff(whole.markers.positions, axis=0), axis=2).max()
    steps = np.linalg.norm(np.diff(filled.markers.positions, axis=0), axis=2)
    assert steps.max() < 1.5 * usual
    away = filled.markers.positions - whole.markers.positions
    assert np.linalg.norm(away, axis=2).max() < 2.5e-3


def test_gaps_within_gaps_of_one_finger_agree(scenes, rng):
    poses = scenes.waving(rng, 240)
    whole = scenes.take(poses)
    take = scenes.without(whole, ("R_INDEX_TIP", 40, 80), (INDEX[1:], 55, 65))
    filled, _ = fill(take, scenes.subject)
    steps = np.linalg.norm(np.diff(filled.markers.positions, axis=0), axis=2)
    usual = np.linalg.norm(np.diff(whole.markers.positions, axis=0), axis=2).max()
    assert steps.max() < 1.6 * usual
    away = filled.markers.positions - whole.markers.positions
    assert np.linalg.norm(away, axis=2).max() < 5e-3


def test_gaps_that_together_leave_a_joint_open_too_long_say_which(scenes, rng):
    whole = scenes.take(scenes.waving(rng, 200))
    # none lasts more than 0.42 s, but two of three are always missing for 0.76 s
    tip, mid, prox = INDEX
    gaps = (tip, 50, 92), (mid, 50, 88), (prox, 88, 126), (mid, 92, 126)
    take = scenes.without(whole, *gaps)
    _, fine = fill(scenes.without(whole, (INDEX[:2], 50, 90)), scenes.subject)
    _, figures = fill(take, scenes.subject)
    assert fine.left_open == 0
    assert figures.left_open > 0
    assert any("index" in reason for reason in figures.reasons)


def test_single_frames_between_gaps_support_what_is_bridged(scenes, rng):
    whole = scenes.take(scenes.waving(rng, 200))
    # one or the other is missing for 0.76 s, except in two frames
    take = scenes.without(whole, (INDEX[:2], 50, 90), (INDEX[1:], 96, 126))
    take = scenes.without(take, ("R_INDEX_TIP", 91, 95))
    filled, figures = fill(take, scenes.subject)
    assert figures.left_open == 0
    away = filled.markers.positions - whole.markers.positions
    assert np.linalg.norm(away, axis=2).max() < 5e-3


def test_noise_does_not_grow_with_the_gap(scenes, rng):
    poses = np.zeros((240, 7 + len(scenes.model.tree.hinges)))
    poses[:, 3], poses[:, 7:] = 1.0, 0.3
    whole = scenes.take(poses)
    noisy = scenes.take(poses, 1e-3, rng)
    worst, column = [], scenes.column("R_INDEX_TIP")
    for frames in (10, 40):
        off = []
        for start in range(30, 190, 20):
            take = scenes.without(noisy, ("R_INDEX_TIP", start, start + frames))
            filled, _ = fill(take, scenes.subject)
            away = filled.markers.positions - whole.markers.positions
            off.append(
                np.linalg.norm(away[start : start + frames, column], axis=1).max()
            )
        worst.append(np.mean(off))
    assert worst[1] < 3.0 * worst[0]


def spread(take, scenes, gap):
    """(N,) [m] what the bridged posture says of its errors in a gap."""
    subjects = {"right": scenes.subject}
    hand = filling.hands_of(take, subjects, None, BRIDGED, SolveConfig())["right"]
    tracks = filling.tracks_of(take, subjects)
    return follower([bridge_hand(hand, tracks)])(gap).spread


def test_sigma_grows_into_a_gap_and_with_its_length(scenes, rng):
    take = scenes.take(scenes.waving(rng, 600), 1e-4, rng)
    column, middles = scenes.column("R_INDEX_TIP"), []
    for frames in (6, 20, 48):
        gap = scenes.without(take, ("R_INDEX_TIP", 300, 300 + frames))
        inside = spread(gap, scenes, Gap(column=column, start=300, stop=300 + frames))
        middle = frames // 2
        assert inside[middle] == pytest.approx(inside.max(), rel=0.1)
        assert inside[0] <= inside[middle]
        assert inside[-1] <= inside[middle]
        middles.append(inside[middle])
    assert middles[0] < middles[1] < middles[2]


def test_most_of_the_truth_lies_within_two_sigma(scenes, rng):
    poses = scenes.waving(rng, 1500)
    true, noisy = scenes.take(poses), scenes.take(poses, 3e-4, rng)
    gaps = [
        (rng.choice(scenes.labels, 2, replace=False).tolist(), start, start + 30)
        for start in range(30, 1450, 60)
    ]
    markers = fill(scenes.without(noisy, *gaps), scenes.subject)[0].markers
    new = markers.origin == Origin.FILLED
    away = np.abs(markers.positions - true.markers.positions)[new]
    share = away / markers.sigma[new][:, None]  # sigma is per axis
    assert 0.55 < np.mean(share <= 1.0) < 0.9
    assert np.mean(share <= 2.0) > 0.9


def test_a_posture_fill_beats_every_baseline_on_a_bending_finger(scenes, rng):
    poses = scenes.waving(rng, 400)
    whole, noisy = scenes.take(poses), scenes.take(poses, 2e-4, rng)
    gaps = [
        (scenes.labels[n % 17], start, start + 40)
        for n, start in enumerate(range(20, 350, 60))
    ]
    take = scenes.without(noisy, *gaps)
    error = {}
    for method in ("min-acceleration", "linear", "cubic", "spline", "pattern"):
        markers = fill(
            take, scenes.subject, settings=FillConfig(method=method, max_sigma_m=1.0)
        )[0]
        new = markers.markers.origin == Origin.FILLED
        away = markers.markers.positions - whole.markers.positions
        error[method] = np.linalg.norm(away, axis=2)[new].mean()
    assert min(error, key=error.get) == "min-acceleration"


GAP = slice(30, 50)


class Elbows:
    """A thumb whose inner marker is missing has two postures for its tip."""

    def __init__(self, scenes):
        rng, self.model = np.random.default_rng(1), scenes.model
        self.poses = scenes.waving(rng, 80)
        self.positions = marker_positions(self.model, self.poses)
        self.positions[GAP, scenes.column("R_THUMB_PROX")] = np.nan
        self.finger = np.array(hinges_of(scenes, "thumb"))
        self.noise = np.full(len(self.model.labels), 2e-4)
        self.other = self.poses.copy()
        self.other[GAP] = self._other(rng)

    def _other(self, rng):
        """(20, 7 + D) the posture that fits as well, far from the true one."""
        rows, targets = np.arange(80)[GAP], self._targets()
        low, high = self.model.tree.limits[self.finger].T
        found, start = self.poses[rows], self.poses.copy()
        missing = np.ones(len(rows), dtype=bool)
        for _ in range(100):
            start[:, 7 + self.finger] = rng.uniform(low, high)
            held = np.zeros((80, len(self.model.tree.hinges)))
            tried = targets.fitted(rows, start, held)
            away = np.abs(tried - self.poses[rows])[:, 7:].max(axis=1)
            off = marker_positions(self.model, tried) - self.positions[rows]
            good = (away > 0.3) & (np.nanmax(np.abs(off), axis=(1, 2)) < 1e-5)
            found[good & missing] = tried[good & missing]
            missing &= ~good
            if not missing.any():
                return found
        raise AssertionError("every frame should have two postures")

    def _targets(self):
        still = np.zeros(self.positions.shape)
        seen = seen_in(self.positions)
        return Targets(
            self.model, self.positions, seen, still, self.noise, SolveConfig()
        )

    def bridged(self, solved):
        """The posture that is made of what inverse kinematics has."""
        frames = len(solved)
        solution = Solution(
            poses=solved,
            residual=np.zeros(frames),
            opened=np.zeros((frames, solved.shape[1] - 7), dtype=bool),
            decided=np.ones(frames, dtype=bool),
            steps=np.zeros(frames, dtype=np.int64),
        )
        take = SolvedTake(
            model=self.model,
            positions=self.positions,
            expected=np.ones(self.positions.shape[:2], dtype=bool),
            solution=solution,
            noise=self.noise,
        )
        return bridge_posture(
            take, Limits(longest=50, seed=5, rate=100.0), follows=False
        )


def test_a_posture_is_led_through_a_gap_from_what_is_known_on_both_sides(scenes):
    """Where inverse kinematics changes over within a gap, and back."""
    elbows = Elbows(scenes)
    solved = elbows.poses.copy()
    solved[34:46] = elbows.other[34:46]
    posture = elbows.bridged(solved)
    assert not posture.bridged.any()  # nothing jumps at the ends of the gap
    away = np.abs(posture.poses - elbows.poses)[:, 7:]
    assert np.abs(solved - elbows.poses)[34:46, 7:].max(axis=1).min() > 0.3
    assert away.max() < 0.02


def test_hinges_that_jump_at_the_ends_of_a_gap_are_bridged(scenes):
    elbows = Elbows(scenes)
    posture = elbows.bridged(elbows.other)
    jump = np.abs(np.diff(elbows.other[29:31, 7:], axis=0))[0] > 0.4
    assert jump.any()
    assert posture.bridged[GAP][:, jump].all()
    assert not elbows.bridged(elbows.poses).bridged.any()
    away = np.abs(posture.poses - elbows.poses)[:, 7:]
    assert away.max() < 0.05
