"""The C3D file a recording came from, with the recording's points in it."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from handclean.io.c3d.analog import analog_rows, channels_of, gains_of
from handclean.io.c3d.columns import Angles, Columns
from handclean.io.c3d.draft import (
    TOP_STEPS,
    Source,
    Writing,
    check_fits,
    extent,
    rejected,
    with_angles,
)
from handclean.io.c3d.edit import with_floats, with_shorts, with_strings, without_group
from handclean.io.c3d.filled_list import (
    GROUP,
    NO_MARKS,
    is_unrecorded,
    marks_of,
    with_marks,
)
from handclean.io.c3d.head import (
    Head,
    with_frames,
    with_header_floats,
    with_header_shorts,
    with_section,
)
from handclean.io.c3d.numbers import Words
from handclean.io.c3d.parameters import BLOCK_BYTES, Section
from handclean.io.c3d.samples import SHORT_MAX, SHORT_MIN, Coding
from handclean.recording import Recording
from handclean.remarks import remark


def same_file(
    recording: Recording,
    source: Source,
    columns: Columns,
    angles: Angles,
    where: Path | str,
) -> Writing:
    """Plan the source's file with this recording's points."""
    head, coding = source.head, source.coding
    turn = 180.0 / np.pi
    if head.section.strings("POINT", "ANGLE_UNITS")[:1] == ["rad"]:
        turn = 1.0
    low, high = extent(recording)
    check_fits(max(-low, high), coding, where)
    if not coding.is_float:
        values = angles.values[np.isfinite(angles.values)] * turn
        low = min(low / coding.metres, float(values.min(initial=0.0)))
        high = max(high / coding.metres, float(values.max(initial=0.0)))
        coding = _with_room(source, low, high)
    remarks = list(rejected(recording))
    section = head.section
    if not columns.unchanged or len(columns.columns) != source.points:
        section = _with_labels(section, columns, source.points)
        head = with_header_shorts(head, {1: len(columns.columns)})
    section = with_angles(section, angles)
    if source.unit:
        section = with_strings(section, "POINT", "UNITS", [source.unit], 4)
        remarks.append(
            remark(
                "unit",
                f"POINT:UNITS is {source.unit} now, as --unit said",
                taken=source.unit,
            )
        )
    unrecorded = coding == source.coding and is_unrecorded(source)
    filled = marks_of(recording, columns, coding) if unrecorded else NO_MARKS
    marked = with_marks(section, filled)
    if marked is None:
        remarks.append(
            remark(
                "not-kept",
                "which samples are filled is not kept: residuals of the source were "
                "not recorded, and the file has no room for a list of its gaps",
            )
        )
        marked = without_group(section, GROUP)
    section = marked
    if coding.scale != source.coding.scale:
        section = with_floats(section, "POINT", "SCALE", coding.scale)
        head = with_header_floats(head, {12: coding.scale})
        remarks.append(
            remark(
                "not-kept",
                f"POINT:SCALE went from {source.coding.scale:g} to {coding.scale:g} so "
                "that all coordinates fit 16 bits; every point was rounded to it",
            )
        )
    elif section is not source.head.section or source.frames is None:
        head, section = _with_one_scale(head, section, coding)
    analog = None
    if source.frames is None:
        remarks.append(
            remark(
                "not-kept",
                "other frames than its C3D source has: its samples were not kept",
            )
        )
        analog = _other_analog(recording, source, where)
        if not analog.shape[1]:
            section = with_shorts(section, "ANALOG", "USED", 0)
            head = with_header_shorts(head, {2: 0})
        head = replace(head, section=section)
        head = with_frames(head, recording.frames, max(recording.first_frame, 0))
    elif section is not head.section:
        head = with_section(head, section)
    return Writing(
        recording=recording,
        columns=columns,
        angles=angles,
        coding=coding,
        head=head.raw,
        source=source if source.frames is not None else None,
        analog=analog,
        tail=_tail(source, len(columns.columns)),
        turn=turn,
        unrecorded=unrecorded,
        remarks=tuple(remarks),
    )


def _with_one_scale(
    head: Head, section: Section, coding: Coding
) -> tuple[Head, Section]:
    """Let header and parameters state the scale that was taken.

    A file is left with two only where all else is left, too: by other labels another
    one might be taken.
    """
    scale = section.numbers("POINT", "SCALE")[:1].tolist()
    if coding.is_float or np.allclose([*scale, head.header.scale], coding.scale, 1e-5):
        return head, section
    section = with_floats(section, "POINT", "SCALE", coding.scale)
    return with_header_floats(head, {12: coding.scale}), section


def _with_room(source: Source, low: float, high: float) -> Coding:
    """Return the coding of an integer file, with a larger SCALE if it must be."""
    coding = source.coding
    steps = low / coding.scale, high / coding.scale
    if steps[0] > SHORT_MIN - 0.49 and steps[1] < SHORT_MAX + 0.49:
        return coding
    largest = max(-low, high)
    if source.frames is not None:
        shorts = coding.numbers(source.words(slice(None)))[..., :3]
        ends = max(-int(shorts.min()), int(shorts.max()))
        largest = max(largest, ends * coding.scale)
    return replace(coding, scale=float(np.float32(largest / TOP_STEPS)))


def _with_labels(section: Section, columns: Columns, points: int) -> Section:
    """Set labels, descriptions and the number of points."""
    section = with_shorts(section, "POINT", "USED", len(columns.columns))
    for name, values in (
        ("LABELS", [c.label for c in columns.columns]),
        ("DESCRIPTIONS", _descriptions(section, columns)),
    ):
        old = section.find("POINT", name)
        if old is not None or any(values):
            width = old.dims[0] if old is not None and len(old.dims) > 1 else 1
            section = with_strings(section, "POINT", name, values, width)
    return section


def _descriptions(section: Section, columns: Columns) -> list[str]:
    """Return the source's descriptions at their columns' new places."""
    old = section.strings("POINT", "DESCRIPTIONS")
    return [
        old[c.home] if 0 <= c.home < len(old) else c.description
        for c in columns.columns
    ]


def _other_analog(recording: Recording, source: Source, where: Path | str) -> Words:
    """(T, words) analog words of a recording whose frames are not the source's."""
    frames = recording.frames
    channels = channels_of(source.head, source.analog_words)
    analog = recording.analog
    if analog is None or not channels or analog.values.shape[1] != channels:
        return source.coding.words(np.zeros((frames, 0)))
    gains = gains_of(source.head.section, channels)
    is_float = source.coding.is_float
    return source.coding.words(analog_rows(analog, frames, gains, is_float, where))


def _tail(source: Source, columns: int) -> bytes | None:
    """Return what stood behind the samples, None for the padding of a block."""
    if source.frames is None:
        return None
    if columns == source.points:
        return source.tail
    size = source.frames.size * source.frames.itemsize
    beyond = source.tail[-size % BLOCK_BYTES :]
    words = len(source.frames) * (4 * columns + source.analog_words)
    return b"\0" * (-words * source.frames.itemsize % BLOCK_BYTES) + beyond
