"""Numbers of a table, many at once: the same bits as ``float()``, or none at all."""

import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import FileError
from handclean.io.shared import decimals, reading
from handclean.io.shared.grid import Form, read_numbers
from handclean.io.shared.lines import Lines
from handclean.io.text.csv_read import read_csv

digits = st.text("0123456789", min_size=1, max_size=21)
signs = st.sampled_from(["", "-", "+"])
floats = st.floats(allow_nan=False, allow_infinity=False)
numbers = st.one_of(
    floats.map(repr),
    st.integers(-(10**20), 10**20).map(str),
    st.builds("{}{}.{}".format, signs, digits, digits),
    st.builds("{}{}.{}e{}{}".format, signs, digits, digits, signs, st.integers(0, 400)),
    st.builds("{:.{}f}".format, st.floats(-1e6, 1e6), st.integers(0, 18)),
    st.builds("{:.{}e}".format, floats, st.integers(0, 18)),
)


def bits(values):
    return np.asarray(values, dtype=np.float64).view(np.int64).tolist()


def block(cells, part=","):
    return (part.join(cells) + "\n").encode()


@given(st.lists(numbers, min_size=1, max_size=30))
def test_numbers_are_those_of_float_to_the_last_bit(cells):
    found = decimals.table(block(cells), len(cells), b",")
    assert bits(found[0]) == bits([float(cell) for cell in cells])


def near_halves(rng):
    """Whole numbers and decimals half way between two floats, and beside them."""
    for _ in range(300):
        low = rng.randrange(2**52, 2**53)
        up = rng.randrange(0, 11)
        half = (2 * low + 1) << up
        for number in (half - 1, half, half + 1):
            yield str(number)
    for power in range(1, 19):
        for _ in range(100):
            text = str(rng.randrange(10**18, 10**19))
            yield f"{text[:-power]}.{text[-power:]}"


def beside_halves():
    """Long numbers that differ from half way by less than rounding twice does.

    ``m 10^-k`` is half way between two floats where ``m 2^t = n 5^k`` with n odd, of 54
    bits; here the two sides differ by one. So with ``m 10^k`` and ``m 5^k = n 2^t``.
    """
    for k in range(15, 23):
        for t in range(40, 64):
            for by in (1, -1):
                step = 2 ** (t + 1)
                least = (2**t + by) * pow(5**k, -1, step) % step
                for number in range(least, min(10**19, least + 20 * step), step):
                    if number >= 2**53 and 2**53 <= number * 5**k >> t < 2**54:
                        yield f"{number}e{k}"
    for k in range(8, 23):
        five = 5**k
        for t in range(1, 60):
            for by in (1, -1):
                least = by * pow(2**t, -1, five) % five
                for number in range(least, min(10**19, least + 20 * five), five):
                    n = (number * 2**t - by) // five
                    if number >= 2**53 and n % 2 and 2**53 <= n < 2**54:
                        yield f"{number}e-{k}"


def test_what_lies_nearly_half_way_is_rounded_to_the_nearer():
    cells = list(beside_halves())
    assert len(cells) > 30
    found = decimals.table(block(cells), len(cells), b",")
    assert bits(found[0]) == bits([float(cell) for cell in cells])


def test_what_lies_half_way_between_two_floats_is_rounded_to_even():
    cells = [*near_halves(random.Random(0)), "9007199254740993", "0.5", "2.5e0"]
    found = decimals.table(block(cells), len(cells), b",")
    assert bits(found[0]) == bits([float(cell) for cell in cells])


@pytest.mark.parametrize("digits", range(1, 20))
def test_any_count_of_digits_before_and_after_the_point(digits):
    rng = random.Random(digits)
    cells = []
    for after in range(digits + 1):
        for sign in ("", "-", "+"):
            text = "".join(rng.choices("0123456789", k=digits))
            at = digits - after
            cells.append(f"{sign}{text[:at]}.{text[at:]}")
    found = decimals.table(block(cells), len(cells), b",")
    assert bits(found[0]) == bits([float(cell) for cell in cells])


@pytest.mark.parametrize("part", [",", ";", "\t"])
def test_rows_blanks_and_words_for_none(part):
    rows = [
        ["1", "", "-2.5"],
        ["NaN", "NULL", "4"],
        ["n/a", "  7 ", " "],
        ["", "-", "8"],
    ]
    text = b"".join(block(row, part) for row in rows)
    found = decimals.table(text, 3, part.encode())
    nan = np.nan
    want = [[1, nan, -2.5], [nan, nan, 4], [nan, 7, nan], [nan, nan, 8]]
    np.testing.assert_array_equal(found, want)


@pytest.mark.parametrize("zero", ["-0", "-0.0", "-.0", "-0e5", "-0.000000000000000000"])
def test_a_zero_keeps_its_sign(zero):
    found = decimals.table(block(["1.5", zero]), 2, b",")
    assert bits(found[0]) == bits([1.5, -0.0])


BAD = "1-2 --1 +-1 1e 1e+ e5 1e2e3 1e2.5 1.2.3 1_000 0x10 12:30 1,5 oops + \u0663 1e-+5"


@pytest.mark.parametrize("cell", [*BAD.split(" "), "1 2", "1 .5", "- 1"])
def test_what_is_no_number_is_none(cell):
    assert decimals.table(block(["1.5", cell, "2.5"], ";"), 3, b";") is None


@pytest.mark.parametrize(
    "rows",
    [
        ["1,2,3", "4,5"],
        ["1,2,3", "4,5,6,7"],
        ["1,2", "3,4,5,6"],
        ["1,2,3,4", "5,6", "7,8,9"],
        ["1,2,3", "", "4,5,6"],
        ["1,2,3", ",,", "4,5,6"],
        ["1,2,3,", "4,5,6,"],
    ],
)
def test_lines_of_more_or_fewer_cells_are_none(rows):
    assert decimals.table(("\n".join(rows) + "\n").encode(), 3, b",") is None


def test_what_is_ignored_may_be_anything():
    rows = [["1", "a.b-c", "2"], ["3", "", "4"], ["5", "1e5", "6"]]
    found = decimals.table(b"".join(map(block, rows)), 3, b",", [1])
    np.testing.assert_array_equal(
        found, [[1, np.nan, 2], [3, np.nan, 4], [5, np.nan, 6]]
    )


# --- the whole of a table -----------------------------------------------------------


def naive(text, columns):
    """Every cell by itself, with Python's float."""
    rows = [line.split(",") for line in text.splitlines()]
    assert all(len(row) == columns for row in rows)
    return np.array([[float(c) if c.strip() else np.nan for c in row] for row in rows])


def many(rng, rows, columns):
    kinds = ("%.6f", "%.3f", "%r", "%.18e", "%g", "%.0f")
    fmt = [kinds[int(k)] for k in rng.integers(len(kinds), size=columns)]
    table = rng.normal(0, 300, (rows, columns))
    lines = []
    for row in table.tolist():
        cells = [
            f % x if rng.random() > 0.02 else "" for f, x in zip(fmt, row, strict=True)
        ]
        lines.append(",".join([*cells[:-1], cells[-1] or "1"]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("columns", [1, 2, 50, 400])
def test_a_table_of_many_blocks_is_read_cell_by_cell_the_same(columns, tmp_path):
    text = many(np.random.default_rng(columns), 800_000 // (columns * 4), columns)
    assert len(text) > 1_000_000
    lines = Lines(tmp_path, text.encode())
    found = read_numbers(lines, Form(columns=columns, delimiter=b","), [])
    want = naive(text, columns)
    assert np.array_equal(np.isnan(found), np.isnan(want))
    assert bits(found[~np.isnan(found)]) == bits(want[~np.isnan(want)])
    assert lines.number == len(found)


@pytest.mark.parametrize("at", [0, 1, 7000, -2, -1])
def test_a_bad_cell_is_named_by_its_line_wherever_it_is(at, tmp_path):
    rows = many(np.random.default_rng(0), 15_000, 9).splitlines()
    at %= len(rows)
    rows[at] = rows[at].replace(",", ",oops", 1)
    lines = Lines(tmp_path, ("\n".join(rows) + "\n").encode())
    number = rf"line {at + 1}( column 2)?: 'oops"
    with pytest.raises(FileError, match=number):
        read_numbers(lines, Form(columns=9, delimiter=b","), [])


@pytest.mark.parametrize("at", [0, 3, 7000, -1])
def test_rows_that_are_cut_or_blank_among_many_are_read_as_alone(at, tmp_path):
    rows = [f"{k},1.5,2.5,3.5" for k in range(15_000)]
    at %= len(rows)
    rows[at] = f"{at},1.5"
    rows.insert(at, ",,,")
    form = Form(columns=4, delimiter=b",", ends=(2,), numbered=True)
    remarks = []
    found = read_numbers(
        Lines(tmp_path, ("\n".join(rows) + "\n").encode()), form, remarks
    )
    want = np.tile([0, 1.5, 2.5, 3.5], (15_000, 1))
    want[:, 0] = np.arange(15_000)
    want[at, 2:] = np.nan
    np.testing.assert_array_equal(found, want)
    assert [one.data["rows"] for one in remarks] == [1]


# --- lines out of pieces ------------------------------------------------------------


def pieces(text, size):
    """The text in pieces of whole lines, about ``size`` bytes each."""
    out, piece = [], b""
    for line in text.splitlines(keepends=True):
        piece += line
        if len(piece) >= size:
            out.append(piece)
            piece = b""
    return [*out, *([piece] if piece else [])]


@pytest.mark.parametrize("end", [b"", b"\n"])
@pytest.mark.parametrize("size", [1, 5, 30, 1000])
def test_lines_of_pieces_are_those_of_the_whole(size, end, tmp_path):
    text = b"\n".join(b"x" * (k % 7) for k in range(40)) + b"last" + end
    whole = Lines(tmp_path, text)
    cut = Lines(tmp_path, lambda: iter(pieces(text, size)))
    while True:
        for after in (0, 1, 3, 50):
            assert cut.peek(after) == whole.peek(after)
        line = whole.next()
        assert cut.next() == line
        assert (cut.number, cut.ended) == (whole.number, whole.ended)
        if line is None:
            break


@pytest.mark.parametrize("size", [1, 5, 30, 1000])
@pytest.mark.parametrize("last", [12, 20, None])
def test_lines_can_be_narrowed_to_some_of_them(size, last, tmp_path):
    text = b"\n".join(str(k).encode() for k in range(1, 31)) + b"\n"
    lines = Lines(tmp_path, lambda: iter(pieces(text, size)))
    lines.peek(20)
    lines.narrow(8, last)
    found = []
    while block := lines.block(9):
        lines.skip(block, block.count(b"\n"))
        found += block.split()
        assert lines.number == int(found[-1])
    assert [int(word) for word in found] == list(range(8, (last or 30) + 1))
    assert lines.next() is None
    assert lines.peek() is None


def test_titles_are_lines_of_their_own(tmp_path):
    text = b'One\nnone One\n"Two";;\nx\nOne,\nOne two\nTwo'
    for size in (1, 1000):
        lines = Lines(tmp_path, lambda size=size: iter(pieces(text, size)))
        found = lines.titles(("One", "Two"), b'",; ')
        assert found == [(1, "One"), (3, "Two"), (5, "One"), (7, "Two")]


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_text_in_pieces_is_the_text(end, mark, tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "_PIECE_BYTES", 64)
    rows = [b"%d,%s" % (k, b"1" * (k * 37 % 150)) for k in range(60)]
    (tmp_path / "a.csv").write_bytes(mark + end.join(rows) + b"\x1a")
    found = list(reading.open_text(tmp_path / "a.csv"))
    assert b"".join(found) == b"\n".join(rows) == reading.load_text(tmp_path / "a.csv")
    assert (len(found) > 20) == (end != b"\r")
    assert all(piece.endswith(b"\n") for piece in found[:-1])


def test_a_zero_byte_far_into_a_text_is_found(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"A_X,A_Y,A_Z\n" + b"1,2,3\n" * 400_000 + b"1,2,\0\n")
    with pytest.raises(FileError, match="is not text: it holds zero bytes"):
        read_csv(path, rate_hz=1.0, unit="mm")
