"""What a written C3D file is made of: its bytes before the samples, columns, coding.

See `handclean.io.c3d_write` for the rules.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean import __version__
from handclean.errors import FileError
from handclean.io.c3d_analog import Gains, analog_rows, channels_of, gains_of
from handclean.io.c3d_columns import Angles, Columns, angles_of, plan_columns
from handclean.io.c3d_events import KEY, with_events
from handclean.io.c3d_numbers import Processor, Words
from handclean.io.c3d_parameters import (
    BLOCK,
    Section,
    with_floats,
    with_shorts,
    with_strings,
    with_text,
)
from handclean.io.c3d_samples import SHORT_MAX, SHORT_MIN, Coding, placed, valid
from handclean.io.c3d_structure import (
    MAGIC,
    Head,
    coding_of,
    parse_head,
    with_frames,
    with_header_floats,
    with_header_shorts,
    with_section,
)
from handclean.io.reading import METRES
from handclean.recording import Origin, Recording

BLOCK_SAMPLES = 1 << 15
TOP = 32000
"""The largest coordinate in steps of SCALE, by the format's rule."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """The C3D file a recording came from, as ``parameters["c3d"]`` keeps it.

    Attributes
    ----------
    frames : (T, words) as in the file; None if the recording has other frames now.
    """

    head: Head
    coding: Coding
    points: int
    analog_words: int
    loose: NDArray[np.intp]
    tail: bytes
    frames: Words | None

    def words(self, rows: slice) -> Words:
        """(B, P, 4) words of the points of some frames."""
        assert self.frames is not None
        block = self.frames[rows, : 4 * self.points]
        return block.reshape(-1, self.points, 4)


@dataclass(frozen=True, kw_only=True)
class Writing:
    """All that the samples of a file are made of.

    Attributes
    ----------
    head : bytes before them; tail : after them.
    coding : of the file to write.
    source : whose words are copied where nothing has changed; or None.
    analog : (T, words) file words, or None where the source's are copied.
    turn : what one radian is in an angle's coordinate.
    notes : what the file cannot hold or how it was met, one line each.
    """

    recording: Recording
    columns: Columns
    angles: Angles
    coding: Coding
    head: bytes
    source: Source | None = None
    analog: Words | None = None
    tail: bytes | None = None
    turn: float = 180.0 / np.pi
    notes: tuple[str, ...] = ()


def plan_writing(recording: Recording, where: Path | str) -> Writing:
    """Decide on everything but the samples.

    Raises
    ------
    FileError
        If there are no points, or they do not fit the format.
    """
    if recording.frames < 1:
        raise FileError(where, "nothing to write: the take has no frames")
    angles = angles_of(recording)
    source = source_of(recording, where)
    if source is None:
        columns = plan_columns(recording, angles, (), set(), {}, where)
        return _new(recording, columns, angles, where)
    labels, outputs = source.head.labels(source.points), source.head.outputs()
    loose = {int(c): _is_silent(source, int(c)) for c in source.loose}
    columns = plan_columns(recording, angles, labels, outputs, loose, where)
    return _again(recording, source, columns, angles, where)


def source_of(recording: Recording, where: Path | str) -> Source | None:
    """Return the C3D file that a recording came from, None if it came from another.

    Raises
    ------
    FileError
        If what the recording keeps of it does not hold together.
    """
    kept = recording.parameters.get("c3d")
    if not isinstance(kept, Mapping) or "head" not in kept:
        return None
    try:
        return _source(kept, recording.frames, where)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        wrong = f"parameters/c3d cannot be written again ({error})"
        raise FileError(where, wrong, "remove it to write a new file") from None


def _source(kept: Mapping[str, Any], frames: int, where: Path | str) -> Source:
    raw = np.asarray(kept["head"], np.uint8)
    head = parse_head(raw, where, len(raw))
    head = replace(head, raw=raw.tobytes())
    is_float = kept["numbers"] == "float"
    metres = METRES[str(kept["unit"]).lower()]
    coding = coding_of(head, is_float, metres, where)
    points = int(kept["points"])
    words = np.asarray(kept["frames"])
    if words.ndim != 2 or words.shape[1] < 4 * points or points < 1:
        raise ValueError(f"frames have shape {words.shape}")
    same = len(words) == frames
    return Source(
        head=head,
        coding=coding,
        points=points,
        analog_words=words.shape[1] - 4 * points,
        loose=np.asarray(kept.get("loose", ()), np.intp),
        tail=np.asarray(kept.get("tail", ()), np.uint8).tobytes(),
        frames=words.astype(coding.word, copy=False) if same else None,
    )


def _is_silent(source: Source, column: int) -> bool:
    """Whether a source's column has no point at all."""
    if source.frames is None:
        return False
    words = source.frames[:, 4 * column : 4 * column + 4]
    with np.errstate(all="ignore"):
        numbers = source.coding.numbers(words)
        return not (valid(numbers) & placed(numbers)).any()


def _extent(recording: Recording) -> tuple[float, float]:
    """[m] the smallest and the largest coordinate of any point; 0 if there are none."""
    low, high = 0.0, 0.0
    markers, points = recording.markers, recording.unlabelled
    for positions in (
        markers.positions if markers is not None else np.zeros((0, 1, 3)),
        points.positions if points is not None else np.zeros((0, 3)),
    ):
        step = max(BLOCK_SAMPLES * 3 // max(positions[:1].size, 1), 1)
        for begin in range(0, len(positions), step):
            block = positions[begin : begin + step]
            ends = [f.reduce(block, axis=None, initial=0.0) for f in (np.fmin, np.fmax)]
            if not np.isfinite(ends).all():
                block = block[np.isfinite(block)]
                ends = [block.min(initial=0.0), block.max(initial=0.0)]
            low, high = min(low, float(ends[0])), max(high, float(ends[1]))
    return low, high


def _check_fits(largest: float, coding: Coding, where: Path | str) -> None:
    """Refuse a coordinate [m] that a float of 32 bits cannot hold."""
    is_dec = coding.processor is Processor.DEC
    most = 1.7e38 if is_dec else float(np.finfo(np.float32).max)
    if largest / coding.metres > most:
        raise FileError(where, f"a coordinate of {largest:g} m is no place")


def _new(
    recording: Recording, columns: Columns, angles: Angles, where: Path | str
) -> Writing:
    """Plan a file of handclean's own: Intel floats, mm."""
    low, high = _extent(recording)
    largest = max(-low, high) / METRES["mm"]
    scale = float(np.float32(np.clip(largest / TOP, 1e-6, 1e30)))
    coding = Coding(
        processor=Processor.INTEL, is_float=True, scale=scale, metres=METRES["mm"]
    )
    _check_fits(max(-low, high), coding, where)
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
    section = _with_angles(section, angles)
    section = with_events(
        section, recording.source_events, recording.first_frame, recording.rate
    )
    head = with_header_shorts(
        head, {1: len(columns.columns), 2: channels * per_frame, 9: per_frame, 149: KEY}
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
        notes=_rejected(recording),
    )


def _rejected(recording: Recording) -> tuple[str, ...]:
    markers = recording.markers
    count = 0
    if markers is not None:
        count = int(np.count_nonzero(markers.origin == Origin.REJECTED))
    return (f"{count} rejected samples are written as missing",) if count else ()


def _blank_head() -> Head:
    """Return a header and an empty section, Intel."""
    header = bytes([2, MAGIC]).ljust(BLOCK, b"\0")
    lead = bytes([1, MAGIC, 1, Processor.INTEL])
    raw = header + lead.ljust(BLOCK, b"\0")
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


def _with_angles(section: Section, angles: Angles) -> Section:
    """List the points that are joint angles."""
    if not angles.labels:
        return section
    listed = section.strings("POINT", "ANGLES")
    listed += [label for label in angles.labels if label not in listed]
    section = with_strings(section, "POINT", "ANGLES", listed)
    if not section.strings("POINT", "ANGLE_UNITS"):
        section = with_text(section, "POINT", "ANGLE_UNITS", "deg")
    return section


def _again(
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
    low, high = _extent(recording)
    _check_fits(max(-low, high), coding, where)
    if not coding.is_float:
        values = angles.values[np.isfinite(angles.values)] * turn
        low = min(low / coding.metres, float(values.min(initial=0.0)))
        high = max(high / coding.metres, float(values.max(initial=0.0)))
        coding = _with_room(source, low, high)
    notes = list(_rejected(recording))
    section = head.section
    if not columns.unchanged or len(columns.columns) != source.points:
        section = _with_labels(section, columns, source.points)
        head = with_header_shorts(head, {1: len(columns.columns)})
    section = _with_angles(section, angles)
    if coding.scale != source.coding.scale:
        section = with_floats(section, "POINT", "SCALE", coding.scale)
        head = with_header_floats(head, {12: coding.scale})
        notes.append(
            f"POINT:SCALE went from {source.coding.scale:g} to {coding.scale:g} so "
            "that all coordinates fit 16 bits; every point was rounded to it"
        )
    analog = None
    if source.frames is None:
        notes.append("other frames than its C3D source has: its samples were not kept")
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
        notes=tuple(notes),
    )


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
    return replace(coding, scale=float(np.float32(largest / TOP)))


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
    beyond = source.tail[-size % BLOCK :]
    words = len(source.frames) * (4 * columns + source.analog_words)
    return b"\0" * (-words * source.frames.itemsize % BLOCK) + beyond
