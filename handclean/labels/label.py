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
from handclean.labels.checks.evidence import MOST, give_up
from handclean.labels.checks.side import expect_side
from handclean.labels.checks.unit import unit_hint
from handclean.labels.points import Cloud, cloud_of
from handclean.labels.search.align import Found
from handclean.labels.settings import LabelConfig
from handclean.labels.target import sought
from handclean.labels.track.tracker import REFUSED, Trace, rules_of
from handclean.labels.track_take import first_fit, pursue
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
    settings, solving = settings or LabelConfig(), SolveConfig()
    cloud = cloud_of(recording)
    thing = sought(subject, prior, name)
    rules = rules_of(settings, solving, recording.rate)
    found = first_fit(cloud, thing, rules, settings, solving)
    if found is None:
        right = unit_hint(cloud, subject.model) or (
            f"at least {max(4, len(thing.sigma) // 2)} of its {len(thing.sigma)} "
            "markers should be in view at once"
        )
        raise HandcleanError(
            f"the hand of '{subject.name}' is in none of its frames; {right}",
            where=TAKE,
        )
    trace = pursue(cloud, found, rules, settings, solving)
    if not trace.known.any():
        right = unit_hint(cloud, subject.model) or (
            "is it this hand, with these markers, and is the unit of length right?"
        )
        raise HandcleanError(
            f"the hand of '{subject.name}' could be followed in none of its "
            f"{cloud.frames} frames; {right}",
            where=TAKE,
        )
    shown = give_up(trace, int(rules.patience))
    if not trace.known.any():
        count = len(thing.sigma)
        right = (
            unit_hint(cloud, subject.model) or "is it this hand, with these markers?"
        )
        raise HandcleanError(
            f"{math.ceil(MOST * count)} of the {count} markers of the hand of "
            f"'{subject.name}' were never found together for a while (at most {shown} "
            f"at once), and fewer fit points of other things as well; {right}",
            where=TAKE,
        )
    near = plausible(subject, trace.chosen >= 0, trace.rms)
    wrong = "" if near[trace.known].any() else unit_hint(cloud, subject.model)
    if wrong:
        raise HandcleanError(
            f"no frame fits the hand of '{subject.name}'; {wrong}", where=TAKE
        )
    expect_side(cloud, subject, trace, prior, rules, settings, solving)
    return _result(recording, cloud, found, trace, prior, near)


def _result(
    recording: Recording,
    cloud: Cloud,
    found: Found,
    trace: Trace,
    prior: PosturePrior | None,
    near: Bools,
) -> tuple[Recording, LabelFigures]:
    thing = found.thing
    model = thing.model
    frames, markers = trace.chosen.shape
    has = trace.chosen >= 0
    rows = trace.chosen[has]
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
    labelled = Trajectories(
        positions=positions,
        labels=model.labels,
        model=(thing.name,) * markers,
        origin=np.where(has, np.uint8(Origin.MEASURED), np.uint8(Origin.MISSING)),
        confidence=trace.sure,
        source=source,
        residual=residual,
        cameras=cameras,
    )
    free = np.ones(len(cloud.at), dtype=bool)
    free[rows] = False
    motion = motion_from_poses(
        model.tree.hinges,
        trace.pose,
        residual=trace.rms,
        trusted=trace.known & near & decided(model, positions, trace.pose, prior),
    )
    figures = LabelFigures(
        frames=frames,
        followed=int(trace.known.sum()),
        start_frame=recording.numbering.of(found.frame),
        start_score=found.score,
        labelled=len(rows),
        unlabelled=int(free.sum()),
        refused=int((trace.fate == REFUSED).sum()),
        rms_m=float(np.sqrt(np.nanmean(trace.rms**2))),
        mean_confidence=float(trace.sure[has].mean()) if has.any() else 0.0,
    )
    out = replace(
        recording,
        markers=labelled,
        unlabelled=cloud.points(np.flatnonzero(free)),
        skeletons={**recording.skeletons, thing.name: model.tree},
        motions={**recording.motions, thing.name: motion},
        events=recording.events + _events(model.labels, trace),
    )
    return out, figures


def _events(labels: tuple[str, ...], trace: Trace) -> tuple[Event, ...]:
    """List gaps of each marker."""
    events = []
    for m, name in enumerate(labels):
        missing = np.concatenate([[0], (trace.chosen[:, m] < 0).astype(int), [0]])
        edges = np.diff(missing)
        for a, b in zip(
            np.flatnonzero(edges > 0), np.flatnonzero(edges < 0), strict=True
        ):
            text = f"gap of {name}"
            events.append(
                Event(start=int(a), stop=int(b), text=text, kind="lost", marker=name)
            )
    return tuple(sorted(events, key=lambda e: (e.start, e.stop)))
