"""Takes in, filled takes out."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.gaps.family.table import BASELINES
from handclean.gaps.fill import fill
from handclean.gaps.settings import CAUSAL_METHODS, FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.prior import PosturePrior
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Event, Origin, Points, Recording, trajectories


@pytest.fixture
def gappy(scenes, rng):
    whole = scenes.take(scenes.waving(rng, 80), 2e-5, rng)
    return scenes.without(whole, ("R_INDEX_TIP", 20, 40), ("R_HAND_IN", 50, 60))


def test_figures_count_what_happened(scenes, gappy):
    take = scenes.without(gappy, ("R_THUMB_TIP", 2, 78))
    _, figures = fill(take, scenes.subject)
    assert (figures.gaps, figures.filled, figures.left_open) == (3, 2, 1)
    assert (figures.missing_samples, figures.filled_samples) == (106, 30)
    assert figures.longest_filled_s == pytest.approx(0.2)
    assert figures.reasons == {"seen with the other markers in too few frames": 1}
    assert figures.filled_by == {"take": 2}
    assert figures.sigma_m > 0.0
    assert figures.bridged_frames == 20  # the others of the hand decide where it is


def test_a_take_without_gaps_comes_back_as_it_was_with_its_motion(scenes, rng):
    take = scenes.take(scenes.waving(rng, 50))
    filled, figures = fill(take, scenes.subject)
    np.testing.assert_array_equal(filled.markers.positions, take.markers.positions)
    assert figures.gaps == figures.filled_samples == figures.bridged_frames == 0
    assert filled.motions["right"].angles.shape == (50, 20)
    assert filled.events == ()


def test_the_motion_goes_under_the_name_asked_for(scenes, gappy):
    filled, _ = fill(gappy, scenes.subject, name="right_2")
    assert list(filled.motions) == ["right_2"]
    assert filled.skeletons["right_2"] is scenes.model.tree
    assert filled.motions["right_2"].names == scenes.model.tree.hinges


def test_angles_that_nothing_decides_have_no_sigma(scenes, rng):
    take = scenes.without(
        scenes.take(scenes.waving(rng, 120)), ("R_INDEX_TIP", 20, 110)
    )
    sigma = fill(take, scenes.subject)[0].motions["right"].angles_sigma
    tip = scenes.model.tree.hinges.index("index_dip_flexion")
    assert np.isnan(sigma[20:110, tip]).all()
    assert np.isfinite(sigma[:20]).all()
    assert np.isfinite(np.delete(sigma, tip, axis=1)).all()


def test_bridged_angles_are_less_sure_than_measured_ones(scenes, gappy):
    sigma = fill(gappy, scenes.subject)[0].motions["right"].angles_sigma
    tip = scenes.model.tree.hinges.index("index_dip_flexion")
    assert np.isfinite(sigma).all()
    assert sigma[30, tip] > sigma[10, tip]


def test_frames_in_which_the_hand_is_lost_for_long_are_not_trusted(scenes, rng):
    take = scenes.without(
        scenes.take(scenes.waving(rng, 150)), (scenes.labels, 30, 110)
    )
    filled, figures = fill(take, scenes.subject)
    trusted = filled.motions["right"].trusted
    assert not trusted[30:110].any()
    assert trusted[:30].all()
    assert trusted[110:].all()
    assert figures.filled == 0
    assert np.isnan(filled.motions["right"].residual[30:110]).all()


def test_filled_samples_have_none_of_what_the_source_said_of_measured_ones(
    scenes, gappy
):
    shape = gappy.markers.origin.shape
    parts = {
        "source": np.tile(np.arange(17, dtype=np.int32), (80, 1)),
        "residual": np.full(shape, 5e-4, dtype=np.float32),
        "cameras": np.full(shape, 7, dtype=np.uint8),
        "confidence": np.full(shape, 0.5, dtype=np.float32),
    }
    take = replace(gappy, markers=replace(gappy.markers, **parts))
    markers = fill(take, scenes.subject)[0].markers
    new = markers.origin == Origin.FILLED
    for part, blank in (("source", -1), ("residual", 0.0), ("cameras", 0)):
        found = getattr(markers, part)
        assert np.all(found[new] == blank)
        np.testing.assert_array_equal(found[~new], parts[part][~new])
        assert found.dtype == parts[part].dtype
    np.testing.assert_array_equal(markers.confidence, parts["confidence"])


def test_a_rejected_point_gives_way_but_is_kept(scenes, gappy, rng):
    positions, origin = gappy.markers.positions.copy(), gappy.markers.origin.copy()
    column = scenes.column("R_INDEX_TIP")
    positions[25:28, column] = rng.normal(size=(3, 3))
    origin[25:28, column] = Origin.REJECTED
    before = Points(
        frame=np.array([10, 26, 70], dtype=np.int32),
        source=np.array([4, 5, 6], dtype=np.int32),
        positions=rng.normal(size=(3, 3)),
    )
    markers = replace(gappy.markers, positions=positions, origin=origin)
    take = replace(gappy, markers=markers, unlabelled=before)
    filled, _ = fill(take, scenes.subject)
    assert (filled.markers.origin[20:40, column] == Origin.FILLED).all()
    points = filled.unlabelled
    np.testing.assert_array_equal(points.frame, [10, 25, 26, 26, 27, 70])
    np.testing.assert_array_equal(points.source, [4, -1, 5, -1, -1, 6])
    np.testing.assert_array_equal(points.positions[[1, 3, 4]], positions[25:28, column])


def test_a_rejected_point_stays_where_its_gap_stays_open(scenes, rng):
    take = scenes.without(scenes.take(scenes.waving(rng, 80)), ("R_INDEX_TIP", 20, 80))
    positions, origin = take.markers.positions.copy(), take.markers.origin.copy()
    column = scenes.column("R_INDEX_TIP")
    positions[75, column], origin[75, column] = 1.0, Origin.REJECTED
    take = replace(
        take, markers=replace(take.markers, positions=positions, origin=origin)
    )
    filled, _ = fill(take, scenes.subject)
    assert filled.markers.origin[75, column] == Origin.REJECTED
    np.testing.assert_array_equal(filled.markers.positions, positions)
    assert filled.unlabelled is None


def test_events_of_others_stay_and_are_sorted_with_those_of_gaps(scenes, gappy):
    other = Event(start=45, stop=46, text="swap of R_RING_TIP repaired")
    filled, _ = fill(replace(gappy, events=(other,)), scenes.subject)
    assert [event.start for event in filled.events] == [20, 45, 50]
    assert filled.events[1] is other
    text = filled.events[0].text
    assert text.startswith("gap in R_INDEX_TIP: filled by take; expected error 0.")
    assert text.endswith(" mm per axis")


def test_markers_of_others_stay_open_where_nothing_tells_of_them(scenes, gappy):
    markers = gappy.markers
    extra = np.random.default_rng(0).normal(size=(80, 1, 3))  # jumps about by a metre
    extra[10:20] = np.nan
    take = replace(
        gappy,
        markers=trajectories(
            np.concatenate([markers.positions, extra], axis=1),
            (*markers.labels, "CUP_1"),
        ),
    )
    found = fill(take, scenes.subject)[0].markers
    np.testing.assert_array_equal(found.positions[:, 17], extra[:, 0])
    assert (found.origin[10:20, 17] == Origin.MISSING).all()


def test_markers_the_take_does_not_have_are_no_gaps(scenes, gappy):
    keep = [n for n, label in enumerate(scenes.labels) if "LITTLE" not in label]
    markers = trajectories(
        gappy.markers.positions[:, keep], tuple(scenes.labels[n] for n in keep)
    )
    _, figures = fill(replace(gappy, markers=markers), scenes.subject)
    assert (figures.gaps, figures.filled) == (2, 2)


def test_the_inputs_are_not_changed(scenes, gappy):
    before = gappy.markers.positions.copy(), gappy.markers.origin.copy()
    fill(gappy, scenes.subject)
    np.testing.assert_array_equal(gappy.markers.positions, before[0])
    np.testing.assert_array_equal(gappy.markers.origin, before[1])


def test_a_reduced_set_is_filled_with_the_prior_s_help(scenes, rng):
    marker_set = load_marker_set("schroeder8")
    subject = template_subject(marker_set)
    poses = scenes.waving(rng, 300)
    closing = 0.5 - 0.5 * np.cos(np.arange(300) / 40.0)
    flexes = np.array(["flexion" in name for name in subject.model.tree.hinges])
    poses[:, 7:] = np.outer(closing, np.where(flexes, 0.8, 0.1))  # one synergy
    whole = scenes.take(poses).markers
    columns = [scenes.column(label) for label in subject.model.labels]
    positions = whole.positions[:, columns].copy()
    positions[100:130, subject.model.labels.index("R_MIDDLE_TIP")] = np.nan
    take = Recording(
        rate=100.0,
        frames=300,
        markers=trajectories(positions, subject.model.labels),
    )
    direction = np.where(flexes, 0.8, 0.1)
    size = np.linalg.norm(direction)
    prior = PosturePrior(
        names=subject.model.tree.hinges,
        mean=0.5 * direction,
        components=(direction / size)[:, None],
        deviations=np.array([0.35 * size]),
        variance_share=np.ones(1),
    )
    filled, figures = fill(take, subject, prior=prior)
    assert figures.filled == 1
    away = filled.markers.positions - whole.positions[:, columns]
    assert np.linalg.norm(away, axis=2).max() < 4e-3
    ring = [d for d, name in enumerate(subject.model.tree.hinges) if "ring" in name]
    angles = filled.motions["right"].angles
    assert np.abs(angles - poses[:, 7:])[:, ring].max() < np.radians(8.0)


def test_a_take_without_rate_or_markers_is_refused(scenes, gappy):
    with pytest.raises(HandcleanError, match="rate"):
        fill(replace(gappy, rate=0.0), scenes.subject)
    with pytest.raises(HandcleanError, match="none of the subject's markers"):
        fill(replace(gappy, markers=None), scenes.subject)


@pytest.mark.parametrize(
    ("given", "wrong"),
    [
        ({"method": "magic"}, "method"),
        ({"max_gap_s": -1.0}, "max_gap_s"),
        ({"seed_frames": 4}, "seed_frames"),
        ({"max_sigma_m": 0.0}, "max_sigma_m"),
        ({"causal": True, "method": "take"}, "'take' looks ahead; with causal it"),
    ],
)
def test_settings_outside_their_limits_are_refused(given, wrong):
    with pytest.raises(ValueError, match=wrong):
        FillConfig(**given)


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"max_gap_s": 0.05}, "longer than max_gap_s = 0.05 s"),
        ({"max_sigma_m": 1e-9}, "its expected error is over max_sigma_m = 1e-09 m"),
    ],
)
def test_what_is_too_long_or_too_unsure_stays_open(scenes, gappy, settings, why):
    filled, figures = fill(gappy, scenes.subject, settings=FillConfig(**settings))
    assert figures.filled == 0
    assert figures.reasons == {why: 2}
    assert all(why in event.text for event in filled.events)
    np.testing.assert_array_equal(filled.markers.origin, gappy.markers.origin)


def test_real_gaps_of_a_quiet_system_are_filled(shared_data, scenes):
    """Twenty gaps of 16-57 frames."""
    path = shared_data / "hand_embodiment" / "recording.tsv"
    lines = path.read_text().splitlines()
    names = next(line for line in lines if line.startswith("MARKER_NAMES")).split("\t")
    rows = np.array([line.split("\t") for line in lines[12:] if line], dtype=float)
    places = rows[:, 2:].reshape(len(rows), -1, 3)[:, :13] / 1e3
    places[(places == 0.0).all(axis=2)] = np.nan
    take = Recording(
        rate=100.0, frames=len(rows), markers=trajectories(places, tuple(names[1:14]))
    )
    subject = template_subject(load_marker_set("dfki13"))
    filled, figures = fill(take, subject)
    assert (figures.gaps, figures.filled) == (20, 20)
    steps = np.linalg.norm(np.diff(filled.markers.positions, axis=0), axis=2)
    new = filled.markers.origin == Origin.FILLED
    edges = new[1:] != new[:-1]
    assert np.nanmax(steps[edges]) < 0.01
    assert np.nanmedian(steps[edges]) < 1.5 * np.nanmedian(steps[:, new.any(axis=0)])


def test_short_gaps_beside_a_long_one_are_filled_as_well_as_others(scenes, rng):
    """A finger hidden for 0.7 s, seen for five frames, hidden for five more."""
    whole = scenes.take(scenes.waving(rng, 260))
    finger = [label for label in scenes.labels if "INDEX" in label]
    gaps = [(finger, 40, 110), (finger, 115, 120), ("R_RING_TIP", 150, 220)]
    take = scenes.without(whole, *gaps, ("R_RING_TIP", 222, 223))
    posture = FillConfig(method="coupled", max_gap_s=0.5, max_sigma_m=1.0)
    filled, figures = fill(take, scenes.subject, prior=read_prior(), settings=posture)
    assert (figures.filled, figures.left_open) == (len(finger) + 1, len(finger) + 1)
    new = filled.markers.origin == Origin.FILLED
    assert new.sum() == 5 * len(finger) + 1
    away = np.linalg.norm(filled.markers.positions - whole.markers.positions, axis=2)
    assert away[new].max() < 1e-3


def test_a_causal_fill_does_not_depend_on_what_comes_after(scenes, rng):
    """But for sigma, and for whether a gap is filled at all."""
    whole = scenes.take(scenes.waving(rng, 300), 2e-5, rng)
    take = scenes.without(whole, ("R_INDEX_TIP", 100, 115))
    later = take.markers.positions.copy()
    later[115:] += 0.02 * rng.normal(size=later[115:].shape)
    other = replace(take, markers=replace(take.markers, positions=later))
    settings = FillConfig(causal=True, max_sigma_m=1.0)
    found = [fill(one, scenes.subject, settings=settings) for one in (take, other)]
    column = scenes.column("R_INDEX_TIP")
    places = [one.markers.positions[100:115, column] for one, _ in found]
    assert found[0][1].filled_by == found[1][1].filled_by == {"affine": 1}
    np.testing.assert_array_equal(*places)
    ahead = fill(take, scenes.subject)[0].markers.positions[100:115, column]
    assert not np.array_equal(places[0], ahead)


def test_the_causal_methods_are_those_of_the_table():
    assert set(CAUSAL_METHODS) == {n for n, one in BASELINES.items() if one.causal}
