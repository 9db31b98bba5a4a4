"""Labelling: right names, nothing lost, whatever the order, the room or the ghosts."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.errors import HandcleanError
from handclean.labels import track_take
from handclean.labels.checks.unit import unit_hint
from handclean.labels.label import label
from handclean.labels.points import cloud_of
from handclean.labels.search.align import search_frame
from handclean.labels.settings import LabelConfig
from handclean.recording import Origin, Points, Recording
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

SETTINGS = SimulateConfig(
    trials=1, seed=12, rate_hz=100.0, ghosts_per_s=2.0, impostors_per_s=0.4
)


@pytest.fixture(scope="module")
def trial():
    """A simulated grasp with gaps, ghosts and impostors."""
    return next(iter(simulate("grasp", SETTINGS)))


@pytest.fixture(scope="module")
def labelled(trial):
    return label(trial.unlabelled, trial.subject)[0]


def rows(points, order=None):
    """The same points in another order, columns told or not."""
    frame = points.frame[order]
    return replace(
        points,
        frame=frame,
        source=points.source[order],
        positions=points.positions[order],
        residual=None if points.residual is None else points.residual[order],
        cameras=None if points.cameras is None else points.cameras[order],
    )


def shuffled(points, rng):
    return rows(points, np.lexsort((rng.random(len(points.frame)), points.frame)))


def without_columns(recording, rng):
    points = shuffled(recording.unlabelled, rng)
    nowhere = np.full_like(points.source, -1)
    return replace(recording, unlabelled=replace(points, source=nowhere))


def scores(found, truth):
    """Precision and recall over measured samples."""
    right = found.measured & truth.measured
    right &= (found.positions == truth.positions).all(axis=2)
    return right.sum() / found.measured.sum(), right.sum() / truth.measured.sum()


def test_markers_get_their_names_and_ghosts_none(trial, labelled):
    precision, recall = scores(labelled.markers, trial.labelled.markers)
    assert precision > 0.999
    assert recall > 0.995


def test_without_columns_the_names_are_as_good(trial, rng):
    found = label(without_columns(trial.unlabelled, rng), trial.subject)[0]
    precision, recall = scores(found.markers, trial.labelled.markers)
    assert precision > 0.998
    assert recall > 0.99


def test_nothing_measured_is_changed_or_lost(trial, labelled):
    markers = labelled.markers
    named = markers.positions[markers.origin > Origin.MISSING]
    left = labelled.unlabelled.positions
    both = np.vstack([named, left])
    before = trial.unlabelled.unlabelled.positions
    assert len(both) == len(before)
    np.testing.assert_array_equal(
        both[np.lexsort(both.T)], before[np.lexsort(before.T)]
    )


def test_the_order_of_points_within_a_frame_does_not_matter(trial, labelled, rng):
    points = shuffled(trial.unlabelled.unlabelled, rng)
    again = label(replace(trial.unlabelled, unlabelled=points), trial.subject)[0]
    np.testing.assert_array_equal(again.markers.positions, labelled.markers.positions)


def test_labelling_twice_gives_the_same(trial, labelled):
    again = label(trial.unlabelled, trial.subject)[0]
    np.testing.assert_array_equal(again.markers.positions, labelled.markers.positions)
    np.testing.assert_array_equal(again.markers.confidence, labelled.markers.confidence)


def test_the_laboratory_may_stand_anywhere(trial, labelled, rng):
    turn, shift = Rotation.random(rng=rng), np.array([3.0, -2.0, 1.0])
    points = trial.unlabelled.unlabelled
    moved = replace(points, positions=turn.apply(points.positions) + shift)
    found = label(replace(trial.unlabelled, unlabelled=moved), trial.subject)[0]
    same = found.markers.measured == labelled.markers.measured
    assert same.mean() > 0.999


def test_confidence_is_a_share_and_given_to_labels_only(labelled):
    sure, has = labelled.markers.confidence, labelled.markers.measured
    assert (sure[has] > 0.0).all()
    assert (sure <= 1.0).all()
    assert not sure[~has].any()


def test_sources_name_the_points_the_labels_came_from(trial, labelled):
    points, markers = trial.unlabelled.unlabelled, labelled.markers
    known = {
        (int(f), int(s)): p
        for f, s, p in zip(points.frame, points.source, points.positions, strict=True)
    }
    for t, m in np.argwhere(markers.measured)[::97]:
        place = known[int(t), int(markers.source[t, m])]
        np.testing.assert_array_equal(markers.positions[t, m], place)


def test_a_take_without_the_hand_is_refused_in_one_line(trial, rng):
    points = Points(
        frame=np.repeat(np.arange(20), 3).astype(np.int32),
        source=np.tile(np.arange(3), 20).astype(np.int32),
        positions=rng.normal(size=(60, 3)),
    )
    take = Recording(rate=100.0, frames=20, unlabelled=points)
    with pytest.raises(HandcleanError, match="hand") as caught:
        label(take, trial.subject)
    assert "\n" not in str(caught.value)


def resized(subject, factor):
    """The same hand and markers, larger or smaller, as sure of itself as before."""
    tree = subject.model.tree
    tree = replace(tree, offsets=factor * tree.offsets, scale=factor * tree.scale)
    model = replace(subject.model, tree=tree, at=factor * subject.model.at)
    return replace(subject, model=model, calibrated=True)


@pytest.mark.filterwarnings("error")
def test_another_persons_subject_is_refused_after_few_searches(trial, monkeypatch):
    efforts = []

    def counted(*given):
        efforts.append(given[-1].kept)
        return search_frame(*given)

    monkeypatch.setattr(track_take, "search_frame", counted)
    with pytest.raises(HandcleanError, match=r"in none of its .* frames; is"):
        label(trial.unlabelled, resized(trial.subject, 1.5))
    tried = 2 * LabelConfig().start_frames
    further = (
        2 * np.log(trial.unlabelled.frames) / np.log(track_take.UNFOUND_STRIDE_FACTOR)
    )
    assert tried < len(efforts) <= tried + further + 2


@pytest.mark.parametrize("factor", [1e3, 1e2, 10.0, 0.1, 0.01, 1e-3])
def test_a_wrong_unit_is_told_by_the_size_of_the_points(trial, factor):
    points = trial.unlabelled.unlabelled
    points = replace(points, positions=factor * points.positions)
    cloud = cloud_of(replace(trial.unlabelled, unlabelled=points))
    hint = unit_hint(cloud, trial.subject.model)
    assert re.fullmatch(
        r"the points .* span .* m: is the unit right\? \(--unit\)", hint
    )


@pytest.mark.parametrize("factor", [0.6, 1.0, 1.6])
def test_hands_of_any_size_are_not_taken_for_another_unit(trial, factor):
    model = resized(trial.subject, factor).model
    assert unit_hint(cloud_of(trial.unlabelled), model) == ""


def test_a_take_in_another_unit_is_refused_with_both_sizes(trial):
    points = trial.unlabelled.unlabelled
    large = replace(points, positions=1e3 * points.positions)
    with pytest.raises(HandcleanError, match=r"hand's span 0\.\d+ m.*--unit"):
        label(replace(trial.unlabelled, unlabelled=large), trial.subject)


@pytest.mark.parametrize("frames", [1, 2, 4, 5])
def test_a_take_of_a_few_frames_is_labelled(trial, frames):
    points = trial.unlabelled.unlabelled
    cut = rows(points, np.flatnonzero(points.frame < frames))
    short = replace(trial.unlabelled, frames=frames, unlabelled=cut)
    found, figures = label(short, trial.subject)
    assert found.frames == frames
    assert figures.followed == frames


def test_repair_and_review_each_have_a_switch():
    """Many ghosts and dropouts: each pass changes what the other leaves."""
    hard = SimulateConfig(
        seed=0,
        rate_hz=60.0,
        duration_s=5.0,
        dropouts_per_s=1.0,
        ghosts_per_s=10.0,
        impostors_per_s=2.0,
    )
    take = next(iter(simulate("grasp", hard)))
    found = set()
    for repair in (True, False):
        for review in (True, False):
            settings = LabelConfig(repair=repair, review=review)
            labelled, _ = label(take.unlabelled, take.subject, settings=settings)
            found.add(labelled.markers.positions.tobytes())
    assert len(found) == 4
