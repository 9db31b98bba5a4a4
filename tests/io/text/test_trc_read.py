"""TRC: what programs write is read, and what we write comes back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from told import texts

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.io import files
from handclean.io.text.trc_read import read_trc
from handclean.io.text.trc_write import write_trc
from handclean.recording import Origin, Recording, trajectories

PLAIN = (
    "PathFileType\t4\t(X/Y/Z)\tx.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
    "OrigDataStartFrame\tOrigNumFrames\n"
    "100\t100\t3\t2\tmm\t100\t1\t3\n"
    "Frame#\tTime\tA\t\t\tB b\t\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n"
    "\n"
    "1\t0.00\t1\t2\t3\t4\t5\t6\t\n"
    "2\t0.01\t1\t2\t3\t\t\t\t\n"
    "3\t0.02\t1\t2\t3\t7\t8\t9\n"
)


def written(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_blank_cells_are_missing_and_lengths_become_metres(tmp_path):
    reading = read_trc(written(tmp_path / "a.trc", PLAIN))
    take = reading.recording
    assert (take.rate, take.frames, take.first_frame) == (100.0, 3, 1)
    assert take.markers.labels == ("A", "B b")
    np.testing.assert_array_equal(
        take.markers.positions[:, 0], [[1e-3, 2e-3, 3e-3]] * 3
    )
    assert np.isnan(take.markers.positions[1, 1]).all()
    assert take.markers.origin.tolist() == [[1, 1], [1, 0], [1, 1]]
    assert texts(reading.remarks) == ()
    assert reading.unit == "mm"


@pytest.mark.parametrize(
    ("old", "new", "trap"),
    [
        ("X1\tY1\tZ1\tX2\tY2\tZ2", "X0\tY0\tZ0\tX1\tY1\tZ1", "X0"),
        ("100\t100\t3\t2\tmm", "100\t100\t9\t2\tmm", "NumFrames says 9"),
        ("100\t100\t3\t2\tmm", "100\t100\t3\t7\tmm", "NumMarkers says 7"),
        ("2\t0.01", "2\t0.5", "Time column"),
        ("3\t0.02", "5\t0.04", "2 of 5 frames are left out"),
        ("3\t0.02\t1\t2", "3\t0.02\t1\tinf", "1 infinite"),
        ("3\t0.02\t1\t2\t3", "3\t0.02\t0\t0\t0.0", "1 samples at (0, 0, 0)"),
    ],
)
def test_what_is_odd_is_read_and_reported(old, new, trap, tmp_path):
    reading = read_trc(written(tmp_path / "a.trc", PLAIN.replace(old, new)))
    assert any(trap in line for line in texts(reading.remarks)), texts(reading.remarks)


def test_frames_that_are_left_out_are_missing_at_their_place(tmp_path):
    text = PLAIN.replace("3\t0.02", "5\t0.04").replace("1\t0.00", "-1\t-0.02")
    take = read_trc(written(tmp_path / "a.trc", text)).recording
    assert (take.first_frame, take.frames) == (-1, 7)
    assert take.markers.origin[:, 0].tolist() == [1, 0, 0, 1, 0, 0, 1]


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_any_line_end_and_byte_order_mark_will_do(end, tmp_path):
    plain = read_trc(written(tmp_path / "a.trc", PLAIN)).recording
    text = "\ufeff" + PLAIN.replace("\n", end)
    for name, encoding in (("b.trc", "utf-8"), ("c.trc", "utf-16-le")):
        take = read_trc(written(tmp_path / name, text.encode(encoding))).recording
        np.testing.assert_array_equal(take.markers.positions, plain.markers.positions)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("PathFileType", "Path", "not a TRC file"),
        ("DataRate\tC", "Rate\tC", "no DataRate"),
        ("\n100\t100", "\nnan\t100", "DataRate is 'nan'"),
        ("\n100\t100", "\n0\t100", "DataRate is '0'"),
        ("\tmm\t", "\tinch\t", "'inch'"),
        (PLAIN[PLAIN.index("A\t\t") :], "\n\n\n1\t0.0\n2\t0.1\n", "no markers"),
        ("B b", "A", "2 markers are called 'A'"),
        ("A\t\t\tB", "A\tB\t\tC", "above its X"),
        ("2\t0.01\t1", "2\t0.01\tx", "line 8 column 3: 'x' is not a number"),
        ("2\t0.01\t1", "2\t0.01\t1_0", "'1_0' is not a number"),
        ("2\t0.01\t1", "2\t0.01\t1,5", "decimal point"),
        ("\t\t\t\t\n3", "\t\t\t\t7\n3", "more than 8 cells"),
        ("2\t0.01\t1\t2\t3\t\t\t\t", "2\t0.01\t1", "has 3 cells"),
        ("2\t0.01", "1\t0.01", "frame 1 follows frame 1"),
        ("2\t0.01", "1.5\t0.01", "whole number"),
        ("3\t0.02", "3000\t0.02", "over 3000 frames"),
        ("3\t0.02", "1e300\t0.02", "beyond any take"),
        (PLAIN[PLAIN.index("1\t0.00") :], "", "no frames"),
        (PLAIN[40:], "", "ends after line 2"),
    ],
)
def test_a_broken_file_is_one_clear_line(old, new, complaint, tmp_path):
    path = written(tmp_path / "a.trc", PLAIN.replace(old, new, 1))
    with pytest.raises(FileError, match=complaint) as caught:
        read_trc(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_cut_file_is_saved_only_when_asked(tmp_path):
    path = written(tmp_path / "a.trc", PLAIN[:-8])
    with pytest.raises(FileError, match="--lenient saves 2 rows"):
        read_trc(path)
    reading = read_trc(path, lenient=True)
    assert reading.recording.frames == 2
    assert any("left out" in trap for trap in texts(reading.remarks))


def test_options_must_agree_with_the_file(tmp_path):
    path = written(tmp_path / "a.trc", PLAIN)
    read_trc(path, rate_hz=100.05, unit="mm")
    with pytest.raises(UsageError, match=r"--rate 100\.2 contradicts"):
        read_trc(path, rate_hz=100.2)
    other = read_trc(path, unit="cm")
    assert "--unit cm is taken, though the file says mm" in texts(other.remarks)
    with pytest.raises(UsageError, match="mm, cm or m"):
        read_trc(path, unit="furlong")
    with pytest.raises(UsageError, match="--rate should be"):
        read_trc(path, rate_hz=-1.0)


places = hnp.arrays(
    np.float64,
    st.tuples(st.integers(1, 6), st.integers(1, 4), st.just(3)),
    elements=st.floats(1e-8, 100) | st.floats(-100, -1e-8) | st.just(np.nan),
)


@given(positions=places, rate=st.floats(0.01, 1e5), first=st.integers(-9, 10**6))
def test_what_is_written_is_read_back(positions, rate, first, tmp_path_factory):
    path = tmp_path_factory.mktemp("trc") / "a.trc"
    positions[np.isnan(positions).any(axis=2)] = np.nan
    names = tuple(f"M{i}" for i in range(positions.shape[1]))
    take = Recording(
        rate=rate,
        frames=len(positions),
        first_frame=first,
        markers=trajectories(positions, names),
    )
    assert write_trc(path, take) == ()
    reading = read_trc(path)
    back = reading.recording
    assert (back.frames, back.first_frame, back.markers.labels) == (
        take.frames,
        first,
        names,
    )
    assert back.rate == pytest.approx(rate, rel=1e-9)
    np.testing.assert_allclose(back.markers.positions, positions, atol=5.1e-10)
    np.testing.assert_array_equal(back.markers.origin, take.markers.origin)


def test_filled_and_rejected_samples_are_noted(tmp_path):
    positions = np.ones((3, 1, 3))
    origin = np.array([[Origin.MEASURED], [Origin.FILLED], [Origin.REJECTED]], np.uint8)
    markers = trajectories(positions, ("A",), origin=origin)
    take = Recording(rate=1.0, frames=3, markers=markers)
    notes = texts(files.write(tmp_path / "a.trc", take))
    assert any("TRC keeps no marks of filled" in note for note in notes)
    assert any("1 rejected" in note for note in notes)
    back = read_trc(tmp_path / "a.trc").recording.markers
    assert back.origin[:, 0].tolist() == [1, 1, 0]


@given(data=st.data())
def test_damaged_files_raise_nothing_but_our_errors(data, tmp_path_factory):
    path = tmp_path_factory.mktemp("fuzz") / "a.trc"
    raw = bytearray(PLAIN.encode())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at : at + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=3))
    path.write_bytes(raw[: data.draw(st.integers(0, len(raw)))])
    try:
        reading = read_trc(path, lenient=data.draw(st.booleans()))
    except HandcleanError:
        return
    assert reading.recording.frames > 0


@given(raw=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
def test_any_bytes_raise_nothing_but_our_errors(raw, tmp_path_factory):
    path = tmp_path_factory.mktemp("fuzz") / "a.trc"
    path.write_bytes(PLAIN[: PLAIN.index("Frame#")].encode() + raw)
    try:
        read_trc(path)
    except HandcleanError as error:
        message = str(error)
    else:
        message = ""
    assert "\n" not in message


def test_real_takes_with_wrong_counts_keep_their_timing(shared_data):
    folder = shared_data / "sig18"
    paths = sorted(folder.glob("*/*/*.trc"))
    wrong = 0
    for path in paths:
        reading = read_trc(path)
        take = reading.recording
        assert take.rate == 120.0
        assert len(take.markers.labels) == 19
        assert any("X0" in trap for trap in texts(reading.remarks))
        said = [trap for trap in texts(reading.remarks) if "NumFrames" in trap]
        wrong += bool(said)
        assert not any("Time" in trap for trap in texts(reading.remarks))
    assert (len(paths), wrong) == (168, 15)
    take = read_trc(next(p for p in paths if p.match("*User1/capture1/sequence.27*")))
    assert take.recording.frames == 112
    assert np.count_nonzero(take.recording.markers.origin.any(axis=1)) == 90


@pytest.mark.parametrize("start", [2.345, -1.5, 0.0])
def test_the_time_of_the_first_row_is_kept(start, tmp_path):
    text = PLAIN
    for row in range(3):
        text = text.replace(f"\t0.0{row}\t", f"\t{start + 0.01 * row:.3f}\t")
    take = read_trc(written(tmp_path / "a.trc", text)).recording
    assert take.start_time == start
    for suffix in (".trc", ".csv", ".h5"):
        files.write(tmp_path / f"b{suffix}", take)
        assert files.read(tmp_path / f"b{suffix}").start_time == start
