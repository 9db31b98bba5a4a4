"""Meshes and skinned hands: inspected, read in a unit, made a subject."""

import contextlib
import json
import struct

import numpy as np

from handclean.errors import HandcleanError, UsageError
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import template
from handclean.io import files
from handclean.io.gltf.skinned import SkinnedHand, write_hands
from handclean.io.gltf.write import write_hand
from handclean.io.mesh.meshes import Mesh, expect_faces, read_mesh, write_mesh
from handclean.io.shapes import read_hand
from tests.fuzz.inputs import BYTES, TEXT, Reader

ASCII = """ply
format ascii 1.0
comment unit mm
element vertex 4
property float x
property float y
property double z
property uchar red
property uchar green
property uchar blue
element edge 0
property int a
element face 2
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
100 0 0 0 255 0
0 120 5.5 0 0 255
30 40 90 9 9 9
3 0 1 2
4 0 1 2 3
"""
OBJ = """# unit mm
mtllib no.mtl
o hand
v 0 0 0 1 0 0
v 100 0 0 0 1 0
v 0 120 5.5 0 0 1
v 30 40 90 .5 .5 .5
vt 0 1
vn 0 0 1
g palm
usemtl skin
s 1
f 1/1/1 2/1/1 3/1/1
f 1 2 3 4
f -1 -2 -3
"""
STL = """solid hand
 facet normal 0 0 1
  outer loop
   vertex 0 0 0
   vertex 100 0 0
   vertex 0 120 5.5
  endloop
 endfacet
 facet normal 0 0 1
  outer loop
   vertex 0 0 0
   vertex 0 120 5.5
   vertex 30 40 90
  endloop
 endfacet
endsolid hand
"""


def mesh(path):
    """All that commands do with a mesh."""
    files.inspect(path)
    try:
        found = read_mesh(path)
    except UsageError:
        found = read_mesh(path, unit="mm")
    for suffix in (".ply", ".obj"):
        write_mesh(path.with_name("out" + suffix), found)
    with contextlib.suppress(HandcleanError):
        expect_faces(path, found)


def hand(path):
    """All that commands do with a skinned hand."""
    files.inspect(path)
    for name in ("", "handclean"):
        try:
            read_hand(path, name)
        except HandcleanError:
            continue
    read_hand(path)


def small():
    """A mesh of four faces, with all that there may be."""
    rng = np.random.default_rng(0)
    return Mesh(
        vertices=np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.12, 0], [0.02, 0.03, 0.09]]),
        faces=np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
        normals=rng.normal(size=(4, 3)),
        colors=rng.integers(0, 255, (4, 3)).astype(np.uint8),
    )


def plys(folder):
    """A text of ours, a binary, one of the other byte order with polygons."""
    (folder / "a.ply").write_text(ASCII)
    write_mesh(folder / "b.ply", small())
    lead = ASCII.replace("ascii", "binary_big_endian").partition("element vertex")
    head = f"{lead[0]}element vertex 3\nproperty short x\nproperty short y\n"
    head += "property short z\nelement face 2\n"
    head += "property list uchar ushort vertex_index\nend_header\n"
    body = np.array([0, 0, 0, 100, 0, 0, 0, 90, 5], ">i2").tobytes()
    body += b"\3" + np.array([0, 1, 2], ">u2").tobytes()
    body += b"\4" + np.array([0, 1, 2, 1], ">u2").tobytes()
    (folder / "c.ply").write_bytes(head.encode() + body)


def objs(folder):
    """A text of somebody's and one of ours."""
    (folder / "a.obj").write_text(OBJ)
    write_mesh(folder / "b.obj", small())


def stls(folder):
    """A text and a binary."""
    (folder / "a.stl").write_text(STL)
    write_mesh(folder / "b.stl", small())


def spiky(tree):
    """A skin of one triangle a bone."""
    joints = rest_joints(tree)
    bones = np.zeros((3 * len(joints), 4), dtype=np.int64)
    bones[:, 0] = np.repeat(np.arange(len(joints)), 3)
    return Surface(
        vertices=(joints[:, None] + 0.01 * np.eye(3)).reshape(-1, 3),
        faces=np.arange(3 * len(joints)).reshape(-1, 3),
        bones=bones,
        weights=np.tile([1.0, 0.0, 0.0, 0.0], (3 * len(joints), 1)),
    )


def glbs(folder):
    """A hand at rest, and one that moves; their JSON is most of them."""
    tree = template("right")
    write_hand(folder / "a.glb", tree, spiky(tree))
    poses = np.zeros((5, 7 + len(tree.hinges)))
    poses[:, 3] = 1.0
    poses[:, 10] = np.linspace(0.0, 0.5, 5)
    moves = SkinnedHand(
        name="", tree=tree, surface=spiky(tree), poses=poses, doubt=((2, 3),)
    )
    write_hands(folder / "b.glb", [moves], rate=100.0, up_axis="+z")


def in_json(rng, content, other):
    """Put something else for a value of a glTF's JSON, and mend the sizes."""
    try:
        size = struct.unpack_from("<I", content, 12)[0]
        tree = json.loads(content[20 : 20 + size])
    except (ValueError, struct.error, RecursionError):
        return content
    places = []
    left = [(tree, key) for key in tree] if isinstance(tree, dict) else []
    while left:
        at, key = left.pop()
        places.append((at, key))
        if isinstance(at[key], dict):
            left += [(at[key], inner) for inner in at[key]]
        elif isinstance(at[key], list):
            left += [(at[key], inner) for inner in range(len(at[key]))]
    if not places:
        return content
    at, key = places[int(rng.integers(len(places)))]
    there, where = places[int(rng.integers(len(places)))]
    odd = [None, True, -1, 0, 1, 2**31, 2**53, 0.5, 1e308, "", "x", [], {}, [[1]]]
    choice = int(rng.integers(len(odd) + 2))
    if choice < len(odd):
        at[key] = odd[choice]
    elif choice == len(odd):
        at[key] = json.loads(json.dumps(there[where]))
    elif isinstance(at, dict):
        del at[key]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + size :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    return head + struct.pack("<I", len(text)) + b"JSON" + text + rest


READERS = {
    "obj": Reader(read=mesh, seeds=objs, mutators=TEXT),
    "stl": Reader(read=mesh, seeds=stls, mutators=BYTES + TEXT),
    "ply": Reader(read=mesh, seeds=plys, mutators=BYTES + TEXT),
    "glb": Reader(read=hand, seeds=glbs, mutators=(*BYTES, *(in_json,) * 7)),
}
