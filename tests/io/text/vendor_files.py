"""Files as tracking systems export them, in many forms, and a naive reader of each.

The makers draw a form (sections, marks between cells, units, names ...) and return the
text and what is in it. The readers go through the cells with Python's csv module.
"""

import csv
import math

import numpy as np

AXES = "XYZ"
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
OTHERS = ("Devices", "Joints", "Segments", "Model Outputs", "Events")


def places(rng, frames, markers, size=200.0):
    """(T, M, 3) of decimal numbers with gaps, none of them a number for nothing."""
    out = np.round(rng.normal(0.3 * size, size, (frames, markers, 3)), 3)
    gap = rng.random((frames, markers)) < 0.2
    gap[0] = False
    out[gap] = np.nan
    return out


def cell(number):
    return "" if math.isnan(number) else repr(float(number))


def other_section(rng, title, mark, frames):
    """A section of another kind, ten rows a frame, as forces have."""
    lines = [title, "1000", mark * 2 + "Plate - Force"]
    if title == "Events":
        lines[2:] = [mark.join(["Subject", "Context", "Name", "Time (s)"])]
        return [*lines, mark.join(["Hand", "General", "Event", "0.5"]), ""]
    lines += [mark.join(["Frame", "Sub Frame", "Fx", "Fy", "Fz"]), mark * 2 + "N"]
    for frame in range(frames):
        for sub in range(3):
            force = [f"{x:.3f}" for x in rng.normal(size=3)]
            lines.append(mark.join([str(frame + 1), str(sub), *force]))
    return [*lines, ""]


def nexus(rng):
    """Return the text of a file of Vicon Nexus and what is in it."""
    frames, markers = int(rng.integers(2, 9)), int(rng.integers(1, 6))
    unit = str(rng.choice(list(UNITS)))
    mark = str(rng.choice([",", ",", ";", "\t"]))
    subject = str(rng.choice(["", "Hand:", "Patient 2:"]))
    names = [f"{subject}{label}" for label in ("RTH1", "R_IDX", "RVEL", "A b", "LQ")]
    names = names[:markers]
    unnamed = bool(rng.random() < 0.3)
    if unnamed:
        names[-1] = str(rng.choice(["", "*7"])) if markers > 1 else "*7"
    truth = places(rng, frames, markers, 0.2 / UNITS[unit])
    first, rate = int(rng.integers(0, 5000)), float(rng.choice([100, 120, 59.94]))
    speeds = bool(rng.random() < 0.3)
    columns = 6 if speeds else 3
    axes = [*AXES, *("X'", "Y'", "Z'")][:columns] * markers
    units = ([unit] * 3 + [f"{unit}/s"] * 3)[: 3 * (columns // 3)] * markers
    over = [part for name in names for part in [name, *[""] * (columns - 1)]]
    lines = ["Trajectories" + mark * int(rng.integers(3)), f"{rate:g}"]
    lines += [mark.join(["", "", *over]), mark.join(["Frame", "Sub Frame", *axes])]
    lines.append(mark.join(["", "", *units]))
    for t in range(frames):
        row = [str(first + t), "0"]
        for m in range(markers):
            row += [cell(x) for x in truth[t, m]] + ["0.5"] * (columns - 3)
        line = mark.join(row)
        lines.append(line.rstrip(mark) if rng.random() < 0.3 else line)
    before = list(rng.choice(OTHERS, int(rng.integers(0, 3)), replace=False))
    after = [t for t in OTHERS if t not in before][: int(rng.integers(0, 2))]
    text = [x for t in before for x in other_section(rng, t, mark, frames)]
    text += [*lines, ""]
    text += [x for t in after for x in other_section(rng, t, mark, frames)]
    if rng.random() < 0.2:
        text = ["﻿" + text[0], *text[1:]]
    return str(rng.choice(["\n", "\r\n"])).join(text), {
        "names": names,
        "positions": truth * UNITS[unit],
        "metres": UNITS[unit],
        "first": first,
        "rate": rate,
        "sections": [*before, *after],
        "subjects": [subject[:-1]]
        if subject and names != [""] and named(names)
        else [],
    }


def named(names):
    return [name for name in names if name and not name.startswith("*")]


def motive(rng):
    """Return the text of a file of OptiTrack Motive and what is in it."""
    frames, markers = int(rng.integers(2, 9)), int(rng.integers(1, 6))
    word, unit = [("Meters", "m"), ("Centimeters", "cm"), ("Millimeters", "mm")][
        int(rng.integers(3))
    ]
    rate, first = float(rng.choice([120, 240, 100])), int(rng.integers(0, 400))
    asset = str(rng.choice(["Hand:", "MarkerSet 001:"]))
    names = [f"{asset}{label}" for label in ("RTH1", "RIN1", "R-3", "R 4", "dlan")]
    names = names[:markers]
    truth = places(rng, frames, markers, 0.2 / UNITS[unit])
    blocks = [("Marker", name, ["Position"] * 3, list(AXES)) for name in names]
    values = [
        [[cell(x) for x in truth[t, m]] for m in range(markers)] for t in range(frames)
    ]
    solved = []
    if rng.random() < 0.6:
        solved = [("rigid body", "Cup"), ("rigid body marker", "Cup:Marker1")]
        body = ["Rotation"] * 4 + ["Position"] * 3 + ["Mean Marker Error"]
        blocks.insert(0, ("Rigid Body", "Cup", body, ["X", "Y", "Z", "W", *AXES, ""]))
        expected = ["Position"] * 3 + ["Marker Quality"]
        blocks.insert(1, ("Rigid Body Marker", "Cup:Marker1", expected, [*AXES, ""]))
        for row in values:
            row.insert(0, ["0.1", "0.2", "0.3", "0.927", "5", "6", "7", "0.001"])
            row.insert(1, ["51", "61", "71", "1.0"])
    loose = places(rng, frames, 1, 0.5 / UNITS[unit])
    if rng.random() < 0.5:
        blocks.append(("Marker", "Unlabeled 1005", ["Position"] * 3, list(AXES)))
        for t, row in enumerate(values):
            row.append([cell(x) for x in loose[t, 0]])
    else:
        loose = loose[:, :0]
    code = bool(rng.random() < 0.3)
    labels, facts = bool(rng.random() < 0.7), bool(rng.random() < 0.8)
    lead = ["", ""] + [""] * code
    rows = []
    for label, part in (("Type", 0), ("Name", 1), ("ID", None), ("Parent", None)):
        if label == "Parent" and rng.random() < 0.6:
            continue
        begin = ["", label if labels else "", *lead[2:]]
        cells = [b[part] if part is not None else "4E2" for b in blocks for _ in b[2]]
        rows.append([*begin, *cells])
    rows.append([*lead, *(word_ for b in blocks for word_ in b[2])])
    rows.append(
        ["Frame", "Time (Seconds)", *["TimeCode"] * code]
        + [axis for b in blocks for axis in b[3]]
    )
    start = float(rng.choice([0.0, 1.5]))
    for t in range(frames):
        rows.append(
            [str(first + t), f"{start + t / rate:.6f}", *["15:26:46:12.02"] * code]
        )
        rows[-1] += [x for part in values[t] for x in part]
    head = ["Format Version", "1.23", "Take Name", "Take, one", "Take Notes", ""]
    head += ["Capture Frame Rate", f"{rate:.6f}", "Export Frame Rate", f"{rate:.6f}"]
    head += ["Total Exported Frames", str(frames), "Length Units", word]
    out = []
    for row in [*([head, [""]] if facts else []), *rows]:
        out.append(",".join(f'"{c}"' if "," in c else c for c in row))
    return str(rng.choice(["\n", "\r\n"])).join([*out, ""]), {
        "names": names,
        "positions": truth * UNITS[unit],
        "metres": UNITS[unit],
        "loose": loose * UNITS[unit],
        "first": first,
        "rate": rate,
        "start": start,
        "unit": None if facts else unit,
        "solved": [" ".join(one) for one in solved],
        "subjects": [asset[:-1]],
    }


def read_naively(text, first_cell="Frame"):
    """Return the cells of such a file: above its axes, the axes, below them."""
    lines = text.lstrip("﻿").splitlines()
    if any(line.startswith("Trajectories") for line in lines):
        at = next(k for k, x in enumerate(lines) if x.startswith("Trajectories"))
        lines = lines[at + 2 :]
    mark = max(",;\t", key=next(x for x in lines if x.startswith(first_cell)).count)
    table = list(csv.reader(lines, delimiter=mark))
    axes = next(k for k, row in enumerate(table) if row[:1] == [first_cell])
    body = []
    for row in table[axes + 1 :]:
        if not row or not row[0]:
            if body:
                break
            continue
        body.append(row)
    return table[:axes], table[axes], body
