"""Compile every kernel and cache it, by doing a little of everything once.

numba compiles a kernel for the types it is called with, so this goes the way the
commands go, on a short simulated take. A kernel that no part reaches would compile when
a command first needs it; a test forbids that.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from handclean.gaps.fill import fill
from handclean.hand import model
from handclean.hand.marker_set import load_marker_set
from handclean.ik.solve import solve
from handclean.io.prior import read_prior
from handclean.kernels import cache_directory
from handclean.labels.label import label
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import Trial, simulate
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig

TAKE = SimulateConfig(duration_s=1.0, rate_hz=100.0, dropouts_per_s=0.5)
EXERCISE = SimulateConfig(duration_s=21.0, rate_hz=25.0)


def trial(scenario: str, settings: SimulateConfig) -> Trial:
    """Simulate a take."""
    return next(iter(simulate(scenario, settings)))


def hand() -> None:
    """Place joints, bones and markers of a hand."""
    subject = trial("demo", TAKE).subject.model
    poses = np.tile(model.neutral_pose(subject.tree), (2, 1))
    model.joint_positions(subject.tree, poses)
    model.bone_rotations(subject.tree, poses)
    model.marker_positions(subject, poses)
    model.jacobian(subject, poses[0])
    model.moved(poses[0], np.zeros(subject.tree.dofs))


def chain() -> None:
    """Label, fill and solve a take, with and without a prior."""
    made = trial("demo", TAKE)
    labelled, _ = label(made.unlabelled, made.subject, prior=read_prior())
    for prior in (read_prior(), None):
        fill(labelled, made.subject, prior=prior)
        solve(labelled, made.subject, prior=prior)


def calibration() -> None:
    """Learn a hand."""
    made = trial("rom", EXERCISE)
    markers = load_marker_set(EXERCISE.marker_set)
    calibrate([made.labelled], markers, replace(CalibrateConfig(), frames=20))


PARTS: Mapping[str, Callable[[], None]] = {
    "hand": hand,
    "label, fill-gaps, solve, simulate": chain,
    "calibrate-hand": calibration,
}
"""What is warmed, in this order."""


def kernels() -> Iterator[Any]:
    """Yield every kernel of the modules that are loaded."""
    seen = set()
    for name, module in sorted(sys.modules.items()):
        if not name.startswith("handclean."):
            continue
        for thing in vars(module).values():
            if hasattr(thing, "nopython_signatures") and thing not in seen:
                seen.add(thing)
                yield thing


def warm() -> dict[str, Any]:
    """Do every part; return how many kernels were compiled and how many loaded."""
    for part in PARTS.values():
        part()
    loaded = compiled = 0
    for kernel in kernels():
        loaded += sum(kernel.stats.cache_hits.values())
        compiled += sum(kernel.stats.cache_misses.values())
    return {
        "compiled": compiled,
        "loaded": loaded,
        "cache": str(cache_directory()),
    }
