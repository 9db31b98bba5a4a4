"""Two subjects: what differs is found, and what is nobody's measure is not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.report.subjects import compare_subjects


@pytest.fixture(scope="module")
def one():
    return template_subject(load_marker_set("maycock26"), "right")


def changed(subject, *, offsets=None, at=None, **parts):
    tree = subject.model.tree
    tree = replace(tree, **parts) if parts else tree
    tree = tree if offsets is None else replace(tree, offsets=offsets)
    at = subject.model.at if at is None else at
    return replace(subject, model=replace(subject.model, tree=tree, at=at))


def test_a_subject_differs_from_itself_in_nothing(one):
    figures = compare_subjects(one, one).figures()
    assert max(figures.values()) < 1e-3
    assert {"length_mean_mm", "joint_max_mm", "marker_max_mm"} <= set(figures)


def test_the_frame_of_the_root_does_not_count(one):
    tree, model = one.model.tree, one.model
    turn, shift = Rotation.from_rotvec([0.05, -0.1, 0.08]), np.array([3e-3, -5e-3, 0.0])
    offsets, axes, at = turn.apply(tree.offsets), turn.apply(tree.axes), None
    at = turn.apply(model.at)
    offsets[tree.parents == 0] += shift
    at[model.bone == 0] += shift
    moved = changed(one, offsets=offsets, axes=axes, at=at)
    found = compare_subjects(one, moved)
    assert max(found.markers.values()) < 1e-3
    assert max(found.joints.values()) < 1e-3


def test_a_longer_bone_and_a_marker_elsewhere_are_named(one):
    tree, model = one.model.tree, one.model
    offsets, at = tree.offsets.copy(), model.at.copy()
    b = tree.joints.index("index_pip")
    offsets[b] *= 1.0 + 0.003 / np.linalg.norm(offsets[b])
    m = int(np.flatnonzero(model.bone == 0)[0])
    at[m] += [0.0, 0.004, 0.0]
    found = compare_subjects(one, changed(one, offsets=offsets, at=at))
    figures = found.figures()
    assert figures["length.index_pip_mm"] == pytest.approx(3.0)
    assert figures["length_max_mm"] == pytest.approx(3.0)
    label = model.labels[m]
    assert max(found.markers, key=found.markers.get) == label
    assert figures[f"marker.{label}_mm"] == pytest.approx(4.0, abs=0.8)
    told = found.in_text().splitlines()
    assert any(line.split()[0] == "index_pip" and "+3.00" in line for line in told)


def test_hands_of_two_sides_are_not_compared(one):
    left = template_subject(load_marker_set("maycock26"), "left")
    with pytest.raises(HandcleanError, match=r"left.*right"):
        compare_subjects(one, left)
