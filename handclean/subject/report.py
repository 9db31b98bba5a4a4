"""What a calibration found, as figures and as remarks."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.remarks import Remark, remark
from handclean.subject.frames import LEAST_FRAMES, Frames
from handclean.subject.judge import Fit
from handclean.tree import ROOT_DOFS, JointTree

NOISY_SD_M = 0.001
"""[m] noise from which on it is remarked on (chosen)."""


@dataclass(frozen=True, kw_only=True)
class CalibrationReport:
    """Figures of a calibration, and remarks on it.

    Attributes
    ----------
    side : of the hand; size : its length against the template's.
    frames : of all takes; frames_usable : with enough markers.
    frames_used : the hand was learnt from; the others taught nothing new.
    frames_held_out : frames the error was measured on, by a hand learnt from the rest.
    train_rms_m : [m] root mean square distance of markers in the frames used.
    heldout_rms_m : [m] in those held out, over every measured sample; NaN if none.
    heldout_kept_rms_m : [m] the same without doubtful samples.
    heldout_by_marker_m : [m] that per marker; NaN if never measured there.
    doubtful : share of held-out samples that fit no posture (wrong labels, ghosts).
    noise_m : [m] noise of a marker, each way, that the adjustment found.
    camera_noise_m : [m] the part of it that changes from frame to frame.
    lengths_m, lengths_sigma_m : [m] by joint: distance from the joint before it, and
        how well that is known.
    moved_rad : [rad] by hinge: its range; 0 if hardly a marker beyond it was measured.
    poorly_moved : hinges that moved too little.
    iterations : steps of the last adjustments.
    remarks : what its owner should know.
    """

    side: str
    size: float
    frames: int
    frames_usable: int
    frames_used: int
    frames_held_out: int
    train_rms_m: float
    heldout_rms_m: float
    heldout_kept_rms_m: float
    heldout_by_marker_m: Mapping[str, float]
    doubtful: float
    noise_m: float
    camera_noise_m: float
    lengths_m: Mapping[str, float]
    lengths_sigma_m: Mapping[str, float]
    moved_rad: Mapping[str, float]
    poorly_moved: tuple[str, ...]
    iterations: int
    remarks: tuple[Remark, ...] = field(default=())


def remarks_on_joints(
    hinges: tuple[str, ...], went: Floats, still: Bools, left: Bools
) -> list[Remark]:
    """Say which joints moved too little.

    Parameters
    ----------
    went : (D, 2) [rad] from where to where, NaN where hardly a marker shows it.
    still : (D,) which moved too little; left : (D,) whose axes were left alone.
    """
    found: list[Remark] = []
    for d in np.flatnonzero(still):
        verb = "are" if left[d] else "lean on"
        if np.isfinite(went[d]).all():
            degrees = f"{np.degrees(went[d, 1] - went[d, 0]):.0f} degrees"
            kind, what = "few", f"{hinges[d]} moved only {degrees}"
        else:
            kind = "unobserved"
            what = (
                f"{hinges[d]}: no marker beyond it was measured in {LEAST_FRAMES} "
                "frames or more"
            )
        found.append(
            remark(
                kind,
                f"{what}: its axis and place {verb} the template's",
                joint=hinges[d],
            )
        )
    return found


def remarks_on_markers(
    labels: tuple[str, ...], every: Frames, looked_at: Frames, fit: Fit
) -> list[Remark]:
    """Say which markers were never measured, and which labels are doubtful.

    Parameters
    ----------
    every : all frames of the takes; looked_at : those that ``fit`` is of.
    """
    found: list[Remark] = []
    for m, label in enumerate(labels):
        if not every.seen[:, m].any():
            found.append(
                remark(
                    "unseen",
                    f"{label} was never measured: its place is the template's",
                    marker=label,
                )
            )
        odd = np.flatnonzero(fit.doubtful[:, m])
        if len(odd):
            take, frame = looked_at.take[odd[0]], looked_at.frame[odd[0]]
            first, name = every.numberings[take].of(frame), every.called(take)
            where = f"frame {first}" + (f" of {name}" if len(every.rates) > 1 else "")
            found.append(
                remark(
                    "fit",
                    f"{label} does not fit the other markers in {len(odd)} of "
                    f"{len(looked_at)} frames looked at, first in {where}: are it and "
                    "its neighbours labelled right?",
                    frames=(first, first),
                    marker=label,
                    count=len(odd),
                    take=name,
                )
            )
    return found


def remarks_on_equations(frames: Frames, tree: JointTree) -> list[Remark]:
    """Say when there are too few markers to decide a posture."""
    numbers = ROOT_DOFS + len(tree.hinges)
    measured = float(np.median(frames.seen.sum(axis=1)))
    if 3 * measured >= numbers:
        return []
    text = (
        f"{measured:.0f} markers cannot decide the {numbers} numbers of a pose: "
        "lengths and places lean on the template's"
    )
    return [remark("few", text, markers=measured, numbers=numbers)]


def remarks_on_noise(camera_m: float) -> list[Remark]:
    """Say when noise is so large that it makes fingers long (see ``adjust``)."""
    if camera_m < NOISY_SD_M:
        return []
    text = (
        f"markers are noisy ({1e3 * camera_m:.1f} mm each way): fingers come out a "
        "little long, by more than their standard deviations say"
    )
    return [remark("implausible", text, noise_m=camera_m)]


def remarks_on_side(side: str, clear: bool) -> list[Remark]:
    """Say when markers do not tell a left hand from a right one."""
    if clear:
        return []
    text = f"the other hand would fit about as well: make sure it is a {side} one"
    return [remark("subject", text, side=side)]
