"""CSV reading, 60 markers x 60 000 frames, beside pandas.

``pandas.read_csv`` and `handclean.io` read the same file in turn in one process: the
fastest of some runs on the processor's clock. The first run of each, in a process of
its own, gives the peak of memory above what the process had before (Linux only). pandas
gives a table of numbers; handclean also says of each sample where it comes from and
what stands for none, in metres. Tables as a spreadsheet has them,
six decimals; as Python prints floats, 17 digits; as numpy's ``savetxt`` writes them, 19
digits and an exponent; and a Vicon Nexus export behind a section of devices. Numbers
are the same bits in both ("same").
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from bench_c3d import status
from measuring import absent, counted

from handclean.io import files

FRAMES = counted("frames", 60_000, quick=20_000, tiny=300)
RUNS = counted("runs of which the fastest counts", 5, quick=3)
MARKERS, RATE = 60, 120.0
FORMATS = {"six decimals": "%.6f", "17 digits": "%r", "savetxt": "%.18e"}
NEXUS = "Vicon Nexus"


def places():
    """(T, M, 3) [mm] wandering markers, 1 % missing."""
    rng = np.random.default_rng(0)
    steps = rng.normal(0, 0.1, (FRAMES, MARKERS, 3))
    steps = np.cumsum(steps, axis=0) + rng.uniform(-500, 500, (MARKERS, 3))
    steps[rng.random((FRAMES, MARKERS)) < 0.01] = np.nan
    return steps


def cells(row, form):
    return ",".join("" if x != x else form % x for x in row.ravel().tolist())


def write(path, name):
    """Write a table; return how many lines are above its numbers."""
    table = places()
    axes = ",".join(f"M{m:02d}_{axis}" for m in range(MARKERS) for axis in "XYZ")
    with open(path, "w") as file:
        if name != NEXUS:
            file.write(f"frame,time_s,{axes}\n")
            for t, row in enumerate(table):
                file.write(f"{t + 1},{t / RATE:.6f},{cells(row, FORMATS[name])}\n")
            return 1
        head = ["Devices", "1200", ",,Plate", "Frame,Sub Frame,Fx", ",,N"]
        head += [
            f"{t + 1},{sub},{t}.5" for t in range(FRAMES // 10) for sub in range(9)
        ]
        over = ",".join(f"Hand:M{m:02d},," for m in range(MARKERS))
        head += ["", "Trajectories", f"{RATE:g}", f",,{over}"]
        head += ["Frame,Sub Frame" + ",X,Y,Z" * MARKERS, ",," + ",".join(["mm"] * 180)]
        file.write("\n".join([*head, ""]))
        for t, row in enumerate(table):
            file.write(f"{t + 1},0,{cells(row, '%.6g')}\n")
        return len(head)


def by_pandas(path, above):
    """Read as a user of pandas would who knows where the numbers begin."""
    import pandas

    return pandas.read_csv(path, skiprows=above, header=None)


def by_handclean(path, above):
    return files.read(path, unit="mm")


READ = {"pandas": by_pandas, "handclean": by_handclean}


def spent(work):
    """[s] of processor time of one run, and what it gives."""
    begin = time.process_time()
    kept = work()
    return time.process_time() - begin, kept


def one(with_what, path, above):
    """Peak memory [bytes] of the first run of a process, and its time [s]."""
    if with_what == "pandas":
        import pandas  # noqa: F401
    else:
        from handclean.io.text import csv_read  # noqa: F401
    before = status("VmRSS")
    if before is not None:
        Path("/proc/self/clear_refs").write_text("5")
    seconds, kept = spent(lambda: READ[with_what](path, int(above)))
    peak = None if before is None else status("VmHWM") - before
    del kept
    return {"seconds": seconds, "peak": peak}


def both(path, above):
    """Fastest time [s] of each in turn, and whether the numbers are the same."""
    best, kept = {}, {}
    for _ in range(RUNS):
        for name, read in READ.items():
            seconds, kept[name] = spent(lambda read=read: read(path, int(above)))
            best[name] = min(best.get(name, np.inf), seconds)
    theirs = kept["pandas"].to_numpy(dtype=float)[:, 2:] / 1000
    ours = kept["handclean"].markers.positions.reshape(len(theirs), -1)
    there = np.isfinite(theirs).reshape(len(theirs), -1, 3).all(axis=2)
    theirs[~np.repeat(there, 3, axis=1)] = np.nan
    return {**best, "same": bool(np.array_equal(theirs, ours, equal_nan=True))}


def apart(*words):
    """Measure in a fresh process."""
    command = [sys.executable, __file__, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def row(name, folder):
    path = Path(folder) / "table.csv"
    above = write(path, name)
    turn = apart("--both", path, above)
    first = {what: apart("--one", what, path, above) for what in READ}
    ratio = turn["handclean"] / turn["pandas"]
    found = {
        "table": name,
        "MB": f"{path.stat().st_size / 1e6:.0f}",
        "pandas [s]": f"{turn['pandas']:.2f}",
        "handclean [s]": f"{turn['handclean']:.2f}",
        "x pandas": f"{ratio:.2f}",
        "first run [s]": " ".join(f"{one['seconds']:.2f}" for one in first.values()),
    }
    peaks = [one["peak"] for one in first.values()]
    if None not in peaks:
        found["peak [MB]"] = " ".join(f"{peak / 1e6:.0f}" for peak in peaks)
        found["x memory"] = f"{peaks[1] / peaks[0]:.2f}"
    return {**found, "same": "yes" if turn["same"] else "NO"}


def rows():
    """One row per table."""
    try:
        import pandas  # noqa: F401
    except ImportError:
        absent("pandas")
        return []
    with tempfile.TemporaryDirectory() as folder:
        return [row(name, folder) for name in (*FORMATS, NEXUS)]


def main():
    """Print the table."""
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(one(*sys.argv[2:5])))
    elif sys.argv[1:2] == ["--both"]:
        print(json.dumps(both(*sys.argv[2:4])))
    else:
        for line in rows():
            print(line)


if __name__ == "__main__":
    main()
