"""Which raw point is which marker: the entry of labelling."""

import math
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bytes, Floats32, Ints
from handclean.errors import HandcleanError
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.ik.settings import SolveConfig
from handclean.kernels.gauss_newton import make_work
from handclean.labels.align import Found, search
from handclean.labels.ghosts import usual
from handclean.labels.models import Sought, sought
from handclean.labels.points import Cloud, cloud_of
from handclean.labels.settings import LabelConfig
from handclean.labels.track import (
    REFUSED,
    UNIT,
    Book,
    Rules,
    Trace,
    follow,
    make_trace,
)
from handclean.recording import (
    Event,
    Origin,
    Recording,
    Trajectories,
    motion_from_poses,
)

HAND_VOLUME = 8e-3
"""[m^3] a cube the length of a hand."""


@dataclass(frozen=True, kw_only=True)
class LabelFigures:
    """What labelling did.

    Attributes
    ----------
    frames : T; followed : how many of them the model was followed in.
    start_frame : where it was found first, -1 nowhere.
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


def rules_of(
    settings: LabelConfig, solving: SolveConfig, thing: Sought, rate: float
) -> Rules:
    """Return the tracker's numbers for a frame rate [Hz]."""
    ghosts = settings.ghosts_per_hand / HAND_VOLUME
    volume = (2.0 * math.pi) ** 1.5 * UNIT**3
    fall = 0.25 * settings.acceleration_m_s2 / rate**2
    return Rules(
        seen_price=2.0 * math.log(99.0 / (ghosts * volume)),
        gone_price=2.0 * math.log(0.03 / (ghosts * volume)),
        floor=math.hypot(2e-4, fall),
        drift=settings.drift_m_s / rate,
        reach=settings.reach_m,
        strict=settings.strict,
        small=settings.small_m,
        lever=solving.lever_m,
    )


def new_book(thing: Sought, rules: Rules, gone: Ints) -> Book:
    """Return the state of the markers at the start."""
    markers = len(thing.sigma)
    return Book(
        bias=np.zeros((markers, 3)),
        surprise=(thing.sigma**2 / 3.0 + (2.0 * rules.floor) ** 2 + 1e-6),
        gone=gone.astype(np.int64),
        usual=usual(thing.sigma),
    )


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
        If the hand is found nowhere in the take.
    """
    settings, solving = settings or LabelConfig(), SolveConfig()
    cloud = cloud_of(recording)
    thing = sought(subject, prior, name)
    found = first_fit(cloud, thing, settings, solving)
    if found is None:
        raise HandcleanError(
            f"take: the hand of '{subject.name}' is in none of its frames; "
            f"at least {max(4, len(thing.sigma) // 2)} of its {len(thing.sigma)} "
            "markers should be in view at once"
        )
    trace = track(cloud, found, settings, solving, recording.rate)
    return _result(recording, cloud, found, trace)


def first_fit(
    cloud: Cloud, thing: Sought, settings: LabelConfig, solving: SolveConfig
) -> Found | None:
    """Find the model in the best of the early, full frames."""
    counts = np.diff(cloud.start)
    markers = len(thing.sigma)
    if cloud.frames == 0 or counts.max() < max(4, markers // 2):
        return None
    full = min(markers, int(np.percentile(counts, 90)))
    rows = np.flatnonzero(counts >= full)
    if len(rows) == 0:
        rows = np.flatnonzero(counts >= max(4, markers // 2))
    picked = np.unique(
        rows[np.linspace(0, len(rows) - 1, settings.start_frames).astype(int)]
    )
    best: Found | None = None
    for postures, rotations, keep in ((4, 0, 8), (len(thing.starts), 30, 30)):
        for frame in picked:
            points = cloud.at[cloud.start[frame] : cloud.start[frame + 1]]
            ways = search(
                points,
                thing,
                int(frame),
                alpha=settings.alpha,
                solving=solving,
                postures=postures,
                rotations=rotations,
                keep=keep,
            )
            if ways and (best is None or ways[0].score < best.score):
                best = ways[0]
            if best is not None and _good(best):
                return best
    return best


def _good(one: Found) -> bool:
    """Whether a fit is as close as the model promises, with hardly a marker missing."""
    usual_rms = float(np.sqrt(np.mean(one.thing.sigma**2)))
    missing = float(np.mean(one.chosen < 0))
    return one.rms < 1.5 * usual_rms and missing <= 0.1


def track(
    cloud: Cloud,
    found: Found,
    settings: LabelConfig,
    solving: SolveConfig,
    rate: float,
) -> Trace:
    """Follow a model from where it was found to both ends of the take."""
    thing = found.thing
    markers, hinges = len(thing.sigma), len(thing.mean)
    rules = rules_of(settings, solving, thing, rate)
    trace = make_trace(cloud.frames, markers, hinges)
    work = make_work(hinges, markers, thing.basis.shape[1])
    numbers = (solving.damping, solving.enough_m, solving.prior_m)
    gone = (found.chosen < 0).astype(np.int64)
    for stop, by in ((cloud.frames, 1), (-1, -1)):
        follow(
            cloud.at,
            cloud.start,
            found.frame,
            stop,
            by,
            found.pose,
            thing.chain,
            work,
            thing.mean,
            thing.basis,
            numbers,
            rules,
            new_book(thing, rules, gone),
            trace,
        )
    return trace


def _result(
    recording: Recording, cloud: Cloud, found: Found, trace: Trace
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
        model.tree.hinges, trace.pose, residual=trace.rms, trusted=trace.known
    )
    figures = LabelFigures(
        frames=frames,
        followed=int(trace.known.sum()),
        start_frame=found.frame,
        start_score=found.score,
        labelled=len(rows),
        unlabelled=int(free.sum()),
        refused=int((trace.fate == REFUSED).sum()),
        rms_m=float(np.sqrt(np.nanmean(trace.rms**2)))
        if trace.known.any()
        else math.nan,
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
            events.append(Event(start=int(a), stop=int(b), text=f"gap of {name}"))
    return tuple(sorted(events, key=lambda e: (e.start, e.stop)))
