"""A damaged glTF file is refused in one line, whatever is wrong with it."""

import contextlib
import json
import struct
import time

import numpy as np
import pytest
from gltf_oracle import Scene, numbers
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import FileError, HandcleanError
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import template
from handclean.io.gltf.hand import import_hand
from handclean.io.gltf.nodes import nodes_of
from handclean.io.gltf.read import accessor, read_glb
from handclean.io.gltf.skin import skinned_mesh
from handclean.io.gltf.skinned_map import load_skinned_map
from handclean.io.gltf.write import write_hand

MAP = load_skinned_map("handclean")


def spiky(tree):
    """A skin of one triangle a bone."""
    joints = rest_joints(tree)
    count = len(joints)
    corners = 0.01 * np.eye(3)
    bones = np.zeros((3 * count, 4), dtype=np.int64)
    bones[:, 0] = np.repeat(np.arange(count), 3)
    return Surface(
        vertices=(joints[:, None] + corners).reshape(-1, 3),
        faces=np.arange(3 * count).reshape(-1, 3),
        bones=bones,
        weights=np.tile([1.0, 0.0, 0.0, 0.0], (3 * count, 1)),
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """JSON and bytes of a good file."""
    tree = template("right")
    path = tmp_path_factory.mktemp("whole") / "m.glb"
    write_hand(path, tree, spiky(tree))
    glb = read_glb(path)
    return glb.tree, glb.block


def packed(tree, block, *, cut=0):
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(block))
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(block), b"BIN\0") + block
    return (head + body)[: len(head) + len(body) - cut]


def test_a_good_file_is_read(tmp_path, whole):
    path = tmp_path / "m.glb"
    path.write_bytes(packed(*whole))
    found = import_hand(read_glb(path), MAP)
    assert len(found.subject.surface.vertices) == 48


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"ply\n" * 10, "not a binary glTF file"),
        (struct.pack("<4sII", b"glTF", 1, 20) + bytes(8), "version 1"),
        (struct.pack("<4sII", b"glTF", 2, 2**31) + bytes(80), "ends after 92 of"),
        (
            struct.pack("<4sIII4s", b"glTF", 2, 24, 2**31, b"JSON") + bytes(4),
            "reaches beyond its end",
        ),
        (packed([], b""), "JSON is no object"),
        (packed({"extensionsRequired": ["KHR_draco"]}, b""), "extension KHR_draco"),
        (packed({}, b"")[:-9] + b"nonsense!", "JSON|beyond"),
    ],
)
def test_what_is_no_glb_is_said(tmp_path, content, message):
    path = tmp_path / "m.glb"
    path.write_bytes(content)
    with pytest.raises(FileError, match=message) as raised:
        skinned_mesh(read_glb(path))
    assert str(raised.value).startswith(f"{path}: ")


def test_deeply_nested_json_is_refused(tmp_path):
    path = tmp_path / "m.glb"
    text = b"[" * 200_000
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON")
    path.write_bytes(head + text)
    with pytest.raises(FileError, match="JSON cannot be read"):
        read_glb(path)


def spoiled(whole, *changes):
    """A copy of the good file with some values replaced; a path of keys each."""
    tree = json.loads(json.dumps(whole[0]))
    for *keys, last, value in changes:
        row = tree
        for key in keys:
            row = row[key]
        row[last] = value
    return packed(tree, whole[1])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("skins", []), "has no skin; a rigged hand"),
        (("skins", [{}, {}]), "has 2 skins; save one hand per file"),
        (("skins", 0, "joints", []), "no joints"),
        (("skins", 0, "joints", [1, 1]), "2 joints are called 'wrist'"),
        (("skins", 0, "joints", [9999]), "nodes 9999 is not one of its"),
        (("skins", 0, "joints", ["a"]), "nodes 'a' is not one of its"),
        (("nodes", 0, "children", [0]), "own ancestor"),
        (("nodes", 2, "children", [1]), "two parents|own ancestor"),
        (("nodes", 1, "rotation", [0, 0, 0, 0]), "no unit quaternion"),
        (("nodes", 1, "translation", [1, 2]), "translation is not 3 numbers"),
        (("nodes", 1, "scale", [0, 0, 0]), "no size|finite|inverted"),
        (("accessors", 0, "count", 2**39), "do not fit"),
        (("accessors", 0, "count", -1), "whole number"),
        (("accessors", 0, "count", 0), "do not fit"),
        (("accessors", 0, "byteOffset", 10**9), "do not fit"),
        (("accessors", 0, "sparse", {}), "are sparse"),
        (("accessors", 0, "type", "VEC4"), "vertices are 'VEC4'"),
        (("accessors", 0, "componentType", 5130), "type 5130"),
        (("accessors", 2, "count", 3), "should be of 48 vertices"),
        (("bufferViews", 0, "byteLength", 10**9), "beyond the end"),
        (("bufferViews", 0, "byteStride", 4), "do not fit"),
        (("bufferViews", 0, "buffer", 1), "in another file"),
        (("buffers", 0, "uri", "x.bin"), "in another file"),
        (("meshes", 0, "primitives", 3), "no list of primitives"),
        (("meshes", 0, "primitives", 0, "mode", 0), "no mesh of triangles"),
        (
            ("meshes", 0, "primitives", 0, "attributes", {"POSITION": 0}),
            "no joints and weights",
        ),
    ],
)
def test_what_is_wrong_inside_is_said(tmp_path, whole, change, message):
    path = tmp_path / "m.glb"
    path.write_bytes(spoiled(whole, change))
    with pytest.raises(HandcleanError, match=message) as raised:
        import_hand(read_glb(path), MAP)
    assert str(raised.value).startswith(str(path))
    assert "\n" not in str(raised.value)


def test_strided_and_normalized_numbers_are_read_as_the_independent_reader_does(
    tmp_path, whole
):
    tree, block = json.loads(json.dumps(whole[0])), whole[1]
    rows = np.zeros((5, 2), dtype=[("a", "<f4", 3), ("b", "u1", 4)])[:, 0]
    rows["a"], rows["b"] = np.arange(15).reshape(5, 3), np.arange(20).reshape(5, 4)
    start = len(block)
    view = {"buffer": 0, "byteOffset": start, "byteLength": 80, "byteStride": 16}
    tree["bufferViews"].append(view)
    common = {"bufferView": len(tree["bufferViews"]) - 1, "count": 5}
    first = len(tree["accessors"])
    tree["accessors"] += [
        {**common, "type": "VEC3", "componentType": 5126},
        {**common, "type": "VEC4", "componentType": 5121, "byteOffset": 12},
        {
            **common,
            "type": "VEC4",
            "componentType": 5121,
            "byteOffset": 12,
            "normalized": True,
        },
    ]
    tree["buffers"][0]["byteLength"] = start + 80
    path = tmp_path / "m.glb"
    path.write_bytes(packed(tree, block + np.ascontiguousarray(rows).tobytes()))
    glb = read_glb(path)
    np.testing.assert_array_equal(accessor(glb, first, 3, "x"), rows["a"])
    np.testing.assert_array_equal(accessor(glb, first + 1, 4, "x"), rows["b"])
    np.testing.assert_allclose(accessor(glb, first + 2, 4, "x"), rows["b"] / 255.0)
    gltf = Scene(path).gltf
    np.testing.assert_array_equal(accessor(glb, 0, 3, "x"), numbers(gltf, 0))


def test_nodes_are_where_the_independent_reader_has_them(tmp_path, whole):
    path = tmp_path / "m.glb"
    path.write_bytes(packed(*whole))
    np.testing.assert_allclose(
        nodes_of(read_glb(path)).world, Scene(path).world(0.0), atol=1e-12
    )


def test_a_matrix_stands_for_a_node_s_place(tmp_path, whole):
    tree = json.loads(json.dumps(whole[0]))
    matrix = np.eye(4)
    matrix[:3, 3] = [0.1, 0.2, 0.3]
    del tree["nodes"][1]["rotation"], tree["nodes"][1]["translation"]
    tree["nodes"][1]["matrix"] = matrix.T.ravel().tolist()
    path = tmp_path / "m.glb"
    path.write_bytes(packed(tree, whole[1]))
    nodes = nodes_of(read_glb(path))
    expected = nodes.world[0] @ [0.1, 0.2, 0.3, 1.0]
    np.testing.assert_allclose(nodes.world[1][:, 3], expected)


def leaves(row, path=()):
    """Paths of all values of a JSON tree."""
    items = row.items() if isinstance(row, dict) else enumerate(row)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from leaves(value, (*path, key))


ODD = st.sampled_from(
    [None, True, -1, 0, 1, 3, 5121, 5126, 2**40, 1e300, "", "x", [], [1], {}, [{}]]
)


@given(data=st.data())
def test_any_value_of_the_json_may_be_wrong(tmp_path_factory, whole, data):
    paths = list(leaves(whole[0]))
    picked = data.draw(st.lists(st.sampled_from(paths), min_size=1, max_size=2))
    path = tmp_path_factory.mktemp("fuzz") / "m.glb"
    changes = [(*keys, data.draw(ODD)) for keys in picked]
    with contextlib.suppress(KeyError, IndexError, TypeError):
        content = spoiled(whole, *changes)
        path.write_bytes(content)
    if path.exists():
        with contextlib.suppress(HandcleanError):
            found = import_hand(read_glb(path), MAP)
            assert np.isfinite(found.subject.surface.vertices).all()


@given(data=st.data())
def test_any_byte_may_be_wrong_and_any_end_missing(tmp_path_factory, whole, data):
    content = bytearray(packed(*whole))
    where = st.integers(0, len(content) - 1)
    for at, value in data.draw(
        st.lists(st.tuples(where, st.integers(0, 255)), max_size=8)
    ):
        content[at] = value
    stop = data.draw(where | st.just(len(content)))
    path = tmp_path_factory.mktemp("fuzz") / "m.glb"
    path.write_bytes(bytes(content[:stop]))
    with contextlib.suppress(HandcleanError):
        found = import_hand(read_glb(path), MAP)
        assert np.isfinite(found.subject.surface.vertices).all()


@pytest.mark.parametrize("shape", ["chain", "star"])
def test_thousands_of_nodes_below_a_joint_cost_little(tmp_path, whole, shape):
    tree, block = json.loads(json.dumps(whole[0])), whole[1]
    count, more = len(tree["nodes"]), 15_000
    tree["nodes"] += [{"name": f"n{n}"} for n in range(more)]
    if shape == "chain":
        for n in range(count, count + more - 1):
            tree["nodes"][n]["children"] = [n + 1]
    below = [count] if shape == "chain" else list(range(count, count + more))
    tree["nodes"][1].setdefault("children", []).extend(below)
    path = tmp_path / "m.glb"
    path.write_bytes(packed(tree, block))
    began = time.process_time()
    found = import_hand(read_glb(path), MAP)
    assert time.process_time() - began < 5.0
    assert len(found.subject.surface.vertices) == 48


def test_accessors_may_not_name_the_same_bytes_for_ever(tmp_path, whole):
    tree = json.loads(json.dumps(whole[0]))
    view = len(tree["bufferViews"])
    tree["bufferViews"].append({"buffer": 0, "byteLength": 2**20})
    row = {"bufferView": view, "componentType": 5121, "type": "SCALAR", "count": 2**20}
    first = len(tree["accessors"])
    tree["accessors"] += [dict(row) for _ in range(100)]
    path = tmp_path / "m.glb"
    path.write_bytes(packed(tree, whole[1] + bytes(2**20)))
    glb = read_glb(path)
    for n in range(4):
        accessor(glb, first + n, 1, "times")
    with pytest.raises(FileError, match="the same bytes again and again"):
        all(len(accessor(glb, first + n, 1, "times")) for n in range(4, 100))


def test_json_nested_deeper_than_anybody_reads_is_refused(tmp_path, whole):
    tree = whole[0] | {"extras": json.loads("[" * 300 + "]" * 300)}
    path = tmp_path / "m.glb"
    path.write_bytes(packed(tree, whole[1]))
    with pytest.raises(FileError, match="nested more than 50 deep"):
        read_glb(path)


def test_true_is_no_index(tmp_path, whole):
    tree = json.loads(json.dumps(whole[0]))
    tree["skins"][0]["joints"][0] = True
    path = tmp_path / "m.glb"
    path.write_bytes(packed(tree, whole[1]))
    with pytest.raises(FileError, match="nodes True is not one of its"):
        import_hand(read_glb(path), MAP)
