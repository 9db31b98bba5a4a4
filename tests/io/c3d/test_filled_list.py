"""Fills stay told apart where a C3D file's residuals were not recorded."""

import io
from dataclasses import replace

import numpy as np
import pytest
from told import texts

from handclean.io.c3d.filled_list import Marks, read_marks, with_marks
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.numbers import Processor
from handclean.io.c3d.parameters import Section, parse_section
from handclean.io.c3d.read import read_c3d, write_c3d
from handclean.io.hdf5.session import read_session, write_session
from handclean.recording import Origin
from tests.io.c3d.c3d_oracles import by_c3d, by_ezc3d, c3d_bytes

FRAMES, POINTS = 40, 4
LABELS = ["A", "B", "C", "*0"]
ALL = pytest.mark.parametrize(
    ("processor", "is_float"),
    [("intel", True), ("intel", False), ("dec", True), ("mips", False)],
)


def silent(rng, processor="intel", is_float=True, **more):
    """Bytes of a file all of whose fourth words are 0, -1 where a point is missing."""
    raw = np.rint(rng.normal(size=(FRAMES, POINTS, 3)) * 1000)
    words = np.zeros((FRAMES, POINTS), int)
    words[10:15, 1] = words[20:22, 0] = words[3, 3] = -1
    raw[words < 0] = 0
    coded = {"processor": processor, "is_float": is_float}
    return c3d_bytes(raw, words, LABELS, **coded, **more)


def filled(recording, *gaps):
    """Fill gaps: marker, first frame, frame behind the last."""
    markers = recording.markers
    positions, origin = markers.positions.copy(), markers.origin.copy()
    for marker, start, stop in gaps:
        positions[start:stop, marker] = 0.1 + 0.01 * np.arange(stop - start)[:, None]
        origin[start:stop, marker] = Origin.FILLED
    return replace(
        recording, markers=replace(markers, positions=positions, origin=origin)
    )


def written(recording):
    file = io.BytesIO()
    notes = texts(write_c3d(file, recording))
    return file.getvalue(), notes


@pytest.fixture
def read(tmp_path):
    def go(content):
        (tmp_path / "a.c3d").write_bytes(content)
        return read_c3d(tmp_path / "a.c3d")

    return go


@ALL
def test_fills_in_a_file_without_residuals_come_back_as_fills(
    rng, read, processor, is_float
):
    source = read(silent(rng, processor, is_float))
    assert (source.markers.origin <= Origin.MEASURED).all()
    take = filled(source, (1, 10, 15), (0, 20, 21))
    content, notes = written(take)
    assert notes == ()
    again = read(content)
    np.testing.assert_array_equal(again.markers.origin, take.markers.origin)
    (event,) = again.remarks
    assert "6 points are listed in HANDCLEAN:FILLED" in event.text
    # and once more, byte for byte
    assert written(again)[0] == content


@ALL
def test_what_was_measured_is_not_touched(rng, read, processor, is_float):
    source = read(silent(rng, processor, is_float))
    again = read(written(filled(source, (1, 10, 15)))[0])
    before = source.parameters["c3d"]["frames"].reshape(FRAMES, -1, 4)
    after = again.parameters["c3d"]["frames"].reshape(FRAMES, -1, 4)
    same = np.ones((FRAMES, POINTS), bool)
    same[10:15, 1] = False
    np.testing.assert_array_equal(before[:, :POINTS][same], after[:, :POINTS][same])


def test_fills_survive_a_stay_in_a_session_file(rng, read, tmp_path):
    take = filled(read(silent(rng)), (1, 10, 15))
    content, _ = written(take)
    write_session(tmp_path / "a.h5", read(content))
    back = read_session(tmp_path / "a.h5")
    np.testing.assert_array_equal(back.markers.origin, take.markers.origin)
    assert written(back)[0] == content


def test_other_readers_find_every_point(rng, tmp_path):
    path = tmp_path / "a.c3d"
    path.write_bytes(silent(rng, analog=np.zeros((FRAMES, 1)), per_frame=1))
    content, _ = written(filled(read_c3d(path), (1, 10, 15)))
    path.write_bytes(content)
    ours = read_c3d(path).markers.positions * 1e3
    seen = np.isfinite(ours).all(axis=2)
    assert seen[10:15, 1].all()
    np.testing.assert_allclose(by_c3d(path)[:, :3, :3][seen], ours[seen], atol=1e-3)
    np.testing.assert_allclose(by_ezc3d(path)[:, :3][seen], ours[seen], atol=1e-3)


def test_a_fill_that_is_taken_back_leaves_the_file_as_it_was(rng, read):
    first = silent(rng)
    source = read(first)
    again = read(written(filled(source, (1, 10, 15)))[0])
    unfilled = replace(again, markers=source.markers)
    last = read(written(unfilled)[0])
    assert "HANDCLEAN" not in last.parameters["c3d"]["groups"]
    np.testing.assert_array_equal(last.markers.origin, source.markers.origin)


def test_other_fills_replace_those_before(rng, read):
    again = read(written(filled(read(silent(rng)), (1, 10, 15)))[0])
    more = filled(again, (0, 20, 22))
    np.testing.assert_array_equal(
        read(written(more)[0]).markers.origin, more.markers.origin
    )


def test_a_measured_point_that_was_moved_makes_no_fill_of_the_others(rng, read):
    source = read(silent(rng))
    positions = source.markers.positions.copy()
    positions[5, 2] += 0.01
    moved = replace(source, markers=replace(source.markers, positions=positions))
    again = read(written(moved)[0])
    np.testing.assert_array_equal(again.markers.origin, source.markers.origin)


def test_a_list_of_other_samples_is_not_believed(rng, read, tmp_path):
    content, _ = written(filled(read(silent(rng)), (1, 10, 15)))
    take = read(content)
    words = take.parameters["c3d"]["frames"]
    at = content.rindex(words[12, 4:7].tobytes())  # the middle of the gap
    moved = np.frombuffer(words[12, 4:7].tobytes(), "<f4") + np.float32(1)
    other = content[:at] + moved.astype("<f4").tobytes() + content[at + 12 :]
    again = read(other)
    assert not (again.markers.origin == Origin.FILLED).any()
    assert "lists other samples than these" in again.remarks[0].text
    traps = inspect_c3d(tmp_path / "a.c3d")["traps"]
    assert any("lists other samples" in trap for trap in traps)


def empty():
    return parse_section(bytes([1, 80, 1, 84]) + b"\0" * 508, Processor.INTEL)


def test_long_runs_late_frames_and_many_gaps_are_listed():
    runs = np.array([[0, 70_000, 140_000], *([[2, 3 * n, 1] for n in range(600)])])
    section = with_marks(empty(), Marks(runs=runs, crc=2**32 - 5))
    found = read_marks(section)
    assert found.crc == 2**32 - 5
    assert found.runs[:3].tolist() == [
        [0, 70_000, 65_535],
        [0, 135_535, 65_535],
        [0, 201_070, 8_930],
    ]
    np.testing.assert_array_equal(found.runs[3:], runs[1:])
    assert with_marks(section, Marks(runs=runs, crc=2**32 - 5)) is section


def test_a_list_that_has_no_room_is_not_written(rng, read, monkeypatch):
    runs = np.array([[0, 3 * n, 1] for n in range(20_000)])
    assert with_marks(empty(), Marks(runs=runs, crc=1)) is None
    monkeypatch.setattr("handclean.io.c3d.filled_list._SPARED_BYTES", 1 << 20)
    content, notes = written(filled(read(silent(rng)), (1, 10, 15)))
    assert any("which samples are filled is not kept" in note for note in notes)
    assert read(content).frames == FRAMES


@pytest.mark.parametrize("broken", ["cut", "odd", "far", "no sum"])
def test_a_broken_list_is_no_reason_to_fail(broken):
    marks = Marks(runs=np.array([[0, 1, 2], [1, 5, 3]]), crc=9)
    section = with_marks(empty(), marks)
    assert isinstance(section, Section)
    kept = []
    for entry in section.entries:
        if entry.name == "FILLED_CRC" and broken == "no sum":
            continue
        if entry.name == "FILLED" and broken == "cut":
            entry = replace(entry, data=entry.data[:11])
        if entry.name == "FILLED" and broken == "odd":
            entry = replace(entry, data=b"")
        if entry.name == "FILLED" and broken == "far":
            entry = replace(entry, data=b"\xff" * 16)
        kept.append(entry)
    found = read_marks(replace(section, entries=tuple(kept)))
    assert found is None or len(found.runs) in (1, 2)
