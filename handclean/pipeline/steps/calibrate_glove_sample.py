"""Samples of a glove: readings with the rotations that were known."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.errors import FileError, HandcleanError, UsageError
from handclean.glove import readings as checks
from handclean.glove import samples as samples_of
from handclean.glove import touch
from handclean.glove.calibrate import predict_measured
from handclean.glove.gloves import Glove
from handclean.glove.poses import key_pose
from handclean.glove.samples import FK, IK, Samples
from handclean.glove.smooth import smoothed
from handclean.glove.streams import at_times, find_offset
from handclean.io import files
from handclean.pipeline import glove_files
from handclean.pipeline.batch import Source
from handclean.pipeline.choices import GloveSampling
from handclean.pipeline.outcome import Entry, Outcome

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


def calibrate_glove_sample(
    sources: tuple[Source, ...], settings: GloveSampling
) -> Outcome:
    """Sample readings in one of four modes."""
    mode = _mode(sources[0], settings)
    glove = _glove(sources[0], settings)
    parts, warnings = [], []
    figures: dict[str, Any] = {"glove": glove.name, "mode": mode, "left_out": 0}
    for source in sources:
        found, times, readings = glove_files.whole(source, glove)
        moving = mode != "pose"
        told = checks.remarks(glove, readings, moving)
        warnings += [f"{source.path.name}: {text}" for text in told]
        inside = (times >= times[0] + settings.sample.skip_s) & (
            times <= times[-1] - settings.sample.skip_s
        )
        good = np.flatnonzero(inside & checks.usable(glove, readings))
        figures["left_out"] += int(inside.sum()) - len(good)
        if not len(good):
            raise FileError(source.path, "has no frame in which all sensors read")
        rows = good[samples_of.spread(len(good), settings.sample.most)]
        readings = smoothed(times, readings, settings.sample.cutoff_hz)
        facts = found.facts.get("subject", "")
        one = _sampled(
            source, settings, glove, mode, times, readings, rows, figures, str(facts)
        )
        parts.append(one)
    merged = samples_of.merged(parts)
    if not len(merged.readings):
        raise HandcleanError(
            f"{sources[0].path}: in none of {len(rows)} frames could fingertips be "
            "brought together; --start CALIBRATION may begin nearer"
        )
    warnings += _doubles(merged)
    known = np.flatnonzero(np.isfinite(merged.targets).any(axis=0))
    kind = "IK" if mode == "touch" else "FK"
    names = [merged.rotations[r] for r in known]
    figures |= {"samples": len(merged.readings), "kind": kind, "rotations": names}

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        glove_files.write_samples(path, merged, glove, provenance)

    line = f"{len(merged.readings)} {kind} samples of {len(names)} rotations"
    if "offset_s" in figures:
        line += (
            f"; glove's clock {figures['offset_s']:+.3f} s, "
            f"correlation {figures['likeness']:.2f}"
        )
    if "apart_mm" in figures:
        line += f"; readings were {figures['moved_deg']:.1f} degrees from touching"
    if figures["left_out"]:
        line += f"; {figures['left_out']} frames left out"
    return Outcome(
        line=line, figures=figures, warnings=tuple(warnings), writers=(write,)
    )


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
            f"{what}: give one of --pose NAME, --hold JOINT=DEG, --touch thumb,index, "
            "--markers TAKE"
        )
    return modes[0]


def _glove(source: Source, settings: GloveSampling) -> Glove:
    if "start" in source.files and not (settings.glove or "glove" in source.files):
        return glove_files.read_calibration(source.files["start"]).glove
    return glove_files.glove_of(source, settings.glove)


def _sampled(
    source: Source,
    settings: GloveSampling,
    glove: Glove,
    mode: str,
    times: Floats,
    readings: Floats,
    rows: Any,
    figures: dict[str, Any],
    subject: str,
) -> Samples:
    """Samples of one file; figures of touching and of clocks are added."""
    hand, kind = glove.hand, FK
    if mode == "pose":
        try:
            pose = key_pose(settings.pose)
        except HandcleanError as error:
            raise UsageError(str(error)) from None
        targets = samples_of.of_pose(hand, pose, len(rows))
        about = f"pose {settings.pose}"
    elif mode == "hold":
        holds = _holds(settings.holds)
        targets = samples_of.of_hold(glove, holds, len(rows))
        about = "hold " + " ".join(settings.holds)
    elif mode == "touch":
        targets = _touch(source, settings, glove, readings[rows], figures)
        about, kind = f"touch {settings.touch}", IK
    else:
        targets = _markers(source, settings, glove, times, readings, rows, figures)
        about = f"markers {source.files['markers'].name}"
    about = f"{about} ({source.path.name})"
    return samples_of.make_samples(glove, readings[rows], targets, kind, about, subject)


def _holds(texts: tuple[str, ...]) -> Mapping[str, float]:
    holds = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            angle = float(value)
        except ValueError:
            angle = float("nan")
        if not (name and equals and np.isfinite(angle)):
            raise UsageError(f"--hold: '{text}' should be like IM_ABD=20, in degrees")
        holds[name.strip()] = float(np.radians(angle))
    return holds


def _touch(
    source: Source,
    settings: GloveSampling,
    glove: Glove,
    readings: Floats,
    figures: dict[str, Any],
) -> Floats:
    """(N, R) [rad] rotations that bring fingertips together; NaN where they do not."""
    tree, _ = glove_files.tree_of(source, glove)
    fingers = [name.strip() for name in settings.touch.split(",") if name.strip()]
    chains = touch.chains_of(glove, tree, fingers)
    if "start" in source.files:
        begun = glove_files.read_calibration(source.files["start"])
        if begun.glove.sensors != glove.sensors:
            raise UsageError(
                f"--start {source.files['start']}: is of glove {begun.glove.name}, "
                f"the readings are of {glove.name}"
            )
        start, variance = predict_measured(begun, readings)
        sigma = np.sqrt(np.nan_to_num(variance, nan=_UNKNOWN_SIGMA**2))
        sigma = np.maximum(sigma, _LEAST_SIGMA)
    else:
        start, sigma = checks.rescaled(glove, readings), touch.start_sigma(glove)
    met = touch.meet(glove, chains, start, sigma)
    reached: Bools = met.apart <= settings.sample.reach_m
    figures["left_out"] += int((~reached).sum())
    if reached.any():
        moved = (met.rotations - start)[reached]
        figures["apart_mm"] = float(1e3 * np.median(met.apart[reached]))
        figures["moved_deg"] = float(np.degrees(np.sqrt(np.nanmean(moved**2))))
    out = np.full((len(readings), len(glove.hand.rotations)), np.nan)
    own = [glove.hand.index(row.rotation) for row in glove.measured]
    out[:, own] = np.where(reached[:, None], met.rotations, np.nan)
    return out


def _markers(
    source: Source,
    settings: GloveSampling,
    glove: Glove,
    times: Floats,
    readings: Floats,
    rows: Any,
    figures: dict[str, Any],
) -> Floats:
    """(N, R) [rad] rotations of a solved take at the glove's times."""
    path = source.files["markers"]
    take = files.read(path)
    motions = {
        name: motion
        for name, motion in take.motions.items()
        if name not in take.skeletons or take.skeletons[name].kind == "hand"
    }
    if not motions:
        raise FileError(path, "has no joint angles", "'handclean solve' adds them")
    if len(motions) > 1 and source.side not in motions:
        raise UsageError(
            f"--markers {path}: has {' and '.join(motions)}; --side should choose"
        )
    motion = motions.get(source.side) or next(iter(motions.values()))
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
            times,
            readings[:, [glove.sensors.index(row.measured_by) for row in measured]],
            take.times,
            rotations[:, [places[k] for k in own]],
            settings.sample.max_offset_s,
        )
    except HandcleanError as error:
        raise FileError(source.path, f"with {path.name}: {error}") from None
    figures |= {"offset_s": offset.seconds, "likeness": offset.likeness}
    return at_times(take.times, rotations, times[rows] + offset.seconds)


def _doubles(samples: Samples) -> list[str]:
    """Say that readings come twice, as key poses of a coarse converter do."""
    count = len(samples.readings) - len(np.unique(samples.readings, axis=0))
    if count < 0.5 * len(samples.readings):
        return []
    return [f"{count} of {len(samples.readings)} samples have the readings of another"]
