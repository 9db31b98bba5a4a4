"""How well hands learnt from real takes fit frames they were not learnt from.

    python tests/bench/bench_subject.py

"spread": every fifth block of two seconds is kept aside; "first half": learnt from the
first half of the takes, measured on the second. RMS distances are three-dimensional.
"kept" leaves out samples that fit no posture of the hand, which in Pick1 are wrong
labels (R-C1 on another point in frames 484-496, 821-837 and 2427-2451, R-B1 on R-C1's
point in frames 155-182). "ik" is the first half's subject solved by `solve --per-frame`
on the same frames. "x noise" compares the error, corrected for the degrees of freedom
that poses take up, with the noise in the high frequencies of the data themselves; it
is given where that noise is the error's better part.

The recordings are those of the folder named by HANDCLEAN_DATA (default: the recordings
kept beside the project). Rows of those that are not there stay as an earlier run had
them.
"""

import os
import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.hand.marker_set import load_marker_set
from handclean.ik.solve import solve_markers
from handclean.io.files import read
from handclean.recording import trajectories
from handclean.subject.calibrate import calibrate, measure
from handclean.subject.frames import gather
from handclean.subject.judge import HeldOut
from handclean.subject.settings import CalibrateConfig

BESIDE = Path(__file__).parents[3] / "shared" / "data"
DATA = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))
FRAMES = counted("frames that a hand is learnt from", 400, quick=200, tiny=40)
FILES = counted("takes of a sig18 user, at most", 1000, quick=40, tiny=4)


def in_order(path):
    """Sequence 2 comes before sequence 10."""
    parts = re.split(r"(\d+)", str(path.relative_to(DATA)))
    return [int(part) if part.isdigit() else part for part in parts]


def recordings():
    """Name, marker set and takes of every recording there is."""
    guitar = DATA / "guitar" / "Pick1.csv"
    if guitar.is_file():
        yield "guitar Pick1", "xu19", [read(guitar, rate_hz=120.0, unit="mm")]
    else:
        absent("guitar Pick1")
    glove = DATA / "hand_embodiment" / "recording.tsv"
    if glove.is_file():
        yield "dfki13", "dfki13", [read(glove, unit="mm")]
    else:
        absent("dfki13")
    for user in ("User1", "User2"):
        paths = sorted((DATA / "sig18" / user).rglob("*.trc"), key=in_order)
        if paths:
            yield f"sig18 {user}", "han19", [read(path) for path in paths[:FILES]]
        else:
            absent(f"sig18 {user}")


def part(take, start, stop):
    """Some frames of a take."""
    markers = trajectories(take.markers.positions[start:stop], take.markers.labels)
    return replace(take, frames=stop - start, markers=markers)


def halves(takes):
    """The first and the second half of one take, or of a list of takes."""
    if len(takes) > 1:
        middle = len(takes) // 2
        return takes[:middle], takes[middle:]
    (take,) = takes
    middle = take.frames // 2
    return [part(take, 0, middle)], [part(take, middle, take.frames)]


def solved_rms(subject, takes):
    """[m] RMS distance that the frame solver leaves, over every measured marker."""
    frames = gather(takes, subject.model.labels)
    places = np.where(frames.seen[:, :, None], frames.targets, np.nan)[::5]
    found = solve_markers(subject.model, places)
    seen = np.isfinite(places).all(axis=2).sum(axis=1)
    total = np.sum((found.residual**2 * seen)[seen > 0])
    return float(np.sqrt(total / seen.sum()))


def row(name, split, report, fit, seconds, subject, camera_m):
    """One line of the table."""
    markers = len(subject.model.labels)
    dofs = subject.model.tree.dofs
    noise = np.sqrt(3.0) * camera_m
    free = np.sqrt(3 * markers / (3 * markers - dofs))
    ratio = free * fit.kept_rms_m / noise
    return {
        "recording": name,
        "learnt from": split,
        "frames used": report.frames_used,
        "held out": fit.frames,
        "RMS [mm]": round(1e3 * fit.rms_m, 3),
        "kept [mm]": round(1e3 * fit.kept_rms_m, 3),
        "doubtful": f"{100 * fit.doubtful:.2f} %",
        "noise [mm]": round(float(1e3 * noise), 3),
        "x noise": f"{ratio:.2f}" if ratio < 3.0 else "",
        "hand": f"{report.side}, {100 * report.size:.0f} %",
        "seconds": round(seconds, 1),
    }


def rows():
    """The table; its first row does not pay for compiling."""
    out = []
    for name, markers, takes in recordings():
        chosen = load_marker_set(markers)
        if not out:
            calibrate(takes, chosen, CalibrateConfig(frames=20))
        start = time.perf_counter()
        subject, report = calibrate(takes, chosen, CalibrateConfig(frames=FRAMES))
        seconds = time.perf_counter() - start
        camera_m = report.camera_noise_m
        fit = HeldOut(
            frames=report.frames_held_out,
            rms_m=report.heldout_rms_m,
            kept_rms_m=report.heldout_kept_rms_m,
            by_marker_m=np.array(list(report.heldout_by_marker_m.values())),
            doubtful=report.doubtful,
        )
        out.append(row(name, "spread", report, fit, seconds, subject, camera_m))
        first, second = halves(takes)
        start = time.perf_counter()
        half = CalibrateConfig(frames=FRAMES, holdout=0.0)
        subject, report = calibrate(first, chosen, half)
        seconds = time.perf_counter() - start
        fit = measure(subject, second)
        out.append(row(name, "first half", report, fit, seconds, subject, camera_m))
        out[-1]["ik [mm]"] = round(1e3 * solved_rms(subject, second), 3)
    return out


if __name__ == "__main__":
    for line in rows():
        print(line)
