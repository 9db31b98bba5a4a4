"""Labelling of real recordings whose points were permuted in every frame, and speed.

Real: nothing but the points of each frame is given, in random order, other people's and
objects' points among them. The hand is calibrated on one part with its labels, and the
other part is labelled: the second half of `dfki13` and of guitar `Pick1`, and those
sequences of each sig18 user that were not calibrated on (every third was), each from
its own first frames, in whatever posture. "wrong" counts labels on another point than
the recording's own label (not always right); "lost" sequences are those with F1
under 0.9. The baseline goes frame to frame without a model, but starts from the true
labels of the first frame.

Repair and review: mean F1 over takes with both passes, with each alone, and with
neither. Beside the recordings stand hard simulated takes: grasps and gestures in turns,
5 s at 60 Hz, seeds 0, 1, 2, ...; each marker drops out once a second, 10 ghosts a
second come and go, and 2 a second live on beside a hidden marker.

Speed: simulated grasps, 26 markers, warm caches, one core, best of three, frames per
second of processor time; "clean" is label, fill-gaps and solve on arrays, no files.
"""

import json
import os
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.errors import HandcleanError
from handclean.gaps.fill import fill
from handclean.hand.marker_set import load_marker_set
from handclean.ik.solve import markers_of, solve_markers
from handclean.io.files import read
from handclean.io.hdf5.prior import read_prior
from handclean.labels.baseline import follow_points
from handclean.labels.label import label
from handclean.labels.settings import LabelConfig
from handclean.recording import Points, Recording
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig

BESIDE = Path(__file__).parents[3] / "shared" / "data"
DATA = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))
FILES = counted("sequences of a sig18 user, at most", 1000, quick=30, tiny=4)
LEARNT = counted("frames that a hand is learnt from", 400, quick=200, tiny=40)
FRAMES = counted("frames of another take, at most", 10**6, quick=3000, tiny=600)
HARD = counted("hard simulated takes", 19, quick=6)
PASSES = {
    "repair and review": LabelConfig(),
    "repair alone": LabelConfig(review=False),
    "review alone": LabelConfig(repair=False),
    "neither": LabelConfig(repair=False, review=False),
}


def part(take, start, stop):
    """Frames ``start`` to ``stop`` of a labelled take."""
    markers = take.markers
    arrays = ("positions", "origin", "source", "residual", "cameras")
    cut = {
        name: getattr(markers, name)[start:stop]
        for name in arrays
        if getattr(markers, name) is not None
    }
    return Recording(
        rate=take.rate,
        frames=stop - start,
        markers=replace(markers, confidence=None, sigma=None, **cut),
    )


def permuted(take, rng):
    """The measured points of each frame in random order, without names or columns."""
    frame, marker = np.nonzero(take.markers.measured)
    order = np.lexsort((rng.random(len(frame)), frame))
    frame, marker = frame[order], marker[order]
    points = Points(
        frame=frame.astype(np.int32),
        source=np.full(len(frame), -1, dtype=np.int32),
        positions=take.markers.positions[frame, marker],
    )
    return Recording(rate=take.rate, frames=take.frames, unlabelled=points)


def score(found, take, labels):
    """Right, given and present labels of the set's markers."""
    columns = [take.markers.labels.index(name) for name in labels]
    truth, seen = take.markers.positions[:, columns], take.markers.measured[:, columns]
    order = [found.labels.index(name) for name in labels]
    mine, named = found.positions[:, order], found.measured[:, order]
    right = named & seen & (mine == truth).all(axis=2)
    return np.array([right.sum(), named.sum(), seen.sum()])


def f1(counts):
    return 2 * counts[0] / max(counts[1] + counts[2], 1)


def labelled(cloud, take, subject, prior, settings=None):
    """Counts of ours for a take."""
    labels = subject.model.labels
    try:
        found = label(cloud, subject, prior=prior, settings=settings)[0].markers
    except HandcleanError:
        return np.array([0, 0, score(take.markers, take, labels)[2]])
    return score(found, take, labels)


def one(take, subject, prior, rng):
    """Counts of ours and of the baseline for a take."""
    labels = subject.model.labels
    cloud = permuted(take, rng)
    ours = labelled(cloud, take, subject, prior)
    columns = [take.markers.labels.index(name) for name in labels]
    first = np.where(
        take.markers.measured[0, columns][:, None],
        take.markers.positions[0, columns],
        np.nan,
    )
    return ours, score(follow_points(cloud, labels, first), take, labels)


def row(name, takes, subject, prior):
    rng = np.random.default_rng(0)
    counts = np.array([one(take, subject, prior, rng) for take in takes])
    out = {"recording": name, "sequences": len(takes)}
    for at, who in ((0, "handclean"), (1, "frame to frame")):
        each = np.array([f1(c) for c in counts[:, at]])
        total = counts[:, at].sum(axis=0)
        out |= {
            f"{who}: F1": round(f1(total), 5),
            "wrong" if at == 0 else "wrong ": int(total[1] - total[0]),
            "median F1" if at == 0 else "median F1 ": round(float(np.median(each)), 5),
            "lost" if at == 0 else "lost ": int((each < 0.9).sum()),
        }
    if len(takes) > 0:
        model = subject.model
        found = [solve_markers(model, markers_of(t, model), prior=prior) for t in takes]
        squares = np.concatenate([f.residual**2 for f in found])
        out["RMS of true labels [mm]"] = round(1e3 * np.sqrt(np.nanmean(squares)), 3)
    return out


@cache
def recordings():
    """Name, takes and subject of each recording: the part it was not learnt from."""
    found = []
    for path, name, options in (
        ("hand_embodiment/recording.tsv", "dfki13", {}),
        ("guitar/Pick1.csv", "xu19", {"rate_hz": 120.0, "unit": "mm"}),
    ):
        if not (DATA / path).is_file():
            absent(f"{name}, second half")
            continue
        take = read(DATA / path, **options)
        take = part(take, 0, min(take.frames, FRAMES))
        middle = take.frames // 2
        subject, _ = calibrate(
            [part(take, 0, middle)],
            load_marker_set(name),
            CalibrateConfig(frames=LEARNT),
        )
        rest = part(take, middle, take.frames)
        found.append((f"{name}, second half", [rest], subject))
    for user in ("User1", "User2"):
        files = sorted((DATA / "sig18" / user).glob("*/*.trc"))[:FILES]
        if not files:
            absent(f"sig18 {user}")
            continue
        takes = [part(t, 0, t.frames) for t in map(read, files)]
        subject, _ = calibrate(
            takes[::3],
            load_marker_set("han19"),
            CalibrateConfig(frames=LEARNT),
            side="left",
        )
        rest = [take for n, take in enumerate(takes) if n % 3]
        found.append((f"sig18 {user}", rest, subject))
    return found


def real():
    prior = read_prior()
    return [row(name, takes, subject, prior) for name, takes, subject in recordings()]


def hard(seed):
    """A simulated take that is hard to label."""
    settings = SimulateConfig(
        seed=seed,
        rate_hz=60.0,
        duration_s=5.0,
        dropouts_per_s=1.0,
        ghosts_per_s=10.0,
        impostors_per_s=2.0,
    )
    return next(iter(simulate(("grasp", "free")[seed % 2], settings)))


def passes():
    """Mean F1 with repair and review on and off."""
    prior = read_prior()
    groups = {
        f"{name}, F1": [(permuted(t, np.random.default_rng(0)), t, subject) for t in ts]
        for name, ts, subject in recordings()
    }
    takes = [hard(seed) for seed in range(HARD)]
    groups["hard simulated, F1"] = [
        (take.unlabelled, take.labelled, take.subject) for take in takes
    ]
    table = []
    for name, settings in PASSES.items():
        line = {"passes": name}
        for group, those in groups.items():
            each = [f1(labelled(*take, prior, settings)) for take in those]
            if each:
                line[group] = round(float(np.mean(each)), 5)
        table.append(line)
    return table


def best(work, frames):
    """Frames per second of processor time, the best of three after one to warm up."""
    work()
    times = []
    for _ in range(3):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return frames / min(times)


def speed():
    prior, table = read_prior(), []
    settings = SimulateConfig(trials=6, subjects=6, seed=77)
    for take in simulate("grasp", settings):
        cloud, subject, frames = take.unlabelled, take.subject, take.unlabelled.frames
        positions = markers_of(take.labelled, subject.model)

        def clean(cloud=cloud, subject=subject):
            return fill(label(cloud, subject, prior=prior)[0], subject, prior=prior)

        def name_it(cloud=cloud, subject=subject):
            return label(cloud, subject, prior=prior)

        def solve(subject=subject, positions=positions):
            return solve_markers(subject.model, positions, prior=prior)

        table.append(
            {
                "take": take.name,
                "label": round(best(name_it, frames)),
                "solve": round(best(solve, frames)),
                "clean": round(best(clean, frames)),
            }
        )
    middle = {
        key: round(float(np.median([r[key] for r in table])))
        for key in ("label", "solve", "clean")
    }
    return [*table, {"take": "median", **middle}]


def rows():
    """Tables by title."""
    return {
        "real recordings, points permuted in every frame": real(),
        "repair and review, on and off": passes(),
        "frames per second": speed(),
    }


if __name__ == "__main__":
    for title, lines in rows().items():
        for line in lines:
            sys.stdout.write(json.dumps({"table": title, **line}) + "\n")
