"""Samples of a glove: readings with the rotations that were known."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.commands.shared import glove_files, sessions
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
from handclean.glove.streams import at_times, find_offset
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome

FIGURES = {
    "glove": "its name",
    "mode": "pose, hold, touch or markers",
    "samples": "readings with known rotations",
    "kind": "FK, for other wearers too, or IK, for this one",
    "rotations": "rotations that are known in some sample",
    "left_out": "frames left out: not usable, or fingertips did not reach each other",
    "apart_mm": "median distance of fingertips from where they touch",
    "moved_deg": "RMS angle between where readings put rotations and where they touch",
    "offset_s": "what to add to the glove's clock to have the markers'",
    "likeness": "correlation of the two streams at that offset",
}

_LEAST_SIGMA = np.radians(1.5)
_UNKNOWN_SIGMA = np.radians(10.0)

_FAR_DEG, _FAR_RAW_DEG = 12.0, 20.0
"""Degrees from touching at which fingers may not have touched: from a calibration, and
from readings linearly rescaled, which coupling leads astray."""


@dataclass(frozen=True, kw_only=True)
class _Recording:
    """One file: what is sampled of it, and what was found out on the way.

    Attributes
    ----------
    times : (T,) [s].
    readings : (T, S) smoothed.
    rows : frames that may become samples.
    apart, moved : of fingers that touched: [m] between tips, [rad] RMS to there.
    figures, warnings : are added to.
    several : whether there are other files.
    """

    source: Source
    times: Floats
    readings: Floats
    rows: Ints
    subject: str
    figures: dict[str, Any]
    warnings: list[str]
    several: bool
    apart: list[Floats]
    moved: list[Floats]

    def warn(self, text: str) -> None:
        """Add a remark about this file, named if it is one of several."""
        name = f"{self.source.path.name}: " if self.several else ""
        self.warnings.append(name + text)


def calibrate_glove_sample(
    sources: tuple[Source, ...], settings: GloveSampling
) -> Outcome:
    """Sample readings in one of four modes."""
    mode = _mode(sources[0], settings)
    glove = _glove(sources[0], settings)
    figures: dict[str, Any] = {"glove": glove.name, "mode": mode, "left_out": 0}
    stated, about, told = _stated(settings, glove, mode)
    warnings = list(told)
    parts, frames = [], 0
    apart: list[Floats] = []
    moved: list[Floats] = []
    for source in sources:
        found, times, readings = glove_files.whole(source, glove)
        inside = (times >= times[0] + settings.sample.skip_s) & (
            times <= times[-1] - settings.sample.skip_s
        )
        good = np.flatnonzero(inside & checks.usable(glove, readings))
        figures["left_out"] += int(inside.sum()) - len(good)
        if not len(good):
            raise FileError(source.path, "has no frame in which all sensors read")
        one = _Recording(
            source=source,
            times=times,
            readings=checks.smooth(glove, times, readings, settings.sample.cutoff_hz),
            rows=good[samples_of.spread(len(good), settings.sample.most)],
            subject=str(found.facts.get("subject", "")),
            figures=figures,
            warnings=warnings,
            several=len(sources) > 1,
            apart=apart,
            moved=moved,
        )
        for text in checks.remarks(glove, readings, mode != "pose"):
            one.warn(text)
        if mode == "pose" and (text := claims.moved(glove, times, readings, good)):
            one.warn(f"{text}; is all of it the pose?")
        part = _sampled(one, settings, glove, mode, stated, about)
        if not len(part.readings):
            one.warn("gave no sample")
        parts.append(part)
        frames += len(one.rows)
    merged = samples_of.merged(parts)
    if not len(merged.readings):
        raise FileError(sources[0].path, *_nothing(sources[0], mode, frames))
    warnings += _doubles(merged)
    known = np.flatnonzero(np.isfinite(merged.targets).any(axis=0))
    kind = "IK" if mode == "touch" else "FK"
    names = [merged.rotations[r] for r in known]
    figures |= {"samples": len(merged.readings), "kind": kind, "rotations": names}
    if apart:
        figures["apart_mm"] = float(1e3 * np.median(np.concatenate(apart)))
        mean = np.mean(np.concatenate(moved) ** 2)
        figures["moved_deg"] = float(np.degrees(np.sqrt(mean)))

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        glove_files.write_samples(path, merged, glove, provenance)

    return Outcome(
        line=_line(figures), figures=figures, warnings=tuple(warnings), writers=(write,)
    )


def _line(figures: Mapping[str, Any]) -> str:
    count, rotations = figures["samples"], len(figures["rotations"])
    line = (
        f"{count} {figures['kind']} sample{'s' * (count != 1)} of "
        f"{rotations} rotation{'s' * (rotations != 1)}"
    )
    if "offset_s" in figures:
        line += (
            f"; glove's clock {figures['offset_s']:+.3f} s, "
            f"correlation {figures['likeness']:.2f}"
        )
    if "apart_mm" in figures:
        line += f"; readings were {figures['moved_deg']:.1f} degrees from touching"
    if left_out := figures["left_out"]:
        line += f"; {left_out} frame{'s' * (left_out != 1)} left out"
    return line


def _nothing(source: Source, mode: str, frames: int) -> tuple[str, str]:
    """Say why there is no sample, and what would help."""
    none = f"in none of {frames} frames"
    if mode == "touch":
        start = "--start CALIBRATION may begin nearer"
        if "start" in source.files:
            start = "did these fingers touch?"
        return f"{none} could fingertips be brought together", start
    if mode == "markers":
        return (
            f"{none} does {source.files['markers'].name} tell a trusted angle",
            "was it recorded at the same time?",
        )
    return f"{none} are there smoothed readings of all sensors", "--cutoff-hz 0?"


def _mode(source: Source, settings: GloveSampling) -> str:
    given = {
        "pose": bool(settings.pose),
        "hold": bool(settings.holds),
        "touch": bool(settings.touch),
        "markers": "markers" in source.files,
    }
    modes = [name for name, is_given in given.items() if is_given]
    if len(modes) != 1:
        what = " and ".join(f"--{m}" for m in modes) or "nothing that is known"
        raise UsageError(
            "give one of --pose NAME, --hold JOINT=DEG, --touch thumb,index, "
            "--markers TAKE",
            where=what,
        )
    return modes[0]


def _glove(source: Source, settings: GloveSampling) -> Glove:
    if "start" in source.files and not (settings.glove or "glove" in source.files):
        return glove_files.read_calibration(source.files["start"]).glove
    return glove_files.glove_of(source, settings.glove)


def _stated(
    settings: GloveSampling, glove: Glove, mode: str
) -> tuple[Floats, str, tuple[str, ...]]:
    """(R,) [rad] rotations a pose or widgets state, NaN where none; what; remarks."""
    hand = glove.hand
    try:
        if mode == "pose":
            where = place_of(settings.pose)
            pose = key_pose(settings.pose)
            told = claims.expect_pose(where, hand, pose)
            stated = samples_of.of_pose(hand, pose, 1)[0]
            claims.expect_measured(where, glove, stated)
            return stated, f"pose {settings.pose}", told
        if mode == "hold":
            holds = _holds(settings.holds)
            for name, angle in holds.items():
                held = samples_of.of_hold(glove, {name: angle}, 1)[0]
                claims.expect_measured(f"--hold {name}", glove, held)
            stated = samples_of.of_hold(glove, holds, 1)[0]
            told = claims.expect_reachable("--hold", hand, stated)
            return stated, "hold " + " ".join(settings.holds), told
    except HandcleanError as error:
        raise UsageError.of(error) from None
    return np.full(len(hand.rotations), np.nan), "", ()


def _sampled(
    one: _Recording,
    settings: GloveSampling,
    glove: Glove,
    mode: str,
    stated: Floats,
    about: str,
) -> Samples:
    """Samples of one file; figures of touching and of clocks are added."""
    kind, readings = FK, one.readings[one.rows]
    if mode == "touch":
        targets = _touch(one, settings, glove, readings)
        about, kind = f"touch {settings.touch}", IK
    elif mode == "markers":
        targets = _markers(one, settings, glove)
        about = f"markers {one.source.files['markers'].name}"
    else:
        targets = np.tile(stated, (len(readings), 1))
    about = f"{about} ({one.source.path.name})"
    return samples_of.make_samples(glove, readings, targets, kind, about, one.subject)


def _holds(texts: tuple[str, ...]) -> Mapping[str, float]:
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


def _touch(
    one: _Recording, settings: GloveSampling, glove: Glove, readings: Floats
) -> Floats:
    """(N, R) [rad] rotations that bring fingertips together; NaN where they do not."""
    source = one.source
    tree, _ = glove_files.tree_of(source, glove)
    fingers = [name.strip() for name in settings.touch.split(",") if name.strip()]
    chains = reach.chains_of(glove, tree, fingers)
    if "start" in source.files:
        begun = glove_files.read_calibration(source.files["start"])
        if begun.glove.sensors != glove.sensors:
            raise UsageError(
                f"is of glove {begun.glove.name}, the readings are of {glove.name}",
                where=Place(source.files["start"], option="--start"),
            )
        start, variance = predict_measured(begun, readings)
        sigma = np.sqrt(np.nan_to_num(variance, nan=_UNKNOWN_SIGMA**2))
        sigma = np.maximum(sigma, _LEAST_SIGMA)
    else:
        start, sigma = checks.rescaled(glove, readings), touch.start_sigma(glove)
    met = touch.meet(glove, chains, start, sigma)
    reached: Bools = met.apart <= settings.sample.reach_m
    one.figures["left_out"] += int((~reached).sum())
    if reached.any():
        moved = (met.rotations - start)[reached]
        moved = moved[np.isfinite(moved)]
        one.apart.append(met.apart[reached])
        one.moved.append(moved)
        degrees = float(np.degrees(np.sqrt(np.mean(moved**2))))
        begun_near = "start" in source.files
        if degrees > (_FAR_DEG if begun_near else _FAR_RAW_DEG):
            right = "" if begun_near else " --start CALIBRATION begins nearer"
            one.warn(
                f"readings were {degrees:.0f} degrees from touching: did "
                f"{' and '.join(fingers)} touch?{right}"
            )
    out = np.full((len(readings), len(glove.hand.rotations)), np.nan)
    own = [glove.hand.index(row.rotation) for row in glove.measured]
    out[:, own] = np.where(reached[:, None], met.rotations, np.nan)
    return out


def _markers(one: _Recording, settings: GloveSampling, glove: Glove) -> Floats:
    """(N, R) [rad] rotations of a solved take at the glove's times."""
    source = one.source
    path = source.files["markers"]
    take = sessions.read(given := Source(path=path))
    for trap in sessions.traps(given, take):
        one.warn(f"{path.name}: {trap}")
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
    motion = motions.get(side) or next(iter(motions.values()))
    angles = motion.angles.copy()
    if motion.trusted is not None:
        angles[~motion.trusted] = np.nan
    rotations = samples_of.of_hinges(glove.hand, motion.names, angles)
    places = [glove.hand.index(row.rotation) for row in glove.measured]
    own = [k for k, r in enumerate(places) if np.isfinite(rotations[:, r]).any()]
    if not own:
        raise FileError(path, "has no angle the glove measures")
    measured = [glove.measured[k] for k in own]
    try:
        offset = find_offset(
            one.times,
            one.readings[:, [glove.sensors.index(row.measured_by) for row in measured]],
            take.times,
            rotations[:, [places[k] for k in own]],
            settings.sample.max_offset_s,
        )
    except HandcleanError as error:
        raise FileError(source.path, f"with {path.name}: {error}") from None
    one.figures.update(offset_s=offset.seconds, likeness=offset.correlation)
    return at_times(take.times, rotations, one.times[one.rows] + offset.seconds)


def _doubles(samples: Samples) -> list[str]:
    """Say that readings come twice, as key poses of a coarse converter do."""
    count = len(samples.readings) - len(np.unique(samples.readings, axis=0))
    if count < 0.5 * len(samples.readings):
        return []
    return [f"{count} of {len(samples.readings)} samples have the readings of another"]
