"""What is in samples and calibrations of gloves."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.commands.shared import glove_files
from handclean.errors import HandcleanError
from handclean.glove.gloves import Glove
from handclean.glove.samples import FK, IK
from handclean.io.hdf5.file import read_h5
from handclean.io.hdf5.provenance import provenance_from
from handclean.io.shared.reading import reported, with_remarks
from handclean.remarks import Remark, remark


def inspect_glove(path: Path, about: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is in samples or a calibration, as plain JSON values.

    Parameters
    ----------
    about : what `handclean.io.files.inspect` found; that is all there is to say of a
        file that is damaged, but for a remark that says so.
    """
    look = _samples if about["format"] == glove_files.SAMPLES else _calibration
    try:
        steps = provenance_from(read_h5(path, about["format"]))
        made = [str(entry.get("command", "?")) for entry in steps]
        return {"format": about["format"], **look(path), "steps": made}
    except HandcleanError as error:
        return with_remarks(about, (), [remark("damage", error.wrong)])


def _samples(path: Path) -> dict[str, Any]:
    samples, glove = glove_files.read_samples(path)
    known = np.isfinite(samples.targets)
    counts = np.bincount(samples.group, minlength=len(samples.groups))
    rotations = {
        row.rotation: _kinds(samples.kind[known[:, glove.hand.index(row.rotation)]])
        for row in glove.measured
        if known[:, glove.hand.index(row.rotation)].any()
    }
    return {
        "glove": samples.glove,
        "wearer": samples.subject,
        "readings": len(samples.readings),
        "kinds": _kinds(samples.kind),
        "recordings": dict(zip(samples.groups, counts.tolist(), strict=True)),
        "rotations": rotations,
        "rotations_measured": len(glove.measured),
        **reported([]),
    }


def _kinds(kind: Any) -> dict[str, int]:
    """How many samples there are for any wearer, and for this one alone."""
    return {
        "fk": int(np.count_nonzero(kind == FK)),
        "ik": int(np.count_nonzero(kind == IK)),
    }


def _calibration(path: Path) -> dict[str, Any]:
    found = glove_files.read_calibration(path)
    rotations = {
        one.rotation: {
            "fk": one.fk,
            "ik": one.ik,
            "sensors": list(one.sensors),
            "floor_deg": float(np.degrees(one.floor)),
        }
        for one in found.fits
    }
    donning = found.donning
    return {
        "glove": found.glove.name,
        "wearer": found.subject,
        "model": found.kind,
        "use": found.use,
        "rotations": rotations,
        "rotations_measured": len(found.glove.measured),
        "repeat_deg": float(np.degrees(found.repeat)),
        "worn_again": donning is not None,
        "doubt_deg": None if donning is None else float(np.degrees(donning.doubt)),
        **reported(_without(found.glove, list(rotations))),
    }


def _without(glove: Glove, rotations: Sequence[str]) -> list[Remark]:
    rest = [row.rotation for row in glove.measured if row.rotation not in rotations]
    text = f"no model of {', '.join(rest)}"
    return [remark("unobserved", text, rotations=rest)] if rest else []


def in_words(figures: Mapping[str, Any]) -> list[str]:
    """Say what is in such a file, a part at a time."""
    words = [figures["glove"]]
    if figures["wearer"]:
        words.append(f"on {figures['wearer']}")
    rotations = (
        f"{len(figures['rotations'])} of {figures['rotations_measured']} rotations"
    )
    if "model" in figures:
        samples = "all" if figures["use"] == "all" else figures["use"].upper()
        words.append(f"{figures['model']} from {samples} samples")
        words.append(rotations)
        if figures["worn_again"]:
            doubt = f"{figures['doubt_deg']:.1f} degrees in doubt"
            words.append(f"for another donning, {doubt}")
        return words
    words.append(_counted(figures["kinds"]))
    count = len(figures["recordings"])
    words.append(f"{count} recording{'s' * (count != 1)}")
    return [*words, f"{rotations} known"]


def rows(figures: Mapping[str, Any]) -> str:
    """Rotations, and recordings where the file tells of them, one a line."""
    lines = [
        f"{count:6d} samples of {name}"
        for name, count in figures.get("recordings", {}).items()
    ]
    for name, one in figures["rotations"].items():
        line = f"{name:>24} from {_counted(one)}"
        if "floor_deg" in one:
            line += f", floor {one['floor_deg']:.1f} degrees"
        lines.append(line)
    return "\n".join(lines)


def _counted(kinds: Mapping[str, Any]) -> str:
    parts = [f"{kinds[kind]} {kind.upper()}" for kind in ("fk", "ik") if kinds[kind]]
    return f"{' and '.join(parts) or 'no'} samples"
