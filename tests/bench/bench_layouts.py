"""Reduced marker layouts: the searches beside each other, and what they take.

    python tests/bench/bench_layouts.py

Simulated grasps (40 takes, 6 people), the template hand's fine skin, 10 keyframes; what
differs is said in the row. Seconds are processor time on one core, from candidates and
Jacobians to the layout, but for the rows that say otherwise. All searches of a seed
begin with the same 1000 random layouts, the greedy one with the best of them. "gap" is
how far an energy lies above the least that any search and seed found, in shares of that
layout's weighted condition term.

Schroeder 2016: swarm 5 to 10 s, greedy 45 s to 3 min. The peers' script (numpy's
eigvalsh and a numba prototype) is that of the folder named by HANDCLEAN_PEERS; it has
random matrices 9 x 9 of 6 among 800 candidates, and neither distances, projection nor
perturbation. Its rows stay as an earlier run had them where it is not there.
"""

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.io.files import read
from handclean.layouts.feasible import feasible
from handclean.layouts.objective import energies
from handclean.layouts.optimize import METHODS, SEARCHES, optimize
from handclean.layouts.problem import make_problem, on_bones
from handclean.layouts.search import random_layouts
from handclean.layouts.settings import LayoutConfig
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

SHARED = Path(__file__).parents[3] / "shared"
DATA = Path(os.environ.get("HANDCLEAN_DATA", SHARED / "data"))
PEERS = Path(os.environ.get("HANDCLEAN_PEERS", SHARED / "peers"))

SEEDS = counted("seeds of figure 9", 50, quick=2, tiny=1)
TIMES = counted("runs of which the fastest counts", 3, quick=1)
PARTICLES = counted("particles", 1000, quick=400, tiny=60)
PRECISION = ("thumb_index", "thumb_2_finger", "tripod")
FULL = LayoutConfig(patience=1000, dimensions=5, particles=PARTICLES)
CASES = {
    "4 markers, 5 dimensions": replace(FULL, markers=4),
    "6 markers, 5 dimensions": FULL,
    "8 markers, 9 dimensions": replace(FULL, markers=8, dimensions=9),
    "10 markers, 5 dimensions": replace(FULL, markers=10),
}


@cache
def grasps(classes=()):
    """(T, D) angles of simulated takes, and their names."""
    settings = SimulateConfig(
        trials=40, subjects=6, seed=4, occlusion=False, grasps=classes
    )
    takes, names = [], ()
    for trial in simulate("grasp", settings):
        (motion,) = (m for n, m in trial.truth.motions.items() if n != "object")
        takes.append(motion.angles)
        names = motion.names
    return takes, names


@cache
def manipnet():
    """The same of manipnet's takes, or nothing."""
    takes, names = [], ()
    for path in sorted((DATA / "manipnet").glob("*/*.bvh")):
        (motion,) = read(path).motions.values()
        takes.append(motion.angles)
        names = motion.names
    return takes, names


def problem_of(settings, motion=None, coarse=False):
    """The problem of the template hand and a motion."""
    tree = template("left")
    takes, names = motion or grasps()
    surface = template_surface(tree, coarse=coarse)
    model = on_bones(surface, tree, feasible(surface, tree, settings))
    return make_problem(model, takes, names, settings)


def timed(work):
    """What some work returns, and the processor time it takes [s]."""
    begin = time.process_time()
    out = work()
    return out, time.process_time() - begin


def found(problem, settings, method, seed=0, times=TIMES):
    """A layout, and the shortest time it took."""
    settings = replace(settings, method=method)
    runs = [
        timed(lambda: optimize(problem, settings, np.random.default_rng(seed)))
        for _ in range(times)
    ]
    return runs[0][0], min(spent for _, spent in runs)


def eigvalsh_seconds(problem, settings, iterations=2):
    """[s] of the condition numbers alone of a whole swarm, by numpy."""
    rng = np.random.default_rng(0)
    low = np.tril_indices(len(problem.columns))
    square = np.zeros(
        (*problem.grams.shape[:2], len(problem.columns), len(problem.columns))
    )
    square[:, :, low[0], low[1]] = square[:, :, low[1], low[0]] = problem.grams

    def some():
        for _ in range(iterations):
            layouts = random_layouts(problem, settings.markers, settings.particles, rng)
            total = square[layouts[:, 0]].copy()
            for m in range(1, settings.markers):
                total += square[layouts[:, m]]
            np.linalg.eigvalsh(total)

    return timed(some)[1] * settings.iterations / iterations


def peer_rows():
    """What the peers' script says, in this run."""
    script = PEERS / "pso.py"
    if not script.is_file():
        absent("peers:")
        return []
    done = subprocess.run(
        [sys.executable, "-B", str(script)],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    lines = [json.loads(t) for t in done.stdout.splitlines() if t.startswith("{")]
    return [
        {"": f"peers: {line['peer']}", "s": line["total_s"], "vertices": 800, "C": 9}
        for line in lines
        if line.get("threads", 1) == 1
    ]


def speed_rows():
    """1000 particles, 100 iterations, 10 keyframes, 6 markers."""
    problem, spent = timed(lambda: problem_of(FULL))
    out = [{"": "candidates, keyframes, subspace, Jacobians (any search)", "s": spent}]
    for dimensions in (5, 6):
        settings = replace(FULL, dimensions=dimensions)
        problem = problem_of(settings)
        for method in SEARCHES:
            layout, spent = found(problem, settings, method)
            out.append(
                {
                    "": method,
                    "s": spent,
                    "C": len(problem.columns),
                    "layouts": layout.weighed,
                    "energy": layout.energy,
                }
            )
        spent = eigvalsh_seconds(problem, settings)
        name = "condition numbers of a swarm by numpy eigvalsh"
        out.append({"": name, "s": spent, "C": len(problem.columns)})
    for row in out:
        row["vertices"] = len(problem.home)
    return [rounded(row) for row in out + peer_rows()]


def growth_rows():
    """Seconds of the searches as the problem grows."""
    out = []

    def add(name, settings, coarse=False):
        problem = problem_of(settings, coarse=coarse)
        row = {"": name, "vertices": len(problem.home), "C": len(problem.columns)}
        for method in SEARCHES:
            row[method] = found(problem, settings, method)[1]
        out.append(rounded(row))

    for markers in (4, 6, 8, 10, 14):
        add(f"{markers} markers", replace(FULL, markers=markers))
    for count in (3, 10, 20):
        add(f"{count} keyframes", replace(FULL, keyframes=count))
    for normal in (0.95, 0.9, 0.7):
        add(f"normals within {normal}", replace(FULL, normal=normal))
    add("coarse skin", FULL, coarse=True)
    add("no anchor, 6 markers", replace(FULL, anchor=False))
    add("all joints, 13 markers", replace(FULL, markers=13, full=True))
    return out


def figure_9(seeds):
    """The searches from the same starts: who wins, how far along they are when."""
    ends, courses = [], []
    for title, settings in CASES.items():
        problem = problem_of(settings)
        runs = {name: [] for name in SEARCHES}
        for seed in range(seeds):
            rng = np.random.default_rng(seed)
            start = random_layouts(problem, settings.markers, PARTICLES, rng)
            for name, into in runs.items():
                into.append(course(problem, settings, name, start, seed))
        least = min(run[-1][1] for group in runs.values() for run in group)
        scale = settings.w1 * best_condition(problem, settings)
        paper = np.array([run[-1][1] for run in runs["swarm"]])
        for name, group in runs.items():
            last = np.array([run[-1][1] for run in group])
            same = np.abs(last - paper) <= 1e-6 * scale
            gaps = (last - least) / scale
            ends.append(
                rounded(
                    {
                        "": title,
                        "search": name,
                        "median energy": np.median(last),
                        "worst": last.max(),
                        "median gap": f"{np.median(gaps):.2%}",
                        "worst gap": f"{gaps.max():.2%}",
                        "best found": f"{(gaps < 1e-6).mean():.0%}",
                        "beats the swarm": f"{((last < paper) & ~same).mean():.0%}",
                        "ties": f"{same.mean():.0%}",
                        "loses": f"{((last > paper) & ~same).mean():.0%}",
                        "s": np.median([run[-1][2] for run in group]),
                    }
                )
            )
            row = {"": title, "search": name}
            for column, marks in ((0, (2e3, 1e4, 3e4, 1e5)), (2, (0.05, 0.1, 0.3, 1))):
                for mark in marks:
                    at = [after(run, column, mark) for run in group]
                    unit = "layouts" if column == 0 else "s"
                    gap = (np.median(at) - least) / scale
                    row[f"{mark:g} {unit}"] = f"{gap:.1%}"
            courses.append(row)
    return ends, courses


def course(problem, settings, name, start, seed):
    """(H, 3) layouts weighed, least energy, processor time [s] of a search."""
    rows, begin = [], time.process_time()

    def watch(weighed, energy):
        rows.append((weighed, energy, time.process_time() - begin))

    METHODS[name](problem, settings, np.random.default_rng(seed), start, watch)
    return rows


def after(run, column, mark):
    """The least energy of a search after so many layouts or seconds."""
    reached = [row[1] for row in run if row[column] <= mark]
    return reached[-1] if reached else run[0][1]


def best_condition(problem, settings):
    layout = optimize(
        problem, replace(settings, method="anneal"), np.random.default_rng(1)
    )
    return layout.condition


def figure_7():
    """Each term alone and both, 10 markers on precision grasps."""
    out = []
    motions = {"precision grasps": grasps(PRECISION), "all grasps": grasps()}
    if manipnet()[0]:
        motions["manipnet"] = manipnet()
    else:
        absent("manipnet")
    for name, motion in motions.items():
        for markers in (6, 10):
            settings = replace(FULL, markers=markers)
            problem = problem_of(settings, motion)
            pairs = [(0.1, 0.0), (0.0, 1.0)]
            pairs += [(0.1, w2) for w2 in (30.0, 100.0, 300.0, 1000.0, 3000.0)]
            for w1, w2 in pairs:
                layout, _ = found(
                    problem, replace(settings, w1=w1, w2=w2), "anneal", 0, 1
                )
                out.append(
                    {
                        "": name,
                        "markers": markers,
                        "w1": w1,
                        "w2": w2,
                        "mean condition": round(layout.condition, 1),
                        "smallest distance, mm": round(1e3 * layout.smallest_m, 1),
                        "on": ", ".join(
                            f"{layout.bones.count(b)} {b}"
                            for b in dict.fromkeys(layout.bones)
                        ),
                    }
                )
    return out


def baseline_rows():
    """Layouts of all methods, 6 markers, judged by the energy."""
    problem = problem_of(replace(FULL, normal=0.85))
    out = []
    tries = [(name, 0.01) for name in METHODS if name != "wheatland"]
    tries += [("wheatland", share) for share in (1.0, 0.05, 0.01)]
    for name, share in tries:
        settings = replace(FULL, method=name, base_share=share)
        layout = optimize(problem, settings, np.random.default_rng(0))
        title = f"wheatland, {share:.0%}" if name == "wheatland" else name
        out.append(
            {
                "": title,
                "markers": len(layout.chosen),
                "mean condition": round(layout.condition, 1),
                "smallest distance, mm": round(1e3 * layout.smallest_m, 1),
                "on": ", ".join(layout.bones),
            }
        )
    return out


def rounded(row):
    """A row with numbers of four digits."""
    return {
        key: float(f"{value:.4g}") if isinstance(value, float) else value
        for key, value in row.items()
    }


def rows():
    """The tables."""
    np.linalg.eigvalsh(np.eye(3)[None])
    warm = problem_of(FULL, coarse=True)
    energies(warm, random_layouts(warm, 6, 10, np.random.default_rng(0)), FULL)
    for method in SEARCHES:
        found(warm, replace(FULL, particles=20), method, times=1)
    ends, courses = figure_9(SEEDS)
    return {
        f"Speed: {PARTICLES} particles, 100 iterations, 10 keyframes, 6 markers": (
            speed_rows()
        ),
        f"Figure 9: {SEEDS} seeds, the same starts": ends,
        "Figure 9: median gap after so many layouts, and seconds": courses,
        "Growth, seconds": growth_rows(),
        "Figure 7: the terms and their weights": figure_7(),
        "Searches and baselines, normals within 0.85": baseline_rows(),
    }


if __name__ == "__main__":
    for title, part in rows().items():
        sys.stdout.write(f"{title}\n")
        for row in part:
            sys.stdout.write(f"  {row}\n")
