"""The session file: everything known about a take, in SI units, as HDF5.

Part for part what `handclean.recording` holds; see interface.md for the table. The
arrays of a motion or of markers that a take does not have are not in the file either.

Version 2 has events by the source's frame numbers, both ends included, and ``sigma`` of
filled samples per axis. Version 1 had rows from 0, the stop left out, and the root mean
square distance, sqrt(3) times as much; it is read for what it meant.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handclean.errors import FileError, HandcleanError
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Part, tree_from
from handclean.io.hdf5.provenance import provenance_from
from handclean.io.hdf5.session_parts import MARKER_ARRAYS, SAID_OF_EVENTS, session_part
from handclean.recording import (
    Analog,
    Event,
    Motion,
    Numbering,
    Origin,
    Points,
    Recording,
    SourceEvent,
    Trajectories,
)

FORMAT = "handclean session"
VERSION = 2
"""Of the session's layout."""

_ROWS_AND_DISTANCES = 1
"""The last version that had events in rows and ``sigma`` as a distance."""

_UP = ("", "+x", "-x", "+y", "-y", "+z", "-z")
_LATEST_S = 1e12
"""[s] no clock shows more (chosen)."""


def write_session(path: Path, recording: Recording) -> None:
    """Write a take as a session file; the same content gives the same bytes.

    Raises
    ------
    FileError
        If it cannot be written, or ``parameters`` hold what no file can.
    """
    write_h5(path, FORMAT, session_part(recording), version=VERSION)


def read_session(path: Path) -> Recording:
    """Read a session file.

    Raises
    ------
    FileError
        If it is not a session file, is damaged, or its parts do not fit together.
    """
    root = read_h5(path, FORMAT, version=VERSION)
    old = root.number("version") <= _ROWS_AND_DISTANCES
    rate, frames = root.number("rate"), root.number("frames")
    first, up_axis = root.number("first_frame", 1), root.text("up_axis", "")
    start = root.number("start_time", 0.0)
    if not 1e-9 < rate < 1e9:
        raise FileError(path, f"its rate is {rate:g} Hz", "it should be above 0")
    if not isinstance(frames, int) or frames < 1:
        raise FileError(path, "has no frames")
    if not isinstance(first, int):
        raise FileError(path, f"its first frame is {first:g}", "not a whole number")
    if not abs(start) < _LATEST_S:
        raise FileError(path, f"its first frame is at {start:g} s", "no such time")
    if up_axis not in _UP:
        raise FileError(path, f"its up axis is '{up_axis[:20]}'", "+y or the like")
    try:
        return Recording(
            rate=float(rate),
            frames=frames,
            first_frame=first,
            start_time=float(start),
            up_axis=up_axis,
            markers=_markers(root.part("markers"), frames, distances=old),
            unlabelled=_points(root.part("unlabelled"), frames),
            skeletons={
                name: tree_from(part) for name, part in root.part("skeleton").parts()
            },
            motions={
                name: _motion(part, frames)
                for name, part in root.part("motion").parts()
            },
            events=_events(
                root.part("events"), frames, None if old else Numbering(first)
            ),
            analog=_analog(root.part("analog"), frames),
            parameters=_parameters(root),
            source_events=_source_events(root.part("source_events")),
            provenance=provenance_from(root),
        )
    except FileError:
        raise
    except HandcleanError as error:
        raise FileError(path, str(error)) from None


def _optional(part: Part, name: str, units: str, dtype: Any, *shape: int | None) -> Any:
    return part.array(name, units, dtype, *shape) if part.has(name) else None


def _markers(part: Part, frames: int, *, distances: bool) -> Trajectories | None:
    """Read markers; ``distances``: their sigma is one, of three axes together."""
    if not part.items:
        return None
    labels = part.names("labels")
    shape = (frames, len(labels))
    positions = part.array("positions", "m", np.float64, *shape, 3)
    if part.has("origin"):
        origin = part.array("origin", "", np.uint8, *shape)
    else:
        origin = np.isfinite(positions).all(axis=2).astype(np.uint8)
    if origin.size and origin.max() > max(Origin):
        raise part.fail(f"origin holds {origin.max()}", "0 to 4 are known")
    blank = ("",) * len(labels)
    arrays = {
        name: _optional(part, name, units, dtype, *shape)
        for name, (units, dtype) in MARKER_ARRAYS.items()
    }
    if distances and arrays["sigma"] is not None:
        arrays["sigma"] = (arrays["sigma"] / np.sqrt(3.0)).astype(np.float32)
    return Trajectories(
        positions=positions,
        labels=labels,
        model=part.names("model", len(labels)) if part.has("model") else blank,
        origin=origin,
        raw=_optional(part, "raw", "m", np.float64, *shape, 3),
        q95=part.table("q95", "sigma", 2),
        **arrays,
    )


def _points(part: Part, frames: int) -> Points | None:
    if not part.items:
        return None
    frame = part.array("frame", "", np.int32, None)
    if np.any(np.diff(frame) < 0) or (
        frame.size and not 0 <= frame[0] <= frame[-1] < frames
    ):
        raise part.fail("frame should rise and stay within the take")
    count = len(frame)
    return Points(
        frame=frame,
        source=part.array("source", "", np.int32, count),
        positions=part.array("positions", "m", np.float64, count, 3),
        residual=_optional(part, "residual", "m", np.float32, count),
        cameras=_optional(part, "cameras", "", np.uint8, count),
    )


def _motion(part: Part, frames: int) -> Motion:
    names = part.names("names")
    if len(set(names)) < len(names):
        raise part.fail("names of angles stand twice", "each should be there once")
    return Motion(
        names=names,
        angles=part.array("angles", "rad", np.float64, frames, len(names)),
        translation=_optional(part, "translation", "m", np.float64, frames, 3),
        rotation=_optional(part, "rotation", "", np.float64, frames, 4),
        angles_sigma=_optional(
            part, "angles_sigma", "rad", np.float64, frames, len(names)
        ),
        trusted=_optional(part, "trusted", "", np.bool_, frames),
        residual=_optional(part, "residual", "m", np.float64, frames),
    )


def _events(part: Part, frames: int, numbering: Numbering | None) -> tuple[Event, ...]:
    """Read events; they are in rows already where there is no ``numbering``."""
    if not part.items:
        return ()
    texts = part.texts("text")
    starts = part.array("start", "", np.int64, len(texts)).tolist()
    stops = part.array("stop", "", np.int64, len(texts)).tolist()
    spans = list(zip(starts, stops, strict=True))
    if numbering is not None:
        spans = [numbering.rows(*span) for span in spans]
    if not all(0 <= start <= stop <= frames for start, stop in spans):
        there = (numbering or Numbering(0)).words(0, frames)
        raise part.fail("an event is outside the take", f"it has {there}")
    if not part.has("kind"):
        said = [_said_before_kinds(text) for text in texts]
    else:
        blank = ("",) * len(texts)
        columns = [
            part.texts(name, len(texts)) if part.has(name) else blank
            for name in SAID_OF_EVENTS
        ]
        said = list(zip(*columns, strict=True))
    return tuple(
        Event(start=a, stop=b, text=text, kind=kind, model=model, marker=marker)
        for (a, b), text, (kind, model, marker) in zip(spans, texts, said, strict=True)
    )


def _said_before_kinds(text: str) -> tuple[str, str, str]:
    """Kind, model and marker of an event in a file that has no kinds.

    Until sessions had them the text was all there was: "gap in A: filled by coupled".
    """
    for begins, kind in (("gap in ", "gap"), ("gap of ", "lost")):
        if text.startswith(begins):
            return kind, "", text.removeprefix(begins).partition(": ")[0]
    return "", "", ""


def _analog(part: Part, frames: int) -> Analog | None:
    if not part.items:
        return None
    labels = part.names("labels")
    values = part.array("values", "as in units", np.float64, None, len(labels))
    if len(values) % frames:
        raise part.fail(f"has {len(values)} samples over {frames} frames")
    rate = part.number("rate")
    if not 0 < rate < 1e12:
        raise part.fail(f"its rate is {rate:g} Hz", "it should be above 0")
    return Analog(
        values=values,
        labels=labels,
        units=part.names("units", len(labels)),
        rate=float(rate),
    )


def _source_events(part: Part) -> tuple[SourceEvent, ...]:
    if not part.items:
        return ()
    labels = part.texts("label")
    contexts = part.texts("context", len(labels))
    times = part.array("time", "s", np.float64, len(labels))
    if np.isinf(times).any():
        raise part.fail("time should be finite numbers")
    rows = zip(times.tolist(), labels, contexts, strict=True)
    return tuple(SourceEvent(time=t, label=x, context=c) for t, x, c in rows)


def _parameters(root: Part) -> Mapping[str, Any]:
    found = root.items.get("parameters", {})
    if not isinstance(found, dict):
        raise root.fail("parameters should be a group of kind 'dict'")
    return found
