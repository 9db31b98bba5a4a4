"""A skinned hand of another program becomes ours, whatever pose it was drawn in."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from handclean.errors import FileError, HandcleanError, UnknownNameError, UsageError
from handclean.hand.skinning import bone_transforms, posed
from handclean.hand.surface import is_closed, rest_joints, volume
from handclean.hand.template import FINGERS, bone_frame, distal_length, template
from handclean.hand.template_surface import template_surface
from handclean.io.gltf.hand import hand_of, import_hand
from handclean.io.gltf.read import Glb, read_glb
from handclean.io.gltf.skin import SkinnedMesh, skinned_mesh
from handclean.io.gltf.skinned_map import load_skinned_map, of_hands
from handclean.io.gltf.write import write_hand
from handclean.io.shared.joint_map import SHIPPED, shipped
from handclean.tree import MIRROR


@pytest.fixture
def nameless(tmp_path):
    return Glb(tmp_path / "drawn.glb", {}, b"")


def standing(tree, pose):
    """(B, 3, 3), (B, 3) frames of the bones in a pose."""
    turn, shift = (part[0] for part in bone_transforms(tree, pose[None]))
    return turn, shift + np.einsum("bij,bj->bi", turn, rest_joints(tree))


def drawn(side, rng, spread=0.25):
    """A hand of odd proportions in some pose, lying anywhere, as a rig would have it.

    Returns
    -------
    mesh, tree, pose, surface
    """
    tree = template(side)
    lengths = rng.uniform(0.9, 1.1, len(tree.bones))[:, None]
    outer = tree.parents > 0
    offsets = np.where(outer[:, None], lengths * tree.offsets, tree.offsets)
    tree = replace(tree, offsets=offsets)
    surface = template_surface(tree, coarse=True)
    pose = np.zeros(7 + len(tree.hinges))
    pose[3] = 1.0
    pose[7:] = rng.uniform(0.05, spread, len(tree.hinges))
    vertices = posed(surface, tree, pose[None])[0]
    turn, origin = standing(tree, pose)
    away, shift = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    places = {}
    for b, joint in enumerate(tree.joints):
        places[joint] = np.eye(4)
        places[joint][:3, :3], places[joint][:3, 3] = away @ turn[b], away @ origin[b]
    for finger in FINGERS:
        b = tree.bone(f"{finger}_distal")
        along = bone_frame(finger)[:, 1] * (MIRROR if side == "right" else 1.0)
        tip = origin[b] + distal_length(tree, finger) * (turn[b] @ along)
        places[f"{finger}_tip"] = np.eye(4)
        places[f"{finger}_tip"][:3, 3] = away @ tip
    for place in places.values():
        place[:3, 3] += shift
    mesh = SkinnedMesh(
        vertices=vertices @ away.T + shift,
        faces=surface.faces,
        joints=surface.bones,
        weights=surface.weights,
        names=tree.joints,
        places=places,
        up=dict.fromkeys(places, ""),
        colors=None,
    )
    return mesh, tree, pose, surface


@pytest.mark.parametrize("exact", [True, False])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_bent_hand_anywhere_is_found_straight_in_its_frame(
    rng, nameless, side, exact
):
    mesh, tree, pose, surface = drawn(side, rng)
    joint_map = load_skinned_map("handclean")
    joint_map = replace(joint_map, bones=replace(joint_map.bones, exact=exact))
    found = hand_of(nameless, mesh, joint_map)
    ours = found.subject.model.tree
    assert ours.side == side
    assert ours.hinges == tree.hinges
    np.testing.assert_allclose(ours.offsets, tree.offsets, atol=1e-9)
    np.testing.assert_allclose(ours.axes, tree.axes, atol=1e-9)
    np.testing.assert_allclose(found.bind[7:], pose[7:], atol=1e-9)
    assert found.missed < 1e-9
    back = posed(found.subject.surface, ours, found.bind[None])[0]
    inside = (mesh.vertices - found.frame[:3, 3]) @ found.frame[:3, :3]
    _, first = np.unique(inside, axis=0, return_index=True)
    np.testing.assert_allclose(back, inside[first], atol=1e-9)
    np.testing.assert_allclose(
        found.subject.surface.vertices, surface.vertices[first], atol=1e-9
    )
    assert ours.scale == pytest.approx(tree.scale, rel=0.1)


@pytest.mark.parametrize("tips", [True, False])
@pytest.mark.parametrize("head", ["", "mixamorig:"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_names_of_humanik_and_mixamo_say_which_hand_it_is(
    rng, nameless, side, head, tips
):
    mesh, tree, _, _ = drawn(side, rng)
    humanik, ours = load_skinned_map("humanik"), load_skinned_map("handclean")
    word = head + side.capitalize()
    names = {
        joint: humanik.bones.bones[bone].replace("{side}", word)
        for bone, joint in ours.bones.bones.items()
    }
    for finger, joint in ours.tips.items():
        names[joint] = humanik.tips[finger].replace("{side}", word)
    places = {
        names[joint]: place
        for joint, place in mesh.places.items()
        if tips or not joint.endswith("_tip")
    }
    mesh = replace(
        mesh,
        names=tuple(names[joint] for joint in mesh.names),
        places=places,
        up=dict.fromkeys(places, ""),
    )
    [joint_map] = of_hands(humanik, set(places))
    assert len(joint_map.tips) == (5 if tips else 0)
    found = hand_of(nameless, mesh, joint_map).subject.model.tree
    assert found.side == side
    np.testing.assert_allclose(found.offsets[1:9], tree.offsets[1:9], atol=2e-3)


def test_a_file_with_two_hands_of_such_names_has_a_map_for_each():
    humanik = load_skinned_map("humanik")
    names = {
        joint.replace("{side}", side)
        for side in ("Left", "Right")
        for joint in humanik.bones.bones.values()
    }
    assert {one.bones.side for one in of_hands(humanik, names)} == {"left", "right"}
    assert of_hands(humanik, names - {"LeftHand", "RightHandRing2"}) == []


def test_an_axis_of_flexion_is_taken_from_the_rig_or_from_the_bend(rng, nameless):
    mesh, tree, _, surface = drawn("left", rng)
    outer = [h for h in tree.hinges if h.endswith(("pip_flexion", "dip_flexion"))]
    rows = [tree.hinges.index(hinge) for hinge in outer]
    rolled = Rotation.from_rotvec([0.0, np.radians(20.0), 0.0]).as_matrix()
    axes, pose = tree.axes.copy(), np.eye(1, 7 + len(tree.hinges), 3)[0]
    axes[rows] = axes[rows] @ rolled.T
    tree = replace(tree, axes=axes)
    pose[[7 + row for row in rows]] = 0.6
    turn, origin = standing(tree, pose)
    places = {name: place.copy() for name, place in mesh.places.items()}
    for b, joint in enumerate(tree.joints):
        places[joint][:3, :3], places[joint][:3, 3] = turn[b], origin[b]
        if b:  # as many rigs have it: x is what the joint flexes about
            x = axes[np.flatnonzero(tree.hinge_bone == b)[-1]]
            y = bone_frame(tree.bones[b])[:, 1]
            places[joint][:3, :3] = turn[b] @ np.column_stack([x, y, np.cross(x, y)])
    for finger in FINGERS:
        b = tree.bone(f"{finger}_distal")
        along = turn[b] @ bone_frame(finger)[:, 1]
        places[f"{finger}_tip"][:3, 3] = origin[b] + 0.02 * along
    vertices = posed(surface, tree, pose[None])[0]
    mesh = replace(mesh, places=places, vertices=vertices)
    plain = load_skinned_map("handclean")

    said = hand_of(nameless, mesh, replace(plain, flexion=np.array([1.0, 0.0, 0.0])))
    np.testing.assert_allclose(said.subject.model.tree.axes, axes, atol=1e-9)
    np.testing.assert_allclose(said.bind[7:], pose[7:], atol=1e-9)
    assert said.missed < 1e-9

    seen = hand_of(nameless, mesh, plain)
    cosine = np.sum(seen.subject.model.tree.axes[rows] * axes[rows], axis=1)
    assert np.degrees(np.arccos(cosine)).max() < 7.0  # the template's draws a little
    assert np.degrees(seen.missed) < 4.0
    for wrong in ([0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]):
        with pytest.raises(FileError, match="flexion is askew"):
            hand_of(nameless, mesh, replace(plain, flexion=np.array(wrong)))


def test_weights_of_merged_joints_add_up_and_four_bones_stay(rng, nameless):
    mesh, tree, _, _ = drawn("right", rng)
    odd = rng.random(len(mesh.joints)) < 0.5
    joints, weights = mesh.joints.copy(), mesh.weights.copy()
    joints[odd] = rng.integers(0, len(tree.bones), (odd.sum(), 4))
    weights[odd] = rng.dirichlet(np.ones(4), odd.sum())
    mesh = replace(mesh, joints=joints, weights=weights)
    plain = load_skinned_map("handclean")
    names = (*mesh.names, "index_metacarpal", "index_nail")
    joints = np.column_stack([mesh.joints, np.full((len(mesh.joints), 2), 0)])
    joints[:, 4], joints[:, 5] = len(names) - 2, len(names) - 1
    weights = np.column_stack([0.5 * mesh.weights, np.full((len(joints), 2), 0.25)])
    places = {
        **mesh.places,
        "index_metacarpal": mesh.places["wrist"],
        "index_nail": mesh.places["index_dip"],
    }
    up = {**mesh.up, "index_metacarpal": "", "index_nail": "index_dip"}
    rig = replace(
        mesh, names=names, joints=joints, weights=weights, places=places, up=up
    )
    with pytest.raises(FileError, match="'index_metacarpal' moves vertices"):
        hand_of(nameless, rig, plain)
    merged = replace(plain, merged={"hand": ("index_metacarpal",)})
    found = hand_of(nameless, rig, merged).subject.surface
    dense = np.zeros((len(joints), len(tree.bones)))
    np.add.at(dense, (np.arange(len(joints))[:, None], mesh.joints), weights[:, :4])
    dense[:, 0] += 0.25
    dense[:, tree.bone("index_distal")] += 0.25
    inside = hand_of(nameless, mesh, plain).frame
    at = (mesh.vertices - inside[:3, 3]) @ inside[:3, :3]
    _, first = np.unique(at, axis=0, return_index=True)
    again = np.zeros((len(first), len(tree.bones)))
    np.add.at(again, (np.arange(len(first))[:, None], found.bones), found.weights)
    few = (dense[first] > 0.0).sum(axis=1) <= 4
    assert few.any()
    assert not few.all()
    np.testing.assert_allclose(again[few], dense[first][few], atol=1e-12)
    assert (np.diff(found.weights, axis=1) <= 0.0).all()
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-12)


def test_a_rig_without_tips_is_read(rng, nameless):
    mesh, tree, pose, _ = drawn("left", rng)
    blunt = replace(load_skinned_map("handclean"), tips={})
    found = hand_of(nameless, mesh, blunt)
    ours = found.subject.model.tree
    np.testing.assert_allclose(ours.offsets, tree.offsets, atol=1e-9)
    assert ours.scale == pytest.approx(tree.scale, rel=0.1)
    assert np.degrees(np.abs(found.bind[7:] - pose[7:])).max() < 15.0


def test_what_cannot_be_a_hand_is_refused(rng, nameless):
    mesh, _, _, _ = drawn("right", rng)
    plain = load_skinned_map("handclean")
    lost = {k: v for k, v in mesh.places.items() if k != "ring_pip"}
    with pytest.raises(UnknownNameError, match="no joint is called 'ring_pip'"):
        hand_of(nameless, replace(mesh, places=lost), plain)
    huge = {k: v.copy() for k, v in mesh.places.items()}
    for place in huge.values():
        place[:3, 3] *= 100.0
    with pytest.raises(FileError, match=r"the hand is 1\d\.\d+ m long"):
        hand_of(
            nameless, replace(mesh, places=huge, vertices=100.0 * mesh.vertices), plain
        )
    turned = replace(mesh, faces=mesh.faces[:, ::-1])
    with pytest.raises(FileError, match="faces look inwards"):
        hand_of(nameless, turned, plain)
    sideways = replace(plain.bones, back=np.array([1.0, 0.0, 0.0]))
    with pytest.raises(FileError, match="back is askew"):
        hand_of(nameless, mesh, replace(plain, bones=sideways))
    stuck = {**mesh.places, "ring_tip": mesh.places["ring_dip"]}
    with pytest.raises(FileError, match="two joints of the ring are in one place"):
        hand_of(nameless, replace(mesh, places=stuck), plain)


@pytest.mark.parametrize("side", ["left", "right"])
def test_what_we_write_comes_back(tmp_path, side):
    tree = template(side, 0.2, 0.08)
    surface = template_surface(tree, coarse=True)
    colors = np.arange(3 * len(surface.vertices)).reshape(-1, 3) % 256
    surface = replace(surface, colors=colors.astype(np.uint8))
    write_hand(tmp_path / "m.glb", tree, surface)
    found = import_hand(read_glb(tmp_path / "m.glb"), load_skinned_map("handclean"))
    ours = found.subject.model.tree
    assert (ours.side, ours.subject) == (side, "m")
    np.testing.assert_allclose(ours.offsets, tree.offsets, atol=1e-6)
    np.testing.assert_allclose(ours.axes, tree.axes, atol=1e-4)
    assert ours.scale == pytest.approx(tree.scale, rel=1e-4)
    np.testing.assert_allclose(found.bind[7:], 0.0, atol=1e-4)
    back = found.subject.surface
    away, row = cKDTree(surface.vertices).query(back.vertices)
    assert away.max() < 2e-6
    np.testing.assert_array_equal(np.sort(row), np.arange(len(surface.vertices)))
    np.testing.assert_array_equal(back.colors, surface.colors[row])


@pytest.mark.data
@pytest.mark.parametrize("flexion", ["the rig's", "the bend's"])
def test_the_webxr_hands_become_a_pair_of_ours(shared_data, flexion):
    joint_map = load_skinned_map("webxr")
    if flexion == "the bend's":
        joint_map = replace(joint_map, flexion=None)
    hands = {}
    for side in ("left", "right"):
        glb = read_glb(shared_data / "webxr_hand" / f"{side}.glb")
        found = import_hand(glb, joint_map)
        tree, surface = found.subject.model.tree, found.subject.surface
        assert tree.side == side
        assert len(surface.vertices) == 1159  # of 1360: seams of the texture are closed
        assert is_closed(surface.faces)
        assert 250e-6 < volume(surface.vertices, surface.faces) < 450e-6
        low, high = tree.limits.T
        assert ((low <= found.bind[7:]) & (found.bind[7:] <= high)).all()
        assert np.degrees(found.missed) < 10.0
        mesh = skinned_mesh(glb)
        inside = (mesh.vertices - found.frame[:3, 3]) @ found.frame[:3, :3]
        _, first = np.unique(inside, axis=0, return_index=True)
        back = posed(surface, tree, found.bind[None])[0]
        away = np.linalg.norm(back - inside[first], axis=1)
        assert away.mean() < 1e-3
        assert away.max() < 7e-3  # what our hinges miss of a slightly skew finger
        hands[side] = tree
    ours, theirs = hands["left"], hands["right"].mirrored()
    np.testing.assert_allclose(ours.offsets, theirs.offsets, atol=4e-3)
    np.testing.assert_allclose(ours.axes, theirs.axes, atol=0.02)


@pytest.mark.data
def test_fingers_of_the_webxr_hand_are_straight_and_parallel(shared_data):
    glb = read_glb(shared_data / "webxr_hand" / "right.glb")
    subject = import_hand(glb, load_skinned_map("webxr")).subject
    tree, surface = subject.model.tree, subject.surface
    joints = rest_joints(tree)
    for finger in FINGERS[1:]:
        for segment in ("proximal", "middle", "distal"):
            b = tree.bone(f"{finger}_{segment}")
            own = (surface.bones[:, 0] == b) & (surface.weights[:, 0] > 0.9)
            middle = surface.vertices[own].mean(axis=0) - joints[b]
            assert abs(middle[0]) < 4e-3
            assert middle[1] > 2e-3


def test_every_shipped_map_is_read_and_wrong_ones_are_told(tmp_path):
    assert "webxr" in [joint_map.name for joint_map in shipped()]
    with pytest.raises(
        UsageError, match="shipped: handclean, humanik, manipnet, webxr"
    ):
        load_skinned_map("webx")
    with pytest.raises(FileError, match="left_handed"):
        load_skinned_map("manipnet")
    text = (SHIPPED / "webxr.toml").read_text()
    for old, new, message in (
        ('ring_middle = "ring', '# "', "bone ring_middle is not mapped"),
        ("ring_middle =", "ring_midle =", "did you mean ring_middle"),
        ("flexion = [-1.0, 0.0, 0.0]", "flexion = [0.0, 0.0, 0.0]", "give an axis"),
        ("flexion =", "flecion =", "did you mean flexion"),
        ('thumb = "thumb-tip"', "thumb = 3", r"\[tips\]: thumb is 3"),
        ('thumb = "thumb-tip"', 'tumb = "thumb-tip"', "did you mean thumb"),
        ('thumb_distal = ["thumb-tip"]', 'thumb_distal = "x"', "list of joints"),
    ):
        path = tmp_path / "m.toml"
        path.write_text(text.replace(old, new, 1))
        assert path.read_text() != text
        with pytest.raises(HandcleanError, match=message) as raised:
            load_skinned_map(str(path))
        assert "\n" not in str(raised.value)
