"""A posture prior from joint angles."""

from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, UsageError
from handclean.ik import prior
from handclean.io.prior import write_prior
from handclean.pipeline import sessions
from handclean.pipeline.batch import Source
from handclean.pipeline.choices import LearnConfig
from handclean.pipeline.outcome import Entry, Outcome

FIGURES = {
    "takes": "motions that were learnt from",
    "frames": "their frames",
    "angles": "joint angles of a posture",
    "directions": "directions that are kept",
    "share": "share of the variance the first 1, 2, ... directions hold",
    "covered": "share that all of them hold",
    "held_out_share": "the same, of takes that were held out",
    "held_out_covered": "share of those that all directions hold",
    "held_out_misfit_deg": "RMS angle that all directions leave of those",
}

Named = tuple[tuple[str, ...], Floats]


def learn_subspace(sources: tuple[Source, ...], settings: LearnConfig) -> Outcome:
    """Learn a mean and directions, and say what they hold of takes held out."""
    odd: list[str] = []
    learnt_from = [motion for source in sources for motion in angles_of(source, odd)]
    names = tuple(
        name for name in learnt_from[0][0] if all(name in n for n, _ in learnt_from)
    )
    if not names:
        raise UsageError("inputs: have no joint angle in common")
    takes = [in_order(names, motion) for motion in learnt_from]
    found = prior.learn(
        takes,
        names,
        directions=settings.directions or None,
        share=settings.share,
        source=f"{len(takes)} motions, {sources[0].path.name} the first of them",
    )

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_prior(path, found, provenance)

    figures: dict[str, Any] = {
        "takes": len(takes),
        "frames": sum(map(len, takes)),
        "angles": len(names),
        "directions": len(found.deviations),
        "share": np.cumsum(found.variance_share),
        "covered": float(found.variance_share.sum()),
        **_held_out(sources[0], found, odd),
    }
    line = (
        f"{figures['directions']} directions hold {100 * figures['covered']:.1f} % of "
        f"the variance of {len(names)} angles in {len(takes)} takes"
    )
    if "held_out_covered" in figures:
        line += f", {100 * figures['held_out_covered']:.1f} % of those held out"
    first = f"{sources[0].path}: "  # of which a warning speaks anyway
    warnings = tuple(text.removeprefix(first) for text in odd)
    return Outcome(line=line, figures=figures, warnings=warnings, writers=(write,))


def angles_of(source: Source, odd: list[str]) -> list[Named]:
    """Names and (T, D) angles of every hand of a take.

    Parameters
    ----------
    odd : what is odd about the file is appended.

    Raises
    ------
    FileError
        If it has none.
    """
    recording = sessions.read(source)
    odd += [f"{source.path}: {trap}" for trap in sessions.traps(source, recording)]
    found = [
        (motion.names, motion.angles)
        for name, motion in recording.motions.items()
        if name not in recording.skeletons or recording.skeletons[name].kind == "hand"
    ]
    if not found:
        raise FileError(
            source.path, "has no joint angles", "'handclean solve' adds them"
        )
    return found


def in_order(names: tuple[str, ...], motion: Named) -> Floats:
    """(T, D) angles of these names.

    Raises
    ------
    UsageError
        If a motion lacks one.
    """
    has, angles = motion
    missing = [name for name in names if name not in has]
    if missing:
        raise UsageError(f"--held-out: a take has no angle {missing[0]}")
    return np.ascontiguousarray(angles[:, [has.index(name) for name in names]])


def _held_out(
    source: Source, found: prior.PosturePrior, odd: list[str]
) -> dict[str, Any]:
    given = [p for role, p in source.files.items() if role.startswith("held_out")]
    if not given:
        return {}
    motions = [motion for path in given for motion in angles_of(Source(path=path), odd)]
    angles = np.concatenate([in_order(found.names, motion) for motion in motions])
    share = prior.coverage(found, angles)
    return {
        "held_out_share": share,
        "held_out_covered": float(share[-1]),
        "held_out_misfit_deg": float(np.degrees(prior.misfit(found, angles)[-1])),
    }
