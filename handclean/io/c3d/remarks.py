"""What is odd about the form of a C3D file but needs no decision."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from handclean.io.c3d.head import Head
from handclean.io.c3d.layout import Layout, analog_ratio, count
from handclean.io.c3d.parameters import BLOCK_BYTES, strings_of
from handclean.remarks import Remark, remark


def of_form(head: Head, layout: Layout, left: int) -> list[Remark]:
    """Remark on what is odd but needs no decision."""
    header, section = head.header, head.section
    remarks: list[Remark] = []
    if head.at:
        remarks.append(remark("header", f"{head.at} zero bytes before the header"))
    if not section.entries:
        remarks.append(
            remark("header", "the parameter section is empty: only the header speaks")
        )
    if layout.first_frame != 1:
        remarks.append(
            remark(
                "header",
                f"the first frame is number {layout.first_frame}",
                first_frame=layout.first_frame,
            )
        )
    if left >= BLOCK_BYTES:
        remarks.append(remark("header", f"{left} bytes after the last frame"))
    rate = section.numbers("POINT", "RATE")
    if rate.size and not np.isclose(rate[0], header.rate, rtol=1e-5, atol=0):
        remarks.append(
            remark(
                "time",
                f"rate: the parameters say {rate[0]:g}, the header {header.rate:g}",
            )
        )
    if abs(head.scale) == 1.0:
        kind = "residuals" if layout.is_float else "coordinates"
        remarks.append(
            remark("unit", f"POINT:SCALE is {head.scale:g}: {kind} in whole units only")
        )
    return remarks + _label_remarks(head, layout.points) + _analog_remarks(head)


def _label_remarks(head: Head, points: int) -> list[Remark]:
    labels = head.section.strings("POINT", "LABELS")
    remarks: list[Remark] = []
    if len(labels) < points:
        remarks.append(
            remark(
                "labels",
                f"{len(labels)} labels for {points} points: the rest are unnamed",
            )
        )
    if len(labels) > points:
        remarks.append(
            remark(
                "labels",
                f"{len(labels)} labels for {points} points: the last are unused",
            )
        )
    first = head.section.find("POINT", "LABELS")
    more = head.section.find("POINT", "LABELS2")
    if first is not None and more is not None and len(strings_of(first)) != 255:
        remarks.append(
            remark("labels", "POINT:LABELS2 is there though LABELS does not hold 255")
        )
    if first is not None and not _is_utf8(first.data):
        remarks.append(
            remark("labels", "labels are not UTF-8; they were read as Latin-1")
        )
    return remarks


def _analog_remarks(head: Head) -> list[Remark]:
    rates = [head.section.numbers(g, "RATE")[:1] for g in ("ANALOG", "POINT")]
    if not all(r.size and np.isfinite(r[0]) and r[0] > 0 for r in rates):
        return []
    ratio = float(rates[0][0] / rates[1][0])
    whole = analog_ratio(head.header, head.section)
    if not count(head.section, "ANALOG", "USED") or abs(ratio - whole) < 1e-6 * ratio:
        return []
    text = (
        f"ANALOG:RATE {rates[0][0]:g} is not a whole multiple of POINT:RATE "
        f"{rates[1][0]:g}"
    )
    return [remark("time", text)]


def _is_utf8(raw: bytes) -> bool:
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def twice(labels: Sequence[str]) -> list[Remark]:
    """Say which labels stand more than once; nothing if none does."""
    found = [name for name, n in Counter(labels).items() if n > 1 and name]
    text = f"labels that stand twice: {some_of(found)}"
    return [remark("labels", text, labels=found)] if found else []


def some_of(names: Sequence[str], most: int = 5) -> str:
    """Return names for a sentence."""
    shown = ", ".join(names[:most])
    return shown + (f" and {len(names) - most} more" if len(names) > most else "")
