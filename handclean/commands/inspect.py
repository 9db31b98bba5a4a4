"""What is in a file, and what is odd about it."""

from collections.abc import Mapping, Sequence
from typing import Any

from handclean.api.contents import OF_GLOVES, contents_of
from handclean.commands.shared import glove_words
from handclean.commands.shared.choices import Inspecting
from handclean.commands.shared.take_options import options_of
from handclean.errors import UsageError
from handclean.io.c3d.verdict import Verdict
from handclean.io.c3d.verify import verify_c3d
from handclean.remarks import listed
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "format": "suffix without its dot, or the kind of an HDF5 file",
    "frames": "frames the file holds",
    "first_frame": "number of its first frame",
    "start_time_s": "time of its first frame, as the file counts time",
    "rate": "frames per second, null when the file does not say",
    "duration_s": "length of the take",
    "unit": "of lengths in the file",
    "up_axis": "axis that points up",
    "markers": "names of the markers",
    "marker_count": "how many of them",
    "missing": "share of frames without it, by marker",
    "samples": "samples that are missing, measured, filled, rejected, smoothed",
    "gaps": "gaps that have a sample before and after",
    "longest_gap_frames": "longest of them",
    "median_gap_frames": "middle one of them",
    "open_ends": "gaps at the take's edges",
    "unlabelled_points": "points without a name, over all frames",
    "most_unlabelled_in_a_frame": "most of them in one frame",
    "motions": "hands and objects whose motion is known",
    "skeletons": "joint trees",
    "analog": "names of analog channels",
    "analog_rate": "their samples per second",
    "events": "events",
    "steps": "commands that made the file",
    "program": "CSV of a tracking system: which wrote it",
    "subjects": "CSV of a tracking system: before the colon of its markers' names",
    "processor": "C3D: Intel, DEC or MIPS",
    "numbers": "C3D: integer or float",
    "scale": "C3D: POINT:SCALE",
    "points": "C3D: columns of points",
    "measured": "C3D: frames in which it was measured, by marker",
    "unlabelled_columns": "C3D: columns without a name",
    "model_outputs": "C3D: points that are angles, forces and the like",
    "angles": "C3D: those of them that are angles, of joints or the like",
    "columns": "MOT: names of its columns",
    "in_degrees": "MOT: whether its angles are in degrees",
    "residual_m": "C3D: smallest and largest residual of measured samples [m]",
    "groups": "C3D: groups of parameters",
    "vertices": "of a mesh, or of a skinned hand without its seams",
    "faces": "triangles of it",
    "joints": "glTF: names of the joints of its skins",
    "name": "of a subject; its file's where it has none",
    "side": "of a subject's hand",
    "size": "length of a subject's hand against the template's",
    "length_mm": "of a subject's hand",
    "marker_set": "that a subject's markers are named after",
    "calibrated": "whether a subject was measured, or is the template",
    "residual_mm": "RMS distance of markers in frames held out of the calibration; "
    "where there are none, that which solvers expect",
    "skin": "whether a subject has a skin of its own",
    "glove": "that samples or a calibration are of",
    "wearer": "who wore it",
    "readings": "samples of a glove",
    "kinds": "of samples: FK, for other wearers too, and IK",
    "recordings": "that samples were taken of, with how many",
    "rotations": "that are known: samples FK and IK, and floor_deg of a calibration, "
    "what samples of one recording are off together [degrees]",
    "rotations_measured": "how many the glove measures",
    "model": "of a calibration: its kind",
    "use": "samples a calibration was learnt from: all, fk or ik",
    "repeat_deg": "what putting the glove on again changes [degrees]",
    "worn_again": "whether a calibration is for another donning than its samples'",
    "doubt_deg": "what is not known of that donning [degrees]",
    "sensors": "of readings of a glove",
    "facts": "what readings of a glove say of themselves",
    "parts": "HDF5 of another kind than a session: its parts",
    "traps": "what is odd, one line each",
    "trap_count": "how many of them",
    "verify": "C3D: what the c3d package reads otherwise, by part (--verify)",
    "verify_differing": "C3D: values that it reads otherwise, null if it reads none",
    "remarks": "the same with kind, place and data",
    "other": "what else the format tells",
}


_OF_ANY = ("format", "parts", "traps", "trap_count", "remarks")
"""Figures of HDF5 of an unknown kind; its attributes may be called anything."""

_MORE = {"point": " without a name", "joint": " with angles"}


def inspect(source: Source, settings: Inspecting | None) -> Outcome:
    """Look into a file; one that is damaged is read as far as it goes.

    Raises
    ------
    UsageError
        If a file that is to be compared is no C3D.
    """
    verdict = _verified(source) if settings is not None and settings.verify else None
    options = options_of(source)
    about = contents_of(
        source.path,
        rate_hz=options.rate_hz,
        unit=options.unit,
        believe_coordinates=options.believe_coordinates,
    )
    known = _OF_ANY if "parts" in about else FIGURES
    figures = {name: about.pop(name) for name in known if name in about}
    if about:
        figures["other"] = about
    if verdict is not None:
        return _compared(figures, verdict)
    if figures["format"] not in OF_GLOVES or "rotations" not in figures:
        return Outcome(line=in_words(figures), figures=figures)
    line = in_words(figures, glove_words.in_words(figures))
    return Outcome(line=line, figures=figures, details=glove_words.rows(figures))


def _verified(source: Source) -> Verdict:
    if source.path.suffix.lower() != ".c3d":
        raise UsageError("--verify compares C3D files", where=source.path)
    return verify_c3d(source.path)


def _compared(figures: dict[str, Any], verdict: Verdict) -> Outcome:
    """Tell of a file that the ``c3d`` package has read, too."""
    differing = None if verdict.unread else verdict.differing
    said = {
        "equal": "equal by the c3d package",
        "different": f"{differing} values differ by the c3d package",
        "unread": f"the c3d package cannot read it ({verdict.unread})",
    }
    return Outcome(
        line=f"{in_words(figures)}; {said[verdict.status]}",
        details="\n".join(f"  {line}" for line in verdict.lines()),
        figures={
            **figures,
            "verify": verdict.as_data(),
            "verify_differing": differing,
        },
        differs=verdict.status == "different",
    )


def in_words(figures: Mapping[str, Any], more: Sequence[str] = ()) -> str:
    """Say on one line what is in a file, ``more`` of what it alone has."""
    words = [_format(figures), *more]
    if "skin" in figures:
        words += _subject(figures)
    if "frames" in figures:
        words.append(_length(figures))
    for name, what in (
        ("markers", "marker" if "skin" not in figures else ""),
        ("unlabelled_points", "point"),
        ("motions", "motion"),
        ("angles", "joint"),
        ("columns", "column"),
        ("sensors", "sensor"),
        ("gaps", "gap"),
        ("open_ends", "open end"),
        ("analog", "analog channel"),
    ):
        count = _count(figures.get(name, 0)) if what else 0
        if count:
            words.append(f"{count} {what}{'s' * (count != 1)}{_MORE.get(what, '')}")
            if what == "marker" and figures.get("subjects"):
                words[-1] += f" of {listed(figures['subjects'])}"
    words += _mesh(figures)
    if figures.get("steps"):
        words.append("made by " + ", ".join(figures["steps"]))
    text = ", ".join(words)
    return "; odd: ".join(
        [text, "; ".join(figures["traps"])][: 1 + bool(figures["traps"])]
    )


def _subject(figures: Mapping[str, Any]) -> list[str]:
    words = [f"'{figures['name']}'"]
    if figures["length_mm"] is not None:
        words.append(
            f"a {figures['side']} hand of {figures['length_mm']:.0f} mm "
            f"({100 * figures['size']:.0f} % of the template's)"
        )
    if count := len(figures["markers"]):
        of_set = f" of {figures['marker_set']}" if figures["marker_set"] else ""
        words.append(f"{count} marker{'s' * (count != 1)}{of_set}")
    if figures["residual_mm"] is not None:
        words.append(f"residual {figures['residual_mm']:.2f} mm")
    if not figures["calibrated"]:
        words.append("not calibrated")
    words.append("with a skin of its own" if figures["skin"] else "no skin of its own")
    return words


def _mesh(figures: Mapping[str, Any]) -> list[str]:
    words = []
    for side in figures.get("skeletons", {}) if "joints" in figures else ():
        words.append(f"a skinned {side} hand")
    if "joints" in figures:
        words.append(f"{len(figures['joints'])} skin joints")
    if "vertices" in figures:
        words.append(f"{figures['vertices']} vertices")
        words.append(f"{figures['faces']} faces")
    return words


def _format(figures: Mapping[str, Any]) -> str:
    parts = (figures.get(name) for name in ("format", "processor", "numbers"))
    text = " ".join(str(part) for part in parts if part)
    return f"{text} of {figures['program']}" if figures.get("program") else text


def _length(figures: Mapping[str, Any]) -> str:
    frames, rate = figures["frames"], figures.get("rate")
    first = figures.get("first_frame", 1)
    text = f"{frames} frame{'s' * (frames != 1)}"
    text += f" from {first}" if first != 1 else ""
    return text + (f" at {rate:g} Hz" if rate else " at an unknown rate")


def _count(value: Any) -> int:
    return value if isinstance(value, int) else len(value)
