"""Compile every kernel and cache it, by doing a little of everything once.

numba compiles a kernel for the types it is called with, so each part below goes the
way a command goes, on a few frames. A kernel no part reaches compiles when a command
first needs it, which a test forbids.
"""

import sys
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numba
import numpy as np

from handclean.hand import model
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.prior import PosturePrior
from handclean.ik.solve import solve_markers

MARKERS = "maycock26"


def hand() -> None:
    """Place joints, bones and markers of a hand."""
    drawn = template_subject(load_marker_set(MARKERS)).model
    poses = np.tile(model.neutral_pose(drawn.tree), (2, 1))
    model.joint_positions(drawn.tree, poses)
    model.bone_rotations(drawn.tree, poses)
    model.marker_positions(drawn, poses)
    model.jacobian(drawn, poses[0])


def solve() -> None:
    """Solve a few frames, plain and with a posture prior."""
    drawn = template_subject(load_marker_set(MARKERS)).model
    poses = np.tile(model.neutral_pose(drawn.tree), (3, 1))
    markers = model.marker_positions(drawn, poses)
    markers[1, 0] = np.nan
    names = drawn.tree.hinges
    prior = PosturePrior(
        names=names,
        mean=np.zeros(len(names)),
        components=np.eye(len(names))[:, :2],
        deviations=np.ones(2),
        variance_share=np.array([0.6, 0.4]),
    )
    solve_markers(drawn, markers)
    solve_markers(drawn, markers, prior=prior)


PARTS: Mapping[str, Callable[[], None]] = {"hand": hand, "solve": solve}
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
        "cache": str(getattr(numba.config, "CACHE_DIR", "")),
    }
