"""Which raw point is which marker: the entry of labelling."""

import math
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Bytes, Floats32
from handclean.errors import TAKE, HandcleanError
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.ik.residual_test import plausible
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import decided
from handclean.labels.checks.evidence import MANY_MARKERS_SHARE, drop_unproven
from handclean.labels.checks.side import expect_side
from handclean.labels.checks.unit import unit_hint
from handclean.labels.points import Cloud, cloud_of
from handclean.labels.search.align import FrameFit
from handclean.labels.settings import LabelConfig
from handclean.labels.target import TrackTarget, make_target
from handclean.labels.track.state import REJECTED, TrackResult
from handclean.labels.track.tracker import track_setup
from handclean.labels.track_take import fewest_points, find_first_fit, track_take
from handclean.recording import (
    Event,
    Origin,
    Recording,
    Trajectories,
    motion_from_poses,
)


@dataclass(frozen=True, kw_only=True)
class LabelFigures:
    """What labelling did.

    Attributes
    ----------
    frames : T; followed : how many of them the model was followed in.
    start_frame : the source's number of the frame in which it was found first.
    start_score : equation 2 there.
    labelled, unlabelled : numbers of points.
    refused : points refused by the distance threshold.
    rms_m : [m] of the labelled points' distance from the model.
    mean_confidence : of the labelled points.
    """

    frames: int
    followed: int
    start_frame: int
    start_score: float
    labelled: int
    unlabelled: int
    refused: int
    rms_m: float
    mean_confidence: float


def label(
    recording: Recording,
    subject: Subject,
    *,
    prior: PosturePrior | None = None,
    settings: LabelConfig | None = None,
    name: str = "",
) -> tuple[Recording, LabelFigures]:
    """Give every measured point the name of the marker it is, or none.

    Names the take already has are ignored. Nothing measured is changed or lost: a
    labelled sample is a bit-exact copy, and what is not labelled is ``unlabelled``.

    Parameters
    ----------
    name : of the skeleton and motion; the hand's side when not given.

    Raises
    ------
    HandcleanError
        If the hand is found nowhere in the take, cannot be followed anywhere, what was
        followed need not be it (see `evidence`), or is the other hand (see `side`).
    """
    setup = track_setup(settings or LabelConfig(), SolveConfig(), recording.rate)
    cloud = cloud_of(recording)
    target = make_target(subject, prior, name)
    found = find_first_fit(cloud, target, setup)
    if found is None:
        right = unit_hint(cloud, subject.model) or (
            f"at least {fewest_points(target)} of its {len(target.sigma)} "
            "markers should be in view at once"
        )
        raise HandcleanError(
            f"the hand of '{subject.name}' is in none of its frames; {right}",
            where=TAKE,
        )
    result = track_take(cloud, found, setup)
    fits = _expect_this_hand(cloud, subject, result, int(setup.rules.lost_after))
    expect_side(cloud, subject, result, prior, setup)
    return _labelled(recording, cloud, found, result, prior, fits)


def _expect_this_hand(
    cloud: Cloud, subject: Subject, result: TrackResult, patience: int
) -> Bools:
    """Expect that what was tracked is this hand, in this unit of length.

    Parameters
    ----------
    result : stretches that never show the hand are dropped from it (see `evidence`).
    patience : frames without the hand that do not end a stretch.

    Returns
    -------
    (T,) whether a frame fits as well as the subject's markers promise.

    Raises
    ------
    HandcleanError
        If it is not.
    """
    if not result.tracked.any():
        right = unit_hint(cloud, subject.model) or (
            "is it this hand, with these markers, and is the unit of length right?"
        )
        raise HandcleanError(
            f"the hand of '{subject.name}' could be followed in none of its "
            f"{cloud.frames} frames; {right}",
            where=TAKE,
        )
    shown = drop_unproven(result, patience)
    if not result.tracked.any():
        count = result.chosen.shape[1]
        right = (
            unit_hint(cloud, subject.model) or "is it this hand, with these markers?"
        )
        raise HandcleanError(
            f"{math.ceil(MANY_MARKERS_SHARE * count)} of the {count} markers of the "
            f"hand of '{subject.name}' were never found together for a while (at most "
            f"{shown} at once), and fewer fit points of other things as well; {right}",
            where=TAKE,
        )
    fits = plausible(subject, result.chosen >= 0, result.rms)
    wrong = "" if fits[result.tracked].any() else unit_hint(cloud, subject.model)
    if wrong:
        raise HandcleanError(
            f"no frame fits the hand of '{subject.name}'; {wrong}", where=TAKE
        )
    return fits


def _labelled(
    recording: Recording,
    cloud: Cloud,
    found: FrameFit,
    result: TrackResult,
    prior: PosturePrior | None,
    fits: Bools,
) -> tuple[Recording, LabelFigures]:
    """Return the recording with its labels, poses and gaps, and what was done.

    Parameters
    ----------
    fits : (T,) whether a frame fits as well as the subject's markers promise.
    """
    target = found.target
    model = target.model
    markers = _trajectories(cloud, target, result)
    rows = result.chosen[result.chosen >= 0]
    free = np.ones(len(cloud.at), dtype=bool)
    free[rows] = False
    settled = decided(model, markers.positions, result.pose, prior)
    motion = motion_from_poses(
        model.tree.hinges,
        result.pose,
        residual=result.rms,
        trusted=result.tracked & fits & settled,
    )
    out = replace(
        recording,
        markers=markers,
        unlabelled=cloud.points(np.flatnonzero(free)),
        skeletons={**recording.skeletons, target.name: model.tree},
        motions={**recording.motions, target.name: motion},
        events=recording.events + _events(model.labels, result),
    )
    start_frame = recording.numbering.of(found.frame)
    return out, _figures(found, start_frame, result, int(free.sum()))


def _trajectories(
    cloud: Cloud, target: TrackTarget, result: TrackResult
) -> Trajectories:
    """Return the labelled points as trajectories of the target's markers."""
    frames, markers = result.chosen.shape
    has = result.chosen >= 0
    rows = result.chosen[has]
    positions = np.full((frames, markers, 3), np.nan)
    positions[has] = cloud.at[rows]
    source = np.full((frames, markers), -1, dtype=np.int32)
    source[has] = cloud.column[rows]
    residual: Floats32 | None = None
    cameras: Bytes | None = None
    if cloud.residual is not None:
        residual = np.full((frames, markers), np.nan, dtype=np.float32)
        residual[has] = cloud.residual[rows]
    if cloud.cameras is not None:
        cameras = np.zeros((frames, markers), dtype=np.uint8)
        cameras[has] = cloud.cameras[rows]
    return Trajectories(
        positions=positions,
        labels=target.model.labels,
        model=(target.name,) * markers,
        origin=np.where(has, np.uint8(Origin.MEASURED), np.uint8(Origin.MISSING)),
        confidence=result.confidence,
        source=source,
        residual=residual,
        cameras=cameras,
    )


def _figures(
    found: FrameFit, start_frame: int, result: TrackResult, unlabelled: int
) -> LabelFigures:
    """Return what was done, in numbers.

    Parameters
    ----------
    start_frame : the source's number of the frame that was found first.
    unlabelled : how many points have no name.
    """
    has = result.chosen >= 0
    return LabelFigures(
        frames=len(has),
        followed=int(result.tracked.sum()),
        start_frame=start_frame,
        start_score=found.score,
        labelled=int(has.sum()),
        unlabelled=unlabelled,
        refused=int((result.outcome == REJECTED).sum()),
        rms_m=float(np.sqrt(np.nanmean(result.rms**2))),
        mean_confidence=float(result.confidence[has].mean()) if has.any() else 0.0,
    )


def _events(labels: tuple[str, ...], result: TrackResult) -> tuple[Event, ...]:
    """List gaps of each marker."""
    events = []
    for m, name in enumerate(labels):
        missing = np.concatenate([[0], (result.chosen[:, m] < 0).astype(int), [0]])
        edges = np.diff(missing)
        for a, b in zip(
            np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True
        ):
            text = f"gap of {name}"
            events.append(
                Event(start=int(a), stop=int(b), text=text, kind="lost", marker=name)
            )
    return tuple(sorted(events, key=lambda e: (e.start, e.stop)))
