"""One door to all formats."""

import json
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from told import texts

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.hand.model import neutral_pose
from handclean.hand.template import template
from handclean.io import files
from handclean.io.contents import gaps_of
from handclean.io.formats import BY_SUFFIX, TAKES_READ
from handclean.io.hdf5.file import write_h5
from handclean.io.hdf5.parts import Array, Part
from handclean.io.shared.unread import UNREAD
from handclean.recording import (
    Origin,
    Points,
    Recording,
    motion_from_poses,
    trajectories,
)


def a_take(rng, frames=30):
    """Return a take that every format can hold something of."""
    tree = template("right")
    poses = np.zeros((frames, 7 + len(tree.hinges)))
    poses[:, 3] = 1.0
    poses[:, 7:] = 0.3 * np.sin(np.linspace(0, 6, frames))[:, None] + 0.3
    positions = rng.normal(size=(frames, 3, 3))
    positions[5:9, 0] = np.nan
    positions[20, 0] = np.nan
    positions[:4, 1] = np.nan
    return Recording(
        rate=120.0,
        frames=frames,
        markers=trajectories(positions, ("A", "B", "C")),
        unlabelled=Points(
            frame=np.array([3, 3, 8], np.int32),
            source=np.array([3, 4, 3], np.int32),
            positions=rng.normal(size=(3, 3)),
        ),
        skeletons={"right": tree},
        motions={"right": motion_from_poses(tree.hinges, poses)},
        provenance=({"command": "simulate"},),
    )


@pytest.mark.parametrize("suffix", [".c3d", ".h5", ".trc", ".csv"])
def test_markers_go_through_every_format_that_holds_them(suffix, rng, tmp_path):
    take = a_take(rng)
    files.write(tmp_path / f"a{suffix}", take, unnamed=True)
    back = files.read(tmp_path / f"a{suffix}")
    assert (back.rate, back.frames) == (take.rate, take.frames)
    assert back.markers.labels == take.markers.labels
    precision = {".c3d": 1e-6, ".h5": 0.0}.get(suffix, 1e-9)
    np.testing.assert_allclose(
        back.markers.positions, take.markers.positions, atol=precision
    )
    np.testing.assert_array_equal(back.markers.origin, take.markers.origin)
    assert len(back.unlabelled.frame) == 3


@pytest.mark.parametrize("suffix", [".h5", ".csv", ".bvh"])
def test_angles_go_through_every_format_that_holds_them(suffix, rng, tmp_path):
    take = a_take(rng)
    files.write(tmp_path / f"a{suffix}", take)
    back = files.read(tmp_path / f"a{suffix}").motions["right"]
    assert back.names == take.motions["right"].names
    np.testing.assert_allclose(back.angles, take.motions["right"].angles, atol=1e-5)


def test_the_format_may_be_named_apart_from_the_file(rng, tmp_path):
    take = a_take(rng)
    files.write(tmp_path / "half-written.tmp", take, suffix=".trc")
    files.write(tmp_path / "whole.trc", take)
    first = (tmp_path / "half-written.tmp").read_bytes()
    assert first == (tmp_path / "whole.trc").read_bytes()
    assert files.check_suffix("a.TRC") == ".trc"
    assert files.check_suffix("a.b", "c3d") == ".c3d"


@pytest.mark.parametrize("suffix", [".c3d", ".h5", ".trc", ".csv", ".mot", ".bvh"])
def test_the_same_take_gives_the_same_bytes(suffix, rng, tmp_path):
    take = a_take(rng)
    files.write(tmp_path / f"a{suffix}", take)
    files.write(tmp_path / f"b{suffix}", take)
    a, b = ((tmp_path / f"{name}{suffix}").read_bytes() for name in "ab")
    assert a == b


def test_formats_that_do_not_exist_are_named(rng, tmp_path):
    take = a_take(rng)
    with pytest.raises(
        UsageError, match=r"no format is called '\.xyz'; writable: \.c3d"
    ):
        files.write(tmp_path / "a.xyz", take)
    with pytest.raises(
        FileError,
        match=r"\.mot files are written for other programs, not read; readable",
    ):
        files.read(tmp_path / "a.mot")
    with pytest.raises(FileError, match="no format is called ''"):
        files.read(tmp_path / "a")


@pytest.mark.parametrize(
    ("suffix", "says"),
    [
        (".mat", "is a MATLAB file, and not read; export C3D or TSV instead"),
        (".FBX", "is an FBX scene, and not read; export its skeleton as BVH"),
        (".tak", "is a take of OptiTrack Motive, and not read; export it from Motive"),
        (".qtm", "is a Qualisys measurement, and not read; export its 3D data"),
        (".xlsx", "is a spreadsheet, and not read; save the sheet as CSV"),
        (".gltf", "is a glTF in several files, and not read; save it as one .glb"),
        (".zip", "is packed, and not read; unpack it"),
        (".xyz", r"no format is called '\.xyz'; readable: \.c3d"),
    ],
)
def test_files_that_are_not_read_are_named_for_what_they_are(suffix, says, tmp_path):
    path = tmp_path / f"take{suffix}"
    path.write_bytes(b"anything")
    for look in (files.read, files.inspect):
        with pytest.raises(FileError, match=says) as caught:
            look(path)
        assert "\n" not in str(caught.value)


def test_no_suffix_is_both_read_and_named_as_not_read():
    assert not set(UNREAD) & set(BY_SUFFIX)
    assert all(suffix.startswith(".") for suffix in UNREAD)


@pytest.mark.parametrize(
    ("begins", "says"),
    [
        (b"MATLAB 5.0 MAT-file", "not text but a MATLAB file; export C3D or TSV"),
        (b"Kaydara FBX Binary  ", "not text but an FBX scene; export its skeleton"),
        (b"PK\x03\x04", "not text but a spreadsheet; save the sheet as CSV"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file under another name; name it .h5"),
        (b"glTF\x02", "not text but a .glb; give it its own suffix"),
        (b"\x02P" + bytes(510), "not text but a C3D; give it the suffix .c3d"),
        (b"\x01\x02\x03", "is not text: it holds zero bytes"),
    ],
)
@pytest.mark.parametrize("suffix", [".csv", ".tsv", ".trc", ".bvh"])
def test_binary_files_under_the_suffix_of_a_text_are_named(
    suffix, begins, says, tmp_path
):
    path = tmp_path / f"take{suffix}"
    path.write_bytes(begins + bytes(512))
    with pytest.raises(FileError, match=says):
        files.read(path)


@pytest.mark.parametrize("suffix", TAKES_READ)
@pytest.mark.parametrize("what", ["missing", "folder", "empty", "blank", "noise"])
def test_what_is_no_take_is_one_clear_line(suffix, what, tmp_path):
    path = tmp_path / f"take{suffix}"
    if what == "folder":
        path.mkdir()
    elif what == "empty":
        path.touch()
    elif what == "blank":
        path.write_bytes(b" \r\n\t\n")
    elif what == "noise":
        path.write_bytes(np.random.default_rng(0).bytes(5000))
    with pytest.raises(HandcleanError) as caught:
        files.read(path, rate_hz=100.0, unit="mm")
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    with pytest.raises(HandcleanError):
        files.inspect(path)


def test_options_must_agree_with_what_a_file_says(rng, tmp_path):
    for suffix in (".c3d", ".h5", ".trc", ".csv"):
        path = tmp_path / f"a{suffix}"
        files.write(path, a_take(rng))
        unit = "m" if suffix == ".h5" else "mm"
        files.read(path, rate_hz=120.1, unit=unit)
        with pytest.raises(UsageError, match="--rate 121 contradicts"):
            files.read(path, rate_hz=121.0)


def test_a_unit_that_contradicts_a_file_is_taken_and_both_are_named(rng, tmp_path):
    for suffix in (".c3d", ".h5", ".trc", ".csv"):
        path = tmp_path / f"a{suffix}"
        files.write(path, a_take(rng))
        stated, factor = ("m", 0.01) if suffix == ".h5" else ("mm", 10.0)
        plain, other = files.read(path), files.read(path, unit="cm")
        line = f"--unit cm is taken, though the file says {stated}"
        assert [e.text for e in other.remarks].count(line) == 1
        assert line not in [e.text for e in plain.remarks]
        want = factor * plain.markers.positions
        np.testing.assert_allclose(other.markers.positions, want, rtol=1e-9)
        assert line in files.inspect(path, unit="cm")["traps"]
        again = tmp_path / f"b{suffix}"
        files.write(again, other)
        found = files.read(again).markers.positions
        np.testing.assert_allclose(found, want, atol=2e-6)


def test_a_session_in_another_unit_is_larger_in_all_its_parts(rng, tmp_path):
    tree = template("right")
    poses = np.tile(neutral_pose(tree), (30, 1))
    poses[:, :3] = rng.normal(size=(30, 3))
    take = replace(
        a_take(rng),
        skeletons={"right": tree},
        motions={"right": motion_from_poses(tree.hinges, poses, residual=np.ones(30))},
    )
    files.write(tmp_path / "a.h5", take)
    found = files.read(tmp_path / "a.h5", unit="mm")
    motion = found.motions["right"]
    np.testing.assert_allclose(motion.translation, 1e-3 * poses[:, :3])
    np.testing.assert_allclose(motion.residual, 1e-3)
    np.testing.assert_allclose(
        found.skeletons["right"].offsets, 1e-3 * tree.offsets, atol=1e-12
    )
    np.testing.assert_array_equal(motion.angles, poses[:, 7:])


def test_what_was_odd_stays_with_the_take(rng, tmp_path):
    path = tmp_path / "a.trc"
    files.write(path, a_take(rng))
    path.write_text(path.read_text().replace("X1\tY1", "X0\tY0", 1))
    texts = [event.text for event in files.read(path).remarks]
    assert any("X0" in text for text in texts)
    assert files.inspect(path)["traps"] == texts


@pytest.mark.parametrize("suffix", [".c3d", ".h5", ".trc", ".csv"])
def test_inspect_counts_what_is_there_in_plain_json(suffix, rng, tmp_path):
    path = tmp_path / f"a{suffix}"
    files.write(path, a_take(rng), unnamed=True)
    about = json.loads(json.dumps(files.inspect(path)))
    assert about["format"] == suffix[1:]
    assert (about["frames"], about["rate"]) == (30, 120.0)
    assert about["duration_s"] == pytest.approx(0.25)
    assert about["unit"] == ("m" if suffix == ".h5" else "mm")
    assert about["markers"] == ["A", "B", "C"]
    assert about["missing"] == pytest.approx(
        {"A": 5 / 30, "B": 4 / 30, "C": 0}, abs=1e-5
    )
    assert (about["gaps"], about["longest_gap_frames"], about["open_ends"]) == (2, 4, 1)
    assert about["unlabelled_points"] == 3
    assert about["samples"]["measured"] == 81
    if suffix in (".h5", ".csv"):
        assert about["motions"]["right"]["missing_frames"] == 0
        assert len(about["motions"]["right"]["hinges"]) == 20
    if suffix == ".h5":
        assert about["steps"] == ["simulate"]
        assert about["skeletons"]["right"]["side"] == "right"


def test_inspect_reads_what_does_not_say_its_rate_or_unit(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("A-X,A-Y,A-Z\n1,2,3\n4,5,6\n7,8")
    about = files.inspect(path)
    assert (about["frames"], about["rate"], about["unit"]) == (2, None, None)
    assert about["duration_s"] is None
    for said in ("give --rate", "give --unit", "left out"):
        assert any(said in trap for trap in about["traps"]), said
    about = files.inspect(path, rate_hz=50.0, unit="mm")
    assert (about["rate"], about["unit"], about["duration_s"]) == (50.0, "mm", 0.04)


def test_inspect_says_what_else_a_file_of_ours_is(tmp_path):
    part = Part({"side": "left"}, {"mean": Array(np.zeros(3), "rad")})
    write_h5(tmp_path / "p.h5", "handclean prior", part)
    about = files.inspect(tmp_path / "p.h5")
    assert about["format"] == "handclean prior"
    assert about["parts"] == ["mean"]
    with pytest.raises(
        FileError, match="is a handclean prior; not a handclean session"
    ):
        files.read(tmp_path / "p.h5")


def test_gaps_have_two_ends_and_open_ends_one():
    seen = np.array([[1, 0, 1, 0], [0, 0, 1, 1], [1, 0, 1, 0], [1, 1, 1, 0]], bool)
    lengths, ends = gaps_of(seen)
    assert sorted(lengths) == [1]
    assert ends == 3
    assert gaps_of(np.zeros((5, 2), bool)) == ([], 4)


def test_a_session_keeps_a_c3d_file_so_that_it_can_be_written_again(
    tmp_path, shared_data
):
    source = shared_data / "c3d" / "sample_01" / "Eb015pr.c3d"
    files.write(tmp_path / "a.h5", files.read(source))
    files.write(tmp_path / "a.c3d", files.read(tmp_path / "a.h5"))
    assert (tmp_path / "a.c3d").read_bytes() == source.read_bytes()


def peak_of(read, path):
    """Peak memory in bytes that reading takes, whether or not it succeeds."""
    tracemalloc.start()
    try:
        read(path)
    except HandcleanError:
        pass
    finally:
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    return peak


def hostile():
    """Files whose shape asks for far more memory than they have bytes."""
    trc = "PathFileType\t4\n" + "DataRate\tNumFrames\tNumMarkers\tUnits\n"
    wide = "".join(f"M{i}\t\t\t" for i in range(30_000))
    yield ".trc", trc + f"100\t9\t9\tmm\nFrame#\tTime\t{wide}\n" + "1\n" * 100_000
    yield ".trc", trc + f"100\t9\t9\tmm\nFrame#\tTime\t{wide}\n1\t0\n" + "\t" * 10**6
    yield ".csv", "A_X,A_Y,A_Z\n" + "," * 3_000_000
    yield ".csv", "A_X,A_Y,A_Z\n" + "\n" * 300_000
    yield ".csv", ",".join(f"{i}_X,{i}_Y,{i}_Z" for i in range(33_000)) + "\n0" * 10**4
    yield ".csv", "frame,A_X,A_Y,A_Z\n0,1,2,3\n2000000000,1,2,3\n"
    yield ".csv", "A_X,A_Y,A_Z\n" + ",,\n" * 10**5
    yield ".tsv", "FREQUENCY\t1\nMARKER_NAMES" + "\ta" * 10**6
    yield ".tsv", "FREQUENCY\t1\n" + "A\n" * 10**5
    yield ".bvh", "HIERARCHY\n" + "ROOT a\n{\nOFFSET 0 0 0\n" + "JOINT a\n{\n" * 10**5
    yield ".bvh", "HIERARCHY " + "a " * 10**6


@pytest.mark.parametrize(("suffix", "text"), list(hostile()), ids=range(11))
def test_hostile_files_take_little_memory(suffix, text, tmp_path):
    path = tmp_path / f"a{suffix}"
    path.write_text(text)

    def read(path):
        files.read(path, rate_hz=1.0, unit="mm")

    assert peak_of(read, path) < 2**22 + 50 * len(text)


@pytest.mark.parametrize("suffix", [".h5", ".trc", ".csv"])
def test_reading_takes_a_small_multiple_of_the_files_size(suffix, rng, tmp_path):
    path = tmp_path / f"a{suffix}"
    positions = rng.normal(size=(3000, 40, 3))
    labels = tuple(f"M{m}" for m in range(40))
    markers = trajectories(positions, labels)
    files.write(path, Recording(rate=100.0, frames=3000, markers=markers))
    assert peak_of(files.read, path) < 2**20 + 6 * path.stat().st_size


def test_rejected_samples_do_not_leave_the_session(tmp_path):
    origin = np.full((2, 1), Origin.REJECTED, np.uint8)
    markers = trajectories(np.ones((2, 1, 3)), ("A",), origin=origin)
    take = Recording(rate=1.0, frames=2, markers=markers)
    files.write(tmp_path / "a.h5", take)
    back = files.read(tmp_path / "a.h5").markers
    assert back.origin.tolist() == [[3], [3]]
    notes = texts(files.write(tmp_path / "a.csv", take))
    assert any("rejected" in note for note in notes)
