"""Events of a C3D file: up to 18 in the header, any number in the EVENT group.

Header times count from the first frame that is stored; times of the EVENT group, each
a pair of minutes and seconds, count from frame 1 of the trial (c3d.org, "Header events"
and "EVENT:TIMES"). Files often hold an event in both places; it is taken once.
"""

import numpy as np

from handclean.io.c3d.edit import with_floats, with_shorts, with_strings
from handclean.io.c3d.head import Head
from handclean.io.c3d.numbers import floats_at, shorts_at
from handclean.io.c3d.parameters import Section, text
from handclean.recording import SourceEvent

LABELLED_EVENTS_KEY = 12345
"""What word 150 of a header holds if its events have labels of four letters (C3D
format)."""

MOST_HEADER_EVENTS = 18
"""Events that a header has room for (C3D format)."""

_KEY_AT, _COUNT_AT, _TIMES_AT, _LABELS_AT = 298, 300, 304, 396
"""[bytes] where a header has its key, count, times and labels of events (C3D
format)."""


def read_events(
    head: Head, first_frame: int, rate: float, *, as_stored: bool = False
) -> tuple[SourceEvent, ...]:
    """Return events in order of time, in seconds from the first frame.

    Parameters
    ----------
    rate : [Hz] of the points.
    as_stored : leave times as the file has them, those of the EVENT group from frame 1.
    """
    before = _before(first_frame, rate)
    group = _group_events(head.section, before)
    same = 0.5 / rate
    extra = [
        event
        for event in _header_events(head)
        if not any(
            abs(event.time - g.time) <= same and g.label.startswith(event.label)
            for g in group
        )
    ]
    found = group + extra
    order = sorted(range(len(found)), key=lambda n: found[n].time)
    if as_stored:
        found = _group_events(head.section, 0.0) + extra
    return tuple(found[n] for n in order)


def events_as_stored(
    head: Head,
) -> tuple[list[tuple[float, str]], list[tuple[float, str]]]:
    """Return time [s] and label of the header's events and of the EVENT group's."""
    parts = (_header_events(head), _group_events(head.section, 0.0))
    header, group = ([(e.time, e.label) for e in events] for events in parts)
    return header, group


def _before(first_frame: int, rate: float) -> float:
    """[s] from frame 1 to the first frame that is stored."""
    return max(first_frame - 1, 0) / rate


def _header_events(head: Head) -> list[SourceEvent]:
    raw = head.raw[head.at : head.at + 512]
    key, number = shorts_at(raw[_KEY_AT : _COUNT_AT + 2], head.processor).tolist()
    if key != LABELLED_EVENTS_KEY or not 0 < number <= MOST_HEADER_EVENTS:
        return []
    times = floats_at(raw[_TIMES_AT : _TIMES_AT + 4 * number], head.processor)
    return [
        SourceEvent(
            time=float(time),
            label=text(raw[_LABELS_AT + 4 * i : _LABELS_AT + 4 * i + 4]),
        )
        for i, time in enumerate(times)
        if np.isfinite(time)
    ]


def _group_events(section: Section, before: float) -> list[SourceEvent]:
    labels, contexts = (section.strings("EVENT", n) for n in ("LABELS", "CONTEXTS"))
    times: list[float] = []
    for number in range(1, 258):
        name = f"TIMES{number}" if number > 1 else "TIMES"
        values = section.numbers("EVENT", name)
        if not values.size:
            break
        pairs = values[: values.size // 2 * 2].reshape(-1, 2)
        with np.errstate(invalid="ignore"):
            times += (60.0 * pairs[:, 0] + pairs[:, 1]).tolist()
    return [
        SourceEvent(
            time=time - before,
            label=labels[i] if i < len(labels) else "",
            context=contexts[i] if i < len(contexts) else "",
        )
        for i, time in enumerate(times)
        if np.isfinite(time)
    ]


def with_events(
    section: Section, events: tuple[SourceEvent, ...], first_frame: int, rate: float
) -> Section:
    """Write events as an EVENT group."""
    if not events:
        return section
    section = with_shorts(section, "EVENT", "USED", min(len(events), 65535))
    section = with_strings(section, "EVENT", "CONTEXTS", [e.context for e in events])
    section = with_strings(section, "EVENT", "LABELS", [e.label for e in events])
    seconds = np.array([e.time for e in events]) + _before(first_frame, rate)
    pairs = np.stack([seconds // 60, seconds % 60], axis=1)
    for number, begin in enumerate(range(0, len(pairs), 255), start=1):
        name = f"TIMES{number}" if number > 1 else "TIMES"
        part = pairs[begin : begin + 255]
        section = with_floats(section, "EVENT", name, part, (2, len(part)))
    return section
