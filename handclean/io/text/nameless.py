"""Tables of numbers alone, as programs export them without a head.

Motive's has the frame's number, the time and places; one of Qualisys may lack the
number, the time, or both. Nothing says whose places they are: points without a name.
"""

import math
from itertools import pairwise

from handclean.io.shared.clock import FASTEST_HZ, SLOWEST_HZ, Column
from handclean.io.shared.lines import Lines
from handclean.io.text.csv_columns import Layout
from handclean.io.text.csv_header import delimiter_of, head_rows, is_number
from handclean.io.text.described import Described
from handclean.remarks import remark

_HEAD_ROWS = 5
"""Rows from which the meaning of the first columns is told (chosen)."""


def describe_nameless(lines: Lines, *, bare: bool) -> Described | None:
    """Tell what the columns of a table without names are; None if it has names.

    Parameters
    ----------
    bare : places without a number and a time before them will do.
    """
    line = lines.peek() or b""
    if line[:1].strip(b'" +-.0123456789'):
        return None
    rows = head_rows(lines, _HEAD_ROWS)
    count = len(rows[0])
    named = not all(map(is_number, filter(None, rows[0])))
    if named or not rows[0][0] or any(len(row) > count for row in rows):
        return None
    lead = count % 3
    counts, runs = _counts(rows, 0), _runs(rows, lead - 1) if lead else False
    frame = 0 if lead and counts and (lead == 2 or not runs) else None
    time = lead - 1 if runs and frame != lead - 1 else None
    if count - lead < 3 or lead != (frame is not None) + (time is not None):
        return None
    if lead < 2 and not bare:
        return None
    places = range(lead, count, 3)
    said = f"its columns have no names: {len(places)} points are without a name"
    layout = Layout(
        frame=frame,
        time=time,
        clock=Column(1.0, False),
        markers={f"*{k}": [k, k + 1, k + 2] for k in places},
        unit=None,
        origins={},
        motions={},
        extra=[],
        at={},
    )
    return Described(
        layout=layout,
        names=["frame", "time"][2 - lead :] + [""] * (count - lead),
        delimiter=delimiter_of(line, line),
        remarks=(remark("labels", said, columns=len(places)),),
    )


def _column(rows: list[list[str]], column: int) -> list[float]:
    """Return a column's numbers; NaN where it has none."""
    cells = (row[column] if column < len(row) else "" for row in rows)
    return [float(c) if is_number(c) and "," not in c else math.nan for c in cells]


def _counts(rows: list[list[str]], column: int) -> bool:
    """Whether a column rises by one a row."""
    numbers = _column(rows, column)
    whole = all(number == number // 1 for number in numbers)
    return whole and all(b - a == 1 for a, b in pairwise(numbers))


def _runs(rows: list[list[str]], column: int) -> bool:
    """Whether a column rises like the times of a camera, in seconds."""
    steps = [b - a for a, b in pairwise(_column(rows, column))]
    return bool(steps) and all(1 / FASTEST_HZ < s < 1 / SLOWEST_HZ for s in steps)
