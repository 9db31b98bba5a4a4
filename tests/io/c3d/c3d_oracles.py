"""Oracles: C3D files made byte by byte, sharing nothing with handclean's own code, and
what the packages ``c3d`` and ``ezc3d`` read in a file."""

import struct
import warnings

import c3d
import ezc3d
import numpy as np

CODES = {"intel": 84, "dec": 85, "mips": 86}


def shorts(values, processor):
    order = ">" if processor == "mips" else "<"
    return (np.asarray(values, np.int64) & 0xFFFF).astype(order + "u2").tobytes()


def floats(values, processor):
    """IEEE, or VAX F: four times the value, the two halves in the other order."""
    values = np.asarray(values, np.float32)
    if processor == "mips":
        return values.astype(">f4").tobytes()
    if processor == "intel":
        return values.astype("<f4").tobytes()
    halves = (values * np.float32(4)).astype("<f4").view("<u2")
    return halves.reshape(-1, 2)[:, ::-1].tobytes()


def entry(name, group, body, processor, locked=False, description=b""):
    order = ">" if processor == "mips" else "<"
    tail = body + bytes([len(description)]) + description
    length = -len(name) if locked else len(name)
    lead = struct.pack("bb", length, group) + name.encode()
    return lead + struct.pack(order + "H", len(tail) + 2) + tail


def parameter(name, group, value, processor, **more):
    """Entry for strings (list of str), one str, an int, a float or an array."""
    if isinstance(value, str):
        raw = value.encode()
        body = struct.pack("bBB", -1, 1, len(raw)) + raw
    elif isinstance(value, list) and all(isinstance(v, str) for v in value):
        coded = [v.encode() for v in value]
        width = max([1, *map(len, coded)])
        body = struct.pack("bBBB", -1, 2, width, len(coded))
        body += b"".join(c.ljust(width) for c in coded)
    elif isinstance(value, int):
        body = struct.pack("bB", 2, 0) + shorts([value], processor)
    elif isinstance(value, float):
        body = struct.pack("bB", 4, 0) + floats([value], processor)
    else:
        array = np.asarray(value)
        is_float = array.dtype.kind == "f"
        body = struct.pack("bB", 4 if is_float else 2, array.ndim)
        body += bytes(array.shape[::-1])
        body += (floats if is_float else shorts)(array.ravel(), processor)
    return entry(name, group, body, processor, **more)


def named(name, values):
    """{"LABELS": 255 of them, "LABELS2": the next ...}."""
    parts = [values[i : i + 255] for i in range(0, len(values), 255)] or [[]]
    return {f"{name}{i + 1 if i else ''}": part for i, part in enumerate(parts)}


def c3d_bytes(
    points,
    words,
    labels=None,
    *,
    processor="intel",
    is_float=True,
    scale=0.1,
    rate=100.0,
    units="mm",
    first=1,
    count="frames",
    analog=None,
    per_frame=0,
    groups=None,
    header_events=(),
    zeros_before=0,
    pad=True,
):
    """Bytes of a file.

    points : (T, P, 3) raw coordinates: what is stored. words : (T, P) fourth words.
    analog : (T, channels * per_frame) raw. groups : {"GROUP": {"NAME": value}} to add
    or, with None for a value, to leave out.
    """
    frames, used = words.shape
    channels = analog.shape[1] // per_frame if analog is not None else 0
    labels = [f"M{i}" for i in range(used)] if labels is None else labels
    stated = -scale if is_float else scale
    point = {
        "USED": used,
        "FRAMES": min(frames, 65535),
        "DATA_START": 0,
        "SCALE": float(stated),
        "RATE": float(rate),
        "UNITS": units,
        **named("LABELS", labels),
        **named("DESCRIPTIONS", ["about " + label for label in labels]),
    }
    trial = {}
    if count == "float":
        point["FRAMES"] = float(frames)
    if count == "long":
        point["LONG_FRAMES"] = float(frames)
    if count == "trial":
        last = first + frames - 1
        trial["ACTUAL_START_FIELD"] = np.array([first % 65536, first // 65536])
        trial["ACTUAL_END_FIELD"] = np.array([last % 65536, last // 65536])
    everything = {
        "POINT": point,
        "ANALOG": {
            "USED": channels,
            "RATE": float(rate * per_frame),
            "GEN_SCALE": 1.0,
            **named("LABELS", [f"A{i}" for i in range(channels)]),
            **named("DESCRIPTIONS", [f"analog {i}" for i in range(channels)]),
            **named("UNITS", ["V"] * channels),
            **named("SCALE", np.ones(channels)),
            **named("OFFSET", np.zeros(channels, int)),
        },
        "TRIAL": trial,
    }
    for group, values in (groups or {}).items():
        everything.setdefault(group, {}).update(values)
    section, start = section_bytes(everything, processor, 0), 0
    start = 2 + len(section) // 512
    everything["POINT"]["DATA_START"] = start
    section = section_bytes(everything, processor, start)
    head = header_bytes(
        processor, used, channels * per_frame, first, frames, stated, start, per_frame,
        rate, header_events,
    )  # fmt: skip
    rows = np.concatenate([points, words[..., None]], axis=2)
    rows = rows.reshape(frames, 4 * used)
    if analog is not None:
        rows = np.concatenate([rows, analog], axis=1)
    data = (floats if is_float else shorts)(rows.ravel(), processor)
    if pad:
        data += b"\0" * (-len(data) % 512)
    return b"\0" * zeros_before + head + section + data


def section_bytes(groups, processor, start):
    body = b""
    for number, (group, values) in enumerate(groups.items(), start=1):
        if not values:
            continue
        body += entry(group, -number, b"", processor, description=b"a group")
        for name, value in values.items():
            if value is None or (name == "DATA_START" and value is None):
                continue
            locked = name in ("USED", "SCALE")
            body += parameter(name, number, value, processor, locked=locked)
    size = 4 + len(body) + 2
    blocks = -(-size // 512)
    assert blocks < 256
    lead = bytes([1, 0x50, blocks, CODES[processor]])
    return (lead + body + b"\0\0").ljust(blocks * 512, b"\0")


def header_bytes(
    processor, used, analog, first, frames, scale, start, per_frame, rate, events
):
    last = first + frames - 1
    shown = (first, last) if last <= 65535 else (1, 65535)
    raw = bytearray(512)
    raw[0:2] = bytes([2, 0x50])
    raw[2:12] = shorts([used, analog, *shown, 10], processor)
    raw[12:16] = floats([scale], processor)
    raw[16:20] = shorts([start, per_frame], processor)
    raw[20:24] = floats([rate], processor)
    raw[298:302] = shorts([12345, len(events)], processor)
    for i, (time, label) in enumerate(events):
        raw[304 + 4 * i : 308 + 4 * i] = floats([time], processor)
        raw[396 + 4 * i : 400 + 4 * i] = label.encode().ljust(4)
    return bytes(raw)


def take(rng, frames=20, points=3, is_float=True, missing=0.1):
    """Raw coordinates (whole steps for integers) and fourth words, some missing."""
    raw = rng.integers(-30000, 30000, (frames, points, 3))
    values = raw * 0.1234567 if is_float else raw
    words = (rng.integers(0, 128, (frames, points)) << 8) | rng.integers(
        1, 255, (frames, points)
    )
    gone = rng.random((frames, points)) < missing
    words[gone] = -1
    return np.where(gone[..., None], 0, values), words


def by_c3d(path):
    """(T, P, 5) x, y, z, residual, camera mask as the c3d package has them."""
    with warnings.catch_warnings(), open(path, "rb") as file:
        warnings.simplefilter("ignore")
        reader = c3d.Reader(file)
        return np.stack([points.copy() for _, points, _ in reader.read_frames()])


def by_ezc3d(path):
    """(T, P, 3) places as ezc3d has them."""
    return ezc3d.c3d(str(path))["data"]["points"][:3].transpose(2, 1, 0)
