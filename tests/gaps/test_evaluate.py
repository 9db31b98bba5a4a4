"""Fillers judged on gaps cut where nothing is missing."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from handclean.gaps import pseudo
from handclean.gaps.cuts import LENGTHS_S, MOST_HIDDEN, OWN, plan_cuts
from handclean.gaps.evaluate import (
    errors_of,
    judge,
    limbs_of,
    methods_to_judge,
    named,
    of,
)
from handclean.gaps.scores import Cell, against, cells_of, score, winner
from handclean.gaps.settings import CAUSAL_METHODS, METHODS, POSTURE_METHODS
from handclean.gaps.tracks import Path, Refused, Tracks

RATE = 60.0
CHEAP = ("ridge", "linear", "last")


def take(frames=1500, markers=8, gaps=(), seed=1):
    """Markers that slide smoothly on one moving body."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames) / RATE
    sway = np.stack([np.sin(w * t) for w in (1.1, 1.7, 2.3)], axis=1)
    rest = rng.normal(scale=0.05, size=(markers, 3))
    mixed = rng.normal(scale=0.01, size=(markers, 3, 3))
    places = rest + np.einsum("tk,mkj->tmj", sway, mixed) + 0.1 * sway[:, None, ::-1]
    places += rng.normal(scale=1e-4, size=places.shape)
    for column, start, stop in gaps:
        places[start:stop, column] = np.nan
    return Tracks(positions=places, rate=RATE, bones=np.full(markers, -1))


def cuts_of(rounds):
    return [cut for part in rounds for cut in part]


GAPPY = take(gaps=[(1, 100, 130), (2, 400, 460), (3, 0, 12), (5, 50, 1500)])
LIMBS = [np.array([0, 1]), np.array([6, 7])]


def test_gaps_are_cut_where_their_markers_are_measured():
    cuts = cuts_of(plan_cuts(GAPPY, LIMBS))
    assert {cut.pattern for cut in cuts} == {"1", "2", "3", "4", "finger", OWN}
    for cut in cuts:
        assert 5 not in cut.columns  # seen in 3 % of the take
        for one in cut.parts:
            around = slice(one.gap.start - 1, one.gap.stop + 1)
            assert GAPPY.seen[around, one.gap.column].all()
        if cut.pattern == "finger":
            assert cut.columns in {(0, 1), (6, 7)}
        elif cut.pattern != OWN:
            assert len(set(cut.columns)) == int(cut.pattern)
            assert cut.frames == round(cut.length_s * RATE)


def test_gaps_of_a_round_are_apart_and_hide_a_fifth_at_most():
    for cuts in plan_cuts(GAPPY, LIMBS):
        for before, after in pairwise(cuts):
            assert after.start - before.stop >= 0.5 * RATE
        hidden = sum(cut.stop - cut.start for cut in cuts)
        assert hidden <= MOST_HIDDEN * len(GAPPY.seen)


def test_every_cell_has_as_many_gaps_if_there_is_room():
    rounds = plan_cuts(take(frames=6000), per_cell=3)
    counts = [
        sum((cut.pattern, cut.length_s) == (pattern, length) for cut in cuts_of(rounds))
        for pattern in "1234"
        for length in LENGTHS_S
    ]
    assert counts == [3] * 20


def test_markers_and_time_are_spread():
    rounds = plan_cuts(take(frames=20000), per_cell=24)
    single = [cut for cut in cuts_of(rounds) if cut.pattern == "1"]
    assert {cut.columns[0] for cut in single} == set(range(8))
    quarters = np.bincount([4 * cut.start // 20000 for cut in single], minlength=4)
    assert quarters.min() > 0.5 * quarters.max()


def test_own_gaps_are_imitated():
    own = [cut for cut in cuts_of(plan_cuts(GAPPY)) if cut.pattern == OWN]
    frames = {cut.frames for cut in own}
    assert frames == {30, 60, 12}
    ended = [cut.parts[0] for cut in own if cut.frames == 12]
    assert all(one.start < one.gap.start or one.gap.start == 0 for one in ended)


@pytest.mark.parametrize(
    "tracks",
    [
        take(frames=20),
        take(frames=2),
        take(markers=1, frames=20),
        take(gaps=[(m, 0, 1500) for m in range(8)]),
        take(gaps=[(m, 2, 1500) for m in range(8)]),
    ],
    ids=["20 frames", "2 frames", "1 marker", "nothing seen", "two frames seen"],
)
def test_nothing_is_cut_where_there_is_no_room(tracks):
    rounds = plan_cuts(tracks)
    assert all(cut.stop <= len(tracks.seen) for cut in cuts_of(rounds))
    assert len(cuts_of(rounds)) <= 1


def test_a_take_of_one_marker_is_judged_with_it_alone():
    cuts = cuts_of(plan_cuts(take(markers=1)))
    assert {cut.columns for cut in cuts} == {(0,)}
    found = judge(take(markers=1), [cuts[:1]], {"ridge": named("ridge")})
    assert found.rows[0].refused == "no other marker is seen throughout"


def test_the_same_take_gives_the_same_bits():
    def once():
        rounds = plan_cuts(GAPPY, LIMBS, per_cell=2)
        found = judge(GAPPY, rounds, {name: named(name) for name in CHEAP})
        return [errors_of(found, name).tobytes() for name in CHEAP], [
            score(found, name, 0.003).against for name in CHEAP
        ]

    assert once() == once()


@pytest.mark.parametrize("name", ["ridge", "take", "linear", "pca"])
def test_what_is_hidden_is_not_read(name):
    rounds = plan_cuts(GAPPY, LIMBS, per_cell=1)[:1]
    parts = [one for cut in cuts_of(rounds) for one in cut.parts]
    moved = GAPPY.positions.copy()
    for one in parts:
        moved[one.gap.start : one.gap.stop, one.gap.column] += 0.05
    other = Tracks(positions=moved, rate=RATE, bones=GAPPY.bones)
    gaps = [one.gap for one in parts]
    paths = [
        named(name)(pseudo.punched(tracks, parts), gaps) for tracks in (GAPPY, other)
    ]
    assert any(one.path is not None for one in paths[0])
    for one, two in zip(*paths, strict=True):
        if one.path is None:
            assert two.path is None
            continue
        np.testing.assert_array_equal(one.path.places, two.path.places)
        np.testing.assert_array_equal(one.path.spread, two.path.spread)
    here, there = (judge(t, rounds, {name: named(name)}) for t in (GAPPY, other))
    known = np.isfinite(errors_of(here, name))
    assert np.all(errors_of(there, name)[known] > errors_of(here, name)[known])


def test_errors_are_distances_from_what_was_measured():
    off = np.array([0.002, -0.001, 0.002])  # 3 mm

    def prepare(given):
        def fill(gap):
            if gap.column == 7:
                raise Refused("not that one")
            true = GAPPY.positions[gap.start : gap.stop, gap.column]
            return Path(true + off, np.full(gap.frames, 0.002))

        assert given is not GAPPY
        return fill

    rounds = plan_cuts(GAPPY, LIMBS, per_cell=4)
    found = judge(GAPPY, rounds, {"ridge": named("ridge"), "mine": of(prepare)})
    mine = [row for row in found.rows if row.filler == "mine"]
    assert {row.refused for row in mine} == {"", "not that one"}
    for row in mine:
        assert bool(row.refused) == (7 in row.cut.columns)
        if not row.refused:
            np.testing.assert_allclose([row.mean_m, row.last_m], 0.003, rtol=1e-9)
            assert row.within == 1.0  # sigma is learnt: 2 mm, the 0.68 quantile
    one = score(found, "mine", 0.003)
    share = np.mean([7 in row.cut.columns for row in mine])
    assert (one.refused, one.unsure) == (pytest.approx(share), 0.0)
    assert score(found, "mine", 0.001).unsure == pytest.approx(1.0 - share)


def test_all_fillers_are_judged_unless_one_is_asked_for():
    everything = methods_to_judge("", hands=True)
    assert everything[0] == "ridge"
    assert sorted(everything) == sorted(METHODS)
    without = set(everything) - set(methods_to_judge("", hands=False))
    assert without == set(POSTURE_METHODS)
    causal = methods_to_judge("", hands=True, causal=True)
    assert causal == ("ridge", "auto", *CAUSAL_METHODS)
    assert methods_to_judge("pca", hands=False) == ("ridge", "pca")
    assert methods_to_judge("ridge", hands=False) == ("ridge",)


def test_posture_is_followed_where_a_hand_is_known(scenes, rng):
    from handclean.gaps.fill import hands_of, tracks_of
    from handclean.gaps.settings import FillConfig
    from handclean.ik.settings import SolveConfig

    given = scenes.take(scenes.waving(rng, 300), noise=1e-4, rng=rng)
    subjects = {"right": scenes.subject}
    settings = FillConfig(method="coupled")
    hands = hands_of(given, subjects, None, settings, SolveConfig())
    tracks = tracks_of(given, subjects)
    rounds = plan_cuts(tracks, limbs_of(scenes.labels, subjects), per_cell=1)
    fillers = {name: named(name, list(hands.values())) for name in ("ridge", "coupled")}
    found = judge(tracks, rounds[:1], fillers)
    assert np.isfinite(errors_of(found, "coupled")).mean() > 0.5


def test_limbs_are_the_fingers(scenes):
    found = limbs_of(scenes.labels, {"right": scenes.subject})
    fingers = [{scenes.labels[column] for column in limb} for limb in found]
    bones = scenes.model.tree.bones
    for finger in fingers:
        of_finger = {
            bones[scenes.model.bone[scenes.labels.index(label)]].split("_")[0]
            for label in finger
        }
        assert len(of_finger) == 1
    assert len(found) == 5


def test_scores_are_those_of_numbers_one_can_check():
    ridge = np.array([1.0, 2.0, 4.0, np.nan, 8.0])
    mine = np.array([2.0, 1.0, 4.0, 1.0, np.nan])
    found = against(mine, ridge, np.random.default_rng(0))
    assert found.gaps == 3
    assert found.geometric.value == pytest.approx(1.0)
    assert found.of_means.value == pytest.approx(1.0)
    assert found.worse == pytest.approx(1.0 / 3.0)
    assert found.geometric.low == pytest.approx(0.5)
    assert found.geometric.high == pytest.approx(2.0)


def test_an_interval_holds_the_truth_as_often_as_it_says():
    rng = np.random.default_rng(3)
    hits = 0
    for _ in range(200):
        ridge = rng.uniform(1e-3, 2e-3, size=100)
        mine = 0.7 * ridge * np.exp(rng.normal(scale=0.4, size=100))
        low, high = against(mine, ridge, rng).geometric[1:]
        hits += low <= 0.7 <= high
    assert 180 <= hits <= 198


def test_who_fills_little_cannot_win():
    rounds = plan_cuts(GAPPY, per_cell=2)
    found = judge(GAPPY, rounds, {name: named(name) for name in CHEAP})
    scores = [score(found, name, 0.003) for name in CHEAP]
    assert winner(scores).filler == "ridge"
    lazy = replace(scores[1], refused=0.5, mean_m=1e-6)
    assert winner([scores[0], lazy]).filler == "ridge"
    assert winner([replace(one, refused=1.0) for one in scores]) is None
    assert winner([]) is None
    cells = cells_of(found)
    assert cells == sorted(cells)
    one = score(found, "ridge", 0.003, [Cell("1", 0.1)])
    assert one.gaps == 2


def test_a_hand_is_solved_only_where_the_take_is_not_enough(scenes, rng, monkeypatch):
    from handclean.gaps import evaluate
    from handclean.gaps.fill import fill_take, hands_of, tracks_of
    from handclean.gaps.fill_tracks import fill_tracks
    from handclean.gaps.settings import FillConfig
    from handclean.ik.settings import SolveConfig

    whole = scenes.take(scenes.waving(rng, 300), noise=1e-4, rng=rng)
    labels = scenes.labels
    given = scenes.without(whole, (labels[3], 100, 120), (labels[9], 200, 230))
    subjects, settings = {"right": scenes.subject}, FillConfig()
    tracks = tracks_of(given, subjects)
    hands = list(hands_of(given, subjects, None, settings, SolveConfig()).values())
    bridge, solved = evaluate.bridge_hand, []
    monkeypatch.setattr(
        evaluate, "bridge_hand", lambda *of: solved.append(1) or bridge(*of)
    )
    gaps = [one.gap for one in fill_tracks(tracks, [], settings).gaps]
    for max_sigma_m, times in ((0.1, 0), (1e-6, 1)):
        solved.clear()
        found = named("auto", hands, max_sigma_m)(tracks, gaps)
        assert len(solved) == times
        chosen = replace(settings, max_sigma_m=max_sigma_m)
        usual, _ = fill_take(given, subjects, settings=chosen)
        for one in found if max_sigma_m == 0.1 else ():
            rows = slice(one.gap.start, one.gap.stop)
            filled = usual.markers.positions[rows, one.gap.column]
            np.testing.assert_array_equal(filled, one.path.places)


def test_a_marker_measured_in_parts_is_judged_where_it_was_measured():
    """Its own gaps are imitated where it is seen for a part of them only."""
    parts = [(1, start, start + 30) for start in range(0, 1500, 50)]
    tracks = take(gaps=[*parts, (1, 600, 700)])
    cuts = [
        cut
        for cut in cuts_of(plan_cuts(tracks))
        if cut.pattern == OWN
        and not tracks.seen[cut.start : cut.stop, cut.columns[0]].all()
    ]
    assert cuts

    def prepare(given):
        def fill(gap):
            truth = tracks.positions[gap.start : gap.stop, gap.column]
            off = np.where(np.isfinite(truth), truth, 9.0) + np.array([0.003, 0, 0])
            return Path(off, np.full(gap.frames, 0.001))

        return fill

    judged = judge(tracks, [[cut] for cut in cuts], {"mine": of(prepare)})
    for row in judged.rows:
        assert row.mean_m == pytest.approx(0.003)
        assert row.last_m == pytest.approx(0.003)
        assert row.within >= 2.0 / 3.0
