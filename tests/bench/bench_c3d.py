"""C3D reading and writing, 60 markers x 60 000 frames, beside c3d, ezc3d and numpy.

Every row is a process of its own: the best of some runs, and the peak of memory in the
first run above what the process had before (Linux only). "bare numpy" is the floor,
run in turn with each: the same bytes to (T, M, 3) float64 metres with NaN where missing
and nothing else, and the reverse. handclean also has origin, residual, cameras and
source of every sample and the words of the file; "rewrite" is writing what was read,
byte for byte. The second table has the c3d.org samples of the folder named by
HANDCLEAN_DATA (default: the recordings kept beside the project), read and written
again.
"""

import importlib
import io
import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from functools import cache, partial
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.errors import HandcleanError
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d, write_c3d
from handclean.recording import Recording, trajectories

FRAMES = counted("frames", 60_000, quick=60_000, tiny=600)
MARKERS, RATE = 60, 200.0
ARRAY = FRAMES * MARKERS * 3 * 8
RUNS = {"handclean": 9, "rewrite": 9, "bare numpy": 9, "ezc3d": 3, "c3d": 2}
BESIDE = Path(__file__).parents[3] / "shared" / "data"
DATA = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))
LABELS = tuple(f"M{i:02d}" for i in range(MARKERS))


def positions():
    """(T, M, 3) [m] wandering markers, 1 % missing."""
    rng = np.random.default_rng(0)
    steps = rng.normal(0, 1e-4, (FRAMES, MARKERS, 3))
    np.cumsum(steps, axis=0, out=steps)
    steps[rng.random((FRAMES, MARKERS)) < 0.01] = np.nan
    return steps


def recording():
    """The take as handclean has it."""
    markers = trajectories(positions(), LABELS)
    return Recording(rate=RATE, frames=FRAMES, markers=markers)


def data_at(path):
    """Byte where the samples begin."""
    with open(path, "rb") as file:
        return (int(np.fromfile(file, "<u2", 9)[8]) - 1) * 512


def read_bare(path):
    """The same bytes to float64 with NaN."""
    raw = np.fromfile(path, "<f4", FRAMES * MARKERS * 4, offset=data_at(path))
    raw = raw.reshape(FRAMES, MARKERS, 4)
    found = raw[..., :3].astype(np.float64)
    found /= 1000
    found[raw[..., 3] < 0] = np.nan
    return found


def write_bare(path, take):
    """Float64 with NaN to the same bytes."""
    raw = np.zeros((FRAMES, MARKERS, 4), np.float32)
    np.multiply(take, 1000, out=raw[..., :3], casting="same_kind")
    raw[..., 3] = 1
    raw[np.isnan(take[..., 0])] = (0, 0, 0, -1)
    with open(path, "wb") as file:
        file.write(bytes(1536))
        raw.tofile(file)


def read_by_c3d(path):
    """As c3d's own example reads."""
    import c3d

    with open(path, "rb") as file:
        frames = c3d.Reader(file).read_frames(copy=False)
        return np.stack([points.copy() for _, points, _ in frames])


def write_by_c3d(path, points):
    """As c3d's own example writes."""
    import c3d

    writer = c3d.Writer(point_rate=RATE, analog_rate=0.0)
    none = np.empty((0, 0), np.float32)
    writer.add_frames([(frame, none) for frame in points])
    writer.set_point_labels(LABELS)
    with open(path, "wb") as file:
        writer.write(file)


def read_by_ezc3d(path):
    """Places as ezc3d has them."""
    import ezc3d

    return ezc3d.c3d(str(path))["data"]["points"]


def write_by_ezc3d(path, points):
    """As ezc3d's own example writes."""
    import ezc3d

    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(LABELS)
    file["data"]["points"] = points
    file.write(str(path))


def c3d_points():
    """(T, M, 5) as c3d wants them."""
    take = positions() * 1000
    points = np.zeros((FRAMES, MARKERS, 5), np.float32)
    points[..., :3] = np.nan_to_num(take)
    points[np.isnan(take[..., 0]), 3] = -1
    return points


def ezc3d_points():
    """(4, M, T) as ezc3d wants them."""
    points = np.ones((4, MARKERS, FRAMES))
    points[:3] = (positions() * 1000).transpose(2, 1, 0)
    return points


READ = {
    "bare numpy": read_bare,
    "handclean": read_c3d,
    "c3d": read_by_c3d,
    "ezc3d": read_by_ezc3d,
}
WRITE = {  # what is written, and how
    "bare numpy": (positions, write_bare),
    "handclean": (recording, write_c3d),
    "rewrite": (None, write_c3d),
    "c3d": (c3d_points, write_by_c3d),
    "ezc3d": (ezc3d_points, write_by_ezc3d),
}


def status(name):
    """[bytes] one line of the process's own status, None off Linux."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return None
    return next(int(x.split()[1]) * 1024 for x in lines if x.startswith(name))


def timed(work):
    """[s] one run."""
    begin = time.perf_counter()
    kept = work()
    seconds = time.perf_counter() - begin
    del kept
    return seconds


def measure(work, floor, runs):
    """Best time of some runs and of the floor, and peak memory of the first run."""
    before = status("VmRSS")
    if before is not None:
        Path("/proc/self/clear_refs").write_text("5")
    best = timed(work)
    peak = None if before is None else status("VmHWM") - before
    bare = timed(floor())
    for run in range(1, max(RUNS.values())):
        best = min(best, timed(work)) if run < runs else best
        bare = min(bare, timed(floor()))
    return {"seconds": best, "floor": bare, "peak": peak}


def one(what, peer, folder):
    """Measure in this process."""
    warnings.simplefilter("ignore")
    if peer in ("c3d", "ezc3d"):
        importlib.import_module(peer)
    path, out = Path(folder) / "take.c3d", Path(folder) / "out.c3d"
    if what == "read":
        floor = partial(read_bare, path)
        return measure(partial(READ[peer], path), lambda: floor, RUNS[peer])
    make, write = WRITE[peer]
    take = read_c3d(path) if make is None else make()

    @cache
    def floor():
        return partial(write_bare, out, positions())

    return measure(partial(write, out, take), floor, RUNS[peer])


def apart(what, peer, folder):
    """Measure in a fresh process; None where the peer is not there or fails."""
    command = [sys.executable, __file__, "--one", what, peer, folder]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.stderr.write(done.stderr)
        return None
    return json.loads(done.stdout.splitlines()[-1])


def large():
    """Rows of the large file."""
    table = []
    with tempfile.TemporaryDirectory() as folder:
        write_c3d(Path(folder) / "take.c3d", recording())
        for what, peers in (("read", READ), ("write", WRITE)):
            found = {peer: apart(what, peer, folder) for peer in peers}
            for peer, row in found.items():
                if row is None:
                    absent(peer)
                    continue
                peak = row["peak"]
                table.append(
                    {
                        "what": what,
                        "with": peer,
                        "ms": f"{1e3 * row['seconds']:.0f}",
                        "x bare numpy": f"{row['seconds'] / row['floor']:.1f}",
                        "peak MB": "" if peak is None else f"{peak / 1e6:.0f}",
                        "x array": "" if peak is None else f"{peak / ARRAY:.2f}",
                    }
                )
    return table


def sample(path):
    """One row: what was read in a sample file, or its error."""
    row = {"file": f"{path.parent.name}/{path.name}"}
    try:
        take = read_c3d(path)
        report = inspect_c3d(path)
    except HandcleanError as error:
        return {**row, "read": str(error)}
    again = io.BytesIO()
    write_c3d(again, take)
    loose = 0 if take.unlabelled is None else len(take.unlabelled.frame)
    parts = [
        f"{report['processor']} {report['numbers']}",
        f"{take.frames} frames from {take.first_frame} at {take.rate:g} Hz",
        f"{len(report['markers'])} markers" if loose == 0 else f"{loose} points",
    ]
    if report["model_outputs"]:
        parts.append(f"{len(report['model_outputs'])} model outputs")
    if take.analog is not None:
        parts.append(f"{len(take.analog.labels)} analog at {take.analog.rate:g} Hz")
    if take.source_events:
        parts.append(f"{len(take.source_events)} events")
    same = again.getvalue() == path.read_bytes()
    traps = "; ".join(report["traps"])
    return {
        **row,
        "read": ", ".join(parts),
        "traps": traps,
        "rewritten": "byte for byte" if same else "DIFFERS",
    }


def rows():
    """Both tables by title."""
    tables = {f"{MARKERS} markers x {FRAMES} frames, floats": large()}
    paths = sorted((DATA / "c3d").glob("*/*.[cC]3[dD]"))
    if paths:
        tables["Samples of c3d.org"] = [sample(path) for path in paths]
    else:
        absent("Samples of c3d.org")
    return tables


def main():
    """Print the tables."""
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(one(*sys.argv[2:5])))
        return
    for title, table in rows().items():
        print(f"\n{title}")
        for row in table:
            print("  " + " | ".join(str(value) for value in row.values()))


if __name__ == "__main__":
    main()
