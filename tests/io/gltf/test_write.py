"""What we write as glTF is what an independent reader sees."""

from dataclasses import replace

import numpy as np
import pytest
from gltf_oracle import Scene, numbers
from told import texts

from handclean.errors import FileError, UnknownNameError
from handclean.hand.marker_set import MarkerSet
from handclean.hand.skeleton import rigid_subject
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.io import files
from handclean.io.gltf.skinned import bone_quaternions
from handclean.io.gltf.write import write_glb, write_hand
from handclean.recording import Motion, Recording, motion_from_poses

FRAMES, RATE = 40, 100.0


def blocks(tree, rng, colored=False):
    """A skin of a tetrahedron around every joint, each moved by several bones."""
    corners = 0.008 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    joints = rest_joints(tree)
    count = 4 * len(joints)
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    weights = -np.sort(-rng.dirichlet(np.ones(4), size=count), axis=1)
    weights[::3] = [1.0, 0.0, 0.0, 0.0]
    bones = np.argsort(rng.random((count, len(joints))), axis=1)[:, :4]
    colors = rng.integers(0, 256, (count, 3)).astype(np.uint8)
    return Surface(
        vertices=(joints[:, None] + corners).reshape(-1, 3),
        faces=(4 * np.arange(len(joints))[:, None, None] + faces).reshape(-1, 3),
        bones=bones.astype(np.int64),
        weights=weights,
        colors=colors if colored else None,
    )


def wandering(tree, rng, frames=FRAMES):
    """Poses that turn right round, so that quaternions would change their sign."""
    poses = np.zeros((frames, 7 + len(tree.hinges)))
    poses[:, :3] = rng.normal(size=3) + np.cumsum(rng.normal(size=(frames, 3)), 0) / 99
    angle = np.linspace(0.0, 7.0, frames) / 2
    axis = np.array([0.48, 0.6, 0.64])
    poses[:, 3], poses[:, 4:7] = np.cos(angle), np.sin(angle)[:, None] * axis
    poses[::7, 3:7] *= -1.0
    poses[:, 7:] = rng.uniform(*tree.limits.T, (frames, len(tree.hinges)))
    return poses


def take(rng, *, up_axis="+z", sides=("right", "left")):
    trees = {side: template(side, forearm=side == "left") for side in sides}
    poses = {side: wandering(tree, rng) for side, tree in trees.items()}
    motions = {
        side: motion_from_poses(trees[side].hinges, poses[side]) for side in sides
    }
    recording = Recording(
        rate=RATE, frames=FRAMES, up_axis=up_axis, skeletons=trees, motions=motions
    )
    surfaces = {side: blocks(tree, rng, side == "left") for side, tree in trees.items()}
    return recording, surfaces, poses


UP = {  # rows: where the laboratory's x, y and z end up
    "+x": np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]),
    "-x": np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "+y": np.eye(3),
    "-y": np.diag([1, -1, -1]),
    "+z": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "-z": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
}


@pytest.mark.parametrize("up_axis", sorted(UP))
def test_an_independent_reader_sees_our_skinning_at_three_frames(
    tmp_path, rng, up_axis
):
    recording, surfaces, poses = take(rng, up_axis=up_axis)
    path = tmp_path / "m.glb"
    assert write_glb(path, recording, surfaces=surfaces) == ()
    scene = Scene(path)
    assert [node.name for node in scene.skinned] == ["right_skin", "left_skin"]
    for node, side in zip(scene.skinned, ("right", "left"), strict=True):
        tree = recording.skeletons[side]
        places = posed(surfaces[side], tree, poses[side])
        for frame in (0, 17, FRAMES - 1):
            found = scene.vertices(node, frame / RATE)
            np.testing.assert_allclose(found, places[frame] @ UP[up_axis], atol=1e-6)


def test_the_template_s_skin_is_seen_as_we_pose_it(tmp_path, rng):
    recording, _, poses = take(rng, up_axis="+y", sides=("right",))
    write_glb(tmp_path / "m.glb", recording)
    scene = Scene(tmp_path / "m.glb")
    tree = recording.skeletons["right"]
    places = posed(template_surface(tree), tree, poses["right"][[3, 20, 33]])
    for place, frame in zip(places, (3, 20, 33), strict=True):
        found = scene.vertices(scene.skinned[0], frame / RATE)
        np.testing.assert_allclose(found, place, atol=1e-5)


def test_quaternions_keep_their_sign_and_length(rng):
    tree = template("right")
    turns = bone_quaternions(tree, wandering(tree, rng, 400))
    np.testing.assert_allclose(np.linalg.norm(turns, axis=2), 1.0, atol=1e-12)
    assert (np.sum(turns[0, 1:] * turns[0, :-1], axis=1) > 0.0).all()


def test_a_missing_frame_holds_the_last_pose_and_is_told(tmp_path, rng):
    recording, surfaces, poses = take(rng, sides=("right",))
    broken = poses["right"].copy()
    broken[:2], broken[10:15] = np.nan, np.nan
    motion = motion_from_poses(recording.skeletons["right"].hinges, broken)
    recording = replace(recording, motions={"right": motion})
    notes = texts(write_glb(tmp_path / "m.glb", recording, surfaces=surfaces))
    assert notes == ("7 frames without a pose of 'right' hold the last one",)
    scene = Scene(tmp_path / "m.glb")
    node = scene.skinned[0]
    for held, known in ((0, 2), (12, 9)):
        one, two = scene.vertices(node, held / RATE), scene.vertices(node, known / RATE)
        np.testing.assert_array_equal(one, two)


def test_angles_are_found_by_name(tmp_path, rng):
    recording, surfaces, poses = take(rng, sides=("right",))
    hinges = recording.skeletons["right"].hinges
    motion = Motion(
        names=hinges[::-1],
        angles=poses["right"][:, :6:-1],
        translation=poses["right"][:, :3],
        rotation=poses["right"][:, 3:7],
    )
    write_glb(tmp_path / "a.glb", recording, surfaces=surfaces)
    turned = replace(recording, motions={"right": motion})
    write_glb(tmp_path / "b.glb", turned, surfaces=surfaces)
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    short = replace(motion, names=("x", *motion.names[1:]))
    with pytest.raises(UnknownNameError, match="joint angle"):
        write_glb(tmp_path / "c.glb", replace(recording, motions={"right": short}))


def test_a_thing_without_a_skin_is_written_as_bones(tmp_path, rng):
    cup = rigid_subject(
        MarkerSet(
            name="cup",
            side="",
            source="",
            kind="rigid",
            labels=("a",),
            bones=("root",),
            at=np.zeros((1, 3)),
        )
    ).model.tree
    poses = wandering(cup, rng)
    recording = Recording(
        rate=RATE,
        frames=FRAMES,
        skeletons={"cup": cup},
        motions={"cup": motion_from_poses((), poses)},
    )
    notes = texts(write_glb(tmp_path / "m.glb", recording))
    assert notes == (
        "'cup' has no surface: its bones alone are written",
        "the take does not say which way is up: z is taken",
    )
    assert Scene(tmp_path / "m.glb").gltf.nodes[1].name == "root"


def test_a_take_without_motion_is_refused(tmp_path, rng):
    recording, _, poses = take(rng, sides=("right",))
    with pytest.raises(FileError, match="no joint angles; solve it first"):
        write_glb(tmp_path / "m.glb", replace(recording, motions={}))
    with pytest.raises(FileError, match=r"has no joint tree.*solve"):
        write_glb(tmp_path / "m.glb", replace(recording, skeletons={}))
    motion = motion_from_poses(
        recording.skeletons["right"].hinges, np.full_like(poses["right"], np.nan)
    )
    with pytest.raises(FileError, match="all missing"):
        write_glb(tmp_path / "m.glb", replace(recording, motions={"right": motion}))
    assert not (tmp_path / "m.glb").exists()


def test_the_file_keeps_the_rules_of_the_format(tmp_path, rng):
    recording, surfaces, _ = take(rng)
    path = tmp_path / "m.glb"
    write_glb(path, recording, surfaces=surfaces)
    assert path.stat().st_size % 4 == 0
    gltf = Scene(path).gltf
    used = set()
    for mesh in gltf.meshes:
        at = mesh.primitives[0].attributes
        position = gltf.accessors[at.POSITION]
        places = numbers(gltf, at.POSITION)
        np.testing.assert_array_equal(position.min, places.min(axis=0))
        np.testing.assert_array_equal(position.max, places.max(axis=0))
        weights, joints = numbers(gltf, at.WEIGHTS_0), numbers(gltf, at.JOINTS_0)
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=2e-7)
        assert (joints[weights == 0.0] == 0).all()
        normals = np.linalg.norm(numbers(gltf, at.NORMAL), axis=1)
        np.testing.assert_allclose(normals, 1.0, atol=1e-6)
        views = [a for a in vars(at).values() if isinstance(a, int)]
        targets = {gltf.bufferViews[gltf.accessors[a].bufferView].target for a in views}
        assert targets == {34962}
        faces = gltf.accessors[mesh.primitives[0].indices]
        assert gltf.bufferViews[faces.bufferView].target == 34963
        used |= {*views, mesh.primitives[0].indices}
    for sampler in gltf.animations[0].samplers:
        times = gltf.accessors[sampler.input]
        assert (times.min, times.max) == ([0.0], [np.float32((FRAMES - 1) / RATE)])
        assert np.all(np.diff(numbers(gltf, sampler.input)[:, 0]) > 0.0)
        assert gltf.accessors[sampler.output].count == FRAMES
        used |= {sampler.input, sampler.output}
    used |= {skin.inverseBindMatrices for skin in gltf.skins}
    assert used == set(range(len(gltf.accessors)))
    for view in gltf.bufferViews:
        assert view.byteOffset % 4 == 0
        assert view.byteOffset + view.byteLength <= gltf.buffers[0].byteLength
    for n in range(len(gltf.accessors)):
        assert np.isfinite(numbers(gltf, n).astype(float)).all()


def test_the_same_take_gives_the_same_bytes(tmp_path):
    for name in ("a.glb", "b.glb"):
        recording, surfaces, _ = take(np.random.default_rng(7))
        write_glb(tmp_path / name, recording, surfaces=surfaces)
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_a_hand_at_rest_is_palm_down_with_its_tips(tmp_path, rng):
    tree = template("left")
    surface = blocks(tree, rng)
    write_hand(tmp_path / "m.glb", tree, surface)
    scene = Scene(tmp_path / "m.glb")
    assert not scene.gltf.animations
    found = scene.vertices(scene.skinned[0], 0.0)
    np.testing.assert_allclose(found, surface.vertices @ UP["+z"], atol=1e-7)
    names = [node.name for node in scene.gltf.nodes]
    assert {f"{finger}_tip" for finger in ("thumb", "little")} < set(names)
    assert set(tree.joints) < set(names)


def test_frames_that_are_not_trusted_are_listed_by_their_numbers(rng, tmp_path):
    recording, surfaces, _ = take(rng, sides=("right",))
    trusted = np.ones(FRAMES, dtype=bool)
    trusted[[3, 4, 5, 20]] = False
    motion = replace(recording.motions["right"], trusted=trusted)
    recording = replace(recording, first_frame=995, motions={"right": motion})
    path = tmp_path / "hand.glb"
    write_glb(path, recording, surfaces=surfaces)
    (animation,) = Scene(path).gltf.animations
    listed = {"right": [[998, 1000], [1015, 1015]]}
    assert animation.extras == {"first_frame": 995, "not_trusted": listed}
    about = files.inspect(path)
    assert (about["first_frame"], about["not_trusted"]) == (995, listed)


def test_an_older_list_of_frames_is_told_by_number(rng, tmp_path):
    recording, surfaces, _ = take(rng, sides=("right",))
    motion = replace(recording.motions["right"], trusted=np.arange(FRAMES) >= 3)
    path = tmp_path / "hand.glb"
    write_glb(path, replace(recording, motions={"right": motion}), surfaces=surfaces)
    new = b'{"first_frame":1,"not_trusted":{"right":[[1,3]]}}'
    old = b'{"not_trusted":{"right":[[0,3]]}}'  # keys from 0, the last left out
    content = path.read_bytes()
    assert new in content
    path.write_bytes(content.replace(new, old.ljust(len(new))))
    assert files.inspect(path)["not_trusted"] == {"right": [[1, 3]]}
