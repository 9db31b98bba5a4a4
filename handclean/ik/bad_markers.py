"""Markers that are not where they should be for a while: frozen, swapped, knocked off.

Frames whose residual is far more than this subject's say that something is wrong with
them, not what: a pose spreads the error of one marker over its finger and the hand. So
some of them are solved again without each marker in turn. If they fit as usual without
one, that marker is wrong. If there is none, the marker without which they fit best is
left out as well, and so on: of two markers that have changed names, both are wrong.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.ik.residual_test import IMPLAUSIBLE_RATIO, usual_residual
from handclean.ik.solve import solve_markers
from handclean.recording import Recording
from handclean.remarks import Remark, remark

MIN_UNFIT_FRAMES = 5
"""Frames that do not fit, from which on it is said. Chosen."""

SOLVED_FRAMES = 20
"""Frames that are solved again, at most. Chosen."""

MAX_MARKERS = 3
"""Markers that may be wrong at the same time. Chosen."""

MIN_FITTING_SHARE = 0.5
"""Share of the frames that fit without the markers found, at least. Chosen."""


@dataclass(frozen=True, kw_only=True)
class Suspects:
    """What is wrong with some frames.

    Attributes
    ----------
    frames : which, rising.
    labels : markers without which they fit; none if no few markers are to blame.
    residual_m, usual_m : [m] RMS residual of such a frame, median; what is usual.
    """

    frames: Ints
    labels: tuple[str, ...]
    residual_m: float
    usual_m: float


def suspects(
    subject: Subject,
    positions: Floats,
    residual: Floats,
    prior: PosturePrior | None = None,
) -> Suspects | None:
    """Find the markers to blame for frames that do not fit; none if frames do.

    Parameters
    ----------
    positions : (T, M, 3) [m] of the subject's markers, NaN where missing.
    residual : (T,) [m] of the subject's solved posture. Where most frames do not fit,
        no single marker is to blame.
    """
    usual = _usual(subject, positions)
    far = residual > IMPLAUSIBLE_RATIO * usual
    known = np.isfinite(residual)
    if far.sum() < MIN_UNFIT_FRAMES or far.sum() > 0.5 * known.sum():
        return None
    frames = np.flatnonzero(far)
    some = frames[np.unique(np.linspace(0, len(frames) - 1, SOLVED_FRAMES).astype(int))]
    return Suspects(
        frames=frames,
        labels=_to_blame(subject, positions[some], prior),
        residual_m=float(np.median(residual[far])),
        usual_m=float(np.median(usual[far])),
    )


def _to_blame(
    subject: Subject, positions: Floats, prior: PosturePrior | None
) -> tuple[str, ...]:
    """Labels without which frames (N, M, 3) fit, few; none if there are no such."""
    labels, out = subject.model.labels, np.zeros(len(subject.model.labels), dtype=bool)
    for _ in range(MAX_MARKERS):
        tried = [m for m in range(len(labels)) if not out[m]]
        ratios = [_without(subject, positions, out, m, prior) for m in tried]
        best = int(np.argmin([np.median(ratio) for ratio in ratios]))
        out[tried[best]] = True
        if np.mean(ratios[best] <= IMPLAUSIBLE_RATIO) > MIN_FITTING_SHARE:
            return tuple(label for label, bad in zip(labels, out, strict=True) if bad)
    return ()


def _without(
    subject: Subject,
    positions: Floats,
    out: Bools,
    one: int,
    prior: PosturePrior | None,
) -> Floats:
    """(N,) residual over the usual one without some markers and one more."""
    some = positions.copy()
    some[:, out] = np.nan
    some[:, one] = np.nan
    residual = solve_markers(subject.model, some, prior=prior).residual
    return np.where(np.isfinite(residual), residual / _usual(subject, some), np.inf)


def _usual(subject: Subject, positions: Floats) -> Floats:
    """(N,) [m] residual that frames with these markers usually have."""
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    return usual_residual(subject.model, subject.marker_sigma, seen)


def misfits(
    recording: Recording,
    subject: Subject,
    name: str,
    positions: Floats,
    prior: PosturePrior | None = None,
) -> tuple[Remark, ...]:
    """Remark on markers to blame for frames of a solved take, if there are some.

    Parameters
    ----------
    name : of the motion, with its residuals.
    positions : (T, M, 3) [m] of the subject's markers.
    """
    residual = recording.motions[name].residual
    found = None
    if residual is not None:
        found = suspects(subject, positions, residual, prior)
    if found is None:
        return ()
    first, last = recording.numbering.span(found.frames[0], found.frames[-1] + 1)
    text = (
        f"{name}: residual {1e3 * found.residual_m:.2g} mm, usually "
        f"{1e3 * found.usual_m:.2g}, in {len(found.frames)} frames from {first} to "
        f"{last}"
    )
    if found.labels:
        labels = " and ".join(found.labels)
        text = f"{text}, but not without {labels}: frozen or swapped?"
    said = remark(
        "fit",
        text,
        frames=(first, last),
        model=name,
        marker=found.labels[0] if len(found.labels) == 1 else "",
        markers=list(found.labels),
        residual_m=float(found.residual_m),
    )
    return (said,)
