"""What is known of a glove's recording: a pose, widgets, touching fingertips, a take.

Each gives the (N, R) rotations [rad] of frames that may become samples.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from handclean.api import glove_files
from handclean.arrays import Bools, Floats, Ints
from handclean.commands.shared import glove_sources, sessions
from handclean.commands.shared.choices import GloveSampling
from handclean.commands.shared.take_options import options_of
from handclean.errors import FileError, HandcleanError, Place, UsageError
from handclean.glove import claims, reach, touch
from handclean.glove import readings as checks
from handclean.glove import samples as samples_of
from handclean.glove.calibration import predict_measured
from handclean.glove.gloves import Glove
from handclean.glove.poses import key_pose, place_of
from handclean.glove.samples import FK, IK, Samples
from handclean.glove.streams import Offset, at_times, find_offset
from handclean.recording import Motion, Recording
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source

_LEAST_SIGMA_RAD = np.radians(1.5)
"""[rad] no rotation of a calibration is surer, where touching starts (chosen)."""

_UNKNOWN_SIGMA_RAD = np.radians(10.0)
"""[rad] of rotations that are not calibrated, where touching starts (chosen)."""

_MOST_FROM_TOUCHING_DEG, _MOST_RAW_FROM_TOUCHING_DEG = 12.0, 20.0
"""[degrees] from touching at which fingers may not have touched (chosen): from a
calibration, and from readings linearly rescaled, which coupling leads astray."""


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What a pose or widgets state.

    Attributes
    ----------
    rotations : (R,) [rad], NaN where nothing is stated.
    about : what was recorded: "pose flat".
    remarks : what is odd about it.
    """

    rotations: Floats
    about: str = ""
    remarks: tuple[Remark, ...] = ()


@dataclass(frozen=True, kw_only=True)
class GloveRecording:
    """One file of readings, of which frames are sampled.

    Attributes
    ----------
    times : (T,) [s].
    readings : (T, S) smoothed.
    rows : (N,) frames that may become samples.
    subject : who wore the glove, or "".
    """

    source: Source
    times: Floats
    readings: Floats
    rows: Ints
    subject: str


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Samples of one file, and what was found out on the way.

    Attributes
    ----------
    samples : the samples.
    left_out : frames in which fingertips did not reach each other.
    apart, moved : of fingers that touched: [m] between tips, [rad] to there.
    offset : of the glove's clock, where a take was recorded with it.
    remarks : what is odd.
    """

    samples: Samples
    left_out: int = 0
    apart: Floats = field(default_factory=lambda: np.zeros(0))
    moved: Floats = field(default_factory=lambda: np.zeros(0))
    offset: Offset | None = None
    remarks: tuple[Remark, ...] = ()


def stated(settings: GloveSampling, glove: Glove, mode: str) -> Stated:
    """Return what a pose or widgets state; nothing in the other modes.

    Raises
    ------
    UsageError
        If no hand can do it, or the glove measures nothing of it.
    """
    try:
        if mode == "pose":
            return _stated_by_pose(settings.pose, glove)
        if mode == "hold":
            return _stated_by_widgets(settings.holds, glove)
    except HandcleanError as error:
        raise UsageError.of(error) from None
    return Stated(rotations=np.full(len(glove.hand.rotations), np.nan))


def _stated_by_pose(name: str, glove: Glove) -> Stated:
    where = place_of(name)
    pose = key_pose(name)
    remarks = claims.expect_pose(where, glove.hand, pose)
    rotations = samples_of.of_pose(glove.hand, pose, 1)[0]
    claims.expect_measured(where, glove, rotations)
    return Stated(rotations=rotations, about=f"pose {name}", remarks=remarks)


def _stated_by_widgets(texts: tuple[str, ...], glove: Glove) -> Stated:
    holds = _holds(texts)
    for name, angle in holds.items():
        held = samples_of.of_hold(glove, {name: angle}, 1)[0]
        claims.expect_measured(f"--hold {name}", glove, held)
    rotations = samples_of.of_hold(glove, holds, 1)[0]
    remarks = claims.expect_reachable("--hold", glove.hand, rotations)
    about = "hold " + " ".join(texts)
    return Stated(rotations=rotations, about=about, remarks=remarks)


def _holds(texts: tuple[str, ...]) -> Mapping[str, float]:
    """Rotations that widgets hold [rad], of "ROTATION=DEGREES"."""
    holds: dict[str, float] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            angle = float(value)
        except ValueError:
            angle = float("nan")
        if not (name and equals and np.isfinite(angle)):
            raise UsageError(f"--hold: '{text}' should be like IM_ABD=20, in degrees")
        if name.strip() in holds:
            raise UsageError(f"--hold {name.strip()}: is given twice")
        holds[name.strip()] = float(np.radians(angle))
    return holds


def sampled(
    one: GloveRecording, settings: GloveSampling, glove: Glove, mode: str, known: Stated
) -> Sampled:
    """Make samples of one file.

    Raises
    ------
    FileError, UsageError
        If what was recorded with it does not fit.
    """
    if mode == "touch":
        return _touching(one, settings, glove)
    if mode == "markers":
        return _with_markers(one, settings, glove)
    targets = np.tile(known.rotations, (len(one.rows), 1))
    return Sampled(samples=_samples(one, glove, targets, FK, known.about))


def _samples(
    one: GloveRecording, glove: Glove, targets: Floats, kind: int, about: str
) -> Samples:
    about = f"{about} ({one.source.path.name})"
    readings = one.readings[one.rows]
    return samples_of.make_samples(glove, readings, targets, kind, about, one.subject)


def _touching(one: GloveRecording, settings: GloveSampling, glove: Glove) -> Sampled:
    """Samples of rotations that bring fingertips together, where they reach."""
    tree, _ = glove_sources.tree_of(one.source, glove)
    fingers = [name.strip() for name in settings.touch.split(",") if name.strip()]
    chains = reach.chains_of(glove, tree, fingers)
    start, sigma = _start(one, glove)
    met = touch.meet(glove, chains, start, sigma)
    reached: Bools = met.apart <= settings.sample.reach_m
    moved = (met.rotations - start)[reached]
    moved = moved[np.isfinite(moved)]
    targets = np.full((len(one.rows), len(glove.hand.rotations)), np.nan)
    own = [glove.hand.index(row.rotation) for row in glove.measured]
    targets[:, own] = np.where(reached[:, None], met.rotations, np.nan)
    return Sampled(
        samples=_samples(one, glove, targets, IK, f"touch {settings.touch}"),
        left_out=int((~reached).sum()),
        apart=met.apart[reached],
        moved=moved,
        remarks=_far_from_touching(one, fingers, moved) if reached.any() else (),
    )


def _start(one: GloveRecording, glove: Glove) -> tuple[Floats, Floats]:
    """(N, R') [rad] rotations from which fingertips are moved, and their sigma."""
    readings = one.readings[one.rows]
    path = one.source.files.get("start")
    if path is None:
        return checks.rescaled(glove, readings), touch.start_sigma(glove)
    begun = glove_files.read_calibration(path)
    if begun.glove.sensors != glove.sensors:
        raise UsageError(
            f"is of glove {begun.glove.name}, the readings are of {glove.name}",
            where=Place(path, option="--start"),
        )
    start, variance = predict_measured(begun, readings)
    sigma = np.sqrt(np.nan_to_num(variance, nan=_UNKNOWN_SIGMA_RAD**2))
    return start, np.maximum(sigma, _LEAST_SIGMA_RAD)


def _far_from_touching(
    one: GloveRecording, fingers: list[str], moved: Floats
) -> tuple[Remark, ...]:
    """Remark on fingers that were too far apart to have touched."""
    degrees = float(np.degrees(np.sqrt(np.mean(moved**2))))
    near = "start" in one.source.files
    if degrees <= (_MOST_FROM_TOUCHING_DEG if near else _MOST_RAW_FROM_TOUCHING_DEG):
        return ()
    right = "" if near else " --start CALIBRATION begins nearer"
    text = (
        f"readings were {degrees:.0f} degrees from touching: did "
        f"{' and '.join(fingers)} touch?{right}"
    )
    return (remark("fit", text, fingers=fingers, off_deg=degrees),)


def _with_markers(
    one: GloveRecording, settings: GloveSampling, glove: Glove
) -> Sampled:
    """Samples of the rotations of a solved take at the glove's times."""
    path = one.source.files["markers"]
    take = sessions.read(Source(path=path))
    rotations = _rotations(take, one.source, path, glove)
    offset = _offset(one, take, rotations, settings.sample.max_offset_s, glove)
    times = one.times[one.rows] + offset.seconds
    targets = at_times(take.times, rotations, times)
    return Sampled(
        samples=_samples(one, glove, targets, FK, f"markers {path.name}"),
        offset=offset,
        remarks=take.remarks,
    )


def _rotations(take: Recording, source: Source, path: Path, glove: Glove) -> Floats:
    """(T', R) [rad] rotations of the one hand in a take; NaN where not trusted."""
    motions = {
        name: motion
        for name, motion in take.motions.items()
        if name not in take.skeletons or take.skeletons[name].kind == "hand"
    }
    if not motions:
        raise FileError(path, "has no joint angles", "'handclean solve' adds them")
    side = options_of(source).side
    if len(motions) > 1 and side not in motions:
        raise UsageError(
            f"has {' and '.join(motions)}; --side should choose",
            where=Place(path, option="--markers"),
        )
    motion: Motion = motions.get(side) or next(iter(motions.values()))
    angles = motion.angles.copy()
    if motion.trusted is not None:
        angles[~motion.trusted] = np.nan
    return samples_of.of_hinges(glove.hand, motion.names, angles)


def _offset(
    one: GloveRecording, take: Recording, rotations: Floats, most: float, glove: Glove
) -> Offset:
    """Find by how much the clocks of glove and take differ, by [s] at most."""
    path = one.source.files["markers"]
    places = [glove.hand.index(row.rotation) for row in glove.measured]
    own = [k for k, r in enumerate(places) if np.isfinite(rotations[:, r]).any()]
    if not own:
        raise FileError(path, "has no angle the glove measures")
    sensors = [glove.sensors.index(glove.measured[k].measured_by) for k in own]
    try:
        return find_offset(
            one.times,
            one.readings[:, sensors],
            take.times,
            rotations[:, [places[k] for k in own]],
            most,
        )
    except HandcleanError as error:
        raise FileError(one.source.path, f"with {path.name}: {error}") from None
