"""A scanned hand and labelled takes of it become one subject.

The first take's first second places the markers on the skin (`markers`). If the takes
show a range of motion, `calibrate` then refines joints, axes and places, with that hand
as what it expects, closely, instead of a template.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handclean.errors import HandcleanError
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.ik.solve import solve_markers
from handclean.recording import Recording
from handclean.subject.calibrate import calibrate
from handclean.subject.frames import (
    LEAST_FRAMES,
    LEAST_MARKER_SHARE,
    Frames,
    gather,
    thinned,
)
from handclean.subject.report import CalibrationReport
from handclean.subject.scan.markers import Placed, place
from handclean.subject.settings import CalibrateConfig
from handclean.tree import POSE_HEAD

NEUTRAL_S = 1.0
"""[s] at the start of the first take in which the hand is held still (chosen)."""

MOST_FRAMES_LOOKED_AT, LEAST_MOVING_ANGLES = 200, 5
"""Frames that are looked at, and joints that must move in them, to be a range of motion
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Located:
    """A scanned hand with its markers.

    Attributes
    ----------
    subject : with skin and markers.
    placed : what the neutral frames told.
    report : of the range of motion; None if the takes show none.
    """

    subject: Subject
    placed: Placed
    report: CalibrationReport | None


def locate_markers(
    scanned: Subject,
    takes: Sequence[Recording],
    marker_set: MarkerSet,
    settings: CalibrateConfig,
    *,
    name: str = "",
    names: Sequence[str] = (),
) -> Located:
    """Find markers on a scanned hand; and with takes that move, the hand more closely.

    The scanned skin stays as it is: joints that takes move a little move inside it.

    Parameters
    ----------
    scanned : a subject with a skin.
    takes : labelled; the first begins with the hand held still and flat.
    name : whose hand it is; the scan's when not given.
    names : what remarks call the takes; "take 1", "take 2" when not given.

    Raises
    ------
    UnknownNameError
        If a take lacks a marker of the set.
    UsageError
        If the subject has no skin.
    HandcleanError
        If the first second of the first take does not show every marker.
    """
    every = gather(takes, marker_set.labels)
    placed = place(scanned, marker_set, _neutral(every))
    name = name or scanned.name
    errors = dict(scanned.errors)
    arm = placed.on.face < 0
    errors["neutral_rms_m"] = placed.rms_m
    errors["neutral_set_rms_m"] = placed.start_rms_m
    errors["marker_height_m"] = float(np.median(placed.on.lift[~arm]))
    if not _moves(placed.model, every, settings.moved_rad):
        return Located(
            subject=replace(
                scanned,
                name=name,
                model=placed.model,
                marker_set=marker_set.name,
                marker_sigma=np.full(len(placed.model.labels), np.nan),
                errors=errors,
            ),
            placed=placed,
            report=None,
        )
    side = scanned.model.tree.side
    found, report = calibrate(
        takes,
        marker_set,
        settings,
        side=side,
        name=name,
        known=placed.model,
        names=names,
    )
    return Located(
        subject=replace(
            found, surface=scanned.surface, errors={**errors, **found.errors}
        ),
        placed=placed,
        report=report,
    )


def _neutral(every: Frames) -> Frames:
    """Frames of the first take's first second that show most markers."""
    first = (every.take == 0) & (every.frame < NEUTRAL_S * every.rates[0])
    rows = np.flatnonzero(first & (every.seen.mean(axis=1) >= LEAST_MARKER_SHARE))
    if not len(rows):
        raise HandcleanError(
            "calibrate-hand: the first second of the first take hardly shows a marker; "
            "it should begin with the hand held still, flat, as in the scan"
        )
    return every.only(rows)


def _moves(model: Model, every: Frames, moved_rad: float) -> bool:
    """Whether several joints move enough to tell where they are."""
    shown = np.flatnonzero(every.seen.mean(axis=1) >= LEAST_MARKER_SHARE)
    frames = every.only(shown)
    frames = frames.only(thinned(frames, MOST_FRAMES_LOOKED_AT))
    if len(frames) < LEAST_FRAMES:
        return False
    targets = np.where(frames.seen[:, :, None], frames.targets, np.nan)
    angles = solve_markers(model, targets).poses[:, POSE_HEAD:]
    low, high = np.percentile(angles, [5.0, 95.0], axis=0)
    return int(np.count_nonzero(high - low > moved_rad)) >= LEAST_MOVING_ANGLES
