"""Glove readings in files."""

import time

import h5py
import numpy as np
import pytest

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.io import files
from handclean.io.glove.readings import open_readings
from handclean.io.glove.write_readings import write_readings

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
        (
            "time_s,A,B\n0,1,2\n0,1,2\n",
            "line 3: its time 0 s is not later than the 0 s",
        ),
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


def natural(path, **parts):
    """An HDF5 file as somebody writes it who knows only names."""
    with h5py.File(path, "w") as file:
        for name, values in parts.items():
            file[name] = values
    return path


def test_hdf5_needs_nothing_but_readings(tmp_path, rng):
    times, values = made(rng)
    path = natural(tmp_path / "bare.h5", readings=values)
    found = open_readings(path, rate_hz=60.0)
    assert (found.sensors, found.columns) == ((), 3)
    np.testing.assert_array_equal(found.all()[1], values)
    names = np.array(SENSORS, dtype=h5py.string_dtype())
    path = natural(tmp_path / "named.h5", readings=values, time=times, sensors=names)
    found = open_readings(path)
    assert found.sensors == SENSORS
    np.testing.assert_array_equal(found.all()[0], times)
    about = files.inspect(path)
    assert about["format"] == "glove readings"
    assert about["frames"] == 57


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"values": np.ones((4, 3))}, "has no dataset 'readings'"),
        ({"readings": np.ones(4)}, "has no dataset 'readings'"),
        ({"readings": np.full((4, 3), b"x")}, "should hold numbers"),
        ({"readings": np.ones((4, 3)), "time": np.ones(3)}, "4 frames and other times"),
        (
            {"readings": np.ones((4, 3)), "time": np.array([0.0, 0.1, 0.1, 0.2])},
            "frame 3: its time 0.1 s is not later than the 0.1 s before it; "
            "without the dataset 'time', --rate tells",
        ),
    ],
)
def test_what_is_wrong_with_hdf5_is_named(tmp_path, parts, says):
    path = natural(tmp_path / "take.h5", **parts)
    with pytest.raises(FileError, match=says) as caught:
        open_readings(path, rate_hz=None).all()
    assert "\n" not in str(caught.value)


def test_readings_kept_elsewhere_are_refused(tmp_path, rng):
    natural(tmp_path / "other.h5", readings=made(rng)[1])
    path = tmp_path / "linked.h5"
    with h5py.File(path, "w") as file:
        file["readings"] = h5py.ExternalLink("other.h5", "/readings")
    with pytest.raises(FileError, match="numbers of its own"):
        open_readings(path, rate_hz=60.0)


@pytest.mark.parametrize("suffix", [".csv", ".h5"])
def test_a_rate_that_contradicts_the_times_is_refused(tmp_path, rng, suffix):
    times, values = made(rng, count=600)
    path = tmp_path / f"take{suffix}"
    write_readings(path, times, values, SENSORS, {})
    assert len(open_readings(path, rate_hz=60.0).all()[0]) == 600
    assert len(open_readings(path, rate_hz=60.03).all()[0]) == 600
    for rate in (120.0, 60.2, 59.8):
        with pytest.raises(UsageError, match=f"--rate {rate:g} Hz.* run at 60 Hz"):
            open_readings(path, rate_hz=rate)


def test_lost_frames_and_rounded_times_do_not_contradict_a_rate(tmp_path, rng):
    times, values = made(rng, count=600)
    kept = np.setdiff1d(np.arange(600), [50, 51, 52, 300])
    path = tmp_path / "take.csv"
    write_readings(path, times[kept], values[kept], SENSORS, {})
    open_readings(path, rate_hz=60.0)
    write_readings(path, np.round(times[:57], 3), values[:57], SENSORS, {})
    open_readings(path, rate_hz=60.0)
    with pytest.raises(UsageError, match="--rate 120 Hz"):
        open_readings(path, rate_hz=120.0)


def test_a_time_that_runs_backward_names_its_line_in_any_chunk(tmp_path, rng):
    times, values = made(rng)
    times[30] = times[28]
    path = tmp_path / "take.csv"
    write_readings(path, times, values, SENSORS, {})
    for size in (1, 7, 30, 100):
        with pytest.raises(FileError, match=r"line 33: its time 2\.466667 s is not"):
            list(open_readings(path).chunks(size))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time_s;A;B;C\n0,0;1,5;2;3\n", "parted by semicolons.*decimal points"),
        ("0,0;1,5;2;3\n", "parted by semicolons"),
        ('"# handclean readings {""glove"": ""my""}";;\nA;B\n', "by semicolons"),
        ("time_s\tA\tB\tC\n0\t1\t2\t3\n", "parted by tabs"),
    ],
)
def test_other_separators_are_named(tmp_path, text, says):
    with pytest.raises(FileError, match=says):
        open_readings(write(tmp_path, text), sensors=3)


@pytest.mark.parametrize(
    "text", ["time_s,A,B,C\n0,1,2,3\n0.1,1,2,3\n", "0,1,2,3\n0.1,1,2,3\n"]
)
def test_inspect_says_that_a_csv_may_be_readings(tmp_path, text):
    with pytest.raises(HandcleanError, match="calibrate-glove takes it with --glove"):
        files.inspect(write(tmp_path, text))


@pytest.mark.parametrize(
    "text", ["frame,M_X,M_Y\n1,2,3\n", "time_s,A,B,C\n0,a,b,c\n", "A\n1\n"]
)
def test_inspect_takes_no_other_csv_for_readings(tmp_path, text):
    with pytest.raises(HandcleanError) as caught:
        files.inspect(write(tmp_path, text), unit="mm", rate_hz=60.0)
    assert "glove" not in str(caught.value)


def test_inspecting_readings_without_times_asks_for_the_rate(tmp_path):
    path = write(tmp_path, "# handclean readings {}\nA,B\n1,2\n3,4\n")
    about = files.inspect(path)
    assert (about["frames"], about["rate"]) == (2, None)
    assert about["traps"] == ["has no times; give --rate"]
    assert files.inspect(path, rate_hz=50.0)["duration_s"] == pytest.approx(0.04)


@pytest.mark.parametrize(
    "blank", ["\u00a0", "NULL", "-nan(ind)", "1.#QNAN", "NA", '""']
)
@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_blanks_and_words_for_nothing_are_missing_readings(blank, encoding, tmp_path):
    path = tmp_path / "take.csv"
    path.write_bytes(f"time_s,A,B\n0.0,{blank},1\n0.1,2\u00a0,3\n".encode(encoding))
    np.testing.assert_array_equal(open_readings(path).all()[1], [[np.nan, 1], [2, 3]])


@pytest.mark.parametrize("cell", ["1 2", "x\u00a0y", "\u0663", "1_0"])
def test_what_is_no_reading_is_named_with_its_line(cell, tmp_path):
    path = write(tmp_path, f"time_s,A,B\n0.0,1,1\n0.1,{cell},3\n")
    with pytest.raises(FileError, match=f"line 3: '{cell}' is not a number"):
        open_readings(path).all()


@pytest.mark.parametrize("name", ["Time (ms)", "time_ms", "time [ms]"])
def test_a_column_of_times_may_be_in_milliseconds(name, tmp_path):
    path = write(tmp_path, f"{name},A,B\n5000,1,1\n5010,2,3\n")
    np.testing.assert_allclose(open_readings(path).all()[0], [5.0, 5.01])


def test_times_that_as_seconds_would_run_too_slowly_are_no_rate(tmp_path):
    path = write(tmp_path, "time,A,B\n0,1,1\n10,2,3\n20,2,3\n")
    with pytest.raises(FileError, match=r"runs at 0\.1 Hz, .* call them time_ms"):
        open_readings(path)
    assert open_readings(path, rate_hz=0.1).all()[0].tolist() == [0, 10, 20]


@pytest.mark.parametrize(
    "text", ["a,b\r1,2\r", "a,b\n".encode("utf-16").decode("latin-1")]
)
def test_lines_of_another_kind_are_refused_as_such(text, tmp_path):
    path = tmp_path / "take.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(
        FileError, match=r"not lines of text .* save it as CSV in UTF-8"
    ):
        open_readings(path, rate_hz=60.0)


def test_a_rate_is_compared_with_wild_times_without_warnings(tmp_path):
    path = write(tmp_path, "time_s,A,B\n0,1,1\n1e308,2,3\n")
    with pytest.raises(UsageError, match="its times run at"):
        open_readings(path, rate_hz=60.0)


def test_many_sensors_cost_little(tmp_path):
    names = [f"s{k}" for k in range(50_000)]
    row = ",".join("1" * len(names))
    path = write(tmp_path, ",".join(names) + f"\n{row}\n{row}\n")
    begun = time.process_time()
    assert open_readings(path, rate_hz=60.0).columns == len(names)
    assert time.process_time() - begun < 2.0


SECRET = "not for those who look at gloves"


@pytest.mark.parametrize("part", ["readings", "time", "sensors"])
@pytest.mark.parametrize("how", ["external storage", "link", "soft link", "virtual"])
def test_no_part_is_read_from_another_file(tmp_path, rng, part, how):
    secret = tmp_path / "secret"
    secret.write_text(SECRET * 20)
    times, values = made(rng)
    parts = {"readings": values, "time": times, "sensors": ["A", "B", "C"]}
    path = natural(tmp_path / "take.h5", **parts)
    with h5py.File(path, "r+") as file:
        shape = file[part].shape
        del file[part]
        kind = "S8" if part == "sensors" else "f8"
        if how == "external storage":
            size = int(np.prod(shape)) * 8
            outside = [(str(secret), 0, size)]
            file.create_dataset(part, shape, kind, external=outside)
        elif how == "link":
            file[part] = h5py.ExternalLink(str(secret), "/x")
        elif how == "soft link":
            file[part] = h5py.SoftLink("/elsewhere")
        else:
            layout = h5py.VirtualLayout(shape=shape, dtype=kind)
            layout[:] = h5py.VirtualSource(str(secret), "x", shape=shape)
            file.create_virtual_dataset(part, layout)
    for read in (files.inspect, lambda path: open_readings(path, rate_hz=60.0).all()):
        with pytest.raises(FileError, match="elsewhere") as caught:
            read(path)
        assert SECRET[:8] not in str(caught.value)


ODD = {
    "complex": lambda f: put(f, "readings", np.ones((4, 3), "c16")),
    "records": lambda f: put(f, "readings", np.zeros(4, "f8,i4")),
    "references": lambda f: put(f, "readings", f.ref),
    "group": lambda f: f.create_group("nothing") and put(f, "readings", None),
    "empty": lambda f: put(f, "readings", h5py.Empty("f8")),
    "scalar": lambda f: put(f, "readings", 1.0),
    "three axes": lambda f: put(f, "readings", np.ones((4, 3, 2))),
    "no rows": lambda f: put(f, "readings", np.ones((0, 3))),
    "no columns": lambda f: put(f, "readings", np.ones((4, 0))),
    "times of texts": lambda f: put(f, "time", ["a", "b"]),
    "times of two axes": lambda f: put(f, "time", np.ones((4, 1))),
    "one sensor's name": lambda f: put(f, "sensors", "A"),
    "sensors in numbers": lambda f: put(f, "sensors", np.arange(3)),
    "sensors in a table": lambda f: put(f, "sensors", [["A"], ["B"], ["C"]]),
    "two sensors": lambda f: put(f, "sensors", ["A", "B"]),
    "sensors of numbers of any count": lambda f: put_ragged(f),
    "a long name": lambda f: put(f, "sensors", ["A", "B", "C" * 10**6]),
    "a filter of a plug-in": lambda f: put_packed(f, "lzf"),
    "a huge claim": lambda f: put_huge(f),
}


def put(file, name, value):
    if name in file:
        del file[name]
    if value is None:
        file.create_group(name)
    else:
        file[name] = value


def put_ragged(file):
    file.create_dataset("sensors", (3,), dtype=h5py.vlen_dtype("i4"))


def put_packed(file, how):
    del file["readings"]
    file.create_dataset("readings", data=np.ones((4, 3)), compression=how)


def put_huge(file):
    del file["readings"]
    file.create_dataset("readings", (10**9, 1000), "f8", chunks=(10, 10))


@pytest.mark.parametrize("odd", ODD)
def test_odd_parts_of_other_peoples_files_are_errors_of_one_line(tmp_path, odd):
    path = natural(tmp_path / "take.h5", readings=np.ones((4, 3)))
    with h5py.File(path, "r+") as file:
        ODD[odd](file)
    for read in (files.inspect, lambda path: open_readings(path, rate_hz=60.0).all()):
        with pytest.raises(HandcleanError) as caught:
            read(path)
        assert len(str(caught.value).splitlines()) == 1


ATTRIBUTES = {
    "list": [1, 2, 3],
    "texts": ["a", "b"],
    "complex": 1j,
    "record": np.zeros((), "f8,i4"),
    "none": h5py.Empty("f8"),
    "nan": np.nan,
    "large": np.zeros((50, 50)),
}


@pytest.mark.parametrize("odd", ATTRIBUTES)
@pytest.mark.parametrize("name", ["more", "glove", "rate_hz", "subject"])
def test_odd_attributes_of_other_peoples_files_do_no_harm(tmp_path, odd, name):
    path = natural(tmp_path / "take.h5", readings=np.ones((4, 3)))
    with h5py.File(path, "r+") as file:
        file.attrs[name] = ATTRIBUTES[odd]
        file["of_others"] = np.zeros(3, "f8,i4")
        file["linked"] = h5py.ExternalLink("none.h5", "/")
    assert files.inspect(path)["frames"] == 4
    assert open_readings(path, rate_hz=60.0).all()[1].shape == (4, 3)
