"""Remarks: everything worth telling that is no error is one of these.

A reader that met something odd, a step that doubts its result, a format that cannot
hold a part of a take: each makes a `Remark`. The console shows its text, ``--json`` and
the record of an output the whole of it, a session's ``/events`` what belongs to a take.
What a program asks of a remark is in its kind, its place and its data; nothing reads
the text.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

KINDS: Mapping[str, str] = MappingProxyType(
    {
        # of a file that was read
        "damage": "the file is cut off, broken or repaired",
        "header": "what the file says of itself does not agree with what it holds",
        "unit": "the unit of length, or a size that makes one doubt it",
        "time": "frame numbers, times or the rate",
        "missing": "samples that count as missing",
        "filled": "samples that count as filled, not as measured",
        "labels": "names of markers, as the file has them",
        "left-out": "what the file holds and is not taken",
        "implausible": "samples that no camera measures: too far away, frozen",
        # of a step and its result
        "names": "names that were matched, not found or not kept",
        "unseen": "a hand, a joint or a reading that is never or seldom there",
        "fit": "a subject, a marker or a calibration that does not fit what was taken",
        "unobserved": "joints that no marker, or no sensor, tells of",
        "subject": "what is not known of a subject",
        "few": "too little to learn from",
        "trust": "frames or angles that are not trusted",
        "sensor": "a glove's sensor",
        "layout": "what a set of markers cannot do",
        "smoothed": "measured samples that were smoothed or despiked, or could not be",
        "gap": "a gap of a marker, and what became of it",
        "lost": "frames in which a marker was not found",
        "anew": "what was done again although the file had it",
        "not-compared": "what a comparison leaves out",
        "not-kept": "what the output's format cannot hold, or holds otherwise",
        "replaced": "a file that stood in the place of an output",
        "note": "anything else",
    }
)
"""The kinds of remarks, with what they are about. Users hold on to these words."""


@dataclass(frozen=True, kw_only=True)
class Location:
    """Where something is, as far as that is known.

    Attributes
    ----------
    file : the file, or None.
    frames : the first and the last frame, as the file numbers them; None for all of
        a take, or where there are no frames (see `handclean.recording.Numbering`).
    model : the hand or object, by the name of its motion, or "".
    marker, joint : their names, or "".
    """

    file: Path | None = None
    frames: tuple[int, int] | None = None
    model: str = ""
    marker: str = ""
    joint: str = ""


@dataclass(frozen=True, kw_only=True)
class Remark:
    """One thing that is worth telling.

    Attributes
    ----------
    kind : one of `KINDS`.
    where : the file, the frames, the marker, as far as they are known.
    text : one plain sentence for people.
    data : the numbers and names in it, as plain JSON values.

    Raises
    ------
    ValueError
        If the kind is none of `KINDS`.

    Examples
    --------
    >>> remark("missing", "3 samples are missing", frames=(7, 9), samples=3).as_json()
    {'kind': 'missing', 'where': {'frames': [7, 9]}, 'text': '3 samples are missing', \
'data': {'samples': 3}}
    """

    kind: str
    where: Location = Location()
    text: str
    data: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            known = ", ".join(KINDS)
            raise ValueError(f"a remark is one of {known}, not '{self.kind}'")

    def of_file(self, file: Path) -> Self:
        """Return the same remark about a file, if it names none yet."""
        if self.where.file is not None:
            return self
        return replace(self, where=replace(self.where, file=file))

    def said(self, about: Path | None = None) -> str:
        """Return the text, after the name of its file if that is not ``about``."""
        file = self.where.file
        return self.text if file in (None, about) else f"{file}: {self.text}"

    def as_json(self) -> dict[str, Any]:
        """Return the remark as plain JSON values; of the place only what is known."""
        place = self.where
        where: dict[str, Any] = {}
        if place.file is not None:
            where["file"] = str(place.file)
        if place.frames is not None:
            where["frames"] = list(place.frames)
        for name in ("model", "marker", "joint"):
            if value := getattr(place, name):
                where[name] = value
        data = dict(self.data)
        return {"kind": self.kind, "where": where, "text": self.text, "data": data}


def remark(
    kind: str,
    text: str,
    *,
    file: Path | None = None,
    frames: tuple[int, int] | None = None,
    model: str = "",
    marker: str = "",
    joint: str = "",
    **data: Any,
) -> Remark:
    """Make a remark; parameters as in `Location` and `Remark`."""
    where = Location(file=file, frames=frames, model=model, marker=marker, joint=joint)
    return Remark(kind=kind, where=where, text=text, data=data)


def from_json(value: Mapping[str, Any]) -> Remark:
    """Return what `Remark.as_json` made; a kind that is not known here is a note.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the value is no remark.
    """
    where = dict(value.get("where", {}))
    if "file" in where:
        where["file"] = Path(where["file"])
    if "frames" in where:
        first, last = where["frames"]
        where["frames"] = (int(first), int(last))
    names = [part.name for part in fields(Location)]
    known = {name: where[name] for name in names if name in where}
    return Remark(
        kind=value["kind"] if value["kind"] in KINDS else "note",
        where=Location(**known),
        text=str(value["text"]),
        data=dict(value.get("data", {})),
    )


def texts(remarks: Iterable[Remark]) -> tuple[str, ...]:
    """Return the texts of remarks."""
    return tuple(one.text for one in remarks)


def of_file(file: Path, remarks: Iterable[Remark]) -> tuple[Remark, ...]:
    """Return remarks about a file, those that name another left as they are."""
    return tuple(one.of_file(file) for one in remarks)


def first_of(names: Sequence[str], most: int = 4) -> str:
    """Return names for a text, "..." for those beyond so many.

    Examples
    --------
    >>> first_of(["a", "b", "c"], 2)
    'a, b, ...'
    """
    return ", ".join(names[:most]) + (", ..." if len(names) > most else "")


def length_in_words(metres: float, digits: int = 2) -> str:
    """Return a length for a text, in millimetres as far as they are plain numbers.

    Examples
    --------
    >>> length_in_words(0.0123), length_in_words(0.123), length_in_words(0.123, 4)
    ('12 mm', '0.12 m', '123 mm')
    """
    millimetres = f"{1e3 * metres:.{digits}g}"
    if float(millimetres) < min(10**digits, 1000):
        return f"{millimetres} mm"
    return f"{metres:.{digits}g} m"


def listed(names: Sequence[str], most: int = 6) -> str:
    """Return names for a text, and how many there are beyond so many.

    Examples
    --------
    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")
