"""Every filler on the same gaps, on real takes and on simulated ones.

**Fifteen cells**: one marker, four, or a whole finger hidden for 0.1 to 2 s, each gap
cut alone into a take in which nothing else is missing: `dfki13` (13 markers, 100 Hz),
`Pick1 right` (16, 120 Hz), both hands of the ART recording (20 finger points each,
60 Hz), none of them used to choose constants with these seeds (101 to 105). Errors are
mean distances over the gap. "ratio" is the geometric mean of the gaps' ratios to the
ridge regression's error, "of means" the ratio of mean errors, each with the 95 %
interval of the bootstrap over gaps; "worse than 1.25": share of gaps with more than
1.25 times the ridge's error. "ms a gap" is processor time, preparing for the take among
it; `take` is without pseudo-gaps there. "last frame, cm" is table 3 of Pavllo et al.
2019 in its own form.

**auto** tells no error without pseudo-gaps; in the fifteen cells it is judged on fewer
gaps. **Sigma**: takes with their own gaps, several cut at once
(`handclean.gaps.cuts`), sigma learnt from pseudo-gaps of what is left. **Own gaps**: of
markers seen in at least 20 % of the take; "rarely seen" are the others. **Simulated**:
gestures and grasps of 20 s at 100 Hz with 0.2 mm of noise; "its own gaps" are
occlusions and dropouts of simulated cameras, against the truth, with the default of
`--max-sigma-m`. **Parts of the regression**: the take's regression with one term of its
covariance, its bands or its weights off.

Judge your own: `tests/bench/gaps/judge.py`.
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from os import environ, sched_getaffinity

import numpy as np
from gaps import (
    ablation,
    errors,
    own,
    posture,
    sides,
    sigmas,
    simulated_own,
    speed,
    takes,
)
from gaps.cells import EACH, LENGTHS_S, SEEDS, holes
from measuring import absent, counted

from handclean.gaps.evaluate import named
from handclean.gaps.family.table import BASELINES
from handclean.gaps.regression.fill import regression
from handclean.gaps.tracks import Refused
from handclean.hand.marker_set import load_marker_set
from handclean.io.files import read
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Recording, trajectories
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig

USED_SEEDS = SEEDS[: counted("seeds of the fifteen cells", len(SEEDS), quick=1)]
IN_CELL = counted("gaps of a cell, take and seed", EACH, quick=1)
OF_AUTO = counted("of these filled by auto", 2, quick=1)
OF_REST = counted("gaps of a cell, noisy and simulated", 4, quick=1)
SIGMA_GAPS = counted("gaps of a cell for sigma", 30, quick=2)
SIGMA_ROUNDS = counted("rounds for sigma", 40, quick=1)
ABLATED = counted("takes for parts of the regression", 4, quick=2)
POSTURE_ROUNDS = counted("rounds for fillers that follow posture", 3, quick=1)
SIMULATED = counted("simulated takes", 4, quick=1)
LEARNT = counted("frames that a hand is learnt from", 400, quick=200, tiny=40)
OWN_FRAMES = counted("frames of a recording's own gaps", 10**6, quick=1500, tiny=600)
SIZES = (
    (3000, 30), (30000, 30), (100000, 30), (30000, 300), (100000, 1000)
)[: counted("lengths of takes for speed", 5, quick=2)]  # fmt: skip
JOBS = int(environ.get("HANDCLEAN_BENCH_JOBS", len(sched_getaffinity(0))))
"""Processes; figures do not depend on them."""

RECORDINGS = {
    "dfki13": ("hand_embodiment/recording.tsv", "dfki13", {}),
    "Pick1 right": ("guitar/Pick1.csv", "xu19", {"rate_hz": 120.0, "unit": "mm"}),
}


def auto(tracks):
    """The method "auto" without a subject, by the contract of fillers."""
    fill_all = named("auto")

    def fill(gap):
        (found,) = fill_all(tracks, [gap])
        if found.path is None:
            raise Refused(found.gap.refused)
        return found.path

    return fill


def fillers():
    """Functions ``prepare`` by name, the yardstick first."""
    known = {name: one.prepare for name, one in BASELINES.items()}
    return {"ridge": known.pop("ridge"), "take": regression, **known}


def _cells(job):
    """Errors at the gaps of one take and seed; run in a process of its own."""
    take, seed, each, of_auto = job
    found = errors.judged(take, holes(take, seed, each), fillers())
    few = holes(take, seed, of_auto)
    with_auto = {"ridge": BASELINES["ridge"].prepare, "auto": auto}
    return found, errors.judged(take, few, with_auto) if few else None


def _sigma(job):
    take, per_cell, rounds = job
    return sigmas.judgements([take], per_cell, rounds)[0]


def in_processes(function, jobs):
    """Results of jobs, in their order."""
    if JOBS < 2:
        return [function(job) for job in jobs]
    with ProcessPoolExecutor(JOBS, mp_context=get_context("fork")) as pool:
        return list(pool.map(function, jobs))


def cells(taken, seeds, each, of_auto):
    """Errors of all fillers, and of auto with the ridge at some of the gaps."""
    jobs = [(take, seed, each, of_auto) for take in taken for seed in seeds]
    together, with_auto = errors.Errors(), errors.Errors()
    for found, few in in_processes(_cells, jobs):
        together.add(found)
        if few is not None:
            with_auto.add(few)
    return together, with_auto


def last_frame(found):
    """Rows: Pavllo 2019 table 3, [cm] on the last frame, of one and of four markers."""
    names = {"last": "LK", "average": "MA", "affine": "AC", "ridge": "ridge"}
    table = []
    for name, short in {**names, "take": "take"}.items():
        for pattern in ("1", "4"):
            row = {"method": short, "occlusions": pattern}
            for length in LENGTHS_S:
                at = found.where(lambda hole, c=(pattern, length): hole.cell == c)
                last = np.array(found.last[name])[at]
                known = last[np.isfinite(last)]
                row[f"{length} s"] = (
                    round(100.0 * float(known.mean()), 3) if len(known) else ""
                )
            table.append(row)
    return table


def is_there(name):
    """Whether a recording is there; noted if not."""
    if (takes.DATA / RECORDINGS[name][0]).is_file():
        return True
    absent(name)
    return False


def recording(name):
    """A recording's hand, the same as a take, a subject calibrated from it."""
    path, marker_set, options = RECORDINGS[name]
    whole = read(takes.DATA / path, **options)
    markers, kept = whole.markers, min(whole.frames, OWN_FRAMES)
    known = load_marker_set(marker_set)
    of_hand = [m for m, label in enumerate(markers.labels) if label in known.labels]
    labels = tuple(markers.labels[m] for m in of_hand)
    places = np.where(markers.measured[:, :, None], markers.positions, np.nan)
    part = Recording(
        rate=whole.rate,
        frames=kept,
        markers=trajectories(places[:kept][:, of_hand], labels),
    )
    subject = calibrate([part], known, CalibrateConfig(frames=LEARNT))[0]
    return part, takes.of_set(part, name, marker_set), subject


def simulated_grasps():
    """Simulated grasps with their own gaps, subject and truth."""
    settings = SimulateConfig(trials=SIMULATED, subjects=SIMULATED, seed=7)
    return list(simulate("grasp", settings))


def real_tables(taken):
    """Tables of the fifteen cells on real takes."""
    found, with_auto = cells(taken, USED_SEEDS, IN_CELL, OF_AUTO)
    names = ("take", "pca", "kalman", "affine", "pattern", "cubic")
    return {
        "real takes, all fifteen cells": errors.overall(found),
        "real takes, by take: ratio": errors.by_take(found, names),
        "take, by cell: ratio": errors.by_cell(found, "take"),
        "auto, all cells": errors.overall(with_auto),
        "auto, by cell: ratio": errors.by_cell(with_auto, "auto"),
        "auto, by take: ratio": errors.by_take(with_auto, ("auto",)),
        "mean error, mm": errors.millimetres(found),
        "last frame, cm": last_frame(found),
        "second differences at the ends of gaps, mm": errors.ends(found),
    }


def _few(take):
    return holes(take, USED_SEEDS[0], OF_REST)


def _ablation(job):
    taken, name = job
    return ablation.row(taken, _few, BASELINES["ridge"].prepare, regression, name)


def parts_of_regression(taken):
    """Tables on few gaps: what its parts are worth, gaps with one end."""
    one_sided = {"ridge": BASELINES["ridge"].prepare, "take": regression}
    jobs = [(taken[:ABLATED], name) for name in ablation.OFF]
    return {
        "parts of the regression": in_processes(_ablation, jobs),
        "gaps with one end, mm": sides.rows(taken, _few, one_sided),
    }


def sigma_tables(taken):
    """Tables of takes as they are: sigma, and errors with several gaps at once."""
    jobs = [(take, SIGMA_GAPS, SIGMA_ROUNDS) for take in taken]
    found = in_processes(_sigma, jobs)
    return {
        "sigma": sigmas.coverage(found),
        "several gaps at once": sigmas.compared(found),
    }


def _with_subject(name):
    """Rows of own gaps, of filled samples beside the hand, of fillers of posture."""
    part, take, subject = recording(name)
    prior = read_prior()
    rounds = POSTURE_ROUNDS
    return (
        own.rows(take, part, subject, prior),
        own.from_the_hand(name, part, subject, prior),
        posture.rows(name, take, part, subject, prior, SIGMA_GAPS, rounds),
    )


def posture_tables():
    """Tables of recordings with a subject calibrated from them."""
    there = [name for name in RECORDINGS if is_there(name)]
    parts = in_processes(_with_subject, there)
    titles = (
        "own gaps",
        "filled samples from the solved hand's markers",
        "fillers that follow posture",
    )
    return {
        title: [row for part in parts for row in part[i]]
        for i, title in enumerate(titles)
    }


def rows():
    """Tables by title."""
    real = takes.real()
    tables = {}
    if real:
        tables |= real_tables(real)
        tables |= parts_of_regression(real)
        hands = [one for one in (takes.dfki13(), takes.pick1()) if one is not None]
        tables |= sigma_tables([*hands, *takes.art()])
        tables |= posture_tables()
    noisy = takes.noisy()
    if noisy:
        found, _ = cells(noisy, USED_SEEDS[:1], OF_REST, 0)
        tables["sig18, 3 mm of noise"] = errors.overall(found)
    made = takes.simulated(SIMULATED)
    found, _ = cells(made, USED_SEEDS[:1], OF_REST, 0)
    tables["simulated"] = errors.overall(found)
    tables["simulated, take by cell: ratio"] = errors.by_cell(found, "take")
    tables["speed: gaps of 0.2 s"] = speed.rows(made[0], SIZES)
    grasps, prior = simulated_grasps(), read_prior()
    tables["simulated, its own gaps"] = simulated_own.rows(grasps, prior)
    pairs = [(one.labelled, one.subject) for one in grasps]
    tables["speed, solve and fill"] = posture.speed({"simulated": pairs}, prior)
    return tables


if __name__ == "__main__":
    for title, part in rows().items():
        for line in part:
            sys.stdout.write(json.dumps({"table": title, **line}, default=str) + "\n")
