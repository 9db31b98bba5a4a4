"""The shipped skin: a mesh a hand could have, on any hand of ours."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes import bent, crossings, edge_variation, fingers_of, inside, smallest_angles
from people import true_hand

from handclean.errors import UnknownNameError
from handclean.hand import template_surface as t
from handclean.hand.marker_set import load_marker_set
from handclean.hand.surface import (
    BACK,
    edges_of,
    is_closed,
    rest_joints,
    vertex_normals,
    volume,
)
from handclean.hand.template import FINGERS, distal_length, template
from handclean.tree import MIRROR, rigid_tree

LANDMARKS = Path(t.SHIPPED).with_name("template_landmarks.toml")
EITHER = pytest.mark.parametrize("coarse", [False, True], ids=["fine", "coarse"])
LONG = [f"{finger}_{part}" for finger in FINGERS[1:] for part in ("proximal", "middle")]


def calibrated(seed, side="left"):
    """A hand of another size whose joints and axes are no scaling of the template's."""
    rng = np.random.default_rng(seed)
    markers = load_marker_set("maycock26")
    return true_hand(rng, markers, side, rng.uniform(0.85, 1.15)).tree


@EITHER
def test_the_mesh_is_one_closed_body_without_handles(coarse):
    skin = t.template_surface(template("right"), coarse=coarse)
    assert is_closed(skin.faces)
    edges = edges_of(skin.faces)
    assert len(skin.vertices) - len(edges) + len(skin.faces) == 2
    reached, size = np.zeros(len(skin.vertices), dtype=bool), 0
    reached[0] = True
    while reached.sum() > size:
        size = reached.sum()
        reached[edges[reached[edges].any(axis=1)]] = True
    assert reached.all()


@pytest.mark.parametrize(
    ("coarse", "low", "high"), [(False, 11_000, 13_000), (True, 2_700, 3_300)]
)
def test_triangles_are_many_and_even(coarse, low, high):
    skin = t.template_surface(template("right"), coarse=coarse)
    assert low < len(skin.vertices) < high
    angles = smallest_angles(skin.vertices, skin.faces)
    assert angles.min() > 20.0
    assert np.median(angles) > 52.0
    assert edge_variation(skin.vertices, skin.faces) < 0.15


@pytest.mark.parametrize(
    ("size", "low", "high"),
    [((0.1938, 0.0904), 370.0, 470.0), ((0.1805, 0.0794), 260.0, 350.0)],
    ids=["men", "women"],
)
def test_volumes_are_those_of_hands(size, low, high):
    # 0.61 % of a man's 73 kg and 0.56 % of a woman's 62 kg (de Leva 1996) at 1.15 kg/l
    # are 387 and 301 ml, to which 25 mm of wrist add 40 to 50.
    skin = t.template_surface(template("right", *size))
    assert low < 1e6 * volume(skin.vertices, skin.faces) < high


@EITHER
def test_weights_are_shares_of_at_most_four_bones(coarse):
    skin = t.template_surface(template("left"), coarse=coarse)
    assert (skin.weights >= 0.0).all()
    np.testing.assert_allclose(skin.weights.sum(axis=1), 1.0, atol=1e-12)
    ends = edges_of(skin.faces)
    dense = np.zeros((len(skin.vertices), 16))
    np.add.at(dense, (np.arange(len(dense))[:, None], skin.bones), skin.weights)
    leap = np.abs(dense[ends[:, 0]] - dense[ends[:, 1]]).max(axis=1)
    length = np.linalg.norm(np.diff(skin.vertices[ends], axis=1)[:, 0], axis=1)
    assert (leap / length).max() < 350.0  # [1/m]: from 0 to 1 over 3 mm, in the webs
    assert np.quantile(leap / length, 0.98) < 130.0


def test_the_middle_third_of_every_segment_is_rigid():
    tree = template("left")
    skin = t.template_surface(tree)
    joints = rest_joints(tree)
    for name in LONG:
        b = tree.bone(name)
        own = (skin.bones == b) & (skin.weights > 0.0)
        share = (skin.vertices[:, 1] - joints[b, 1]) / tree.offsets[b + 1, 1]
        # The webs reach into the third of the first phalanx, at its sides only.
        aside = np.abs(skin.vertices[:, 0] - joints[b, 0])
        middle = own.any(axis=1) & (share > 0.33) & (share < 0.67)
        middle &= (aside < 0.0025) | ("middle" in name.split("_")[1:])
        assert middle.sum() > 30, name
        assert (skin.weights[middle, 0] == 1.0).all(), name


def test_every_bone_has_skin_of_its_own_alone():
    tree = template("left")
    skin = t.template_surface(tree)
    for b, name in enumerate(tree.bones):
        alone = (skin.bones[:, 0] == b) & (skin.weights[:, 0] == 1.0)
        assert alone.sum() > 60, name


def test_most_of_back_and_palm_is_the_hands_alone():
    tree = template("left")
    skin = t.template_surface(tree)
    x, y, z = skin.vertices.T
    for side in (z > 0.004, z < -0.010):
        there = side & (y > 0.0) & (y < 0.06) & (x < 0.01)
        alone = (skin.bones[there, 0] == 0) & (skin.weights[there, 0] == 1.0)
        assert alone.mean() > 0.8


def test_fingers_share_skin_only_in_the_webs():
    tree = template("left")
    skin = t.template_surface(tree)
    finger = fingers_of(tree)[skin.bones]
    ring, little = tree.bone("ring_proximal"), tree.bone("little_proximal")
    several = np.zeros(len(skin.vertices), dtype=bool)
    for one in range(1, 6):
        for other in range(one + 1, 6):
            pair = [
                ((finger == n) & (skin.weights > 0.0)).any(axis=1) for n in (one, other)
            ]
            both = pair[0] & pair[1]
            assert other == one + 1 or not both.any()
            several |= both
    joints = rest_joints(tree)
    assert several.any()
    reach = joints[[ring, little], 1].mean() + 0.035
    assert skin.vertices[several, 1].max() < max(reach, joints[:, 1].max())
    tips = np.isin(
        skin.bones[several], [b for b, n in enumerate(tree.bones) if "distal" in n]
    )
    assert skin.weights[several][tips].max(initial=0.0) == 0.0


@given(st.floats(0.7, 1.3))
def test_a_scaled_tree_has_a_scaled_skin(scale):
    tree = template("left")
    larger = replace(tree, offsets=scale * tree.offsets, scale=scale)
    expected = scale * t.template_surface(tree, coarse=True).vertices
    vertices = t.template_surface(larger, coarse=True).vertices
    np.testing.assert_allclose(vertices, expected, atol=1e-12)


def test_length_and_breadth_stretch_the_skin_along_and_across():
    tree = template("left")
    skin = t.template_surface(tree)
    longer = t.template_surface(template("left", 1.1 * 0.1872))
    broader = t.template_surface(template("left", breadth_m=1.1 * 0.0849))
    own = np.ptp(skin.vertices, axis=0)
    assert np.ptp(longer.vertices[:, 1]) / own[1] == pytest.approx(1.1, abs=0.01)
    fingers = skin.bones[:, 0] > 3  # the thumb is neither along nor across
    grown = np.ptp(broader.vertices[fingers, 0]) / np.ptp(skin.vertices[fingers, 0])
    assert grown == pytest.approx(1.1, abs=0.01)


@pytest.mark.parametrize("finger", FINGERS)
def test_fingers_end_where_their_last_segment_does(finger):
    for tree in (template("left"), template("left", 0.2, 0.08), calibrated(3)):
        for tips in (None, {finger: 0.025}):
            skin = t.template_surface(tree, tips=tips)
            b = tree.bone(f"{finger}_distal")
            tip = skin.vertices[t.landmarks(tree)[f"{finger}_tip"]]
            length = (tips or {}).get(finger, distal_length(tree, finger))
            gap = np.linalg.norm(tip - rest_joints(tree)[b])
            assert gap == pytest.approx(length, abs=0.0015)


@given(st.integers(0, 1000))
def test_joints_lie_inside_and_no_face_turns_over_on_calibrated_hands(seed):
    tree = calibrated(seed)
    skin = t.template_surface(tree, coarse=True)
    start = t.template_surface(template("left"), coarse=True)
    joints = rest_joints(tree)[[b for b, n in enumerate(tree.bones) if n != "forearm"]]
    assert inside(skin.vertices, skin.faces, joints).all()
    before = vertex_normals(start.vertices, start.faces)
    after = vertex_normals(skin.vertices, skin.faces)
    assert ((before * after).sum(axis=1) > 0.5).mean() > 0.98


def test_the_joints_of_a_hand_lie_in_the_middle_of_its_flesh():
    tree = template("left")
    skin = t.template_surface(tree)
    gap = np.linalg.norm(skin.vertices[:, None] - rest_joints(tree), axis=2).min(axis=0)
    assert gap.min() > 0.005
    assert inside(skin.vertices, skin.faces, rest_joints(tree)).all()


def test_fingers_do_not_cross_each_other_in_the_zero_posture():
    tree = template("left")
    skin = t.template_surface(tree)
    assert crossings(tree, skin, skin.vertices) == 0


def test_the_right_hand_is_the_mirror_image_of_the_left():
    left = t.template_surface(calibrated(5))
    right = t.template_surface(calibrated(5).mirrored())
    np.testing.assert_array_equal(right.vertices, left.vertices * MIRROR)
    assert volume(right.vertices, right.faces) > 0.0
    assert volume(right.vertices, right.faces) == pytest.approx(
        volume(left.vertices, left.faces)
    )


def test_a_forearm_changes_nothing_but_the_tree():
    plain = t.template_surface(template("right"))
    more = t.template_surface(template("right", forearm=True))
    np.testing.assert_array_equal(plain.vertices, more.vertices)
    np.testing.assert_array_equal(plain.bones, more.bones)


def test_plump_hands_are_thicker_and_as_long():
    tree = template("left")
    plain, plump = (t.template_surface(tree, plump=by) for by in (1.0, 1.1))
    sizes = [np.ptp(skin.vertices, axis=0) for skin in (plain, plump)]
    assert 1.06 < sizes[1][2] / sizes[0][2] < 1.11  # the joints stay where they are
    assert sizes[1][1] == pytest.approx(sizes[0][1], abs=0.001)


def test_knuckles_and_nails_look_out_of_the_back():
    tree = template("left")
    skin = t.template_surface(tree)
    normals = vertex_normals(skin.vertices, skin.faces)
    for name, vertex in t.landmarks(tree).items():
        if name.endswith(("_pip", "_knuckle")) and not name.startswith("thumb"):
            assert normals[vertex] @ BACK > 0.9, name
    nails = t.shipped_skin().nails & (skin.bones[:, 0] > tree.bone("thumb_distal"))
    assert (normals[nails] @ BACK).min() > 0.1
    assert (normals[nails] @ BACK).mean() > 0.8


def test_landmarks_are_twenty_spread_over_back_and_palm():
    tree = template("right")
    skin = t.template_surface(tree)
    marks = t.landmarks(tree)
    assert len(marks) == len(set(marks.values())) == 20
    for name, vertex in marks.items():
        bones = {tree.bones[b] for b in skin.bones[vertex][skin.weights[vertex] > 0.0]}
        if name.endswith("_tip"):
            assert bones == {f"{name.split('_')[0]}_distal"}
        elif name.startswith("wrist"):
            assert "hand" in bones
        elif not name.endswith("_web"):
            assert any(bone.startswith(name.split("_")[0]) for bone in bones), name


def test_the_shipped_landmarks_are_those_vertices_in_millimetres():
    shipped = tomllib.loads(LANDMARKS.read_text())
    tree = template("right")
    vertices = t.template_surface(tree).vertices
    marks = t.landmarks(tree)
    assert shipped.keys() == marks.keys()
    for name, vertex in marks.items():
        np.testing.assert_allclose(shipped[name], 1e3 * vertices[vertex], atol=0.006)


@EITHER
@pytest.mark.parametrize("part", ["mcp", "pip", "dip"])
def test_right_angles_keep_the_flesh_and_do_not_turn_the_back_inside_out(part, coarse):
    tree = template("left")
    kept, over = bent(tree, t.template_surface(tree, coarse=coarse), part)
    assert kept.min() > 0.65
    assert over == 0


def test_a_tree_without_fingers_is_refused():
    rod = rigid_tree()
    with pytest.raises(UnknownNameError, match="hand"):
        t.template_surface(rod)
