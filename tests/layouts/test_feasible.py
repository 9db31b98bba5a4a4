"""Where markers may sit."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import HandcleanError, ShapeError, UnknownNameError
from handclean.hand.surface import BACK, vertex_normals
from handclean.hand.template import bone_frame, template
from handclean.hand.template_surface import template_surface
from handclean.layouts.feasible import counts, feasible
from handclean.layouts.settings import LayoutConfig


def test_by_the_papers_rule_normals_look_where_the_hands_back_does(surface, tree):
    rows = feasible(surface, tree, LayoutConfig(back="hand"))
    looks = vertex_normals(surface.vertices, surface.faces) @ BACK > 0.9
    rigid = surface.weights[:, 0] > 1.0 - 1e-6
    ahead = surface.vertices[:, 1] > 0.0  # of the wrist
    assert (looks & rigid & ~ahead).any()
    np.testing.assert_array_equal(rows, np.flatnonzero(looks & rigid & ahead))


def test_the_thumbs_own_back_counts_unless_told_otherwise(surface, tree):
    own, hands = (
        feasible(surface, tree, LayoutConfig(back=back)) for back in ("bone", "hand")
    )
    thumb = [
        tree.bone(f"thumb_{part}") for part in ("metacarpal", "proximal", "distal")
    ]
    on_thumb = [rows[np.isin(surface.bones[rows, 0], thumb)] for rows in (own, hands)]
    normals = vertex_normals(surface.vertices, surface.faces)
    nail = bone_frame("thumb_distal")[:, 2]
    assert len(on_thumb[0]) > 0
    assert (normals[on_thumb[0]] @ nail > 0.9).all()
    np.testing.assert_array_equal(
        np.setdiff1d(own, on_thumb[0]), np.setdiff1d(hands, on_thumb[1])
    )


def test_a_right_hand_has_the_mirror_images(surface, tree):
    right = template("right")
    mirrored = feasible(template_surface(right, coarse=True), right, LayoutConfig())
    np.testing.assert_array_equal(mirrored, feasible(surface, tree, LayoutConfig()))
    box = LayoutConfig(without_boxes_m=(0.0, 0.0, -1.0, 0.1, 0.1, 1.0))
    left = feasible(surface, tree, box)
    assert len(left) < len(mirrored)
    np.testing.assert_array_equal(
        feasible(template_surface(right, coarse=True), right, box), left
    )


def test_a_lower_threshold_only_adds(surface, tree):
    strict, loose = (
        feasible(surface, tree, LayoutConfig(normal=n)) for n in (0.95, 0.7)
    )
    assert set(strict) < set(loose)


def test_bones_boxes_and_masks_take_out(surface, tree):
    everything = feasible(surface, tree, LayoutConfig())
    no_palm = feasible(surface, tree, LayoutConfig(without_bones=("hand",)))
    assert (surface.bones[no_palm, 0] != 0).all()
    assert set(no_palm) == set(everything[surface.bones[everything, 0] != 0])
    two = (-1.0, -1.0, -1.0, 1.0, 0.05, 1.0, -1.0, 0.15, -1.0, 1.0, 1.0, 1.0)
    boxed = surface.vertices[feasible(surface, tree, LayoutConfig(without_boxes_m=two))]
    assert ((boxed[:, 1] > 0.05) & (boxed[:, 1] < 0.15)).all()
    mask = np.zeros(len(surface.vertices), dtype=bool)
    mask[everything[::3]] = True
    np.testing.assert_array_equal(
        feasible(surface, tree, LayoutConfig(), mask), everything[::3]
    )


def test_counts_add_up_and_name_bones_without_any(surface, tree):
    rows = feasible(surface, tree, LayoutConfig(without_bones=("ring_distal",)))
    found = counts(tree, surface.bones[rows, 0])
    assert sum(found.values()) == len(rows)
    assert found["ring_distal"] == 0
    assert tuple(found) == tree.bones


def test_too_few_vertices_are_refused_with_their_number(surface, tree):
    mask = np.zeros(len(surface.vertices), dtype=bool)
    mask[feasible(surface, tree, LayoutConfig())[:3]] = True
    with pytest.raises(HandcleanError, match="3 vertices are feasible for 6 markers"):
        feasible(surface, tree, LayoutConfig(), mask)


def test_what_does_not_exist_cannot_be_left_out(surface, tree):
    settings = replace(LayoutConfig(), without_bones=("thumb_tip",))
    with pytest.raises(UnknownNameError, match="thumb_tip"):
        feasible(surface, tree, settings)
    with pytest.raises(ShapeError, match="mask"):
        feasible(surface, tree, LayoutConfig(), np.ones(4, dtype=bool))
