"""Samples and calibrations of gloves as files (HDF5)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.errors import FileError, HandcleanError
from handclean.glove.calibration import Calibration, Donning, RotationFit
from handclean.glove.definitions import glove_from_text, to_toml
from handclean.glove.gloves import Glove
from handclean.glove.models import from_arrays
from handclean.glove.samples import Samples
from handclean.io.glove.inspect import is_readings
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Array, Fact, Part, expect_finite
from handclean.io.hdf5.provenance import provenance_item

SAMPLES = "handclean glove samples"
CALIBRATION = "handclean glove calibration"

_ARITHMETIC = (TypeError, ArithmeticError)
"""What comes of arrays of another shape, and of infinite counts."""

_DONNING = ("middle", "shift", "gain")
"""Arrays of a donning, in the file's group "wearing"."""


def write_samples(
    path: Path, samples: Samples, glove: Glove, provenance: Sequence[Mapping[str, Any]]
) -> None:
    """Write samples, with the glove they are of.

    Parameters
    ----------
    path : of the ``.h5``.
    samples : N readings (N, S) with rotations (N, R) [rad].
    provenance : the steps that made them.
    """
    items: dict[str, Any] = {
        "definition": to_toml(glove),
        "sensors": list(samples.sensors),
        "rotations": list(samples.rotations),
        "readings": Array(samples.readings),
        "targets": Array(samples.targets, "rad"),
        "kind": Array(samples.kind),
        "group": Array(samples.group),
        "groups": list(samples.groups),
        **provenance_item(provenance),
    }
    attrs = {"glove": samples.glove, "subject": samples.subject}
    write_h5(path, SAMPLES, Part(attrs, items))


def read_samples(path: Path) -> tuple[Samples, Glove]:
    """Read samples and the glove they are of.

    Raises
    ------
    FileError
        If the file is not one.
    """
    part = _part(path, SAMPLES, "'calibrate-glove sample' makes samples of readings")
    expect_finite(part, unknown=("readings", "targets"))
    glove = glove_from_text(path, _definition(part))
    sensors, rotations = part.names("sensors"), part.names("rotations")
    readings = part.array("readings", "", np.float64, None, len(sensors))
    count = len(readings)
    groups = part.names("groups")
    group = part.array("group", "", np.int64, count)
    if count and not 0 <= group.min() <= group.max() < len(groups):
        raise part.fail(f"group should be 0 to {len(groups) - 1}")
    if (sensors, rotations) != (glove.sensors, glove.hand.rotations):
        raise part.fail("its sensors or rotations are not those of its glove")
    samples = Samples(
        glove=part.text("glove"),
        subject=part.text("subject", ""),
        sensors=sensors,
        rotations=rotations,
        readings=readings,
        targets=part.array("targets", "rad", np.float64, count, len(rotations)),
        kind=part.array("kind", "", np.uint8, count),
        group=group,
        groups=groups,
    )
    return samples, glove


def _part(path: Path, kind: str, right: str) -> Part:
    """Read a file of ours; readings and files of other suffixes are told from it."""
    other = path.suffix.lower() != ".h5" and path.is_file()
    if other or is_readings(path):
        what = kind.removeprefix("handclean glove ")
        raise FileError(path, f"holds no {what} of a glove", right)
    return read_h5(path, kind)


def _definition(part: Part) -> str:
    found = part.items.get("definition")
    if not isinstance(found, str):
        raise part.fail("has no definition of its glove")
    return found


def write_calibration(
    path: Path, calibration: Calibration, provenance: Sequence[Mapping[str, Any]]
) -> None:
    """Write a calibration, with the glove it is of.

    Parameters
    ----------
    path : of the ``.h5``.
    provenance : the steps that made it.
    """
    fits = {}
    for one in calibration.fits:
        arrays = one.fitted.to_arrays()
        fits[one.rotation] = Part(
            {
                "kind": one.fitted.kind,
                "fk": one.fk,
                "ik": one.ik,
                "scale": one.scale,
                "floor": one.floor,
            },
            {
                "sensors": list(one.sensors),
                "model": Part(items={k: Array(v) for k, v in arrays.items()}),
            },
        )
    donning = {}
    if (found := calibration.donning) is not None:
        parts = {name: Array(getattr(found, name)) for name in _DONNING}
        donning = {"wearing": Part({"doubt": found.doubt}, parts)}
    items: dict[str, Any] = {
        "definition": to_toml(calibration.glove),
        "low": Array(calibration.low),
        "high": Array(calibration.high),
        "rotations": Part(items=fits),
        **donning,
        **provenance_item(provenance),
    }
    attrs: dict[str, Fact] = {
        "glove": calibration.glove.name,
        "kind": calibration.kind,
        "use": calibration.use,
        "subject": calibration.subject,
        "repeat": calibration.repeat,
    }
    write_h5(path, CALIBRATION, Part(attrs, items))


def read_calibration(path: Path) -> Calibration:
    """Read a calibration.

    Raises
    ------
    FileError
        If the file is not one.
    """
    part = _part(path, CALIBRATION, "'calibrate-glove fit' makes one of samples")
    expect_finite(part, unknown=("low", "high"))
    glove = glove_from_text(path, _definition(part))
    fits = tuple(
        _rotation_fit(part, rotation, one, glove)
        for rotation, one in part.part("rotations").parts()
    )
    if not fits:
        raise part.fail("has no model of any rotation")
    order = [row.rotation for row in glove.measured]
    count = len(glove.sensors)
    used = sorted({glove.sensors.index(name) for fit in fits for name in fit.sensors})
    ends = {name: part.array(name, "", np.float64, count) for name in ("low", "high")}
    for name, values in ends.items():
        if not np.isfinite(values[used]).all():
            raise part.fail(f"{name} is not known of every sensor that is used")
    return Calibration(
        glove=glove,
        kind=part.text("kind"),
        use=part.text("use", "all"),
        subject=part.text("subject", ""),
        fits=tuple(sorted(fits, key=lambda fit: order.index(fit.rotation))),
        **ends,
        repeat=part.number("repeat", 0.0),
        donning=_donning(part, count),
    )


def _rotation_fit(whole: Part, rotation: str, part: Part, glove: Glove) -> RotationFit:
    """Read the model of one rotation, a part of the whole calibration."""
    sensors = part.names("sensors")
    measured = [row.rotation for row in glove.measured]
    if rotation not in measured or not set(sensors) <= set(glove.sensors):
        raise whole.fail(f"its model of {rotation} is not one of its glove")
    arrays = {
        name: np.asarray(item.values, dtype=np.float64)
        for name, item in part.part("model").items.items()
        if isinstance(item, Array)
    }
    try:
        return RotationFit(
            rotation=rotation,
            sensors=sensors,
            fitted=from_arrays(part.text("kind"), arrays),
            fk=int(part.number("fk", 0)),
            ik=int(part.number("ik", 0)),
            scale=part.number("scale", 1.0),
            floor=part.number("floor", 0.0),
        )
    except (HandcleanError, LookupError, ValueError, *_ARITHMETIC) as error:
        why = (str(error).splitlines() or [type(error).__name__])[0]
        raise part.fail(f"its model does not fit together ({why})") from None


def _donning(part: Part, sensors: int) -> Donning | None:
    """Read how the calibration's donning differs from that of its samples."""
    if "wearing" not in part.items:
        return None
    found = part.part("wearing")
    arrays = {name: found.array(name, "", np.float64, sensors) for name in _DONNING}
    return Donning(**arrays, doubt=found.number("doubt"))
