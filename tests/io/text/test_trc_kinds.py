"""TRC of many programs: points without a name, short rows, blanks for tabs."""

import numpy as np
import pytest
from told import texts

from handclean.errors import FileError
from handclean.io import files
from handclean.io.text.trc_read import read_trc
from handclean.io.text.trc_write import write_trc
from handclean.recording import Recording, trajectories

KEYS = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
"""Of other programs: one less than OpenSim insists on."""


def trc(rows, names=("A", "B"), part="\t", count=None, end="\n"):
    """Bytes of a TRC file at 100 Hz, in millimetres, its rows given as texts."""
    count = len(names) if count is None else count
    values = ["100.00", "100.00", len(rows), count, "mm", "100.00", 1]
    blank = "" if part == " " else part.strip(" ")
    axes = part.join(f"{a}{m + 1}" for m in range(len(names)) for a in "XYZ")
    head = [
        part.join(["PathFileType", "4", "(X/Y/Z)", "x.trc"]),
        part.join(KEYS.split()),
        part.join(map(str, values)),
        part.join(["Frame#", "Time", (blank * 2 + part).join(names)]),
        2 * blank + axes,
        "",
    ]
    return (end.join([*head, *rows]) + end).encode()


def row(number, *numbers, part="\t"):
    return part.join([str(number), f"{0.01 * (number - 1):.2f}", *map(str, numbers)])


def read(tmp_path, content, **options):
    (tmp_path / "a.trc").write_bytes(content)
    return read_trc(tmp_path / "a.trc", **options)


ONE, TWO, THREE = (1, 2, 3), (4, 5, 6), (7, 8, 9)


@pytest.mark.parametrize("count", [0, 3])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_without_names_has_points_as_many_a_row_as_there_are(
    count, end, tmp_path
):
    rows = [row(1, *ONE, *TWO), row(2), row(3, *ONE, *TWO, *THREE), row(4, *TWO)]
    reading = read(tmp_path, trc(rows, names=(), count=count, end=end))
    take = reading.recording
    assert (take.frames, take.rate, take.markers) == (4, 100.0, None)
    assert take.unlabelled.frame.tolist() == [0, 0, 2, 2, 2, 3]
    np.testing.assert_allclose(take.unlabelled.positions[-1], [4e-3, 5e-3, 6e-3])
    assert any("6 points, up to 3 in a row" in trap for trap in texts(reading.remarks))


def test_cells_beyond_the_names_are_points_without_a_name(tmp_path):
    rows = [
        row(1, *ONE, *TWO),
        row(2, *ONE, *TWO, *THREE, *ONE) + "\t\t",
        row(4, *ONE, "", "", "", "", "", "", *THREE),
        row(5, *ONE, *TWO, 0, 0, 0, 9999999, 9999999, 9999999),
    ]
    take = read(tmp_path, trc(rows)).recording
    assert take.markers.labels == ("A", "B")
    assert take.markers.origin.tolist() == [[1, 1], [1, 1], [0, 0], [1, 0], [1, 1]]
    assert take.unlabelled.frame.tolist() == [1, 1, 3]
    assert take.unlabelled.source.tolist() == [2, 3, 3]
    np.testing.assert_allclose(take.unlabelled.positions[0], [7e-3, 8e-3, 9e-3])


def test_where_nothing_is_there_no_points_are_told_of(tmp_path):
    reading = read(tmp_path, trc([row(1, *ONE, *TWO, 0, 0, 0)]))
    assert reading.recording.unlabelled is None
    assert texts(reading.remarks) == ("1 samples at (0, 0, 0) count as missing",)


def test_columns_and_cells_without_a_name_come_together_by_frame(tmp_path):
    rows = [row(1, *ONE, *TWO, *THREE), row(2, *ONE, *TWO, *THREE)]
    take = read(tmp_path, trc(rows, names=("A", "U_7"))).recording
    assert take.unlabelled.frame.tolist() == [0, 0, 1, 1]
    assert take.unlabelled.source.tolist() == [1, 2, 1, 2]


@pytest.mark.parametrize("more", ["7", "7\t8", "7\t8\t9\t1", "\t8\t9\tx"])
def test_cells_beyond_that_are_no_whole_point_are_an_error(more, tmp_path):
    content = trc([row(1, *ONE, *TWO) + "\t" + more, row(2, *ONE, *TWO)])
    with pytest.raises(FileError, match=r"line 7( column 12)?: "):
        read(tmp_path, content)


def test_points_of_a_last_row_that_is_left_out_are_left_out(tmp_path):
    rows = [row(1, *ONE, *TWO, *THREE), row(2, *ONE, 4, 5, "x", *THREE)]
    take = read(tmp_path, trc(rows), lenient=True).recording
    assert take.frames == 1
    assert take.unlabelled.frame.tolist() == [0]


def test_a_row_of_blanks_is_none(tmp_path):
    rows = [row(1, *ONE, *TWO), "\t" * 7, row(2, *ONE, *TWO), "\t" * 3, ""]
    assert read(tmp_path, trc(rows)).recording.frames == 2


@pytest.mark.parametrize("short", [(), ONE, (*ONE, ""), (*ONE, "", "")])
def test_a_row_whose_blank_end_was_cut_off_lacks_whole_markers(short, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *short), row(3, *ONE, *TWO)]
    reading = read(tmp_path, trc(rows))
    seen = reading.recording.markers.origin.tolist()
    assert seen == [[1, 1], [int(bool(short)), 0], [1, 1]]
    assert any("1 rows end early" in trap for trap in texts(reading.remarks))


@pytest.mark.parametrize("short", [(1,), (1, 2), (*ONE, 4), (*ONE, 4, 5)])
def test_a_row_that_ends_within_a_marker_is_an_error(short, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *short), row(3, *ONE, *TWO)]
    with pytest.raises(FileError, match=r"line 8: has . cells"):
        read(tmp_path, trc(rows))


def test_a_last_row_without_its_line_end_is_taken_for_cut(tmp_path):
    content = trc([row(1, *ONE, *TWO), row(2, *ONE)]).rstrip(b"\n")
    with pytest.raises(FileError, match="--lenient saves 1 rows"):
        read(tmp_path, content)
    assert read(tmp_path, content, lenient=True).recording.frames == 1
    assert read(tmp_path, content + b"\n").recording.frames == 2


@pytest.mark.parametrize("part", [" ", "   ", ",", ";", ", "])
def test_blanks_commas_and_semicolons_may_part_the_cells(part, tmp_path):
    rows = [row(1, *ONE, *TWO, part=part), row(2, *ONE, *["nan"] * 3, part=part)]
    take = read(tmp_path, trc(rows, part=part if part.strip() else " ")).recording
    assert take.markers.labels == ("A", "B")
    assert take.markers.origin.tolist() == [[1, 1], [1, 0]]


def test_between_blanks_a_missing_cell_is_an_error_that_says_so(tmp_path):
    rows = [row(1, *ONE, *TWO, part=" "), row(2, *ONE, part=" ")]
    with pytest.raises(FileError, match="between blanks a missing cell cannot be"):
        read(tmp_path, trc([*rows, rows[0]], part=" "))


def test_names_with_blanks_between_blanks_are_an_error(tmp_path):
    content = trc([row(1, *ONE, *TWO, part=" ")], names=("A a", "B"), part=" ")
    with pytest.raises(FileError, match="names 3 markers, NumMarkers says 2; tabs"):
        read(tmp_path, content)


def test_names_in_neighbouring_cells_are_read_if_they_are_as_many_as_stated(tmp_path):
    content = trc([row(1, *ONE, *TWO)]).replace(b"A\t\t\tB", b"A\tB")
    assert read(tmp_path, content).recording.markers.labels == ("A", "B")


def with_commas(content):
    """The same file, written with decimal commas."""
    head, rest = content.split(b"\n", 1)
    return head + b"\n" + rest.replace(b".", b",")


LONG = (-1.5, 0.25, 1234.125)


@pytest.mark.parametrize("part", ["\t", ";"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_decimal_commas_between_tabs_or_semicolons_are_read(part, end, tmp_path):
    rows = [row(1, *LONG, *TWO, part=part), row(2, *LONG, *[""] * 3, part=part)]
    rows += [row(n, *LONG, "1.5e2", 2.5, 3.5, part=part) for n in range(3, 9)]
    plain = trc(rows, names=("A", "B 1,5"), part=part, end=end)
    expected = read(tmp_path, plain)
    reading = read(tmp_path, with_commas(plain))
    assert reading.recording.markers.labels == ("A", "B 1,5")
    assert reading.recording.rate == 100.0
    found = reading.recording.markers.positions
    np.testing.assert_array_equal(found, expected.recording.markers.positions)
    assert found[0, 0, 2] == 1.234125
    assert (*texts(expected.remarks), "numbers have a decimal comma ('100,00')") == (
        texts(reading.remarks)
    )


@pytest.mark.parametrize("where", ["head", "rows"])
def test_decimal_commas_beside_decimal_points_are_refused(where, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *ONE, *TWO)]
    if where == "rows":
        rows = [line.replace("\t3", "\t3,25") for line in rows]
    content = trc(rows)
    if where == "head":
        content = content.replace(b"100.00", b"100,00")
    said = (
        r"decimal comma \(.*,.*\) and others with a point \('\d+\.00'\); save it with "
    )
    with pytest.raises(FileError, match=said + "decimal points"):
        read(tmp_path, content)


def test_a_point_far_behind_decimal_commas_is_found_wherever_it_stands(tmp_path):
    rows = [row(n, *LONG, *TWO) for n in range(1, 50_000)]
    content = with_commas(trc(rows))
    assert read(tmp_path, content).recording.frames == len(rows)
    late = b"\n49990\t499,89\t-1.5\t"
    content = content.replace(late.replace(b".", b","), late)
    with pytest.raises(FileError, match=r"others with a point \('-1\.5'\)"):
        read(tmp_path, content)


def test_commas_that_may_part_thousands_are_refused(tmp_path):
    rows = [f"{n}\t{n - 1}\t1,250\t2,500\t10" for n in (1, 2)]
    content = trc(rows, names=("A",)).replace(b"100.00", b"1")
    with pytest.raises(
        FileError, match=r"part thousands or decimals \('1,250'\); save"
    ):
        read(tmp_path, content)
    sure = content.replace(b"2,500", b"2,50")
    assert read(tmp_path, sure).recording.markers.positions[0, 0, 0] == 1.25e-3


@pytest.mark.parametrize("where", ["head", "rows"])
def test_decimal_commas_between_blanks_are_called_that(where, tmp_path):
    rows = [row(n, 1, 2, 3, part=" ") for n in (1, 2)]
    content = trc(rows, names=("A",), part=" ")
    if where == "head":
        content = content.replace(b"100.00", b"100,00")
    else:
        content = content.replace(b" 0.0", b" 0,0")
    said = r"decimal comma \('[\d,]+'\); save it with decimal points"
    with pytest.raises(FileError, match=said):
        read(tmp_path, content)


WORDS = """NULL NaN nan NA N/A #N/A null None -nan -nan(ind) nan(snan) 1.#QNAN -1.#IND
1.#QNAN00 -1.#IND000 -- -"""


@pytest.mark.parametrize("cell", WORDS.split())
def test_words_for_nothing_are_missing_numbers(cell, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *ONE, cell, cell, cell)]
    reading = read(tmp_path, trc(rows))
    assert reading.recording.markers.origin.tolist() == [[1, 1], [1, 0]]
    assert texts(reading.remarks) == ()


@pytest.mark.parametrize(
    "cell", ["1.#INF", "-1.#INF00", "inf", "-Infinity", "1e999", "-1e305", "1.7e308"]
)
def test_infinity_is_missing_and_said(cell, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *ONE, cell, cell, cell)]
    reading = read(tmp_path, trc(rows))
    assert reading.recording.markers.origin.tolist() == [[1, 1], [1, 0]]
    assert texts(reading.remarks) == ("3 infinite numbers count as missing",)


SENTINELS = "9999999 9999999.0 -9999 99999.99 999.999 -999 -3.697314e+28 1e6 -1000000 "
SENTINELS += "-1 32767 -32768 2147483647 3.4028235e38 -1000"


@pytest.mark.parametrize("cell", SENTINELS.split())
def test_one_number_for_nothing_on_all_three_axes_is_missing_and_said(cell, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *ONE, cell, cell, cell)]
    reading = read(tmp_path, trc(rows))
    assert reading.recording.markers.origin.tolist() == [[1, 1], [1, 0]]
    (trap,) = texts(reading.remarks)
    assert "1 samples with" in trap
    assert f"{float(cell):.10g}" in trap


@pytest.mark.parametrize(
    "cells", [(9999999, 5, 6), (9999, 9999, 6), (5, 5, 5), (99, 99, 99), (250,) * 3]
)
def test_a_place_is_no_number_for_nothing(cells, tmp_path):
    rows = [row(1, *ONE, *TWO), row(2, *ONE, *cells)]
    reading = read(tmp_path, trc(rows))
    assert reading.recording.markers.origin.tolist() == [[1, 1], [1, 1]]
    assert texts(reading.remarks) == ()


def test_a_file_of_ours_has_no_numbers_for_nothing(tmp_path):
    positions = np.full((3, 2, 3), 10.0)
    positions[:, 1] = 0.0
    take = Recording(rate=1.0, frames=3, markers=trajectories(positions, ("A", "B")))
    write_trc(tmp_path / "a.trc", take)
    assert read_trc(tmp_path / "a.trc").recording.markers.origin.all()


def test_a_time_column_that_does_not_run_at_the_rate_is_said_and_not_kept(tmp_path):
    rows = [f"{k}\t{5000 + 10 * k}\t1\t2\t3\t4\t5\t6" for k in range(1, 5)]
    reading = read(tmp_path, trc(rows))
    assert reading.recording.start_time == 0.0
    assert any(
        "does not run at DataRate, 100 Hz" in trap for trap in texts(reading.remarks)
    )


def test_inspect_and_convert_take_points_without_a_name(tmp_path):
    read(tmp_path, trc([row(1, *ONE), row(2, *ONE, *TWO)], names=()))
    about = files.inspect(tmp_path / "a.trc")
    assert (about["unlabelled_points"], about["most_unlabelled_in_a_frame"]) == (3, 2)
    files.write(tmp_path / "b.c3d", files.read(tmp_path / "a.trc"))
    assert len(files.read(tmp_path / "b.c3d").unlabelled.frame) == 3
