"""Samples of a glove: readings with the rotations that were known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.api import glove_files
from handclean.commands.shared import glove_known, glove_sources
from handclean.commands.shared.choices import GloveSampling
from handclean.commands.shared.glove_known import GloveRecording, Sampled, Stated
from handclean.errors import FileError, UsageError
from handclean.glove import claims
from handclean.glove import readings as checks
from handclean.glove import samples as samples_of
from handclean.glove.gloves import Glove
from handclean.glove.samples import Samples
from handclean.remarks import Remark, of_file, remark
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

_MANY_DOUBLES_SHARE = 0.5
"""[-] share of samples with another's readings that is worth a warning (chosen)."""


def calibrate_glove_sample(
    sources: tuple[Source, ...], settings: GloveSampling
) -> Outcome:
    """Sample readings in one of four modes."""
    mode = _mode(sources[0], settings)
    glove = _glove(sources[0], settings)
    known = glove_known.stated(settings, glove, mode)
    parts = [_of_file(source, settings, glove, mode, known) for source in sources]
    merged = samples_of.merged([part.sampled.samples for part in parts])
    if not len(merged.readings):
        frames = sum(part.frames for part in parts)
        raise FileError(sources[0].path, *_nothing(sources[0], mode, frames))
    figures = {"glove": glove.name, "mode": mode, **_figures(merged, parts, mode)}

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        glove_files.write_samples(path, merged, glove, provenance)

    return Outcome(
        line=_line(figures),
        figures=figures,
        remarks=(*known.remarks, *_all_of(parts), *_doubles(merged)),
        writers=(write,),
    )


@dataclass(frozen=True, kw_only=True)
class _File:
    """What was made of one file.

    Attributes
    ----------
    frames : that might have become samples.
    unusable : frames left out, as not all sensors read.
    """

    source: Source
    sampled: Sampled
    frames: int
    unusable: int
    remarks: tuple[Remark, ...]


def _of_file(
    source: Source, settings: GloveSampling, glove: Glove, mode: str, known: Stated
) -> _File:
    """Make samples of one file of readings."""
    found, times, readings = glove_sources.whole(source, glove)
    inside = (times >= times[0] + settings.sample.skip_s) & (
        times <= times[-1] - settings.sample.skip_s
    )
    good = np.flatnonzero(inside & checks.usable(glove, readings))
    if not len(good):
        raise FileError(source.path, "has no frame in which all sensors read")
    one = GloveRecording(
        source=source,
        times=times,
        readings=checks.smooth(glove, times, readings, settings.sample.cutoff_hz),
        rows=good[samples_of.spread(len(good), settings.sample.most)],
        subject=str(found.facts.get("subject", "")),
    )
    remarks = list(checks.remarks(glove, readings, mode != "pose"))
    if mode == "pose" and (text := claims.moved(glove, times, readings, good)):
        remarks.append(remark("fit", f"{text}; is all of it the pose?"))
    sampled = glove_known.sampled(one, settings, glove, mode, known)
    remarks += sampled.remarks
    if not len(sampled.samples.readings):
        remarks.append(remark("few", "gave no sample"))
    return _File(
        source=source,
        sampled=sampled,
        frames=len(one.rows),
        unusable=int(inside.sum()) - len(good),
        remarks=tuple(remarks),
    )


def _all_of(parts: Sequence[_File]) -> list[Remark]:
    """Remarks on all files, each with its file."""
    return [said for p in parts for said in of_file(p.source.path, p.remarks)]


def _figures(merged: Samples, parts: Sequence[_File], mode: str) -> dict[str, Any]:
    known = np.flatnonzero(np.isfinite(merged.targets).any(axis=0))
    figures: dict[str, Any] = {
        "left_out": sum(part.unusable + part.sampled.left_out for part in parts)
    }
    for part in parts:
        if (offset := part.sampled.offset) is not None:
            figures |= {"offset_s": offset.seconds, "likeness": offset.correlation}
    figures |= {
        "samples": len(merged.readings),
        "kind": "IK" if mode == "touch" else "FK",
        "rotations": [merged.rotations[r] for r in known],
    }
    touched = [part.sampled for part in parts if len(part.sampled.apart)]
    if touched:
        apart = np.concatenate([one.apart for one in touched])
        moved = np.concatenate([one.moved for one in touched])
        figures["apart_mm"] = float(1e3 * np.median(apart))
        figures["moved_deg"] = float(np.degrees(np.sqrt(np.mean(moved**2))))
    return figures


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
    return glove_sources.glove_of(source, settings.glove)


def _doubles(samples: Samples) -> list[Remark]:
    """Remark that readings come twice, as key poses of a coarse converter do."""
    count = len(samples.readings) - len(np.unique(samples.readings, axis=0))
    if count < _MANY_DOUBLES_SHARE * len(samples.readings):
        return []
    text = f"{count} of {len(samples.readings)} samples have the readings of another"
    return [remark("few", text, count=count)]
