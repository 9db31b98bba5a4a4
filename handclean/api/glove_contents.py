"""What is in samples and calibrations of gloves."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.api import glove_files
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
