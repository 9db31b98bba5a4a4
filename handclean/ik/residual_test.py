"""Whether a solved posture can be the subject's: are its markers as near as usual?

Labels of another person, the other hand or millimetres taken for metres are solved as
willingly as the right ones; what tells is the residual. A calibrated subject says how
far each of its markers usually is from its place, ``marker_sigma``, over frames with
the whole set in sight. A pose absorbs errors, the more the fewer markers there are, so
with n of them in sight

    usual^2 = mean(sigma_m^2) * s(n) / s(all),     s = 1 - (absorbed numbers) / (3 n)

and a frame is implausible whose residual is more than `IMPLAUSIBLE_RATIO` times that.
Absorbed are the six numbers of the root and, finger by finger, as many hinges as the
numbers of the markers beyond each of them decide.

Measured, RMS of a frame over ``usual`` (99th percentile): own subject 1.4 to 2.5 on
real and simulated takes (4.4 on the guitar recording, where some labels are wrong).
Medians: 9 to 15 with another simulated person, 8.9 to 59 with the mirrored hand, 17 and
more with wrong units. Another person cannot be told in single frames where noise is as
large as hands are different (sig18: 2 mm; 1.6 times the usual): hence `ODD_RATIO`, a
remark about whole takes. On a hand nobody measured, residuals of 3 to 4 mm are usual,
16 to 18 mm with the mirrored hand: `TEMPLATE_FAR_M` lies between.
"""

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.ik.whose import reason
from handclean.recording import Recording
from handclean.remarks import Remark, remark
from handclean.tree import ROOT_DOFS

IMPLAUSIBLE_RATIO = 4.0
"""How many times the usual residual is too much for a frame. From the 99th percentiles
above."""

ODD_RATIO = 1.4
"""How many times the usual residual is odd for the median of a take's frames. From the
measurements above."""

TEMPLATE_ODD_RATIO = 3.0
"""The same where places are a template's: recorded hands have 1.2 to 1.5 times it,
simulated ones a tenth larger or smaller up to 2.4, mirrored ones 5.2 to 6.3."""

MIN_MARKER_SD_M = 3e-4
"""[m] no marker's place is known better than this, whatever a calibration says.
Chosen."""

TEMPLATE_FAR_M = 12e-3
"""[m] RMS that is too much for markers whose places nobody has measured, where poses
leave at least `TEMPLATE_FREE_SHARE` of their numbers; less with fewer markers."""

TEMPLATE_FREE_SHARE = 1.0 / 3.0
"""Share of the numbers of 13 markers that 26 degrees of freedom leave."""

MIN_FREE_SHARE = 0.15
"""Share of a residual that is left, at least, where poses absorb nearly all. Chosen."""


def usual_residual(model: Model, marker_sigma: Floats, seen: Bools) -> Floats:
    """(T,) [m] RMS residual that frames with these markers in sight usually have.

    Parameters
    ----------
    marker_sigma : (M,) [m] see `Subject`.
    seen : (T, M)
    """
    unknown = ~np.isfinite(marker_sigma)
    sigma = np.where(
        unknown,
        TEMPLATE_FAR_M / IMPLAUSIBLE_RATIO,
        np.fmax(marker_sigma, MIN_MARKER_SD_M),
    )
    count = np.maximum(seen.sum(axis=1), 1)
    square = (seen @ sigma**2) / count
    left, whole = share_left(model, seen), TEMPLATE_FREE_SHARE
    if not unknown.all():
        whole = float(share_left(model, np.ones((1, len(model.labels)), dtype=bool))[0])
    return np.asarray(np.sqrt(square * np.minimum(left / whole, 1.0)))


def plausible(subject: Subject, seen: Bools, residual: Floats) -> Bools:
    """(T,) whether residuals (T,) [m] are near enough to what the subject usually has.

    Parameters
    ----------
    seen : (T, M) which of the subject's markers a frame was solved with.
    residual : NaN, where there are no markers, contradicts nothing. A take most of
        whose frames are implausible is another hand's: then none is plausible.
    """
    usual = usual_residual(subject.model, subject.marker_sigma, seen)
    far = residual > IMPLAUSIBLE_RATIO * usual
    enough = _enough(seen, residual)
    if enough.any() and far[enough].mean() > 0.5:
        return np.zeros(len(far), dtype=bool)
    return np.asarray(~far)


def _enough(seen: Bools, residual: Floats) -> Bools:
    """(T,) frames with markers enough to tell."""
    return np.asarray(np.isfinite(residual) & (seen.sum(axis=1) > ROOT_DOFS // 3))


def doubts(
    recording: Recording, subject: Subject, name: str = ""
) -> tuple[Remark, ...]:
    """Remark on a solved take that hardly shows this subject; on no other.

    Parameters
    ----------
    recording : with the motion ``name`` (default: the hand's side) and its residuals.
    """
    model = subject.model
    name = name or model.tree.side or model.tree.kind
    motion, markers = recording.motions.get(name), recording.markers
    if motion is None or motion.residual is None or markers is None:
        return ()
    positions = np.full((recording.frames, len(model.labels), 3), np.nan)
    for column, label in enumerate(model.labels):
        if label in markers.labels:
            at = markers.labels.index(label)
            here = markers.measured[:, at]
            positions[here, column] = markers.positions[here, at]
    text = _in_words(subject, motion.residual, positions)
    return (remark("fit", f"{name}: {text}", model=name),) if text else ()


def _in_words(subject: Subject, residual: Floats, positions: Floats) -> str:
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    enough = _enough(seen, residual)
    if not enough.any():
        return ""
    usual = usual_residual(subject.model, subject.marker_sigma, seen[enough])
    ratio = float(np.median(residual[enough] / usual))
    measured = bool(np.isfinite(subject.marker_sigma).any())
    if not ratio > (ODD_RATIO if measured else TEMPLATE_ODD_RATIO):
        return ""
    expected = float(np.median(usual)) * (1.0 if measured else TEMPLATE_ODD_RATIO)
    whose = "this subject has" if measured else "the template hand has at most"
    what = reason(subject, positions)
    found = 1e3 * float(np.median(residual[enough]))
    return f"residual {found:.2g} mm where {whose} {1e3 * expected:.2g} mm: {what}"


def share_left(model: Model, seen: Bools) -> Floats:
    """(T,) share of what markers in sight (T, M) say that poses do not absorb."""
    numbers = 3.0 * np.maximum(seen.sum(axis=1), 1)
    left = 1.0 - (ROOT_DOFS + _hinges_told(model, seen)) / numbers
    return np.asarray(np.maximum(left, MIN_FREE_SHARE))


def _hinges_told(model: Model, seen: Bools) -> Floats:
    """(T,) how many hinges the markers beyond them can tell, limb by limb.

    From the tips inwards, each hinge takes one of the numbers that the markers beyond
    it bring and that hinges further out have left.
    """
    parent, links = model.links.parent, len(model.links.parent)
    numbers = np.zeros((links, len(seen)))
    for m, link in enumerate(model.link):
        numbers[link] += 3.0 * seen[:, m]
    told = np.zeros(len(seen))
    for link in range(links - 1, 0, -1):
        takes = numbers[link] > 0.0
        told += takes
        numbers[parent[link]] += numbers[link] - takes
    return told
