"""What simulated takes are like, beside manipnet's motion and Pavllo's occlusions.

    python tests/bench/bench_simulation.py

The recordings are those of the folder named by HANDCLEAN_DATA (default: the recordings
kept beside the project); without them the table has the simulation alone.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.ik.prior import coverage, misfit
from handclean.io.files import read
from handclean.io.hdf5.prior import read_prior
from handclean.simulation.figures import (
    motion_figures,
    motion_table,
    occlusion_figures,
    occlusion_table,
)
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

BESIDE = Path(__file__).parents[3] / "shared" / "data"
DATA = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))
TAKES = counted("takes of grasps", 100, quick=24, tiny=4)
FREE = counted("takes of gestures", 25, quick=6)


def manipnet():
    """Angles of every manipnet take, and their rate."""
    takes, rate = [], 120.0
    for path in sorted((DATA / "manipnet").glob("*/*.bvh")):
        recording = read(path)
        (motion,) = recording.motions.values()
        takes.append(motion.angles)
        rate = recording.rate
    return takes, rate


def held(trial):
    """Frames of a grasp take in which the hand is at the object."""
    spans = [e for e in trial.truth.events if e.text.split()[0] in ("grasp", "carry")]
    return slice(spans[0].start, spans[-1].stop)


def angles(trial):
    (motion,) = (m for name, m in trial.truth.motions.items() if name != "object")
    return motion.angles


def rows(count=TAKES):
    """The tables, as text."""
    next(simulate("grasp", SimulateConfig()))
    start = time.perf_counter()
    grasps = list(simulate("grasp", SimulateConfig(trials=count, subjects=18, seed=4)))
    spent = time.perf_counter() - start
    free = list(simulate("free", SimulateConfig(trials=FREE, subjects=18, seed=4)))
    columns = {
        "grasp": motion_figures([angles(t) for t in grasps], 200.0),
        "grasp, at the object": motion_figures(
            [angles(t)[held(t)] for t in grasps], 200.0
        ),
        "free": motion_figures([angles(t) for t in free], 200.0),
    }
    real, rate = manipnet()
    if real:
        columns["manipnet"] = motion_figures(real, rate)
    else:
        absent("manipnet")
    parts = [f"{count} takes of 5 s in {spent:.1f} s\n", motion_table(columns)]
    seen = {"grasp": grasps, "free": free}
    figures = {
        name: occlusion_figures(
            [t.labelled.markers.measured for t in trials], 200.0, seen_at_hz=60.0
        )
        for name, trials in seen.items()
    }
    parts.append(occlusion_table(figures))
    tests = {"grasps of other people": np.concatenate([angles(t) for t in grasps])}
    tests["gestures"] = np.concatenate([angles(t) for t in free])
    if real:
        tests["manipnet"] = np.concatenate(real)
    parts.append(coverage_table(read_prior(), tests))
    return "\n".join(parts)


def coverage_table(prior, tests):
    """What the shipped prior holds of motion it was not learnt from."""
    count = len(prior.deviations)
    lines = [
        f"Shipped prior: {prior.source}, {count} directions hold "
        f"{prior.variance_share.sum():.1%} of their variance",
        "",
        "| directions | " + " | ".join(tests) + " |",
        "|---" * (len(tests) + 1) + "|",
    ]
    shares = {name: coverage(prior, test) for name, test in tests.items()}
    left = {name: np.degrees(misfit(prior, test)) for name, test in tests.items()}
    for k in (2, 4, 6, 8, count):
        cells = [f"{shares[n][k - 1]:.1%}, {left[n][k]:.1f} deg left" for n in tests]
        lines.append(f"| {k} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(rows())
