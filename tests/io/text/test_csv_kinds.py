"""CSV and TSV of other programs: heads, units, times, what is no marker."""

import re
import time

import numpy as np
import pytest
from told import texts

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.io import files
from handclean.io.text.csv_read import read_csv
from handclean.io.text.qualisys import read_tsv

HEAD = ["A_X", "A_Y", "A_Z", "B_X", "B_Y", "B_Z"]
ROWS = 6


def csv(head=HEAD, time=None, unit=1.0, part=",", more=(), first=1, start=0.0):
    """Lines of a CSV file of two markers at 120 Hz, a column of times if named."""
    lines = [part.join([*(["frame", time] if time else []), *head])]
    for k in range(ROWS):
        cells = [f"{first + k}", f"{(start + k / 120) / unit:.6f}"] if time else []
        cells += [f"{10 + k}.5", "20.25", "30.125", f"{100 + k}.5", "120.25", "130.125"]
        lines.append(part.join([*cells, *more]))
    return lines


def read(tmp_path, lines, rate_hz=None, unit="mm", **options):
    text = lines if isinstance(lines, bytes) else "\n".join([*lines, ""]).encode()
    (tmp_path / "a.csv").write_bytes(text)
    return read_csv(tmp_path / "a.csv", rate_hz=rate_hz, unit=unit, **options)


def expect(reading, first=1, rate=120.0):
    take = reading.recording
    assert (take.rate, take.frames, take.first_frame) == (rate, ROWS, first)
    assert take.markers.labels == ("A", "B")
    np.testing.assert_allclose(
        take.markers.positions[1],
        [[0.0115, 0.02025, 0.030125], [0.1015, 0.12025, 0.130125]],
    )


# --- times --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time", 1.0),
        ("time_s", 1.0),
        ("Time (s)", 1.0),
        ("Time [sec]", 1.0),
        ("time_ms", 1e-3),
        ("Time (ms)", 1e-3),
        ("timestamp [us]", 1e-6),
        ("Time_Seconds", 1.0),
        ("t", 1.0),
    ],
)
def test_a_column_of_times_may_name_its_unit(name, unit, tmp_path):
    reading = read(tmp_path, csv(time=name, unit=unit, start=5.0))
    expect(reading)
    assert reading.recording.start_time == pytest.approx(5.0)
    assert texts(reading.remarks) == ()


@pytest.mark.parametrize(
    ("unit", "name"), [(1e-3, "milli"), (1e-6, "micro"), (1e-9, "nano")]
)
def test_times_no_camera_runs_at_are_milliseconds_or_less_and_said(
    unit, name, tmp_path
):
    reading = read(tmp_path, csv(time="time", unit=unit, start=2.0))
    expect(reading)
    assert reading.recording.start_time == pytest.approx(2.0)
    assert any(f"read as {name}seconds" in trap for trap in texts(reading.remarks))


@pytest.mark.parametrize(("name", "unit"), [("time_s", 1e-3), ("time_ms", 1.0)])
def test_times_that_deny_their_unit_are_no_rate(name, unit, tmp_path):
    with pytest.raises(FileError, match=f"'{name}' it runs at .* which is no rate"):
        read(tmp_path, csv(time=name, unit=unit))


@pytest.mark.parametrize("rate", [24, 25, 30, 50, 60, 100, 119.88, 120, 125, 144, 240])
@pytest.mark.parametrize("rows", [4, 12, 500])
def test_times_rounded_to_milliseconds_run_at_the_rounder_rate(rate, rows, tmp_path):
    lines = ["time,A_X,A_Y,A_Z"]
    lines += [f"{round(1000 * k / rate)},1,2,{k}" for k in range(rows)]
    found = read(tmp_path, lines).recording.rate
    steps = np.rint(1000 * np.arange(rows) / rate)
    assert np.all(np.abs(np.arange(rows) / found * 1000 - steps) <= 1.0 + 1e-6)
    if rate % 10 == 0 and rate <= 120:
        assert found == rate
    assert abs(found - rate) < (0.06 if rows > 4 else 0.3) * rate


def test_frames_and_times_that_fall_are_an_error(tmp_path):
    rows = [f"{9 - k},{(9 - k) / 119.7:.5f},1,2,{k}" for k in range(6)]
    with pytest.raises(FileError, match="frame 8 follows frame 9"):
        read(tmp_path, ["frame,time,A_X,A_Y,A_Z", *rows])


def test_times_that_count_rows_are_of_no_unit(tmp_path):
    lines = ["time,A_X,A_Y,A_Z", *(f"{k},1,2,{k}" for k in range(5))]
    with pytest.raises(FileError, match="seconds, milliseconds or frames"):
        read(tmp_path, lines)
    assert read(tmp_path, lines, rate_hz=1.0).recording.rate == 1.0
    assert read(tmp_path, lines, rate_hz=1000.0).recording.rate == 1000.0
    with pytest.raises(UsageError, match="--rate 120 contradicts"):
        read(tmp_path, lines, rate_hz=120.0)


def test_an_option_makes_seconds_of_slow_times(tmp_path):
    reading = read(tmp_path, csv(time="time", unit=1e-3), rate_hz=0.12)
    expect(reading, rate=0.12)


def test_the_time_of_the_first_row_goes_through_every_format_that_keeps_it(tmp_path):
    take = read(tmp_path, csv(time="time_s", first=50, start=5.0)).recording
    assert (take.start_time, take.first_frame) == (5.0, 50)
    for suffix in (".csv", ".trc", ".h5"):
        files.write(tmp_path / f"b{suffix}", take)
        back = files.read(tmp_path / f"b{suffix}")
        assert (back.start_time, back.first_frame) == (5.0, 50)
    text = (tmp_path / "b.csv").read_text().splitlines()
    assert text[2].startswith("50,5.000000,")
    assert "5.000000" in (tmp_path / "b.trc").read_text().splitlines()[6]


# --- a line of units ----------------------------------------------------------------


def with_units(row, time="time_s", unit=1.0, part=",", heads=1, **options):
    """Lines of `csv` with a line of units below the names, in one line or in two."""
    head, *rows = csv(time=time, unit=unit, part=part, **options)
    names = [head]
    if heads == 2:
        names = [part.join(["", "", "A", "", "", "B", "", ""])]
        names += [part.join(["frame", time, *"XYZXYZ"])]
    return [*names, row.replace(",", part), *rows]


@pytest.mark.parametrize("heads", [1, 2])
@pytest.mark.parametrize("part", [",", ";", "\t"])
@pytest.mark.parametrize(
    ("row", "time", "unit"),
    [
        (",s,mm,mm,mm,mm,mm,mm", "time_s", 1.0),
        (",s,mm,mm,mm,mm,mm,mm", "time", 1.0),
        (",sec,MM,MM,MM,MM,MM,MM", "Timestamp", 1.0),
        (",ms,mm,mm,mm,mm,mm,mm", "time", 1e-3),
        (",ms,mm,mm,mm,mm,mm,mm", "time_ms", 1e-3),
        (",[s],[mm],[mm],[mm],[mm],[mm],[mm]", "time_s", 1.0),
        ("(#),(ms),(mm),(mm),(mm),(mm),(mm),(mm)", "Time", 1e-3),
        ('"","s","mm","mm","mm","mm","mm","mm"', "time_s", 1.0),
        (",,mm,mm,mm,mm,mm,mm", "time_s", 1.0),
        (",s,mm,,,mm,,", "time", 1.0),
        (",s,mm,,,,,", "time_s", 1.0),
        (",s,mm", "time_s", 1.0),
        ("-, s , mm ,-,-, mm ,-,-", "time_s", 1.0),
        ("frames,seconds,millimetres,mm,mm,mm,mm,mm", "time", 1.0),
    ],
)
def test_units_may_stand_in_a_line_below(row, time, unit, part, heads, tmp_path):
    lines = with_units(row, time, unit, part, heads, start=5.0)
    reading = read(tmp_path, lines, unit=None)
    expect(reading)
    assert reading.recording.start_time == pytest.approx(5.0)
    assert texts(reading.remarks) == ()


@pytest.mark.parametrize("heads", [1, 2])
def test_the_line_of_units_is_the_unit(heads, tmp_path):
    lines = with_units(",s,m,m,m,m,m,m", heads=heads)
    places = read(tmp_path, lines, unit=None).recording.markers.positions
    np.testing.assert_allclose(places[0, 0], [10.5, 20.25, 30.125])


@pytest.mark.parametrize("heads", [1, 2])
def test_a_line_of_units_may_be_of_times_only(heads, tmp_path):
    lines = with_units(",ms,,,,,,", "time", 1e-3, heads=heads)
    expect(read(tmp_path, lines))
    with pytest.raises(UsageError, match="does not say its unit"):
        read(tmp_path, lines, unit=None)


def test_the_unit_of_times_may_stand_beside_the_axes(tmp_path):
    lines = ["Frame,Time,A,,,B,,", ",ms,X,Y,Z,X,Y,Z", *csv(time="t", unit=1e-3)[1:]]
    expect(read(tmp_path, lines))


def test_times_may_be_the_first_column_below_names(tmp_path):
    rows = [row.partition(",")[2] for row in csv(time="t")[1:]]
    lines = ["Time,A,,,B,,", ",X,Y,Z,X,Y,Z", "s,mm,mm,mm,mm,mm,mm", *rows]
    expect(read(tmp_path, lines, unit=None))


@pytest.mark.parametrize("heads", [1, 2])
@pytest.mark.parametrize(
    ("row", "says"),
    [
        (",s,mm,mm,mm,m,m,m", "its columns are in m and in mm"),
        (",s,mm,mm,mm,cm,,", "its columns are in cm and in mm"),
        (",s,mm,m,mm,mm,mm,mm", "its columns are in m and in mm"),
        (",s,mm,mm,mm,inch,inch,inch", "its columns are in mm and in inch"),
        (",s,inch,inch,inch,inch,inch,inch", "no markers; the unit 'inch' is none of"),
        (",ms,mm,mm,mm,mm,mm,mm", "the unit below its column 'time_s' is 'ms'"),
        (",s,mm,mm,mm,mm,mm,7", "line . column 2: 's' is not a number"),
    ],
)
def test_units_that_contradict_each_other_are_an_error(row, says, heads, tmp_path):
    with pytest.raises(FileError, match=says):
        read(tmp_path, with_units(row, heads=heads), unit=None)


def test_the_names_and_the_line_of_units_should_agree(tmp_path):
    head = [f"{name} [mm]" for name in HEAD]
    lines = csv(head, time="time_s")
    units = ",s,mm,mm,mm,mm,mm,mm"
    expect(read(tmp_path, [lines[0], units, *lines[1:]], unit=None))
    with pytest.raises(FileError, match="its columns are in m and in mm"):
        read(tmp_path, [lines[0], units.replace("mm", "m"), *lines[1:]], unit=None)


def test_what_is_no_place_by_its_unit_is_left_out_and_said(tmp_path):
    lines = csv([*HEAD, "F_X", "F_Y", "F_Z"], time="time_s", more=["1", "2", "3"])
    lines.insert(1, ",s,mm,mm,mm,mm,mm,mm,N,N,N")
    reading = read(tmp_path, lines, unit=None)
    expect(reading)
    (trap,) = texts(reading.remarks)
    assert trap == "not a marker's place, left out: F_X [N], F_Y [N], F_Z [N]"


def test_a_unit_that_is_none_of_time_leaves_the_times_out(tmp_path):
    lines = with_units(",h:m:s,mm,mm,mm,mm,mm,mm", "time")
    reading = read(tmp_path, lines, rate_hz=120.0, unit=None)
    expect(reading)
    assert texts(reading.remarks) == ("not a marker's place, left out: time [h:m:s]",)


@pytest.mark.parametrize("heads", [1, 2])
def test_a_row_with_one_bad_cell_is_no_line_of_units(heads, tmp_path):
    for bad in ("oops", "m"):
        lines = csv(time="time_s")
        lines[1] = lines[1].replace("20.25", bad)
        if heads == 2:
            lines = with_units(lines[1], heads=2)
        with pytest.raises(FileError, match=f"column 4: '{bad}' is not a number"):
            read(tmp_path, lines)


def test_a_file_of_ours_has_no_line_of_units(tmp_path):
    files.write(tmp_path / "b.csv", read(tmp_path, csv(time="time_s")).recording)
    lines = (tmp_path / "b.csv").read_text().splitlines()
    lines.insert(2, ",s,m,m,m,,m,m,m,")
    with pytest.raises(FileError, match="has a line of units below its names"):
        read(tmp_path, lines, unit=None)


# --- names --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "form", ["{} [mm]", "{}[mm]", "{} (mm)", "{}_mm", "{} mm", "{}/mm"]
)
def test_the_unit_may_stand_in_the_names(form, tmp_path):
    lines = csv([form.format(name) for name in HEAD], time="time_s")
    expect(read(tmp_path, lines, unit=None))
    metres = [line.replace("mm", "m") for line in lines]
    places = read(tmp_path, metres, unit=None).recording.markers.positions
    np.testing.assert_allclose(places[0, 0], [10.5, 20.25, 30.125])


def test_the_unit_may_stand_before_the_axis(tmp_path):
    head = [name.replace("_", " [mm] ") for name in HEAD]
    expect(read(tmp_path, csv(head, time="time_s"), unit=None))


def test_a_unit_that_is_none_is_named(tmp_path):
    head = [f"{name} [inch]" for name in HEAD]
    with pytest.raises(FileError, match="has no markers; the unit 'inch' is none of"):
        read(tmp_path, csv(head, time="time_s"))


def test_columns_in_two_units_are_an_error(tmp_path):
    head = [f"{name} [{'mm' if name < 'B' else 'm'}]" for name in HEAD]
    with pytest.raises(FileError, match="its columns are in m and in mm"):
        read(tmp_path, csv(head, time="time_s"), unit=None)


@pytest.mark.parametrize(
    ("other", "says"),
    [
        ("A_x", "columns 'A_X' and 'A_x' differ in case only"),
        ("A-X", "columns 'A_X' and 'A-X' are one place"),
        ("A X [mm]", "columns 'A_X' and 'A X .mm.' are one place"),
        ("A_X", "2 columns are called 'A_X'"),
    ],
)
def test_two_columns_for_one_axis_are_an_error(other, says, tmp_path):
    with pytest.raises(FileError, match=says):
        read(tmp_path, csv([*HEAD, other], time="time_s", more=["9"]))


def test_markers_that_differ_in_case_only_are_said(tmp_path):
    head = [*HEAD, "a_X", "a_Y", "a_Z"]
    reading = read(tmp_path, csv(head, time="time_s", more=["1", "2", "3"]))
    assert reading.recording.markers.labels == ("A", "B", "a")
    assert texts(reading.remarks) == (
        "markers whose names differ in case only: 'A' and 'a'",
    )


@pytest.mark.parametrize(
    "names",
    [
        "A_vel_X A_vel_Y A_vel_Z",
        "A_Velocity_x A_Velocity_y A_Velocity_z",
        "AVel_X AVel_Y AVel_Z",
        "vel_A_X vel_A_Y vel_A_Z",
        "quat_X quat_Y quat_Z quat_W",
        "Cup_q_X Cup_q_Y Cup_q_Z Cup_q_W",
        "Cup.rot.X Cup.rot.Y Cup.rot.Z",
        "A_acc_X A_acc_Y A_acc_Z",
        "A_X[m/s] A_Y[m/s] A_Z[m/s]",
        "gyro_X gyro_Y gyro_Z",
        "A_residual",
        "A_v_X A_v_Y A_v_Z",
        "temperature",
    ],
)
def test_what_is_no_place_is_left_out_and_said(names, tmp_path):
    names = names.split()
    lines = csv([*HEAD, *names], time="time_s", more=["0.5"] * len(names))
    reading = read(tmp_path, lines)
    expect(reading)
    (trap,) = texts(reading.remarks)
    assert trap == f"not a marker's place, left out: {', '.join(names)}"


@pytest.mark.parametrize("name", ["MARVEL", "ACCEL2A", "Terror", "vel", "L_VELUM"])
def test_a_name_is_no_word_for_less_than_a_place_by_chance(name, tmp_path):
    head = [f"{name}_{axis}" for axis in "XYZ"]
    if name != "vel":  # where nothing else is there it is a marker
        head += HEAD[:3]
    else:
        head += [f"vel2_{axis}" for axis in "XYZ"]
    assert name in read(tmp_path, csv(head, time="time_s")).recording.markers.labels


# --- heads --------------------------------------------------------------------------

BODY = [line.split(",", 2)[2] for line in csv(time="time_s")[1:]]
STACKED = {
    "pandas": ["bodyparts,A,A,A,B,B,B", "coords,x,y,z,x,y,z"],
    "index name": ["bodyparts,A,A,A,B,B,B", "coords,x,y,z,x,y,z", "frame,,,,,,"],
    "scorer": ["scorer,s,s,s,s,s,s", "bodyparts,A,A,A,B,B,B", "coords,x,y,z,x,y,z"],
    "over the first": ["Frame,A,,,B,,", ",X,Y,Z,X,Y,Z"],
    "numbered": ["Frame#,A,,,B,,", ",X1,Y1,Z1,X2,Y2,Z2"],
    "units": [",A,,,B,,", "Frame,X,Y,Z,X,Y,Z", ",mm,mm,mm,mm,mm,mm"],
    "one line": ["," + ",".join(HEAD)],
    "units below one": ["frame," + ",".join(HEAD), ",mm,mm,mm,mm,mm,mm"],
}


@pytest.mark.parametrize("name", STACKED)
def test_names_may_stand_in_two_lines(name, tmp_path):
    body = [f"{k},{line}" for k, line in enumerate(BODY)]
    unit = None if "units" in name else "mm"
    expect(read(tmp_path, [*STACKED[name], *body], rate_hz=120.0, unit=unit), first=0)


def test_a_likelihood_beside_the_axes_is_left_out(tmp_path):
    lines = ["bodyparts,A,A,A,A", "coords,x,y,z,likelihood", "0,1,2,3,0.9"]
    reading = read(tmp_path, lines, rate_hz=1.0)
    assert reading.recording.markers.labels == ("A",)
    assert texts(reading.remarks) == ("not a marker's place, left out: A_likelihood",)


@pytest.mark.parametrize(
    "lead", ["sep=,", "", ",,,", "# x", '"# handclean csv {""unit"": ""m"""," 2}"']
)
def test_a_line_that_says_nothing_may_come_first(lead, tmp_path):
    expect(read(tmp_path, [lead, *csv(time="time_s")]))


def test_rows_of_blanks_below_the_head_or_at_the_end_are_none(tmp_path):
    lines = csv(time="time_s")
    expect(read(tmp_path, [lines[0], ",,,", *lines[1:], ",,,,,,,", ","]))


@pytest.mark.parametrize(("part", "says"), [(" ", "blanks"), ("|", "'|'")])
def test_cells_parted_by_something_else_are_called_that(part, says, tmp_path):
    lines = csv(time="time_s", part=part)
    with pytest.raises(FileError, match=rf"its cells are parted by {re.escape(says)}"):
        read(tmp_path, lines)


def test_decimal_commas_are_called_that(tmp_path):
    lines = ['"' + line.replace(",", '","') + '"' for line in csv(time="time_s")]
    quoted = [lines[0], *(line.replace(".", ",") for line in lines[1:])]
    with pytest.raises(FileError, match="decimal comma"):
        read(tmp_path, quoted)
    bare = ["A_X,A_Y,A_Z", "1,5,2,5,3,5", "1,5,2,5,3,5"]
    with pytest.raises(FileError, match="are its commas decimal ones"):
        read(tmp_path, bare, rate_hz=1.0)


def test_a_first_column_without_a_name_that_does_not_count_is_left_out(tmp_path):
    lines = [
        ",".join(["", *HEAD]),
        *(f"{0.5 * k},{line}" for k, line in enumerate(BODY)),
    ]
    expect(read(tmp_path, lines, rate_hz=120.0))


# --- bytes --------------------------------------------------------------------------


@pytest.mark.parametrize("mark", [True, False])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16-le", "utf-16-be"])
def test_any_mark_line_end_and_width_of_letters_will_do(mark, end, encoding, tmp_path):
    text = ("\ufeff" if mark else "") + end.join([*csv(time="time_s"), ""])
    expect(read(tmp_path, text.encode(encoding)))


def test_names_in_windows_1252_are_letters(tmp_path):
    lines = csv([name.replace("A", "A\u2013\u00e9") for name in HEAD], time="time_s")
    reading = read(tmp_path, "\n".join(lines).encode("cp1252"))
    assert reading.recording.markers.labels == ("A\u2013\u00e9", "B")


@pytest.mark.parametrize("blank", ["\u00a0", "\u202f", "\u2009", "\ufeff"])
@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_blanks_that_do_not_break_are_blanks(blank, encoding, tmp_path):
    if encoding == "cp1252" and blank != "\u00a0":
        return
    lines = csv(time="time_s")
    lines[2] = lines[2].replace("11.5", f"11.5{blank}")
    expect(read(tmp_path, "\n".join(lines).encode(encoding)))
    lines[3] = lines[3].replace("12.5,20.25,30.125", ",".join([blank] * 3))
    markers = read(tmp_path, "\n".join(lines).encode(encoding)).recording.markers
    assert markers.origin[:, 0].tolist() == [1, 1, 0, 1, 1, 1]


def test_the_end_of_a_file_for_dos_is_no_line(tmp_path):
    expect(read(tmp_path, "\r\n".join([*csv(time="time_s"), "\x1a"]).encode()))


@pytest.mark.parametrize("cell", ["\u0663", "1 234.5", "12:30", "0x10", "1_0"])
def test_what_is_no_number_is_shown(cell, tmp_path):
    lines = csv(time="time_s")
    lines[2] = lines[2].replace("11.5", cell)
    with pytest.raises(FileError, match=f"line 3 column 3: '{cell}' is not a number"):
        read(tmp_path, lines)


@pytest.mark.parametrize("part", [";", "\t"])
def test_rows_whose_blank_end_was_cut_lack_whole_markers(part, tmp_path):
    lines = csv(time="time_s", part=part)
    lines[2] = part.join(lines[2].split(part)[:5])
    reading = read(tmp_path, lines)
    assert reading.recording.markers.origin[:, 1].tolist() == [1, 0, 1, 1, 1, 1]
    assert texts(reading.remarks) == (
        "1 rows end early: what they lack counts as missing",
    )
    lines[2] += f"{part}4"
    with pytest.raises(FileError, match="line 3: has 6 cells"):
        read(tmp_path, lines)


# --- options ------------------------------------------------------------------------


def test_rate_and_unit_are_asked_for_at_once(tmp_path):
    lines = csv()
    both = "does not say its rate nor unit; give --rate HZ and give --unit mm.cm.m$"
    with pytest.raises(UsageError, match=both):
        read(tmp_path, lines, unit=None)
    with pytest.raises(UsageError, match=r"its rate; give --rate HZ$"):
        read(tmp_path, lines, unit="mm")
    with pytest.raises(UsageError, match=r"its unit; give --unit mm.cm.m$"):
        read(tmp_path, lines, rate_hz=120.0, unit=None)
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    about = files.inspect(tmp_path / "a.csv")
    assert (about["rate"], about["unit"], about["frames"]) == (None, None, ROWS)


def test_they_are_asked_for_at_once_where_times_say_no_rate(tmp_path):
    lines = csv(time="time_s")
    lines[3] = lines[3].replace("0.016667", "0.5")
    with pytest.raises(UsageError, match="its rate nor unit"):
        read(tmp_path, lines, unit=None)


# --- Qualisys -----------------------------------------------------------------------

KEYS = ["NO_OF_FRAMES\t6", "FREQUENCY\t120", "MARKER_NAMES\tA\tB"]


def tsv(tmp_path, lines, **options):
    (tmp_path / "a.tsv").write_text("\n".join([*lines, ""]))
    return read_tsv(tmp_path / "a.tsv", **options)


def table(**given):
    head = [name.replace("_", " ") for name in HEAD]
    lines = csv(head, time="Time", part="\t", **given)
    return [lines[0].replace("frame", "Frame"), *lines[1:]]


def test_a_qualisys_file_without_its_head_is_a_table(tmp_path):
    expect(tsv(tmp_path, table(), unit="mm"))
    expect(tsv(tmp_path, table(), unit="mm", rate_hz=120.0))
    with pytest.raises(UsageError, match="give --unit"):
        tsv(tmp_path, table())


def test_times_of_qualisys_are_kept_where_they_run_at_its_frequency(tmp_path):
    reading = tsv(tmp_path, [*KEYS, *table(start=2.0)])
    expect(reading)
    assert (reading.recording.start_time, texts(reading.remarks)) == (2.0, ())
    wrong = [KEYS[0], "FREQUENCY\t200", KEYS[2]]
    reading = tsv(tmp_path, [*wrong, *table(start=2.0)])
    assert reading.recording.start_time == 0.0
    assert any(
        "does not run at FREQUENCY, 200 Hz" in trap for trap in texts(reading.remarks)
    )


@pytest.mark.parametrize("cells", ["NULL\tNULL\tNULL", "NaN\tNaN\tNaN", "-9999\t" * 3])
def test_what_stands_for_nothing_in_a_qualisys_file_is_missing(cells, tmp_path):
    lines = table()
    lines[3] = lines[3].replace("12.5\t20.25\t30.125", cells.rstrip("\t"))
    markers = tsv(tmp_path, [*KEYS, *lines]).recording.markers
    assert markers.origin[:, 0].tolist() == [1, 1, 0, 1, 1, 1]


@pytest.mark.parametrize("part", [",", ";", " "])
def test_a_qualisys_file_parted_by_something_else_is_called_that(part, tmp_path):
    lines = [line.replace("\t", part) for line in [*KEYS, *table()]]
    with pytest.raises(FileError, match="not parted by tabs"):
        tsv(tmp_path, lines)


def test_decimal_commas_of_qualisys_are_called_that(tmp_path):
    lines = [KEYS[0], KEYS[1], KEYS[2], *(row.replace(".", ",") for row in table())]
    with pytest.raises(FileError, match="decimal comma"):
        tsv(tmp_path, lines)


SIX_D = "Frame\tTime\tCup X\tCup Y\tCup Z\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]"
BONES = "Frame\tTime\tHips X\tHips Y\tHips Z\tHips QX\tHips QY\tHips QZ\tHips QW"


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (["NO_OF_BODIES\t1", "BODY_NAMES\tCup", SIX_D], "6D data of rigid bodies"),
        (["DATA_INCLUDED\t6D", "FREQUENCY\t9", SIX_D], "6D data of rigid bodies"),
        ([SIX_D], "6D data of rigid bodies"),
        (["DATA_INCLUDED\t2D", "FREQUENCY\t9", "1\t2\t3"], "2D data of cameras"),
        (["FREQUENCY\t9", "SKELETON_NAME\tS1", BONES], "the segments of skeletons"),
        (["NO_OF_FRAMES\t9", "FREQUENCY\t9", BONES], "the segments of skeletons"),
        ([BONES], "the segments of skeletons"),
        (["NO_OF_SAMPLES\t9", "CHANNEL_NAMES\tEMG"], "analog data"),
        (["NO_OF_SAMPLES\t9", "FORCE_PLATE_NAME\tP1"], "a force plate's data"),
    ],
)
def test_a_qualisys_file_of_something_else_is_called_that(lines, says, tmp_path):
    lines = [line if "\t" in line else f"{line}\t" for line in lines]
    rows = ["\t".join(["1", "0", *"123456789"])]
    with pytest.raises(FileError, match=f"is a Qualisys TSV of {says}, which is not"):
        tsv(tmp_path, [*lines, *rows], rate_hz=100.0, unit="mm")


def test_a_frequency_of_another_device_is_asked_for(tmp_path):
    lines = [KEYS[0], "FREQUENCY\tEXT", KEYS[2], *table()]
    with pytest.raises(UsageError, match="does not say its rate; give --rate HZ"):
        tsv(tmp_path, lines)
    expect(tsv(tmp_path, lines, rate_hz=120.0))


# --- cost ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        "_" * 300_000,
        " " * 300_000 + "x",
        "[" * 300_000 + "]",
        "1" * 300_000,
        "A." * 150_000,
    ],
)
def test_a_huge_name_costs_little(name, tmp_path):
    begun = time.process_time()
    with pytest.raises(HandcleanError):
        read(tmp_path, [f"A_X,{name},A_Y", "1,2,3"], rate_hz=1.0)
    with pytest.raises(HandcleanError):
        read(tmp_path, [f"A_X;{name};A_Y", f"1;{name};3"], rate_hz=1.0)
    assert time.process_time() - begun < 1.0


def test_many_columns_cost_little(tmp_path):
    head = [f"m{k}_{axis}" for k in range(20_000) for axis in "XYZ"]
    lines = [",".join(head), ",".join(["1.5"] * len(head))]
    begun = time.process_time()
    reading = read(tmp_path, lines, rate_hz=1.0)
    assert len(reading.recording.markers.labels) == 20_000
    stacked = [",".join(name[:-2] for name in head), ",".join("XYZ" * 20_000), lines[1]]
    reading = read(tmp_path, stacked, rate_hz=1.0)
    assert len(reading.recording.markers.labels) == 20_000
    assert time.process_time() - begun < 4.0
