"""Tables of decimal numbers out of bytes, many cells at once, exactly as ``float()``.

A cell is ``[sign] digits [. digits] [e [sign] digits]``. Eight digits are read as one
word of 64 bits and added up in three multiplications (Lemire, "Quickly parsing eight
digits", 2018). With m the whole number of all digits and k the power of ten, the value
is ``m 10^k``. Up to ``m < 2^53`` and ``|k| <= 22`` both factors are exact as floats, so
that one product or quotient is rounded rightly (Clinger, PLDI 1990). A longer m is
``h + l``, its nearest float and what is left of it. Then with Dekker's product

    q = fl(h / p),  r = h - q p,  c = (r + l) / p,  s = fl(q + c),  e = q + c - s,

p = 10^-k, s is the nearest float unless e is so near to half a step that the rounding
of c could tip it. Such cells, and all of another form, are read one by one.
"""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Bytes, Floats, Ints, Words
from handclean.io.shared.missing import number_in

_LEAD = b"\n" * 24
"""Before the first cell, so that words of eight letters may begin before it."""

_NEWLINE, _POINT, _MINUS, _PLUS, _E = b"\n.-+e"
_ZERO, _LOWER = np.uint8(ord("0")), np.uint8(0x20)

_ZEROS = np.uint64(0x3030303030303030)
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_BITS = np.uint64(64)
_SIGN = np.uint64(63)
"""Bit of a float that is its sign."""

_PAIRS = ((2561, 8, 0x00FF00FF00FF00FF), (6553601, 16, 0x0000FFFF0000FFFF))
"""Factor, shift and mask that add up neighbouring digits, then pairs of them."""

_WHOLE = 10 ** np.arange(20, dtype=np.uint64)
_EXACT: Floats = np.array([float(10**k) for k in range(23)])
"""Powers of ten that a whole number of 64 bits, and a float, hold exactly."""

_MOST_DIGITS = 19
"""Any number of so many digits is less than 2^64."""

_EXACT_BELOW = np.uint64(2**53)
_SPLIT = 2.0**27 + 1.0
"""Veltkamp's factor, which halves a float's 53 bits."""

_MARGIN = 1.0 - 2.0**-30
"""Share of half a step from which a rounding is not trusted (c is good to 2^-51)."""

_FRACTION = np.int64(2**52 - 1)
"""Bits of a float that are its fraction."""

_STEP = np.int64(52 << 52)
"""What the exponent of a float is above that of the step to the next one."""

_MOST_KNOWN = 1000
"""Words that are remembered (chosen)."""

_WIDEST = 24
"""Blanks beside a number (chosen: wider than any column of numbers)."""


class _Cells(NamedTuple):
    """Where n cells begin and end, and the parts of their numbers.

    Attributes
    ----------
    start, end : (n,) the letters of a cell.
    negative : (n,) whether it begins with a minus.
    whole, fraction : (n,) how many digits are before and after the point.
    point : (n,) where the digits before it end.
    stop : (n,) where the digits after it end.
    power : (n,) of ten, or None where no cell says one.
    odd : (n,) whether it is no number of this form.
    """

    start: Ints
    end: Ints
    negative: Bools
    whole: Ints
    fraction: Ints
    point: Ints
    stop: Ints
    power: Ints | None
    odd: Bools


def table(
    block: bytes, columns: int, delimiter: bytes, ignored: Collection[int] = ()
) -> Floats | None:
    """Read whole lines of numbers; blank cells and words for none are NaN.

    Parameters
    ----------
    block : lines with their ends.
    delimiter : one letter that parts the cells.
    ignored : columns that may hold anything; they are NaN.

    Returns
    -------
    (rows, columns), or None where a line has more or fewer cells, is blank, or holds
    something else than numbers
    """
    if b" " in block:
        block = _without_blanks(block, delimiter)
    text = _LEAD + block + bytes(16 - len(block) % 8)
    letters = np.frombuffer(text, np.uint8)[: len(_LEAD) + len(block)]
    words = np.frombuffer(text, "<u8")
    cells = _cells(letters, words, columns, delimiter[0])
    if cells is None:
        return None
    blank = cells.start == cells.end
    if blank.reshape(-1, columns).all(axis=1).any():
        return None
    values, unsure = _values(words, cells)
    values[blank] = np.nan
    unsure |= cells.odd
    unsure &= ~blank
    if ignored:
        for part, nothing in ((values, np.nan), (unsure, False)):
            part.reshape(-1, columns)[:, list(ignored)] = nothing
    if unsure.any() and not _one_by_one(text, cells, np.flatnonzero(unsure), values):
        return None
    return values.reshape(-1, columns)


def _without_blanks(block: bytes, delimiter: bytes) -> bytes:
    """Leave out blanks beside the marks between cells, up to a certain width."""
    block = block.lstrip(b" ")
    for mark in (delimiter, b"\n"):
        for pair in (mark + b" ", b" " + mark):
            for _ in range(_WIDEST):
                if pair not in block:
                    break
                block = block.replace(pair, mark)
    return block


def _cells(letters: Bytes, words: Words, columns: int, delimiter: int) -> _Cells | None:
    """Find the cells, None where lines are not of so many."""
    sign = (letters == _MINUS) | (letters == _PLUS)
    other = (letters - _ZERO > 9) ^ sign
    other[: len(_LEAD) - 1] = False
    marks = np.flatnonzero(other)
    kinds = letters[marks]
    is_row = kinds == _NEWLINE
    last = np.flatnonzero((kinds == delimiter) | is_row)
    rows = (len(last) - 1) // columns
    if (
        rows * columns != len(last) - 1
        or np.count_nonzero(is_row) != rows + 1
        or not is_row[last[::columns]].all()
    ):
        return None
    ends, between = marks[last], np.diff(last) - 1
    start, end, last = ends[:-1] + 1, ends[1:], last[1:]
    first = letters[start]
    negative = first == _MINUS
    begin = start + (negative | (first == _PLUS))
    signs = int(np.count_nonzero(begin != start))
    stop, power, odd = end, None, np.zeros(len(start), dtype=bool)
    is_e = (kinds | _LOWER) == _E
    if is_e.any():
        has_e = (between > 0) & is_e[last - 1]
        last, between = last - has_e, between - has_e
        stop = marks[last]
        power, more, odd = _powers(letters, stop, end, has_e)
        signs += more
    has_point = between == 1
    point = marks[last - has_point]
    whole, fraction = point - begin, stop - point - has_point
    digits = whole + fraction
    odd |= (digits - 1).view(np.uint64) >= _MOST_DIGITS  # 0, too
    if between.max() > 1 or np.count_nonzero(kinds == _POINT) != between.sum():
        odd |= (between > 1) | (has_point & (letters[point] != _POINT))
    if signs != np.count_nonzero(sign):
        odd |= _misplaced(sign, ends, start, stop)
    for count in (whole, fraction):
        count[odd] = 0
    return _Cells(start, end, negative, whole, fraction, point, stop, power, odd)


def _powers(
    letters: Bytes, stop: Ints, end: Ints, has_e: Bools
) -> tuple[Ints, int, Bools]:
    """(n,) powers of ten behind an e, how many have a sign, and which are none."""
    first = letters[np.minimum(stop + 1, end)]
    minus = has_e & (first == _MINUS)
    signed = minus | (has_e & (first == _PLUS))
    count = np.where(has_e, end - stop - 1 - signed, 0)
    odd = has_e & ((count < 1) | (count > 3))
    count[odd] = 0
    size = np.zeros(len(end), dtype=np.int64)
    for place in range(int(count.max())):
        digit = letters[end - 1 - place] - _ZERO
        digit[count <= place] = 0
        size += 10**place * digit.astype(np.int64)
    power: Ints = np.where(minus, -size, size)
    return power, int(np.count_nonzero(signed)), odd


def _misplaced(sign: Bools, ends: Ints, start: Ints, stop: Ints) -> Bools:
    """(n,) whether a sign stands elsewhere than at the start or behind the e."""
    at = np.flatnonzero(sign)
    cell = np.searchsorted(ends, at) - 1
    wrong = (at != start[cell]) & (at != stop[cell] + 1)
    out = np.zeros(len(start), dtype=bool)
    out[cell[wrong]] = True
    return out


def _digits(words: Words, end: Ints, count: Ints) -> Words:
    """(n,) whole numbers of ``count`` digits, 19 at most, that end before ``end``."""
    at = end - 8
    word = at >> 3
    shift = ((at & 7) << 3).view(np.uint64)
    back = _BITS - shift
    out = np.zeros(len(end), dtype=np.uint64)
    behind: Words = words[1:][word]
    for more in range(0, int(count.max()), 8):
        here: Words = words[word - (more >> 3)]
        eight = here >> shift
        eight |= behind << back
        part = _added(eight, np.minimum(np.maximum(count - more, 0), 8))
        out += part * _WHOLE[more] if more else part
        behind = here
    return out


def _added(eight: Words, count: Ints) -> Words:
    """(n,) whole numbers of the last ``count`` of eight letters, in their place."""
    eight ^= _ZEROS
    eight &= _ALL << (_BITS - (count << 3).view(np.uint64))
    for factor, bits, mask in _PAIRS:
        eight *= np.uint64(factor)
        eight >>= np.uint64(bits)
        eight &= np.uint64(mask)
    eight *= np.uint64(42949672960001)
    eight >>= np.uint64(32)
    return eight


def _values(words: Words, cells: _Cells) -> tuple[Floats, Bools]:
    """(n,) numbers, and whether one may be rounded wrongly."""
    number = _digits(words, cells.point, cells.whole)
    number *= _WHOLE[cells.fraction]
    number += _digits(words, cells.stop, cells.fraction)
    power = -cells.fraction if cells.power is None else cells.power - cells.fraction
    size = np.abs(power)
    unsure = size >= len(_EXACT)
    size[unsure] = 0
    ten: Floats = _EXACT[size]
    values = number.astype(np.float64)
    if number.max() < _EXACT_BELOW:
        up = values * ten if cells.power is not None else values
        np.divide(values, ten, out=values)
        if cells.power is not None:
            np.copyto(values, up, where=power > 0)
    else:
        values, close = _rounded(number, ten, power > 0)
        unsure |= close
    signs = cells.negative.astype(np.uint64) << _SIGN
    values.view(np.uint64)[:] ^= signs
    return values, unsure


def _rounded(number: Words, ten: Floats, up: Bools) -> tuple[Floats, Bools]:
    """(n,) long whole numbers times or through a power of ten, and which are close."""
    high = number.astype(np.float64)
    low = (number - high.astype(np.uint64)).view(np.int64).astype(np.float64)
    quotient = high / ten
    product, error = _product(quotient, ten)
    first, rest = quotient, ((high - product) - error + low) / ten
    if up.any():
        product, error = _product(high, ten)
        first = np.where(up, product, first)
        rest = np.where(up, error + low * ten, rest)
    out = first + rest
    left = np.abs(rest - (out - first))
    bits = out.view(np.int64)
    step = ((bits & ~_FRACTION) - _STEP).view(np.float64)
    close = left >= 0.5 * _MARGIN * step
    close |= (bits & _FRACTION) == 0  # below a power of 2 steps are half
    return out, close & (number != 0)


def _product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """(n,) rounded products and what rounding left out, exactly (Dekker 1971)."""
    product = a * b
    halves = []
    for factor in (a, b):
        wide = _SPLIT * factor
        high = wide - (wide - factor)
        halves.append((high, factor - high))
    (a_high, a_low), (b_high, b_low) = halves
    error = a_low * b_low - (
        ((product - a_high * b_high) - a_low * b_high) - a_high * b_low
    )
    return product, error


def _one_by_one(text: bytes, cells: _Cells, which: Ints, values: Floats) -> bool:
    """Read some cells by themselves; False where one is no number."""
    known: dict[bytes, float] = {}
    starts, ends = cells.start[which].tolist(), cells.end[which].tolist()
    for cell, start, end in zip(which.tolist(), starts, ends, strict=True):
        word = text[start:end]
        number = known.get(word)
        if number is None:
            try:
                number = _number(word)
            except ValueError:
                return False
            if len(known) < _MOST_KNOWN:
                known[word] = number
        values[cell] = number
    return True


def _number(word: bytes) -> float:
    """Return the number in a cell; `ValueError` where it holds something else."""
    if b"_" not in word:
        try:
            return float(word)
        except ValueError:
            pass
    return number_in(word)
