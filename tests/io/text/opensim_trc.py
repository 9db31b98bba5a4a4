"""What OpenSim 4.6 demands of a TRC file, as its TRCFileAdapter reads one.

Strict where that is strict: header keys by name and in order, as many labels as
NumMarkers says, X1 Y1 Z1 X2 ... below them, every row of full length though a blank
last cell is lost, times that rise. And of a marker of a model: that its name has no
character that OpenSim refuses in one.
"""

import numpy as np

KEYS = ["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate"]
KEYS += ["OrigDataStartFrame", "OrigNumFrames"]


def tokens(line):
    """Return the cells of a line as C++ getline gives them: no blank last one."""
    cells = [cell.strip() for cell in line.split("\t")]
    return cells[:-1] if cells[-1] == "" else cells


def filled(line):
    return [cell for cell in tokens(line) if cell]


def read(path):
    """Return labels, times, (T, M, 3) [mm] and the header of a TRC file."""
    lines = path.read_text(encoding="utf-8").split("\n")
    assert tokens(lines[0])[0] == "PathFileType"
    keys, values = filled(lines[1]), filled(lines[2])
    assert keys == KEYS
    assert len(values) == len(keys)
    said = dict(zip(keys, values, strict=True))
    frame, time, *labels = filled(lines[3])
    assert (frame, time) == ("Frame#", "Time")
    assert len(labels) == int(said["NumMarkers"])
    axes = [f"{axis}{m + 1}" for m in range(len(labels)) for axis in "XYZ"]
    assert filled(lines[4]) == axes
    at = 5
    while not tokens(lines[at]) or not tokens(lines[at])[0]:
        at += 1
    times, places = [], []
    for line in lines[at:]:
        row = tokens(line)
        if not row:
            break
        assert len(row) == 2 + 3 * len(labels), f"received {len(row)}"
        int(row[0])
        times.append(float(row[1]))
        places.append([float(cell) for cell in row[2:]])
    assert len(times) == int(said["NumFrames"])
    assert np.all(np.diff(times) > 0)
    assert len(set(labels)) == len(labels)
    for label in labels:
        assert not set(label) & set("\\/*+ \t\n"), label
    return labels, np.array(times), np.array(places).reshape(len(times), -1, 3), said
