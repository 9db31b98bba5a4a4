"""Measured samples cleaned on request: marked, kept as they were, from raw again."""

from dataclasses import replace

import numpy as np
import pytest

import handclean as hc
from handclean.errors import HandcleanError
from handclean.gaps.fill import fill
from handclean.gaps.measured import clean_measured
from handclean.gaps.settings import FillConfig
from handclean.gaps.smooth import padding_frames, smooth
from handclean.ik.solve import markers_of
from handclean.labels.points import cloud_of
from handclean.recording import Origin, Recording, trajectories

RATE = 100.0
BOTH = FillConfig(despike=True, smooth=10.0)
SPIKE = (150, 2)
"""Frame and marker of the take's spike."""
SHORT = slice(240, 246)
"""Frames of a run of marker 0 that is too short to be smoothed."""


@pytest.fixture
def take(rng):
    """Three markers that move slowly, with noise, a spike, gaps and odd samples."""
    t = np.arange(300) / RATE
    pace = np.array([[0.5, 0.7, 0.9], [0.4, 0.6, 1.1], [0.8, 0.3, 0.5]])
    places = 0.05 * np.sin(2.0 * np.pi * t[:, None, None] * pace)
    places += rng.normal(scale=2e-4, size=places.shape)
    places[SPIKE] += 0.03
    origin = np.ones((300, 3), np.uint8)
    origin[200:240, 0] = Origin.MISSING
    origin[SHORT.stop : 260, 0] = Origin.FILLED
    origin[100, 1] = Origin.REJECTED
    places[origin == Origin.MISSING] = np.nan
    markers = trajectories(places, ("A", "B", "C"), origin=origin)
    return Recording(rate=RATE, frames=300, markers=markers)


def bits(array):
    return np.ascontiguousarray(array).view(np.uint64)


def expect_same(one, other):
    for part in ("positions", "origin", "raw", "sigma"):
        a, b = getattr(one, part), getattr(other, part)
        assert (a is None) == (b is None), part
        if a is not None:
            np.testing.assert_array_equal(a, b, err_msg=part)


def test_nothing_is_done_where_nothing_is_asked_for(take):
    done = clean_measured(take, FillConfig())
    assert done.take is take
    assert done.figures == {"despiked": 0, "smoothed": 0}
    assert done.remarks == ()


def test_what_changes_is_marked_and_kept_as_it_was(take):
    before = take.markers
    done = clean_measured(take, BOTH)
    after = done.take.markers
    changed = after.origin == Origin.SMOOTHED
    expected = before.origin == Origin.MEASURED
    expected[SHORT, 0] = False
    np.testing.assert_array_equal(changed, expected)
    np.testing.assert_array_equal(
        bits(after.raw[changed]), bits(before.positions[changed])
    )
    assert np.isnan(after.raw[~changed]).all()
    np.testing.assert_array_equal(after.origin[~changed], before.origin[~changed])
    np.testing.assert_array_equal(
        bits(after.positions[~changed]), bits(before.positions[~changed])
    )
    assert (after.positions[changed] != before.positions[changed]).any(axis=1).all()
    np.testing.assert_array_equal(after.measured, before.measured)
    assert done.figures == {"despiked": 1, "smoothed": int(changed.sum())}
    np.testing.assert_array_equal(
        bits(after.as_measured[expected]), bits(before.positions[expected])
    )


def test_a_spike_is_taken_out_before_smoothing_and_before_filling(take):
    truth = replace(
        take, markers=replace(take.markers, positions=take.markers.positions.copy())
    )
    truth.markers.positions[SPIKE] -= 0.03
    alone = clean_measured(take, FillConfig(smooth=10.0)).take.markers
    both = clean_measured(take, BOTH).take.markers
    wanted = clean_measured(truth, BOTH).take.markers
    near = slice(SPIKE[0] - 5, SPIKE[0] + 6)

    def away(found):
        return np.abs(found.positions - wanted.positions)[near, SPIKE[1]].max()

    assert away(both) < 5e-4 < 5e-3 < away(alone)


def test_despiking_alone_changes_spikes_alone(take):
    done = clean_measured(take, FillConfig(despike=True)).take.markers
    changed = done.origin == Origin.SMOOTHED
    assert np.argwhere(changed).tolist() == [list(SPIKE)]
    assert (done.positions != take.markers.positions)[
        ~np.isnan(done.positions)
    ].sum() == 3
    np.testing.assert_array_equal(done.raw[SPIKE], take.markers.positions[SPIKE])


def test_what_could_not_be_smoothed_is_told_and_so_are_spikes(take):
    spikes, short = clean_measured(take, BOTH).remarks
    assert (spikes.kind, spikes.data) == ("smoothed", {"despiked": {"C": 1}})
    needed = padding_frames(10.0, RATE) + 1
    assert short.data == {"not_smoothed": 6, "needed_frames": needed}
    assert f"takes {needed} measured frames in a row" in short.text


@pytest.mark.parametrize(
    "settings",
    [BOTH, FillConfig(despike=True), FillConfig(smooth=3.0)],
    ids=["both", "despike", "smooth"],
)
def test_doing_it_twice_is_doing_it_once_and_others_settings_replace_it(take, settings):
    once = clean_measured(take, settings).take
    expect_same(clean_measured(once, settings).take.markers, once.markers)
    for earlier in (BOTH, FillConfig(smooth=20.0), FillConfig(despike=True)):
        before = clean_measured(take, earlier).take
        expect_same(clean_measured(before, settings).take.markers, once.markers)


def test_what_was_done_stays_where_nothing_is_asked_for(take):
    before = clean_measured(take, BOTH).take
    assert clean_measured(before, FillConfig()).take is before


def test_remarks_of_an_earlier_run_do_not_stay(take):
    done = clean_measured(take, BOTH)
    told = replace(done.take, remarks=done.remarks)
    told = replace(told, events=told.all_events, remarks=done.remarks)
    again = clean_measured(told, FillConfig(smooth=9.0)).take
    assert again.events == again.remarks == ()


def test_samples_that_came_smoothed_are_measured_as_far_as_anybody_knows(take):
    origin = take.markers.origin.copy()
    origin[origin == Origin.MEASURED] = Origin.SMOOTHED
    given = replace(take, markers=replace(take.markers, origin=origin))
    once = clean_measured(given, BOTH).take
    expect_same(clean_measured(once, BOTH).take.markers, once.markers)
    assert (once.markers.origin[SHORT, 0] == Origin.SMOOTHED).all()
    measured = take.markers.origin == Origin.MEASURED
    measured[SHORT, 0] = False
    np.testing.assert_array_equal(
        once.markers.raw[measured], take.markers.positions[measured]
    )


@pytest.mark.parametrize("cutoff", [50.0, 50.1, 1e6])
def test_a_cutoff_that_is_not_below_half_the_rate_is_refused(take, cutoff):
    with pytest.raises(HandcleanError) as caught:
        clean_measured(take, FillConfig(smooth=cutoff))
    assert "100 Hz" in str(caught.value)
    assert "smooth should be below half its rate, 50 Hz" in str(caught.value)
    clean_measured(take, FillConfig(smooth=49.9))


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
@pytest.mark.parametrize("settings", [BOTH, FillConfig(despike=True)])
def test_a_take_without_a_rate_is_refused(take, rate, settings):
    with pytest.raises(HandcleanError, match="its rate is"):
        clean_measured(replace(take, rate=rate), settings)


@pytest.mark.parametrize("cutoff", [-1.0, float("nan"), float("inf")])
def test_what_is_no_cutoff_is_no_setting(cutoff):
    with pytest.raises(ValueError, match="smooth"):
        FillConfig(smooth=cutoff)


def test_takes_without_markers_are_left():
    empty = Recording(rate=RATE, frames=3)
    assert clean_measured(empty, BOTH).take is empty


def test_labelling_starts_from_what_was_measured(take):
    done = clean_measured(take, BOTH).take
    one, other = cloud_of(done), cloud_of(take)
    np.testing.assert_array_equal(bits(one.at), bits(other.at))


@pytest.fixture
def gappy(scenes, rng):
    """A waving hand with noise, a spike and a gap."""
    whole = scenes.take(scenes.waving(rng, 200), 3e-4, rng)
    whole.markers.positions[60, scenes.column("R_INDEX_TIP")] += 0.03
    return scenes.without(whole, ("R_INDEX_TIP", 100, 115))


@pytest.mark.parametrize("method", ["linear", "coupled"])
def test_filling_meets_the_smoothed_ends_of_a_gap(scenes, gappy, method):
    settings = FillConfig(method=method, despike=True, smooth=6.0)
    cleaned = clean_measured(gappy, settings).take
    done, _ = fill(cleaned, scenes.subject, settings=settings)
    m, markers = scenes.column("R_INDEX_TIP"), done.markers
    assert (markers.origin[100:115, m] == Origin.FILLED).all()
    assert (markers.origin[[99, 115], m] == Origin.SMOOTHED).all()
    np.testing.assert_array_equal(markers.raw, cleaned.markers.raw)
    np.testing.assert_array_equal(
        bits(markers.positions[markers.measured]),
        bits(cleaned.markers.positions[markers.measured]),
    )
    one_run = smooth(
        gappy.markers.positions[:100, [m]] * 1.0, np.ones((100, 1), bool), 6.0, RATE
    )
    assert np.abs(one_run.positions[90:, 0] - markers.positions[90:100, m]).max() < 1e-3
    if method == "linear":
        share = np.arange(1, 16)[:, None] / 16.0
        first, last = markers.positions[[99, 115], m]
        np.testing.assert_allclose(
            markers.positions[100:115, m], first + share * (last - first), atol=1e-12
        )


def test_the_solver_takes_smoothed_samples_for_measured_ones(scenes, gappy):
    cleaned = clean_measured(gappy, BOTH).take
    np.testing.assert_array_equal(
        markers_of(cleaned, scenes.model), cleaned.markers.positions
    )


def test_filling_again_starts_from_what_was_measured_and_says_what_it_did(
    scenes, gappy
):
    given = {"despike": True, "smooth": 6.0, "method": "linear"}
    once = hc.fill_gaps(gappy, scenes.subject, **given)
    twice = hc.fill_gaps(once, scenes.subject, **given)
    expect_same(once.markers, twice.markers)
    for name, motion in once.motions.items():
        np.testing.assert_array_equal(motion.angles, twice.motions[name].angles)
    assert once.events == twice.events
    (told,) = [one for one in once.remarks if one.kind == "smoothed"]
    assert [one for one in twice.remarks if one.kind == "smoothed"] == [told]
    entry = once.provenance[-1]
    assert entry["settings"]["fill"]["smooth"] == 6.0
    assert entry["settings"]["fill"]["despike"] is True
    assert entry["figures"]["despiked"] == 1
    assert entry["figures"]["smoothed"] == once.markers.measured.sum()


def test_filling_without_the_options_leaves_what_was_smoothed(scenes, gappy):
    once = hc.fill_gaps(gappy, scenes.subject, smooth=6.0, method="linear")
    again = hc.fill_gaps(once, scenes.subject, method="linear")
    expect_same(once.markers, again.markers)
    plain = hc.fill_gaps(gappy, scenes.subject, method="linear").markers
    assert plain.raw is None
    np.testing.assert_array_equal(
        bits(plain.positions[plain.measured]),
        bits(gappy.markers.positions[plain.measured]),
    )
