"""What each format keeps of a take, and what of a given take it cannot keep.

`handclean.io.formats` says which parts each keeps; README.md shows it as a table. A
test writes a take in which every part is there in every format, reads it back and
compares.
"""

from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from handclean.io.formats import BY_SUFFIX, FORMATS
from handclean.recording import Motion, Origin, Recording
from handclean.remarks import Remark, remark


class Part(NamedTuple):
    """A part of a take.

    Attributes
    ----------
    name : what to call it in a warning.
    has : whether a take has it.
    much : how much of it there is, to stand behind the name, or "".
    """

    name: str
    has: Callable[[Recording], bool]
    much: Callable[[Recording], str] = lambda _: ""


def _markers(take: Recording) -> bool:
    return take.markers is not None and bool(take.markers.labels)


def _points(take: Recording) -> bool:
    return take.unlabelled is not None and bool(len(take.unlabelled.frame))


def _how_many_points(take: Recording) -> str:
    return "" if take.unlabelled is None else str(len(take.unlabelled.frame))


def _marks(take: Recording) -> bool:
    if take.markers is None:
        return False
    return bool(np.isin(take.markers.origin, (Origin.FILLED, Origin.SMOOTHED)).any())


def _raw(take: Recording) -> bool:
    return take.markers is not None and bool(take.markers.has_raw.any())


def _confidence(take: Recording) -> bool:
    arrays: list[Any] = [motion.angles_sigma for motion in take.motions.values()]
    if take.markers is not None:
        arrays += [take.markers.confidence, take.markers.sigma]
    return any(a is not None and bool(np.isfinite(a).any()) for a in arrays)


def _residuals(take: Recording) -> bool:
    parts = (take.markers, take.unlabelled)
    return any(p is not None and p.residual is not None for p in parts)


def _angles(take: Recording) -> bool:
    return any(motion.names for motion in take.motions.values())


def _in_doubt(take: Recording) -> int:
    """Frames in which a hand is not trusted."""
    doubt = np.zeros(take.frames, dtype=bool)
    for motion in take.motions.values():
        if motion.trusted is not None:
            doubt |= ~motion.trusted
    return int(doubt.sum())


def _how_much_doubt(take: Recording) -> str:
    return f"{_in_doubt(take)} of {take.frames} frames are not trusted"


def _is_placed(motion: Motion) -> bool:
    return motion.translation is not None or motion.rotation is not None


def _roots(take: Recording) -> bool:
    return any(map(_is_placed, take.motions.values()))


def _events(take: Recording) -> bool:
    """Whether there is an event of a step; a reader's, of all frames, comes again."""
    whole = (0, take.frames)
    return any((event.start, event.stop) != whole for event in take.events)


PARTS = MappingProxyType(
    {
        "markers": Part("markers", _markers),
        "points": Part("points without a name", _points, _how_many_points),
        "marks": Part("marks of filled samples", _marks),
        "raw": Part("raw places of smoothed samples", _raw),
        "confidence": Part("confidence and sigma", _confidence),
        "residuals": Part("residuals and cameras", _residuals),
        "angles": Part("joint angles", _angles),
        "roots": Part("where the hand is", _roots),
        "trust": Part("trust", lambda take: bool(_in_doubt(take)), _how_much_doubt),
        "skeletons": Part("joint trees", lambda take: bool(take.skeletons)),
        "events": Part("events of handclean's steps", _events),
        "source_events": Part(
            "events of the source", lambda take: bool(take.source_events)
        ),
        "analog": Part("analog channels", lambda take: take.analog is not None),
        "source": Part(
            "what else the source held",
            lambda take: bool(take.parameters.get("c3d")),
        ),
        "first_frame": Part("the first frame's number", lambda t: t.first_frame != 1),
        "start_time": Part("the first frame's time", lambda t: t.start_time != 0.0),
        "up_axis": Part("the up axis", lambda take: bool(take.up_axis)),
    }
)

KEEPS = MappingProxyType({f.suffix: f.keeps for f in FORMATS if f.keeps})
"""Parts that each format keeps, by its suffix."""


def parts(suffix: str, *, unnamed: bool = False) -> frozenset[str]:
    """Return which parts a format keeps.

    Parameters
    ----------
    unnamed : write points without a name where a format can leave them out (TRC).
    """
    wanted = BY_SUFFIX.get(suffix)
    more = unnamed and wanted is not None and "unnamed" in wanted.options
    return KEEPS.get(suffix, frozenset(PARTS)) | ({"points"} if more else set())


def lost(
    recording: Recording, suffix: str, *, unnamed: bool = False
) -> tuple[Remark, ...]:
    """Remark on what of a take a format cannot keep; nothing if it keeps all."""
    kept = parts(suffix, unnamed=unnamed)
    gone = [
        (key, f"{part.name} ({much})" if (much := part.much(recording)) else part.name)
        for key, part in PARTS.items()
        if key not in kept and part.has(recording)
    ]
    if not gone:
        return ()
    name = suffix.removeprefix(".").upper()
    text = (
        f"{name} keeps no {', '.join(words for _, words in gone)}; .h5 keeps everything"
    )
    return (remark("not-kept", text, parts=[key for key, _ in gone]),)


def kept(recording: Recording, suffix: str, *, unnamed: bool = False) -> Recording:
    """Return a take without the markers, points and motions a format cannot keep."""
    stay = parts(suffix, unnamed=unnamed)
    motions = {
        name: motion
        for name, motion in recording.motions.items()
        if ("angles" in stay and motion.names) or "roots" in stay
    }
    return replace(
        recording,
        markers=recording.markers if "markers" in stay else None,
        unlabelled=recording.unlabelled if "points" in stay else None,
        motions=motions,
    )


def table() -> str:
    """Return the table as Markdown."""
    suffixes = [suffix for suffix in KEEPS if suffix != ".h5"]
    lines = ["| keeps | " + " | ".join(f"`{suffix}`" for suffix in suffixes) + " |"]
    lines.append("|---" * (len(suffixes) + 1) + "|")
    for key, part in PARTS.items():
        marks = ["yes" if key in KEEPS[suffix] else "" for suffix in suffixes]
        lines.append(f"| {part.name} | " + " | ".join(marks) + " |")
    return "\n".join(
        line.replace("|  |", "| |").replace("|  |", "| |") for line in lines
    )
