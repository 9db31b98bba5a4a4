"""Comparisons of takes whose differences are known beforehand."""

from dataclasses import replace

import numpy as np
import pytest
from told import texts

from handclean.errors import HandcleanError
from handclean.recording import (
    Motion,
    Origin,
    Points,
    Recording,
    trajectories,
)
from handclean.report.comparison import in_text, spread_of
from handclean.report.identity import NOBODY, who_is_who
from handclean.report.metrics import compare
from handclean.report.settings import CompareConfig

LABELS = ("a", "b", "c")


def paths(frames=10):
    """Three markers 50 mm apart, moving 1 mm a frame."""
    start = np.array([[0.0, 0, 0], [0.05, 0, 0], [0, 0.05, 0]])
    return start + 1e-3 * np.arange(frames)[:, None, None] * np.array([0, 0, 1.0])


def take(positions=None, labels=LABELS, motions=None, **parts):
    positions = paths() if positions is None else positions
    source = parts.pop("source", None)
    if source is not None:
        source = np.asarray(source, dtype=np.int32)
    markers = trajectories(positions, labels, source=source)
    return Recording(
        rate=100.0,
        frames=len(positions),
        markers=markers,
        motions=motions or {},
        **parts,
    )


def hand(angles, **parts):
    angles = np.asarray(angles, dtype=float)
    names = tuple(f"h{d}" for d in range(angles.shape[1]))
    return Motion(names=names, angles=angles, **parts)


def bare(motion, **parts):
    return Recording(
        rate=100.0, frames=len(motion.angles), motions={"right": motion}, **parts
    )


def test_a_take_compared_with_itself_is_perfect():
    found = compare(take(), take()).figures()
    assert found["precision"] == found["recall"] == found["f1"] == 1.0
    assert found["correct"] == found["labelled"] == found["expected"] == 30
    assert found["swaps"] == found["ghosts"] == found["swapped"] == 0
    assert found["measured_max_mm"] == 0.0
    assert found["filled_samples"] == 0
    assert "filled_mean_mm" not in found


@pytest.mark.parametrize("with_source", [False, True])
def test_two_exchanged_labels_are_two_swaps_of_as_many_samples(with_source):
    columns = np.tile([0, 1, 2], (10, 1))
    swapped = paths()
    swapped[4:7, [0, 1]] = swapped[4:7, [1, 0]]
    there = columns.copy()
    there[4:7, [0, 1]] = there[4:7, [1, 0]]
    source = (columns, there) if with_source else (None, None)
    found = compare(take(source=source[0]), take(swapped, source=source[1]))
    assert found.labels.identity == ("source" if with_source else "position")
    assert found.labels.swaps == 2
    assert found.labels.swapped == 6
    assert found.labels.correct == 24
    assert found.labels.precision == found.labels.recall == pytest.approx(0.8)
    assert found.markers.by_marker["a"][0].most == pytest.approx(0.05)
    assert found.markers.by_marker["c"][0].most == 0.0


def test_a_swap_interrupted_by_a_gap_of_the_label_counts_once():
    other = paths()
    other[3:8, 0] = other[3:8, 1]
    other[3:8, 1] = np.nan
    other[5, 0] = np.nan
    found = compare(take(), take(other)).labels
    assert (found.swaps, found.swapped) == (1, 4)


def test_a_ghost_lowers_precision_and_a_missed_sample_lowers_recall():
    other = paths()
    other[2, 0] += 0.01  # somewhere else: nobody's
    other[5, 1] = np.nan
    found = compare(take(), take(other)).labels
    assert (found.correct, found.labelled, found.expected) == (28, 29, 30)
    assert found.ghosts == 1
    assert found.precision == 28 / 29
    assert found.recall == 28 / 30
    assert found.f1 == pytest.approx(2 * 28 / 59)


def test_filled_samples_are_no_labels_and_are_counted_apart():
    other = take()
    positions = other.markers.positions.copy()
    positions[3:5, 2] += [0.003, 0.0, 0.004]
    origin = other.markers.origin.copy()
    origin[3:5, 2] = Origin.FILLED
    sigma = np.full(origin.shape, np.nan, dtype=np.float32)
    sigma[3, 2], sigma[4, 2] = 0.0035, 0.002
    markers = replace(other.markers, positions=positions, origin=origin, sigma=sigma)
    found = compare(take(), replace(other, markers=markers))
    assert found.labels.labelled == 28
    assert found.labels.precision == 1.0
    assert found.markers.filled.count == 2
    assert found.markers.filled.mean == pytest.approx(0.005)
    assert found.markers.measured.most == 0.0
    assert found.markers.within_one == 3 / 6  # per axis: 3, 0 and 4 mm
    assert found.markers.within_two == 1.0
    assert "per axis, within one sigma 50.0%" in in_text(found)


def test_what_the_reference_filled_is_no_truth():
    true = take()
    origin = true.markers.origin.copy()
    origin[0, 0] = Origin.FILLED
    found = compare(replace(true, markers=replace(true.markers, origin=origin)), take())
    assert found.markers.measured.count == 29
    assert found.labels.expected == 29


def test_columns_that_mean_something_else_do_not_tell():
    renumbered = np.tile([2, 0, 1], (10, 1))
    found = compare(take(source=np.tile([0, 1, 2], (10, 1))), take(source=renumbered))
    assert found.labels.identity == "position"
    assert found.labels.f1 == 1.0


def test_a_sample_is_at_most_one_label_even_when_two_claim_it():
    twice = paths()
    twice[:, 1] = twice[:, 0] + 1e-4
    who, told = who_is_who(take().markers, take(twice).markers, 0.002)
    assert told == "position"
    np.testing.assert_array_equal(who, np.tile([0, NOBODY, 2], (10, 1)))


def test_the_order_of_markers_does_not_matter(rng):
    other = paths() + rng.normal(scale=1e-4, size=(10, 3, 3))
    order = [2, 0, 1]
    labels = tuple(LABELS[n] for n in order)
    one = compare(take(), take(other)).figures()
    two = compare(take(), take(other[:, order], labels)).figures()
    assert one == pytest.approx(two)


def test_angle_differences_are_those_of_figure_6():
    old = np.zeros((4, 2))
    new = np.radians([[1.0, -3.0], [1.0, 3.0], [1.0, -3.0], [1.0, 3.0]])
    found = compare(bare(hand(old)), bare(hand(new))).figures()
    assert found["angles_mean_deg"] == pytest.approx(2.0)
    assert found["angles_sd_deg"] == pytest.approx(1.0)
    assert found["angles_p95_deg"] == pytest.approx(3.0)
    assert found["h0_deg"] == pytest.approx(1.0)
    assert found["h1_deg"] == pytest.approx(3.0)


def test_equal_angles_differ_by_nothing_at_all(rng):
    angles = rng.normal(size=(20, 5))
    found = compare(bare(hand(angles)), bare(hand(angles.copy()))).figures()
    assert found["angles_max_deg"] == 0.0


def test_angles_are_compared_the_short_way_round():
    found = compare(
        bare(hand(np.radians([[179.0]]))), bare(hand(np.radians([[-179.0]])))
    )
    assert found.motions["right"].angles.mean == pytest.approx(np.radians(2.0))


def test_hinges_are_matched_by_name_and_strangers_are_named():
    old = Motion(names=("x", "y", "z"), angles=np.zeros((3, 3)))
    new = Motion(names=("z", "x", "w"), angles=np.tile([3.0, 1.0, 9.0], (3, 1)))
    found = compare(bare(old), bare(new))
    assert found.motions["right"].by_hinge["x"].mean == 1.0
    assert found.motions["right"].by_hinge["z"].mean == 3.0
    assert found.missing == ("y",)
    assert found.extra == ("w",)


def test_roots_differ_by_a_distance_and_an_angle():
    still = np.tile([1.0, 0, 0, 0], (3, 1))
    half = np.radians(5.0)
    turned = -np.tile([np.cos(half), 0, np.sin(half), 0], (3, 1))  # -q is q
    zero = np.zeros((3, 1))
    old = hand(zero, translation=np.zeros((3, 3)), rotation=still)
    new = hand(zero, translation=np.full((3, 3), [0.003, 0.004, 0]), rotation=turned)
    found = compare(bare(old), bare(new)).figures()
    assert found["root_translation_mean_mm"] == pytest.approx(5.0)
    assert found["root_rotation_max_deg"] == pytest.approx(10.0)


def test_only_the_first_frames_are_compared_when_asked():
    bad = paths()
    bad[5:] += 0.01
    all_of_it = compare(take(), take(bad)).labels
    first = compare(take(), take(bad), CompareConfig(frames=5))
    assert all_of_it.f1 == 0.5
    assert first.labels.f1 == 1.0
    assert first.frames == 5


def test_takes_of_different_length_are_compared_where_their_numbers_overlap():
    whole = paths(20)
    part = compare(take(whole, first_frame=1), take(whole[8:15], first_frame=9))
    assert part.frames == 7
    assert part.labels.f1 == 1.0
    assert "overlap" in texts(part.remarks)[0]


def test_takes_that_do_not_overlap_are_refused():
    with pytest.raises(HandcleanError, match="do not overlap"):
        compare(take(first_frame=1), take(first_frame=100))


def test_takes_of_different_rate_are_refused():
    with pytest.raises(HandcleanError, match="same rate"):
        compare(take(), replace(take(), rate=120.0))


def test_takes_with_nothing_in_common_are_refused():
    with pytest.raises(HandcleanError, match="share no marker and no motion"):
        compare(take(), take(labels=("x", "y", "z")))


def test_markers_only_one_take_has_are_named_and_not_judged():
    found = compare(take(), take(paths()[:, :2], labels=("a", "q")))
    assert found.missing == ("b", "c")
    assert found.extra == ("q",)
    assert (found.labels.labelled, found.labels.expected) == (10, 10)
    assert found.labels.f1 == 1.0


def test_unlabelled_points_change_nothing(rng):
    points = Points(
        frame=np.arange(5, dtype=np.int32),
        source=np.full(5, -1, dtype=np.int32),
        positions=rng.normal(size=(5, 3)),
    )
    assert compare(take(), take(unlabelled=points)).labels.f1 == 1.0


def test_motions_of_several_names_get_their_names_before_their_figures():
    old = {"left": hand(np.zeros((3, 1))), "right": hand(np.zeros((3, 1)))}
    new = {"left": hand(np.full((3, 1), 0.1)), "right": hand(np.full((3, 1), 0.3))}
    found = compare(take(paths(3), motions=old), take(paths(3), motions=new)).figures()
    assert found["left.angles_mean_deg"] == pytest.approx(np.degrees(0.1))
    assert found["right.angles_mean_deg"] == pytest.approx(np.degrees(0.3))
    assert found["angles_mean_deg"] == pytest.approx(np.degrees(0.2))


def test_spreads_are_those_of_numpy_and_leave_nan_out(rng):
    values = rng.normal(size=50)
    found = spread_of(np.append(values, np.nan))
    assert found.count == 50
    assert found.mean == pytest.approx(np.mean(np.abs(values)))
    assert found.deviation == pytest.approx(np.std(np.abs(values)))
    assert found.median == pytest.approx(np.median(np.abs(values)))
    assert found.p95 == pytest.approx(np.percentile(np.abs(values), 95))


def test_the_text_names_every_marker_and_hinge_once():
    motions = {"right": hand(np.zeros((10, 2)))}
    text = in_text(compare(take(motions=motions), take(motions=motions)))
    for word in (*LABELS, "h0", "h1", "F1 1.0000", "motion right"):
        assert word in text
    assert "nan" not in text
