"""Is it the other hand? The mirror image of a model, on the same labelled markers.

A left hand's markers on a right hand's model leave residuals that are too large; so do
another person's. What tells is that the mirror image fits the same frames clearly
better. It is looked at only where the model fits worse than it usually does.

Measured, residual of the mirror image over the model's own, median of frames: 0.02 with
subjects of the other side, 0.26 with templates.
"""

from dataclasses import replace

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.errors import TAKE, HandcleanError
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.ik.residual_test import ODD_RATIO, usual_residual
from handclean.ik.solve import solve_markers
from handclean.tree import MIRROR

COMPARED_FRAMES = 60
"""Frames that are solved with both hands. Chosen."""

MIRROR_RATIO = 0.6
"""The mirror image's residual over the model's own, at most, where it is that hand.
From the medians above."""

SAMPLED_FRAMES = 200
"""Frames of a take whose residuals are compared with the usual, about. Chosen."""

TEMPLATE_SUSPECT_RATIO = 1.5
"""How many times the usual residual makes a take suspect, where the hand is a template.
Chosen: below what `residual_test` remarks on."""


def mirrored(model: Model) -> Model:
    """Return the other hand, left for right, with the same markers mirrored."""
    return replace(model, tree=model.tree.mirrored(), at=model.at * MIRROR)


def is_odd(subject: Subject, seen: Bools, residual: Floats) -> bool:
    """Whether a take's usual residual is more than this subject's.

    Parameters
    ----------
    seen : (T, M) markers in sight; residual : (T,) [m].
    """
    rows = np.flatnonzero(np.isfinite(residual) & (seen.sum(axis=1) >= 4))
    if len(rows) == 0:
        return False
    rows = rows[:: max(len(rows) // SAMPLED_FRAMES, 1)]
    usual = usual_residual(subject.model, subject.marker_sigma, seen[rows])
    measured = bool(np.isfinite(subject.marker_sigma).any())
    most = ODD_RATIO if measured else TEMPLATE_SUSPECT_RATIO
    return bool(np.median(residual[rows] / usual) > most)


def expect_side(
    subject: Subject,
    positions: Floats,
    residual: Floats,
    prior: PosturePrior | None = None,
) -> None:
    """Expect that the other hand does not fit labelled markers clearly better.

    Parameters
    ----------
    positions : (T, M, 3) [m] of the subject's markers, NaN where missing.
    residual : (T,) [m] of the subject's solved posture.

    Raises
    ------
    HandcleanError
        If it does.
    """
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    if not subject.model.tree.side or not is_odd(subject, seen, residual):
        return
    count = seen.sum(axis=1)
    rows = np.flatnonzero(count >= max(4, int(np.quantile(count[count > 0], 0.5))))
    if len(rows) == 0:
        return
    some = positions[rows[np.linspace(0, len(rows) - 1, COMPARED_FRAMES).astype(int)]]
    own, other = (
        solve_markers(model, some, prior=prior).residual
        for model in (subject.model, mirrored(subject.model))
    )
    if np.median(other / own) < MIRROR_RATIO:
        found, own_mm = 1e3 * np.median(other), 1e3 * np.median(own)
        refuse(subject, f"{found:.2g} mm against {own_mm:.2g} mm")


def refuse(subject: Subject, against: str) -> None:
    """Say that it is the other hand.

    Parameters
    ----------
    against : how well the other hand fits, and this one.

    Raises
    ------
    HandcleanError
        Always.
    """
    side = subject.model.tree.side
    other = "left" if side == "right" else "right"
    raise HandcleanError(
        f"its markers fit the mirror image of '{subject.name}', a {side} hand, "
        f"better ({against}): is it a {other} hand?",
        where=TAKE,
    )
