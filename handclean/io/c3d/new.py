"""A C3D file of handclean's own: Intel floats in mm."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from handclean import __version__
from handclean.io.c3d.analog import Gains, analog_rows
from handclean.io.c3d.columns import Angles, Columns
from handclean.io.c3d.draft import (
    TOP_STEPS,
    Writing,
    check_fits,
    extent,
    rejected,
    with_angles,
)
from handclean.io.c3d.edit import with_floats, with_shorts, with_strings, with_text
from handclean.io.c3d.events import LABELLED_EVENTS_KEY, with_events
from handclean.io.c3d.head import (
    MAGIC,
    Head,
    parse_head,
    with_frames,
    with_header_floats,
    with_header_shorts,
)
from handclean.io.c3d.numbers import Processor
from handclean.io.c3d.parameters import BLOCK_BYTES, Section
from handclean.io.c3d.samples import Coding
from handclean.io.shared.settle import METRES
from handclean.recording import Recording


def new_file(
    recording: Recording, columns: Columns, angles: Angles, where: Path | str
) -> Writing:
    """Plan a file of handclean's own: Intel floats, mm."""
    low, high = extent(recording)
    largest = max(-low, high) / METRES["mm"]
    scale = float(np.float32(np.clip(largest / TOP_STEPS, 1e-6, 1e30)))
    coding = Coding(
        processor=Processor.INTEL, is_float=True, scale=scale, metres=METRES["mm"]
    )
    check_fits(max(-low, high), coding, where)
    per_frame, channels, analog = 0, 0, None
    if recording.analog is not None and recording.analog.values.size:
        channels = recording.analog.values.shape[1]
        gains = Gains(
            offset=np.zeros(channels), scale=np.ones(channels), unsigned=False
        )
        rows = analog_rows(recording.analog, recording.frames, gains, True, where)
        analog = coding.words(rows)
        per_frame = rows.shape[1] // channels
    head = _blank_head()
    section = _new_section(head.section, recording, columns, scale)
    section = _analog_section(section, recording, channels, per_frame)
    section = with_angles(section, angles)
    section = with_events(
        section, recording.source_events, recording.first_frame, recording.rate
    )
    head = with_header_shorts(
        head,
        {
            1: len(columns.columns),
            2: channels * per_frame,
            9: per_frame,
            149: LABELLED_EVENTS_KEY,
        },
    )
    head = with_header_floats(head, {12: -scale, 20: recording.rate})
    head = replace(head, section=section)
    head = with_frames(head, recording.frames, max(recording.first_frame, 0))
    return Writing(
        recording=recording,
        columns=columns,
        angles=angles,
        coding=coding,
        head=head.raw,
        analog=analog,
        remarks=rejected(recording),
    )


def _blank_head() -> Head:
    """Return a header and an empty section, Intel."""
    header = bytes([2, MAGIC]).ljust(BLOCK_BYTES, b"\0")
    lead = bytes([1, MAGIC, 1, Processor.INTEL])
    raw = header + lead.ljust(BLOCK_BYTES, b"\0")
    head = parse_head(np.frombuffer(raw, np.uint8), "C3D")
    return replace(head, raw=raw)


def _new_section(
    section: Section, recording: Recording, columns: Columns, scale: float
) -> Section:
    """Fill the POINT and MANUFACTURER groups of a new file."""
    section = with_shorts(section, "POINT", "USED", len(columns.columns))
    section = with_shorts(section, "POINT", "FRAMES", 0)
    section = with_shorts(section, "POINT", "DATA_START", 0)
    section = with_floats(section, "POINT", "SCALE", -scale)
    section = with_floats(section, "POINT", "RATE", float(recording.rate))
    section = with_text(section, "POINT", "UNITS", "mm")
    up = recording.up_axis.lower()
    if up[1:] in {"x", "y", "z"} and up[:1] in {"+", "-"}:
        right = "+Y" if up[1:] == "x" else "+X"
        section = with_text(section, "POINT", "X_SCREEN", right)
        section = with_text(section, "POINT", "Y_SCREEN", up.upper())
    labels = [c.label for c in columns.columns]
    section = with_strings(section, "POINT", "LABELS", labels)
    about = [c.description for c in columns.columns]
    section = with_strings(section, "POINT", "DESCRIPTIONS", about)
    section = with_text(section, "MANUFACTURER", "SOFTWARE", "handclean")
    return with_text(section, "MANUFACTURER", "VERSION_LABEL", __version__)


def _analog_section(
    section: Section, recording: Recording, channels: int, per_frame: int
) -> Section:
    """Fill the ANALOG and FORCE_PLATFORM groups of a new file."""
    section = with_shorts(section, "ANALOG", "USED", channels)
    section = with_floats(section, "ANALOG", "RATE", recording.rate * per_frame)
    section = with_floats(section, "ANALOG", "GEN_SCALE", 1.0)
    analog = recording.analog
    if channels and analog is not None:
        section = with_strings(section, "ANALOG", "LABELS", analog.labels)
        section = with_strings(section, "ANALOG", "UNITS", analog.units)
        for number, begin in enumerate(range(0, channels, 255), start=1):
            part = min(255, channels - begin)
            tail = str(number) if number > 1 else ""
            section = with_floats(section, "ANALOG", f"SCALE{tail}", [1.0] * part)
            section = with_shorts(section, "ANALOG", f"OFFSET{tail}", [0] * part)
    return with_shorts(section, "FORCE_PLATFORM", "USED", 0)
