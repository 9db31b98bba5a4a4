"""The parts of a session file, made of a take."""

from typing import Any

import numpy as np

from handclean.io.hdf5.parts import Array, Part, tree_part
from handclean.io.hdf5.provenance import provenance_item
from handclean.recording import (
    Analog,
    Event,
    Motion,
    Numbering,
    Points,
    Recording,
    SourceEvent,
    Trajectories,
)

MARKER_ARRAYS = {
    "sigma": ("m", np.float32),
    "confidence": ("", np.float32),
    "source": ("", np.int32),
    "residual": ("m", np.float32),
    "cameras": ("", np.uint8),
}

SAID_OF_EVENTS = ("kind", "model", "marker")


def session_part(recording: Recording) -> Part:
    """Return a take as the parts of its session file."""
    attrs: dict[str, Any] = {
        "rate": float(recording.rate),
        "first_frame": int(recording.first_frame),
        "start_time": float(recording.start_time),
        "frames": int(recording.frames),
    }
    if recording.up_axis:
        attrs["up_axis"] = recording.up_axis
    items: dict[str, Any] = {}
    if recording.markers is not None:
        items["markers"] = _markers_part(recording.markers)
    if recording.unlabelled is not None:
        items["unlabelled"] = _points_part(recording.unlabelled)
    if recording.skeletons:
        trees = {name: tree_part(tree) for name, tree in recording.skeletons.items()}
        items["skeleton"] = Part(items=trees)
    if recording.motions:
        motions = {name: _motion_part(m) for name, m in recording.motions.items()}
        items["motion"] = Part(items=motions)
    if events := recording.all_events:
        items["events"] = _events_part(events, recording.numbering)
    if recording.analog is not None:
        items["analog"] = _analog_part(recording.analog)
    if recording.parameters:
        items["parameters"] = dict(recording.parameters)
    if recording.source_events:
        items["source_events"] = _source_events_part(recording.source_events)
    items.update(provenance_item(recording.provenance))
    return Part(attrs, items)


def _markers_part(markers: Trajectories) -> Part:
    items: dict[str, Any] = {
        "positions": Array(markers.positions, "m"),
        "labels": list(markers.labels),
        "model": list(markers.model),
        "origin": Array(markers.origin),
    }
    for name, (units, _) in MARKER_ARRAYS.items():
        values = getattr(markers, name)
        if values is not None:
            items[name] = Array(values, units)
    if markers.raw is not None:
        items["raw"] = Array(markers.raw, "m")
    if markers.sigma is not None and markers.q95 is not None:
        items["sigma"] = Array(markers.sigma, "m", {"q95": markers.q95})
    return Part(items=items)


def _points_part(points: Points) -> Part:
    items: dict[str, Any] = {
        "frame": Array(points.frame),
        "source": Array(points.source),
        "positions": Array(points.positions, "m"),
    }
    if points.residual is not None:
        items["residual"] = Array(points.residual, "m")
    if points.cameras is not None:
        items["cameras"] = Array(points.cameras)
    return Part(items=items)


def _motion_part(motion: Motion) -> Part:
    items: dict[str, Any] = {
        "names": list(motion.names),
        "angles": Array(motion.angles, "rad"),
    }
    units = {
        "translation": "m",
        "rotation": "",
        "angles_sigma": "rad",
        "trusted": "",
        "residual": "m",
    }
    for name, unit in units.items():
        values = getattr(motion, name)
        if values is not None:
            items[name] = Array(values, unit)
    return Part(items=items)


def _events_part(events: tuple[Event, ...], numbering: Numbering) -> Part:
    spans = [numbering.span(e.start, e.stop) for e in events]
    starts, stops = np.array(spans, dtype=np.int64).T
    items: dict[str, Any] = {"start": Array(starts), "stop": Array(stops)}
    items["text"] = [e.text for e in events]
    for name in SAID_OF_EVENTS:
        values = [getattr(e, name) for e in events]
        if any(values):
            items[name] = values
    return Part(items=items)


def _analog_part(analog: Analog) -> Part:
    items = {
        "values": Array(analog.values, "as in units"),
        "labels": list(analog.labels),
        "units": list(analog.units),
    }
    return Part({"rate": float(analog.rate)}, items)


def _source_events_part(events: tuple[SourceEvent, ...]) -> Part:
    return Part(
        items={
            "time": Array(np.array([e.time for e in events], dtype=float), "s"),
            "label": [e.label for e in events],
            "context": [e.context for e in events],
        }
    )
