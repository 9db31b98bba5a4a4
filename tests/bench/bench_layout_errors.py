"""Reduced marker layouts judged by what is solved of them.

    python tests/bench/bench_layout_errors.py

The template hand moves as in simulated grasps (17 classes, takes of 9 people for layout
and subspace, of 9 others to judge them) or as in manipnet (teapot and
wineglass for layout and subspace, cup and mug to judge, both hands), which is read from
the folder named by HANDCLEAN_DATA. Markers have 0.2 mm of noise per axis. Distances are
of the coarse skin's vertices, the palm included; "fingers" are those that fingers move.
The anchor, a marker on the forearm, tells where the wrist is, not how the hand is
turned. Layouts of k markers serve as many directions of the subspace as hold 95 % of
the variance, but at most 2 k - 2, or "by error" as many as tell the motion best that
they were made for (--by-error); what is solved uses those that hold 95 %. Generic
layouts come of simulated gestures and exercises (free, rom); wheatland is the mean of
some draws of 1 % of the candidates. Milliseconds are processor time of a frame on one
core.

Schroeder 2016: below 2 mm with 6 markers made for grasps, 9 generic ones; table 1, 4
markers: standard 17.9 mm in the mean and 79 at most, subspace 8.9 and 21.
"""

import os
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from measuring import absent, counted

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import neutral_pose
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.ik.prior import learn
from handclean.io.files import read
from handclean.layouts.choose import choose
from handclean.layouts.evaluate import evaluate, on_fingers, skin_apart
from handclean.layouts.evaluate_settings import EvaluateConfig
from handclean.layouts.feasible import feasible
from handclean.layouts.optimize import optimize
from handclean.layouts.problem import make_problem, on_bones
from handclean.layouts.settings import LayoutConfig
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate
from handclean.tree import POSE_HEAD

SHARED = Path(__file__).parents[3] / "shared"
DATA = Path(os.environ.get("HANDCLEAN_DATA", SHARED / "data"))
LEARNT_FROM, JUDGED_ON = ("teapot2", "wineglass3"), ("cup1", "mug1")

COUNTS = (4, 5, 6, 7, 8, 9, 10, 12, 14)
TRIED = (4, 5, 6, 8, 10)
TAKES = counted("takes to learn from", 36, quick=12, tiny=9)
JUDGING = counted("takes to judge on", 18, quick=6, tiny=3)
DRAWS = counted("draws of wheatland", 5, quick=2)
PARTICLES = counted("particles of a search", 1000, quick=300, tiny=50)
JUDGE = EvaluateConfig(frames=counted("frames to judge on", 600, quick=200, tiny=40))
TREE = template("right")
SHARE = 0.95


@cache
def skin(coarse):
    return template_surface(TREE, coarse=coarse)


@cache
def simulated(kind, trials, seed):
    """(T, D) angles of simulated takes."""
    settings = SimulateConfig(
        trials=trials, subjects=9, seed=seed, occlusion=False, rate_hz=50.0
    )
    takes = []
    for trial in simulate(kind, settings):
        (motion,) = (m for n, m in trial.truth.motions.items() if n != "object")
        names = [motion.names.index(hinge) for hinge in TREE.hinges]
        takes.append(motion.angles[:, names])
    return takes


@cache
def manipnet(objects):
    """The same of manipnet, both hands, every fourth frame; none without the data."""
    takes = []
    for name in objects:
        for path in sorted((DATA / "manipnet" / name).glob("*.bvh")):
            (motion,) = read(path).motions.values()
            columns = [motion.names.index(hinge) for hinge in TREE.hinges]
            angles = motion.angles[::4, columns]
            takes.append(angles[np.isfinite(angles).all(axis=1)])
    return takes


@cache
def motion_of(name):
    """Takes to learn from."""
    if name == "grasps":
        return simulated("grasp", TAKES, 4)
    if name == "generic":
        return [*simulated("free", 9, 4), *simulated("rom", 3, 4)]
    return manipnet(LEARNT_FROM)


@cache
def held_out(name):
    """(T, 7 + D) poses to judge by."""
    takes = simulated("grasp", JUDGING, 11) if name == "grasps" else manipnet(JUDGED_ON)
    out = []
    for take in takes:
        poses = np.tile(neutral_pose(TREE), (len(take), 1))
        poses[:, POSE_HEAD:] = take
        out.append(poses)
    return out


@cache
def prior_of(name):
    return learn(motion_of(name), TREE.hinges, share=SHARE)


@cache
def layout_of(motion, markers, method="anneal", seed=0):
    """The model with a layout's markers."""
    held = learn(motion_of(motion), TREE.hinges, share=SHARE)
    dimensions = min(len(held.deviations), 2 * markers - 2)
    settings = LayoutConfig(
        markers=markers, dimensions=dimensions, method=method, particles=PARTICLES
    )
    surface = skin(False)
    model = on_bones(surface, TREE, feasible(surface, TREE, settings))
    problem = make_problem(model, motion_of(motion), TREE.hinges, settings)
    found = optimize(problem, settings, np.random.default_rng(seed))
    return model.selected(found.labels)


@cache
def chosen(motion, markers):
    """The same, with the number of directions found by trying."""
    settings = LayoutConfig(markers=markers, particles=PARTICLES)
    model = on_bones(skin(False), TREE, feasible(skin(False), TREE, settings))
    takes, names = motion_of(motion), TREE.hinges
    _, found, errors = choose(model, skin(True), takes, names, settings, 0)
    best = min(errors, key=errors.__getitem__)
    sys.stderr.write(f"{motion}, {markers} markers: {best} directions\n")
    return model.selected(found.labels)


def judged(model, motion, subspace=True, anchor=True, settings=JUDGE):
    return evaluate(
        model,
        skin(True),
        held_out(motion),
        settings,
        np.random.default_rng(0),
        prior=prior_of(motion) if subspace else None,
        anchor=anchor,
    )


def mm(errors):
    return {
        "mean mm": round(1e3 * errors.mean_m, 2),
        "fingers mm": round(1e3 * errors.fingers_mean_m, 2),
        "max mm": round(1e3 * errors.max_m, 1),
    }


def ideal(motion):
    """What remains if the subspace is met as well as it can be."""
    prior, poses = prior_of(motion), np.concatenate(held_out(motion))
    some = poses[:: max(len(poses) // JUDGE.frames, 1)]
    off = some[:, POSE_HEAD:] - prior.mean
    near = some.copy()
    near[:, POSE_HEAD:] = prior.mean + off @ prior.components @ prior.components.T
    apart = skin_apart(layout_of(motion, 6), skin(True), some, near)
    fingers = apart[:, on_fingers(layout_of(motion, 6), skin(True))]
    return {
        "mean mm": round(1e3 * float(apart.mean()), 2),
        "fingers mm": round(1e3 * float(fingers.mean()), 2),
        "max mm": round(1e3 * float(apart.max()), 1),
    }


def figure_11(motion, counts=COUNTS):
    """Mean vertex error over markers."""
    specific = {"grasps": "made for grasps"}.get(motion, f"made for {motion}")
    out = []
    for count in counts:
        for name, source in ((specific, motion), ("generic", "generic")):
            found = judged(layout_of(source, count), motion)
            out.append({"layout": name, "markers": count, **mm(found)})
        if count in TRIED:
            found = judged(chosen(motion, count), motion)
            out.append(
                {"layout": f"{specific}, by error", "markers": count, **mm(found)}
            )
        draws = [
            judged(layout_of(motion, count, "wheatland", seed), motion)
            for seed in range(DRAWS)
        ]
        parts = [mm(draw) for draw in draws]
        means = {
            key: round(float(np.mean([p[key] for p in parts])), 2) for key in parts[0]
        }
        out.append({"layout": "wheatland", "markers": count, **means})
    for name in ("hoyet6", "hoyet8", "schroeder6", "schroeder8", "schroeder17"):
        model = load_marker_set(name).on(TREE)
        row = {"layout": name, "markers": len(model.labels)}
        out.append({**row, **mm(judged(model, motion))})
    directions = len(prior_of(motion).deviations)
    name = f"ideal projection, {directions} directions"
    out.append({"layout": name, **ideal(motion)})
    return sorted(out, key=lambda row: row["layout"])


def table_1(motions):
    """Layouts by error: standard and subspace, with and without the anchor."""
    out = []
    for motion in motions:
        for count in (4, 5, 6, 8):
            for anchor in (True, False):
                for subspace in (False, True):
                    model = chosen(motion, count)
                    found = judged(model, motion, subspace, anchor)
                    out.append(
                        {
                            "motion": motion,
                            "markers": count,
                            "anchor": "yes" if anchor else "no",
                            "IK": "subspace" if subspace else "standard",
                            **mm(found),
                        }
                    )
    return out


def figure_14():
    """Milliseconds a frame over markers, the shortest of three."""
    out = []
    short = replace(JUDGE, frames=10)
    models = [layout_of("grasps", count) for count in COUNTS]
    models += [load_marker_set(n).on(TREE) for n in ("schroeder17", "maycock26")]
    for model in models:
        row = {"markers": len(model.labels)}
        for name, subspace in (("standard", False), ("subspace", True)):
            times = [
                judged(model, "grasps", subspace, settings=short).frame_s
                for _ in range(3)
            ]
            row[f"{name} ms"] = round(1e3 * min(times), 4)
        out.append(row)
    return out


def rows():
    """The tables."""
    motions = ["grasps"] + (["manipnet"] if manipnet(JUDGED_ON) else [])
    if "manipnet" not in motions:
        absent("manipnet", "Figure 11: manipnet")
    judged(layout_of("grasps", 6), "grasps", False)
    out = {"Figure 11: grasps": figure_11("grasps")}
    if "manipnet" in motions:
        out["Figure 11: manipnet"] = figure_11("manipnet", (4, 5, 6, 8, 10, 14))
    out["Table 1: few markers, standard and subspace"] = table_1(motions)
    out["Figure 14: time of a frame"] = figure_14()
    return out


if __name__ == "__main__":
    for title, part in rows().items():
        sys.stdout.write(f"{title}\n")
        for row in part:
            sys.stdout.write(f"  {row}\n")
