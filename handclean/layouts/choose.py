"""How many directions a layout should serve, found by trying.

The condition number says how well markers tell a posture subspace, not how much of the
posture lies outside it: with few directions some finger has no marker, with many the
markers tell all of them badly. So layouts are found for several numbers of directions,
and the one is kept whose markers, simulated on the motion itself, tell the skin best.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from handclean.arrays import Floats
from handclean.errors import HandcleanError
from handclean.hand.model import Model, neutral_pose
from handclean.hand.surface import Surface
from handclean.ik.prior import PosturePrior, learn
from handclean.layouts.evaluate import evaluate
from handclean.layouts.evaluate_settings import EvaluateConfig
from handclean.layouts.optimize import Layout, optimize
from handclean.layouts.problem import Problem, make_problem
from handclean.layouts.settings import LayoutConfig
from handclean.tree import POSE_HEAD

FEWEST_DIRECTIONS, MOST_DIRECTIONS = 3, 12
"""Directions that are tried, as far as the markers can tell them (chosen)."""

SOLVER_VARIANCE_SHARE = 0.95
"""Share of the variance that the subspace holds with which markers are solved (chosen:
as the prior that ships)."""

_SOLVED_FRAMES, _COMPARED_FRAMES = 6000, 200
"""Frames that are solved, and those whose skin is compared, at most (chosen)."""

Told = Callable[[int, float], None]
"""Called with the directions and the mean error [m] of each layout."""


def choose(
    model: Model,
    surface: Surface,
    takes: Sequence[Floats],
    names: tuple[str, ...],
    settings: LayoutConfig,
    seed: int,
    *,
    prior: PosturePrior | None = None,
    told: Told | None = None,
) -> tuple[Problem, Layout, dict[int, float]]:
    """Find the layout that tells a motion's skin best, over numbers of directions.

    Parameters
    ----------
    model : the candidates; surface : the hand's skin.
    takes : (T, D) [rad]; names : of the D angles.
    settings : all but dimensions, share and full.
    prior : posture subspace; learnt from the takes if None.

    Returns
    -------
    problem, layout, and by directions the mean error [m] of each that was tried

    Raises
    ------
    HandcleanError
        If the markers cannot tell even the fewest directions; and as `make_problem`.
    """
    if prior is None:
        prior = learn(takes, names, share=1.0)
    varied = int((prior.deviations > 1e-6).sum())
    equations = 3 * settings.markers - (3 if settings.anchor else 6)
    most = min(MOST_DIRECTIONS, equations, varied)
    if most < 1:
        raise HandcleanError(
            f"{settings.markers} markers do not tell any direction of the posture "
            "beside the hand's rotation; take more"
        )
    held = (
        int(np.searchsorted(np.cumsum(prior.variance_share), SOLVER_VARIANCE_SHARE)) + 1
    )
    solved_with = replace(
        prior,
        components=np.ascontiguousarray(prior.components[:, :held]),
        deviations=prior.deviations[:held],
        variance_share=prior.variance_share[:held],
    )
    poses = _poses(model, takes, names)
    best: tuple[float, Problem, Layout] | None = None
    errors = {}
    for count in range(min(FEWEST_DIRECTIONS, most), most + 1):
        asked = replace(settings, dimensions=count, full=False)
        problem = make_problem(model, takes, names, asked, prior=prior, surface=surface)
        layout = optimize(problem, asked, np.random.default_rng(seed))
        found = evaluate(
            model.selected(layout.labels),
            surface,
            poses,
            EvaluateConfig(frames=_COMPARED_FRAMES),
            np.random.default_rng(seed),
            prior=solved_with,
            anchor=settings.anchor,
        ).mean_m
        errors[count] = found
        if told:
            told(count, found)
        if best is None or found < best[0]:
            best = found, problem, layout
    assert best is not None
    return best[1], best[2], errors


def _poses(
    model: Model, takes: Sequence[Floats], names: tuple[str, ...]
) -> list[Floats]:
    """(T, 7 + D) known frames, the wrist at the origin; of long takes the middle."""
    tree, out = model.tree, []
    columns = [POSE_HEAD + tree.hinges.index(name) for name in names]
    each = max(_SOLVED_FRAMES // len(takes), 1)
    for take in takes:
        known = take[np.isfinite(take).all(axis=1)]
        start = max((len(known) - each) // 2, 0)
        known = known[start : start + each]
        poses = np.tile(neutral_pose(tree), (len(known), 1))
        poses[:, columns] = known
        out.append(poses)
    return out
