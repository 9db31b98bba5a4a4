"""Meshes come back as they were written; what is wrong with one is said in a line."""

import contextlib
import struct
import time
import tracemalloc
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from told import texts

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.hand.surface import vertex_normals, volume
from handclean.io.mesh.meshes import (
    Mesh,
    expect_faces,
    looks_inwards,
    read_mesh,
    write_mesh,
)
from handclean.io.mesh.ply import parse_ply
from handclean.io.shapes import inspect_mesh


@pytest.fixture(scope="module")
def blob():
    """A closed mesh of a hand's length, with normals and colours."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    vertices = ball.vertices * [0.03, 0.095, 0.015] + [0.4, -0.2, 1.1]
    faces = np.asarray(ball.faces, dtype=np.int64)
    colors = np.arange(3 * len(vertices)).reshape(-1, 3) % 256
    return Mesh(
        vertices=vertices,
        faces=faces,
        normals=vertex_normals(vertices, faces),
        colors=colors.astype(np.uint8),
    )


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_a_mesh_comes_back_in_its_order_with_normals_and_colors(tmp_path, blob, suffix):
    path = tmp_path / f"m{suffix}"
    assert write_mesh(path, blob) == ()
    back = read_mesh(path)
    np.testing.assert_allclose(back.vertices, blob.vertices, atol=1e-7)
    np.testing.assert_array_equal(back.faces, blob.faces)
    np.testing.assert_array_equal(back.colors, blob.colors)
    np.testing.assert_allclose(back.normals, blob.normals, atol=2e-6)


def test_stl_keeps_the_shape_and_every_vertex_once(tmp_path, blob):
    path = tmp_path / "m.stl"
    assert texts(write_mesh(path, blob)) == ("STL has no colours",)
    back = read_mesh(path)
    assert len(back.vertices) == len(blob.vertices)
    for one, two in zip(blob.faces[::17], back.faces[::17], strict=True):
        np.testing.assert_allclose(blob.vertices[one], back.vertices[two], atol=1e-7)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl"])
def test_an_independent_library_reads_what_we_write(tmp_path, blob, suffix):
    path = tmp_path / f"m{suffix}"
    write_mesh(path, blob)
    other = trimesh.load(path, process=False, force="mesh")
    assert other.volume == pytest.approx(volume(blob.vertices, blob.faces), rel=1e-4)
    if suffix == ".ply":
        np.testing.assert_array_equal(other.visual.vertex_colors[:, :3], blob.colors)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_what_an_independent_library_writes_is_read(tmp_path, blob, encoding):
    other = trimesh.Trimesh(blob.vertices * 1e3, blob.faces, process=False)
    other.visual.vertex_colors = blob.colors
    path = tmp_path / "m.ply"
    path.write_bytes(trimesh.exchange.ply.export_ply(other, encoding=encoding))
    back = read_mesh(path, unit="mm")
    np.testing.assert_allclose(back.vertices, blob.vertices, atol=1e-6)
    np.testing.assert_array_equal(back.faces, blob.faces)
    np.testing.assert_array_equal(back.colors, blob.colors)


@pytest.mark.parametrize("kind", ["obj", "obj without normals", "stl", "stl_ascii"])
def test_obj_and_stl_of_an_independent_library_are_read(tmp_path, blob, kind):
    other = trimesh.Trimesh(blob.vertices * 1e3, blob.faces, process=False)
    other.visual.vertex_colors = blob.colors
    path = tmp_path / f"m.{kind[:3]}"
    more = {"include_normals": kind == "obj"} if kind.startswith("obj") else {}
    other.export(path, file_type=kind.split()[0], **more)
    back = read_mesh(path, unit="mm")
    corners = back.vertices[back.faces]
    np.testing.assert_allclose(corners, blob.vertices[blob.faces], atol=1e-6)
    if kind.startswith("obj"):
        np.testing.assert_array_equal(back.faces, blob.faces)
        np.testing.assert_array_equal(back.colors, blob.colors)
    if kind == "obj":
        np.testing.assert_allclose(back.normals, other.vertex_normals, atol=1e-4)


OBJ = """mtllib none.mtl
o hand
v 0 0 0
v 100 0 0
v 100 100 0
v 0 100 0
vt 0 0
vt 1 1
vn 0 0 1
vn 0 1 0
usemtl skin
f 1/1/1 2/2/1 3/1/1 4/2/1
g other
f -4/1/-1 -3//2 \\
   -1//-1
f 1/2 3/1 4
"""


def test_of_an_obj_vertices_faces_and_normals_are_taken_in_their_order(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text(OBJ.replace("\n", "\r\n"))
    back = read_mesh(path, unit="mm")
    assert back.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3], [0, 2, 3]]
    up, mean = [0.0, 0.0, 1.0], [0.0, 0.5**0.5, 0.5**0.5]
    np.testing.assert_allclose(back.normals, [mean, mean, up, mean])
    assert len(back.vertices) == 4


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("f 1 2 2147483648", "a face names a vertex that is not there"),
        ("f 1 2 9" + "9" * 30, "a face of it names no vertices"),
        ("f 1 2 9" + "9" * 5000, "a face of it names no vertices"),
        ("f 1 2 -5", "a face names a vertex that is not there"),
        ("f 1 2 0", "names vertex 0"),
        ("f 1//1 2//1 3//7", "names a normal that is not there"),
        ("f 1 2", "less than three corners"),
        ("f 1.5 2 3", "names no vertices"),
        ("v 1 2", "too few numbers"),
        ("v 1 2 x", "could not convert"),
        ("v 1 2 nan", "are not numbers"),
        ("v 1 2 1e300", "or too large"),
    ],
)
def test_what_is_wrong_in_an_obj_is_said_at_once(tmp_path, line, message):
    path = tmp_path / "m.obj"
    path.write_text(f"{OBJ}{line}\n")
    tracemalloc.start()
    with pytest.raises(FileError, match=message):
        read_mesh(path, unit="mm")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e6


def test_a_cut_stl_is_said(tmp_path, blob):
    path = tmp_path / "m.stl"
    write_mesh(path, blob)
    path.write_bytes(path.read_bytes()[:-3])
    with pytest.raises(FileError, match=r"it says 320 faces, 319\.9 are there"):
        read_mesh(path)
    trimesh.Trimesh(blob.vertices, blob.faces).export(path, file_type="stl_ascii")
    path.write_bytes(path.read_bytes()[:-90])
    with pytest.raises(FileError, match="corners can be read"):
        read_mesh(path, unit="m")


@pytest.mark.parametrize("suffix", [".stl", ".ply"])
def test_a_signalling_nan_is_refused_without_a_warning(tmp_path, blob, suffix):
    path = tmp_path / f"m{suffix}"
    write_mesh(path, replace(blob, vertices=blob.vertices.astype(np.float32)))
    content = path.read_bytes()
    first = np.float32(blob.vertices[0, 0]).tobytes()
    at = content.rindex(first, 90) if suffix == ".stl" else content.index(first, 90)
    path.write_bytes(content[:at] + b"\x01\x00\xa0\x7f" + content[at + 4 :])
    with pytest.raises(FileError, match="vertices are not numbers"):
        read_mesh(path, unit="m")


def test_an_ascii_ply_may_have_an_element_without_rows(tmp_path):
    path = tmp_path / "m.ply"
    head = HEAD.format(3) + "property float z\nelement edge 0\nproperty int a\n"
    head += "element face 1\nproperty list uchar int vertex_index\nend_header\n"
    path.write_text(head + "0 0 0\n100 0 0\n0 100 0\n3 0 1 2\n")
    back = read_mesh(path, unit="mm")
    assert back.faces.tolist() == [[0, 1, 2]]
    np.testing.assert_allclose(back.vertices[1], [0.1, 0, 0])


@pytest.mark.parametrize("order", ["big", "little"])
def test_mixed_polygons_are_cut_into_triangles_in_their_order(tmp_path, order):
    sign = ">" if order == "big" else "<"
    corners = 100.0 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 1]])
    head = (
        f"ply\nformat binary_{order}_endian 1.0\nelement vertex 5\n"
        "property double x\nproperty double y\nproperty double z\n"
        "element face 3\nproperty list uchar uint vertex_index\nend_header\n"
    )
    body = corners.astype(f"{sign}f8").tobytes()
    for face in ((0, 1, 4), (0, 1, 2, 3), (2, 3, 4)):
        body += struct.pack(f"{sign}B{len(face)}I", len(face), *face)
    path = tmp_path / "q.ply"
    path.write_bytes(head.encode() + body)
    back = read_mesh(path, unit="mm")
    expected = [[0, 1, 4], [0, 1, 2], [0, 2, 3], [2, 3, 4]]
    np.testing.assert_array_equal(back.faces, expected)
    np.testing.assert_allclose(back.vertices, corners / 1e3)


def test_a_point_cloud_keeps_normals_and_colors_and_is_no_mesh(tmp_path, blob):
    cloud = replace(blob, faces=np.zeros((0, 3), dtype=np.int64))
    path = tmp_path / "c.ply"
    write_mesh(path, cloud)
    back = read_mesh(path)
    np.testing.assert_allclose(back.normals, blob.normals, atol=1e-6)
    np.testing.assert_array_equal(back.colors, blob.colors)
    with pytest.raises(FileError, match=r"has 162 points and no faces; a mesh"):
        expect_faces(path, back)
    with pytest.raises(FileError, match="STL needs faces"):
        write_mesh(tmp_path / "c.stl", back)


def stated(path, blob, scale, comment=""):
    """A text file of the blob, scaled, with or without a unit."""
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in blob.vertices * scale]
    rows += ["f {} {} {}".format(*(face + 1)) for face in blob.faces]
    path.write_text("\n".join([comment, *rows]))
    return path


@pytest.mark.parametrize(("scale", "unit"), [(1e3, "mm"), (100.0, "cm"), (1.0, "m")])
def test_a_mesh_without_a_unit_needs_one_and_gets_the_likely_one_named(
    tmp_path, blob, scale, unit
):
    path = stated(tmp_path / "m.obj", blob, scale)
    with pytest.raises(UsageError, match=f"give --unit {unit} ") as raised:
        read_mesh(path)
    assert "\n" not in str(raised.value)
    back = read_mesh(path, unit=unit)
    np.testing.assert_allclose(back.vertices, blob.vertices, atol=1e-6)
    np.testing.assert_array_equal(back.faces, blob.faces)


@pytest.mark.parametrize(
    ("scale", "unit", "size", "right"),
    [
        (1e3, "m", r"1\d\d\.?\d* m long in m", "--unit mm would make it a hand"),
        (1.0, "mm", r"0\.1\d* mm long in mm", "--unit m would make it a hand"),
        (1e3, "cm", r"1\.\d* m long in cm", "--unit mm would make it a hand"),
        (1e7, "mm", r"\d+ m long in mm", "no unit fits a hand"),
    ],
)
def test_a_wrong_unit_is_told(tmp_path, blob, scale, unit, size, right):
    path = stated(tmp_path / "m.obj", blob, scale)
    with pytest.raises(FileError, match=f"the scan is {size}; {right}"):
        read_mesh(path, unit=unit)
    path = stated(tmp_path / "n.obj", blob, scale, f"# unit {unit}")
    with pytest.raises(FileError, match=f"the scan is {size}"):
        read_mesh(path)


def test_an_option_that_contradicts_the_file_is_taken_if_it_makes_a_hand(
    tmp_path, blob
):
    path = stated(tmp_path / "m.obj", blob, 1e3, "# unit m")
    with pytest.raises(FileError, match="it says m; --unit mm would make it a hand"):
        read_mesh(path)
    mesh = read_mesh(path, unit="mm")
    assert texts(mesh.remarks) == ("--unit mm is taken, though the file says m",)
    np.testing.assert_allclose(mesh.vertices, blob.vertices, atol=1e-6)
    with pytest.raises(FileError, match="--unit mm would make it a hand"):
        read_mesh(path, unit="cm")


def test_a_mesh_inside_out_is_told(tmp_path, blob):
    assert not looks_inwards(blob)
    turned = replace(blob, faces=blob.faces[:, ::-1].copy())
    assert looks_inwards(turned)
    opened = replace(turned, faces=turned.faces[: len(turned.faces) * 3 // 4])
    assert looks_inwards(opened)
    assert not looks_inwards(replace(opened, faces=opened.faces[:, ::-1]))
    cloud = replace(blob, faces=np.zeros((0, 3), np.int64), normals=-blob.normals)
    assert looks_inwards(cloud)
    with pytest.raises(FileError, match="faces look inwards"):
        expect_faces(tmp_path / "m.ply", turned)


HEAD = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ply", b"", "is empty"),
        ("a.obj", b"  \n", "is empty"),
        ("a.ply", b"solid x", "not a PLY file"),
        ("a.ply", HEAD.format(2).encode(), "header has no end"),
        ("a.ply", (HEAD.format(1) + "end_header\n1 2\n").encode(), "no vertices"),
        (
            "a.ply",
            (HEAD.format(10**15) + "property float z\nend_header\n1 2 3\n").encode(),
            "ends before the last of 1000000000000000 rows",
        ),
        (
            "a.ply",
            (HEAD.format(2) + "property float z\nend_header\n1 2 3\n4 5\n").encode(),
            "ends before the last of 2 rows of element vertex",
        ),
        (
            "a.ply",
            (HEAD.format(1) + "property float z\nend_header\n1 nan 3\n").encode(),
            "1 of 1 vertices are not numbers, or too large, the first is vertex 0",
        ),
        (
            "a.ply",
            (HEAD.format(1) + "property float z\nend_header\n1 two 3\n").encode(),
            "could not convert",
        ),
        ("a.obj", b"hello\nworld\n", "OBJ|no vertices"),
        ("a.obj", b"v 1 2 3\nv 1 2 4\nv 2 2 2\nf 1 2 9\n", "OBJ|not there"),
        ("a.stl", b"x" * 200, "STL|no vertices"),
        ("a.stl", bytes(80) + struct.pack("<I", 2**31) + bytes(50), "STL|no vertices"),
        ("a.xyz", b"1 2 3", "no mesh format is called"),
    ],
)
def test_what_is_no_mesh_is_said_in_one_line(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(HandcleanError, match=message) as raised:
        read_mesh(path, unit="mm")
    assert str(raised.value).startswith(str(path))
    assert "\n" not in str(raised.value)


def test_a_folder_and_a_missing_file_are_said(tmp_path):
    (tmp_path / "f.ply").mkdir()
    with pytest.raises(FileError, match="is a directory"):
        read_mesh(tmp_path / "f.ply")
    with pytest.raises(FileError, match="no such file"):
        read_mesh(tmp_path / "g.ply")


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl"])
@given(data=st.data())
def test_a_damaged_mesh_is_read_or_refused(tmp_path_factory, blob, suffix, data):
    folder = tmp_path_factory.mktemp("damaged")
    path = folder / f"m{suffix}"
    write_mesh(path, blob)
    content = bytearray(path.read_bytes())
    spots = data.draw(
        st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), max_size=6)
    )
    for at, value in spots:
        content[at] = value
    stop = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    path.write_bytes(bytes(content[:stop]))
    with contextlib.suppress(HandcleanError):
        back = read_mesh(path, unit="m")
        assert np.isfinite(back.vertices).all()
        assert not len(back.faces) or back.faces.max() < len(back.vertices)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
@given(count=st.integers(-5, 2**70), length=st.integers(0, 255))
def test_counts_of_a_header_allocate_nothing(tmp_path_factory, encoding, count, length):
    kind = "ascii" if encoding == "ascii" else "binary_little_endian"
    head = f"ply\nformat {kind} 1.0\nelement vertex {count}\n" + "".join(
        f"property float {axis}\n" for axis in "xyz"
    )
    head += f"element face {count}\nproperty list uint int vertex_indices\nend_header\n"
    path = tmp_path_factory.mktemp("counts") / "m.ply"
    path.write_bytes(head.encode() + bytes([length]) * 60)
    with pytest.raises(HandcleanError):
        read_mesh(path, unit="m")


def test_inspecting_a_point_cloud_says_nothing_of_inside_out(tmp_path, rng):
    places = rng.normal(size=(300, 3))
    outward = places / np.linalg.norm(places, axis=1)[:, None]
    cloud = Mesh(
        vertices=0.05 * outward, faces=np.zeros((0, 3), np.int64), normals=-outward
    )
    assert looks_inwards(cloud)
    write_mesh(tmp_path / "c.ply", cloud)
    assert inspect_mesh(tmp_path / "c.ply")["traps"] == []


def ply_of_lists(lists, end="\n", after=b""):
    """A binary PLY of nine points and these faces."""
    points = np.random.default_rng(0).normal(size=(9, 3)).astype("<f4")
    lines = ["ply", "format binary_little_endian 1.0", "element vertex 9"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"element face {len(lists)}"]
    lines += ["property list uchar int vertex_indices", "end_header", ""]
    rows = [bytes([len(row)]) + np.array(row, "<i4").tobytes() for row in lists]
    return end.join(lines).encode() + points.tobytes() + b"".join(rows) + after


MIXED = [[0, 1, 2, 3], [4, 5, 6], [0, 2, 4, 6, 8]]
"""Lists that together are as long as three of the first one's length."""

TEXT = "ply\nformat ascii 1.0\nelement vertex 3\n{}end_header\n0 0 0\n1 0 0\n"
AXES = "".join(f"property float {axis}\n" for axis in "xyz")


def by_trimesh(content):
    return trimesh.exchange.ply.load_ply(BytesIO(content), skip_materials=True)


def test_lists_of_unlike_length_are_read_where_trimesh_reads_wrong_faces(tmp_path):
    """Why trimesh does not read PLY here; see `handclean.io.mesh.ply`."""
    content = ply_of_lists(MIXED)
    (tmp_path / "m.ply").write_bytes(content)
    fans = [
        *([0, 1, 2], [0, 2, 3], [4, 5, 6]),
        *([0, 2, 4], [0, 4, 6], [0, 6, 8]),
    ]
    assert parse_ply(tmp_path / "m.ply", content).faces.tolist() == fans
    assert by_trimesh(content)["faces"].tolist()[1] == [4, 5, 6, 5]


@pytest.mark.parametrize(
    ("content", "faces"),
    [
        (ply_of_lists([[0, 1, 2], [3, 4, 5, 6]]), 3),
        (ply_of_lists([[0, 1, 2]], after=b"\0\0"), 1),
        (ply_of_lists([[0, 1, 2]], end="\r"), 1),
    ],
    ids=["mixed", "more bytes", "carriage returns"],
)
def test_files_that_trimesh_refuses_are_read(tmp_path, content, faces):
    assert len(parse_ply(tmp_path / "m.ply", content).faces) == faces
    with pytest.raises(ValueError, match=r".*"):
        by_trimesh(content)


def test_a_text_that_was_cut_off_is_refused_where_trimesh_takes_it(tmp_path):
    content = TEXT.format(AXES).encode()
    with pytest.raises(FileError, match="ends before the last of 3 rows"):
        parse_ply(tmp_path / "m.ply", content)
    assert len(by_trimesh(content)["vertices"]) == 2


def test_a_million_points_are_read_in_a_second_and_four_times_their_size(tmp_path, rng):
    kinds = [(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")]
    table = np.zeros(10**6, [*kinds, ("red", "u1"), ("green", "u1"), ("blue", "u1")])
    for axis in "xyz":
        table[axis] = rng.normal(size=len(table)) * 0.05
    words = {"<f4": "float", "u1": "uchar"}
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}"]
    lines += [
        f"property {words[table.dtype[n].str.lstrip('|')]} {n}"
        for n in table.dtype.names
    ]
    content = "\n".join([*lines, "end_header", ""]).encode() + table.tobytes()
    tracemalloc.start()
    found = parse_ply(tmp_path / "m.ply", content)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(found.vertices) == len(found.colors) == len(table)
    assert most < 4 * len(content)
    started = time.process_time()
    parse_ply(tmp_path / "m.ply", content)
    assert time.process_time() - started < 1.0
