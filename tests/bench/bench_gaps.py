"""Gaps cut into takes where nothing is missing, filled, compared with what was there.

Markers are hidden, one or four at once, for 0.1 to 1 s, with a second between gaps; the
errors are distances at hidden samples in mm. Real takes (the recordings of the folder
named by HANDCLEAN_DATA; default: those kept beside the project): the hand is calibrated
from the same take, then the gaps are cut. "simulated": grasps of the simulation with
known truth and the subject as it is, noise 0.2 mm; "simulated, its own gaps" are the
occlusions and dropouts of the simulated cameras. "open" is the share of samples a
method refuses. "within 1, 2 sigma": of filled samples whose sigma, which is per axis,
tells: the share of errors per axis (0.68, 0.95 of normal ones).
"""

import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.gaps.fill import fill
from handclean.gaps.settings import METHODS, FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.io.files import read
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Origin, Recording, trajectories
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig

BESIDE = Path(__file__).parents[3] / "shared" / "data"
DATA = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))
TAKES = {
    "dfki13": ("hand_embodiment/recording.tsv", "dfki13", {}),
    "guitar": ("guitar/Pick1.csv", "xu19", {"rate_hz": 120.0, "unit": "mm"}),
}
LENGTHS_S = (0.1, 0.25, 0.5, 1.0)
AT_ONCE = (1, 4)
MARGIN = 12
SEEDS = range(counted("seeds of a real take", 2, quick=1))
SIMULATED = counted("simulated takes", 8, quick=3)
LEARNT = counted("frames that a hand is learnt from", 400, quick=200, tiny=40)
FRAMES = counted("frames of a real take, at most", 10**6, quick=3000, tiny=600)


def real(name):
    """A take and a subject calibrated from it; None if the recording is not there."""
    path, marker_set, options = TAKES[name]
    if not (DATA / path).is_file():
        absent(name)
        return None
    take = shortened(read(DATA / path, **options))
    markers = load_marker_set(marker_set)
    return take, calibrate([take], markers, CalibrateConfig(frames=LEARNT))[0], take


def shortened(take):
    """The first frames of a take, its named markers."""
    if take.frames <= FRAMES:
        return take
    markers = trajectories(take.markers.positions[:FRAMES], take.markers.labels)
    return Recording(rate=take.rate, frames=FRAMES, markers=markers)


def simulated():
    """Takes, subjects and truths of simulated grasps."""
    settings = SimulateConfig(trials=SIMULATED, subjects=SIMULATED, seed=7)
    return [(t.labelled, t.subject, t.truth) for t in simulate("grasp", settings)]


def cut(take, labels, length_s, at_once, rng):
    """The take with gaps where markers were seen, and (T, M) where it has them."""
    markers = take.markers
    frames, gap = take.frames, max(1, round(length_s * take.rate))
    columns = [
        markers.labels.index(label) for label in labels if label in markers.labels
    ]
    hidden = np.zeros(markers.origin.shape, dtype=bool)
    step = gap + round(take.rate)
    first = MARGIN + int(rng.integers(min(step, max(frames - gap - 2 * MARGIN, 1))))
    for start in range(first, frames - gap - MARGIN, step):
        around = slice(start - MARGIN, start + gap + MARGIN)
        seen = [c for c in columns if markers.measured[around, c].all()]
        if len(seen) >= at_once:
            chosen = rng.choice(seen, at_once, replace=False)
            hidden[start : start + gap, chosen] = True
    positions, origin = markers.positions.copy(), markers.origin.copy()
    positions[hidden], origin[hidden] = np.nan, Origin.MISSING
    return replace(
        take, markers=replace(markers, positions=positions, origin=origin)
    ), (hidden)


def truth_of(truth, labels):
    """(T, M, 3) where markers truly were."""
    columns = [truth.markers.labels.index(label) for label in labels]
    return truth.markers.positions[:, columns]


def scored(jobs, method, longest_s):
    """One row: errors of a method on takes with gaps and what was hidden in them."""
    errors, shares, hidden_samples, prior = [], [], 0, read_prior()
    settings = FillConfig(method=method, max_gap_s=longest_s)
    for take, subject, truth, hidden in jobs:
        found = fill(take, subject, prior=prior, settings=settings)[0].markers
        where = truth_of(truth, found.labels)
        filled = hidden & (found.origin == Origin.FILLED)
        away = (found.positions - where)[filled]
        errors.append(np.linalg.norm(away, axis=1))
        shares.append((np.abs(away) / found.sigma[filled][:, None]).ravel())
        hidden_samples += int(np.count_nonzero(hidden))
    errors, shares = 1e3 * np.concatenate(errors), np.concatenate(shares)
    row = {"method": method, "samples": hidden_samples}
    row["open"] = f"{1.0 - len(errors) / max(hidden_samples, 1):.0%}"
    if len(errors):
        row["mean"] = round(float(errors.mean()), 2)
        row["median"] = round(float(np.median(errors)), 2)
        row["95 %"] = round(float(np.percentile(errors, 95)), 2)
    if np.isfinite(shares).any():
        row["within 1, 2 sigma"] = (
            f"{(shares <= 1).mean():.2f}, {(shares <= 2).mean():.2f}"
        )
    return row


def artificial(takes):
    """Rows for gaps cut into takes."""
    table = []
    for length_s in LENGTHS_S:
        for at_once in AT_ONCE:
            jobs = []
            for number, (take, subject, truth) in enumerate(takes):
                for seed in SEEDS if len(takes) == 1 else SEEDS[:1]:
                    rng = np.random.default_rng([seed, number])
                    labels = subject.model.labels
                    gappy, hidden = cut(take, labels, length_s, at_once, rng)
                    jobs.append((gappy, subject, truth, hidden))
            for method in METHODS:
                row = scored(jobs, method, max(0.5, length_s + 0.02))
                table.append({"gap s": length_s, "at once": at_once, **row})
    return table


def own_gaps(takes):
    """Rows for the gaps simulated takes come with."""
    jobs = [
        (take, subject, truth, ~take.markers.measured) for take, subject, truth in takes
    ]
    return [scored(jobs, method, FillConfig().max_gap_s) for method in METHODS]


def speed(takes):
    """Frames per second on one core: what `fill-gaps` does to a take it has read."""
    table, prior = [], read_prior()
    for name, part in takes.items():
        fill(part[0][0], part[0][1], prior=prior)
        for method in ("min-acceleration", "coupled"):
            frames, begin = 0, time.process_time()
            for take, subject, _ in part:
                settings = FillConfig(method=method)
                fill(take, subject, prior=prior, settings=settings)
                frames += take.frames
            spent = time.process_time() - begin
            row = {"takes": name, "method": method, "frames": frames}
            table.append({**row, "frames/s": round(frames / spent)})
    return table


def rows():
    """Tables by title."""
    takes = {}
    for name in TAKES:
        if (found := real(name)) is not None:
            takes[name] = [found]
    takes["simulated"] = simulated()
    tables = {name: artificial(part) for name, part in takes.items()}
    tables["simulated, its own gaps"] = own_gaps(takes["simulated"])
    tables["speed, solve and fill"] = speed(takes)
    return tables


if __name__ == "__main__":
    for title, part in rows().items():
        for line in part:
            sys.stdout.write(json.dumps({"take": title, **line}) + "\n")
