"""A calibration for another donning, from a few samples of it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from handclean.api import glove_files
from handclean.commands.shared.choices import GloveRewearing
from handclean.errors import FileError, HandcleanError, UsageError
from handclean.glove import samples as samples_of
from handclean.glove.donning import Adapted, adapt_to_donning
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome

FIGURES = {
    "glove": "its name",
    "samples": "samples with a rotation that is calibrated",
    "before_deg": "how far the calibration was from them [degrees]",
    "after_deg": "how far it is now [degrees]",
    "shift_deg": "of each sensor, in degrees of what it measures",
    "gain": "of each sensor",
    "scale": "of what usually changes, that was most probable",
    "doubt_deg": "what stays in doubt of the donning [degrees]",
}

_MOST_USUAL_FACTOR = 3.0
"""[-] of the usual change, above which there is a warning (chosen)."""


def calibrate_glove_rewear(
    sources: tuple[Source, ...], settings: GloveRewearing
) -> Outcome:
    """Adapt a calibration to another donning."""
    given = sources[0].files.get("calibration")
    if given is None:
        raise UsageError(
            "--calibration: is missing; 'handclean calibrate-glove fit' makes one"
        )
    calibration = glove_files.read_calibration(given)
    samples = samples_of.merged(
        [glove_files.read_samples(source.path)[0] for source in sources]
    )
    try:
        found = adapt_to_donning(calibration, samples)
    except HandcleanError as error:
        raise FileError(given, str(error)) from None

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        glove_files.write_calibration(path, found.calibration, provenance)

    shift, gain = _of_sensors(found, calibration.glove.sensors)
    before, after = np.degrees([found.before, found.after])
    most = max(shift, key=lambda name: abs(shift[name]))
    return Outcome(
        line=f"{found.samples} samples were {before:.1f} degrees off and are "
        f"{after:.1f} now; {most} moved most, by {shift[most]:+.1f}",
        figures={
            "glove": calibration.glove.name,
            "samples": found.samples,
            "before_deg": float(before),
            "after_deg": float(after),
            "shift_deg": shift,
            "gain": gain,
            "scale": found.scale,
            "doubt_deg": float(np.degrees(found.doubt)),
        },
        remarks=_remarks(found),
        writers=(write,),
    )


def _of_sensors(
    found: Adapted, sensors: Sequence[str]
) -> tuple[dict[str, float], dict[str, float]]:
    """Shift [degrees] and gain by sensor, of those that are used."""
    own = [k for k in range(len(sensors)) if np.isfinite(found.shift[k])]
    shift = {sensors[k]: float(np.degrees(found.shift[k])) for k in own}
    return shift, {sensors[k]: float(found.gain[k]) for k in own}


def _remarks(found: Adapted) -> tuple[Remark, ...]:
    if found.scale <= _MOST_USUAL_FACTOR:
        return ()
    text = (
        f"readings changed {found.scale:g} times more than between donnings as a "
        "rule: another person or glove? 'calibrate-glove fit' may serve better"
    )
    return (remark("fit", text, scale=float(found.scale)),)
