"""Glove readings in files."""

import numpy as np
import pytest

from handclean.errors import FileError, UsageError
from handclean.io import files
from handclean.io.glove import open_readings, write_readings

SENSORS = ("A", "B", "C")


def made(rng, count=57):
    times = 2.0 + np.arange(count) / 60.0
    values = np.round(rng.uniform(0, 255, (count, 3)), 3)
    values[5, 1] = np.nan
    return np.round(times, 6), values


@pytest.mark.parametrize("suffix", [".csv", ".h5"])
@pytest.mark.parametrize("size", [1, 10, 57, 1000])
def test_readings_come_back_whatever_the_chunks(tmp_path, rng, suffix, size):
    times, values = made(rng)
    path = tmp_path / f"take{suffix}"
    write_readings(path, times, values, SENSORS, {"glove": "my", "moved": "A+B"})
    found = open_readings(path)
    assert (found.sensors, found.columns) == (SENSORS, 3)
    assert found.facts["glove"] == "my"
    assert found.facts["moved"] == "A+B"
    pieces = list(found.chunks(size))
    assert all(len(piece) <= size for piece, _ in pieces)
    np.testing.assert_array_equal(np.concatenate([t for t, _ in pieces]), times)
    np.testing.assert_array_equal(np.concatenate([v for _, v in pieces]), values)


def write(tmp_path, text):
    path = tmp_path / "take.csv"
    path.write_text(text)
    return path


def test_other_peoples_headers_are_understood(tmp_path):
    path = write(tmp_path, "Frame,Time (s),A,B\n1,0.5,10,20\n2,0.6,11,\n")
    found = open_readings(path)
    times, values = found.all()
    assert found.sensors == ("A", "B")
    np.testing.assert_allclose(times, [0.5, 0.6])
    np.testing.assert_array_equal(values, [[10, 20], [11, np.nan]])


def test_without_a_header_columns_are_sensors_perhaps_after_a_time(tmp_path):
    path = write(tmp_path, "0.0,1,2,3\n0.1,4,5,6\n")
    with_time = open_readings(path, sensors=3)
    assert with_time.columns == 3
    np.testing.assert_allclose(with_time.all()[0], [0.0, 0.1])
    bare = open_readings(path, sensors=4, rate_hz=50.0)
    assert bare.columns == 4
    np.testing.assert_allclose(bare.all()[0], [0.0, 0.02])


def test_a_file_without_times_needs_a_rate(tmp_path):
    path = write(tmp_path, "A,B\n1,2\n3,4\n")
    with pytest.raises(UsageError, match="--rate"):
        open_readings(path)
    np.testing.assert_allclose(open_readings(path, rate_hz=10.0).all()[0], [0.0, 0.1])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "has no readings"),
        ("time_s,A,B\n", "has no readings"),
        ("time_s,A,B\n0,1,2\n1,2\n", "line 3: has 2 cells"),
        ("time_s,A,B\n0,1,x2\n", "line 2: 'x2' is not a number"),
        ("time_s,A,B\n0,1,2\n0,1,2\n", "frame 2 is not later"),
        ("time_s,A,B\n0,1,2\n,1,2\n", "without a time"),
        ("time_s,A,A\n0,1,2\n", "'A' twice"),
        ("time_s,A,\n0,1,2\n", "without a name"),
        ("time_s\n0\n", "no column of readings"),
        ("# handclean readings {oops\ntime_s,A\n0,1\n", "damaged"),
    ],
)
def test_what_is_wrong_with_a_file_is_named_in_one_line(tmp_path, text, says):
    path = write(tmp_path, text)
    with pytest.raises(FileError, match=says) as caught:
        open_readings(path).all()
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_are_not_readings_are_refused(tmp_path, rng):
    with pytest.raises(FileError, match="no such file"):
        open_readings(tmp_path / "none.csv")
    with pytest.raises(FileError, match=r"\.csv or \.h5"):
        open_readings(tmp_path / "take.txt")
    path = tmp_path / "take.h5"
    path.write_bytes(b"not hdf5")
    with pytest.raises(FileError, match="HDF5"):
        open_readings(path)


def test_inspecting_readings_tells_frames_sensors_and_dead_ones(tmp_path, rng):
    times, values = made(rng)
    values[:, 2] = 7.0
    path = tmp_path / "take.csv"
    write_readings(path, times, values, SENSORS, {"glove": "my"})
    about = files.inspect(path)
    assert about["format"] == "glove readings"
    assert about["frames"] == 57
    assert about["rate"] == pytest.approx(60.0, rel=1e-3)
    assert about["sensors"] == ["A", "B", "C"]
    assert about["traps"] == ["C never changes", "1 readings are missing"]
