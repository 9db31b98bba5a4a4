"""What a C3D file to be written is made of, and the file a recording came from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.errors import FileError
from handclean.io.c3d.columns import Angles, Columns
from handclean.io.c3d.edit import with_strings, with_text
from handclean.io.c3d.head import Head, coding_of, parse_head
from handclean.io.c3d.numbers import Processor, Words
from handclean.io.c3d.parameters import Section
from handclean.io.c3d.samples import Coding, placed, valid
from handclean.io.shared.settle import METRES, named_unit
from handclean.recording import Origin, Recording
from handclean.remarks import Remark, remark

BLOCK_SAMPLES = 1 << 15
"""Samples written at once (chosen: they stay in the cache)."""

TOP_STEPS = 32000
"""The largest coordinate in steps of SCALE, by the format's rule."""


@dataclass(frozen=True, kw_only=True)
class Source:
    """The C3D file a recording came from, as ``parameters["c3d"]`` keeps it.

    Attributes
    ----------
    frames : (T, words) as in the file; None if the recording has other frames now.
    unit : of length that was taken though the file says another; else "".
    """

    head: Head
    coding: Coding
    points: int
    analog_words: int
    loose: NDArray[np.intp]
    tail: bytes
    frames: Words | None
    unit: str = ""

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
    unrecorded : whether all fourth words are 0 where there is a point, as in the
        source; `handclean.io.c3d.filled_list` says what was filled.
    remarks : what the file cannot hold or how it was met, one each.
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
    unrecorded: bool = False
    remarks: tuple[Remark, ...] = ()


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
    unit, said = str(kept["unit"]), named_unit(head.unit or "mm")
    metres = METRES[unit.lower()]
    coding = coding_of(head, is_float, metres, where)
    if not is_float and "scale" in kept:
        coding = replace(coding, scale=_positive(kept["scale"]))
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
        unit=unit if said is None or METRES[said.lower()] != metres else "",
    )


def _positive(scale: Any) -> float:
    if not 0 < float(scale) < np.inf:
        raise ValueError(f"scale is {scale}")
    return float(scale)


def is_silent(source: Source, column: int) -> bool:
    """Whether a source's column has no point at all."""
    if source.frames is None:
        return False
    words = source.frames[:, 4 * column : 4 * column + 4]
    with np.errstate(all="ignore"):
        numbers = source.coding.numbers(words)
        return not (valid(numbers) & placed(numbers)).any()


def extent(recording: Recording) -> tuple[float, float]:
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


def check_fits(largest: float, coding: Coding, where: Path | str) -> None:
    """Refuse a coordinate [m] that a float of 32 bits cannot hold."""
    is_dec = coding.processor is Processor.DEC
    most = 1.7e38 if is_dec else float(np.finfo(np.float32).max)
    if largest / coding.metres > most:
        raise FileError(where, f"a coordinate of {largest:g} m is no place")


def rejected(recording: Recording) -> tuple[Remark, ...]:
    """Remark on samples that are lost because they were rejected."""
    markers = recording.markers
    count = 0
    if markers is not None:
        count = int(np.count_nonzero(markers.origin == Origin.REJECTED))
    text = f"{count} rejected samples are written as missing"
    return (remark("not-kept", text, samples=count),) if count else ()


def smoothed(recording: Recording) -> tuple[Remark, ...]:
    """Remark on samples that were measured, and that a C3D calls computed."""
    markers = recording.markers
    count = 0
    if markers is not None:
        count = int(np.count_nonzero(markers.origin == Origin.SMOOTHED))
    text = (
        f"{count} smoothed samples are written as computed, like filled ones, and will "
        "not count as measured when they are read; .h5 says that they were"
    )
    return (remark("not-kept", text, samples=count),) if count else ()


def untrusted(recording: Recording) -> tuple[Remark, ...]:
    """Remark on each motion some of whose angles are not written."""
    counts = {
        name: int(np.count_nonzero(~motion.trusted))
        for name, motion in recording.motions.items()
        if motion.names and motion.trusted is not None
    }
    return tuple(
        remark(
            "not-kept",
            f"angles of '{name}' are missing in {count} of {recording.frames} frames: "
            "they are not trusted, and C3D cannot say so",
            model=name,
            count=count,
        )
        for name, count in counts.items()
        if count
    )


def with_angles(section: Section, angles: Angles) -> Section:
    """List the points that are joint angles."""
    if not angles.labels:
        return section
    listed = section.strings("POINT", "ANGLES")
    listed += [label for label in angles.labels if label not in listed]
    section = with_strings(section, "POINT", "ANGLES", listed)
    if not section.strings("POINT", "ANGLE_UNITS"):
        section = with_text(section, "POINT", "ANGLE_UNITS", "deg")
    return section
