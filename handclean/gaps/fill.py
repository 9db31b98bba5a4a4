"""Fill the short gaps of a labelled take: the entry of this package."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.errors import TAKE, HandcleanError
from handclean.gaps import baselines, follow_posture
from handclean.gaps.filler import Filler, Refused, Scene
from handclean.gaps.posture import Posture, SolvedTake, bridge_posture
from handclean.gaps.runs import Gap, Limits, gaps_of, seen_in
from handclean.gaps.samples import with_samples
from handclean.gaps.settings import FillConfig
from handclean.hand.model import Model, marker_positions
from handclean.hand.subject import Subject
from handclean.ik.decide import DECIDED_SD
from handclean.ik.doubt import AngleUncertainty, uncertainty_of_take, zero_sigma
from handclean.ik.noise import marker_noise
from handclean.ik.prior import PosturePrior, knowing
from handclean.ik.residual_test import plausible
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import Solution, markers_of, solve_markers
from handclean.recording import Event, Motion, Recording, motion_from_poses

FILLERS: dict[str, Filler] = {
    "min-acceleration": follow_posture.follow,
    "coupled": follow_posture.follow,  # of another posture, see `bridge_posture`
    "linear": baselines.linear,
    "cubic": baselines.cubic,
    "spline": baselines.spline,
    "pattern": baselines.pattern,
    "rigid": baselines.rigid,
}
"""Ways to fill, by the name the setting ``method`` has for them."""

KIND = "gap"
"""Of every event of this package."""


@dataclass(frozen=True, kw_only=True)
class FillFigures:
    """What was filled.

    Attributes
    ----------
    method : name of the filler.
    gaps : gaps of the subject's markers; filled : how many of them were filled.
    missing_samples, filled_samples : samples in all gaps, in the filled ones.
    longest_filled_s : [s]
    sigma_m : [m] median sigma, per axis, of filled samples; 0 if none has one.
    bridged_frames : frames in which some joint or the root was interpolated.
    reasons : how many gaps were left open, by reason.
    """

    method: str
    gaps: int
    filled: int
    missing_samples: int
    filled_samples: int
    longest_filled_s: float
    sigma_m: float
    bridged_frames: int
    reasons: dict[str, int]

    @property
    def left_open(self) -> int:
        """Gaps that were not filled."""
        return self.gaps - self.filled


@dataclass(frozen=True, kw_only=True)
class _Filled:
    """Gaps with what became of them; (T, M, 3) [m] samples, (T, M) [m] their sigma.

    Sigma is per axis, as in `handclean.recording.Trajectories`.
    """

    gaps: list[Gap]
    places: Floats
    sigma: Floats


def fill(
    recording: Recording,
    subject: Subject,
    *,
    prior: PosturePrior | None = None,
    settings: FillConfig | None = None,
    solve: SolveConfig | None = None,
    name: str = "",
) -> tuple[Recording, FillFigures]:
    """Fill the short gaps of one hand's markers.

    The take is solved anew from its measured samples; samples filled earlier count as
    missing, so that filling twice is filling once. Measured samples come back bit for
    bit. A rejected sample (origin 3) that a fill replaces moves to the unlabelled
    points. Samples filled by the default method have a sigma: how far from the truth
    to expect them, per axis. The bridged motion comes with the take, and
    ``angles_sigma``: what markers, paths and prior leave open and the constant error of
    each joint's zero (see `ik.doubt`); none where nothing tells of a joint.

    Parameters
    ----------
    recording : a labelled take.
    subject : whose hand, with which markers.
    prior : posture subspace for joints the markers never decide.
    settings, solve : of the filling, of inverse kinematics.
    name : of the skeleton and motion; the hand's side when not given.

    Raises
    ------
    HandcleanError
        If the take has none of the subject's markers, or no rate.
    """
    settings = settings or FillConfig()
    solve = solve or SolveConfig()
    if not recording.rate > 0.0:
        raise HandcleanError(
            f"its rate is {recording.rate} Hz; gaps are limited in seconds, so "
            "it should be above 0",
            where=TAKE,
        )
    limits = Limits(
        longest=int(round(settings.max_gap_s * recording.rate, 6)),
        seed=settings.seed_frames,
        rate=recording.rate,
    )
    model, positions = subject.model, markers_of(recording, subject.model)
    prior = knowing(prior, model.tree.hinges)
    labels = recording.markers.labels if recording.markers else ()
    columns = {
        m: labels.index(label)
        for m, label in enumerate(model.labels)
        if label in labels
    }
    seen = seen_in(positions)
    gaps = [gap for gap in gaps_of(seen, limits) if gap.column in columns]
    solution = solve_markers(model, positions, prior=prior, settings=solve)
    noise = marker_noise(model, positions, solution, subject.marker_sigma)
    posture = bridge_posture(
        SolvedTake(
            model=model,
            positions=positions,
            expected=_expected(seen, gaps),
            solution=solution,
            noise=noise,
        ),
        limits,
        follows=prior is not None,
        coupled=settings.method == "coupled",
        settings=solve,
    )
    away = positions - marker_positions(model, posture.poses)
    scene = Scene(
        positions=positions, model=model, posture=posture, limits=limits, noise=noise
    )
    done = _fill_gaps(scene, gaps, settings.method)
    name = name or model.tree.side or model.tree.kind
    filled = replace(
        with_samples(recording, columns, done.places, done.sigma),
        skeletons={**recording.skeletons, name: model.tree},
        motions={
            **recording.motions,
            name: _motion(
                away,
                posture,
                solution,
                subject,
                _doubt(
                    subject, positions, posture, solution, noise, prior, solve.prior_m
                ),
                prior=prior is not None,
            ),
        },
        events=_events(recording, model, done.gaps, settings.method),
    )
    return filled, _figures(done, posture, settings.method, recording.rate)


def _expected(seen: Bools, gaps: list[Gap]) -> Bools:
    """(T, M) samples that are measured or missing only in a gap that may be filled."""
    expected = seen.copy()
    for gap in gaps:
        if not gap.refused:
            expected[gap.start : gap.stop, gap.column] = True
    return expected


def _fill_gaps(scene: Scene, gaps: list[Gap], method: str) -> _Filled:
    """Fill what can be filled; say of the rest why not."""
    places = np.full(scene.positions.shape, np.nan)
    sigma = np.full(scene.positions.shape[:2], np.nan)
    judged = []
    for gap in gaps:
        why = gap.refused
        if not why:
            rows = slice(gap.start, gap.stop)
            try:
                places[rows, gap.column] = FILLERS[method](scene, gap)
            except Refused as no:
                why = str(no)
            if not why and FILLERS[method] is follow_posture.follow:
                square = scene.posture.marker_variance[rows, gap.column]
                # square [m^2] is of the distance: a third of it is that of one axis.
                variance = square / 3.0 + scene.posture.leftovers.at(gap.frames)
                sigma[rows, gap.column] = np.sqrt(variance)
        judged.append(replace(gap, refused=why))
    return _Filled(gaps=judged, places=places, sigma=sigma)


def _doubt(
    subject: Subject,
    positions: Floats,
    posture: Posture,
    solution: Solution,
    noise: Floats,
    prior: PosturePrior | None,
    nominal_m: float,
) -> AngleUncertainty:
    """How uncertain angles are, without the constant offset of each angle.

    See `uncertainty_of_take`; what is bridged is as sure as its path. A 0 for a bridged
    frame says that its path has been judged already.
    """
    found = uncertainty_of_take(
        subject, positions, posture.poses, solution, noise, prior, nominal_m
    )
    bridged = posture.bridged
    return AngleUncertainty(
        root=np.where(posture.bridged_root, 0.0, found.root),
        hinges=np.where(bridged, posture.sigma, found.hinges),
        off=np.where(bridged, 0.0, found.off),
    )


def _motion(
    away: Floats,
    posture: Posture,
    solution: Solution,
    subject: Subject,
    uncertainty: AngleUncertainty,
    *,
    prior: bool,
) -> Motion:
    """Return the bridged motion.

    A frame is trusted if all of these hold:

    - markers and prior decide the posture, as in `solve`, or it was bridged;
    - the root is known;
    - with a prior, no doubt about root or hinges is beyond `DECIDED_SD`;
    - the residual is one that the subject's markers may have.
    """
    square = np.sum(away * away, axis=2)
    seen = np.isfinite(square)
    count = seen.sum(axis=1)
    mean = np.nansum(square, axis=1) / np.maximum(count, 1)
    residual = np.where(count > 0, np.sqrt(mean), np.nan)
    sigma = uncertainty.hinges
    known = solution.decided | posture.bridged_root
    if prior:
        known |= posture.bridged.any(axis=1)
        known &= (uncertainty.root <= DECIDED_SD.root_rad) & (
            sigma <= DECIDED_SD.hinge_rad
        ).all(axis=1)
        known &= (uncertainty.off <= DECIDED_SD.hinge_rad).all(axis=1)
    known &= ~posture.open_root
    return motion_from_poses(
        subject.model.tree.hinges,
        posture.poses,
        angles_sigma=np.sqrt(sigma**2 + zero_sigma(subject) ** 2),
        trusted=known & plausible(subject, seen, residual),
        residual=residual,
    )


def _events(
    recording: Recording, model: Model, gaps: list[Gap], method: str
) -> tuple[Event, ...]:
    """Events of a take with those of its gaps in place of an earlier run's."""
    kept = [
        event
        for event in recording.events
        if event.kind != KIND or event.marker not in model.labels
    ]
    for gap in gaps:
        marker = model.labels[gap.column]
        what = f"left open, {gap.refused}" if gap.refused else f"filled by {method}"
        kept.append(
            Event(
                start=gap.start,
                stop=gap.stop,
                text=f"gap in {marker}: {what}",
                kind=KIND,
                marker=marker,
            )
        )
    return tuple(sorted(kept, key=lambda event: (event.start, event.stop)))


def _figures(done: _Filled, posture: Posture, method: str, rate: float) -> FillFigures:
    filled = [gap.frames for gap in done.gaps if not gap.refused]
    sigma = done.sigma[np.isfinite(done.sigma)]
    why = Counter(gap.refused for gap in done.gaps if gap.refused)
    bridged = posture.bridged.any(axis=1) | posture.bridged_root
    return FillFigures(
        method=method,
        gaps=len(done.gaps),
        filled=len(filled),
        missing_samples=sum(gap.frames for gap in done.gaps),
        filled_samples=sum(filled),
        longest_filled_s=max(filled, default=0) / rate,
        sigma_m=float(np.median(sigma)) if len(sigma) else 0.0,
        bridged_frames=int(bridged.sum()),
        reasons=dict(why.most_common()),
    )
