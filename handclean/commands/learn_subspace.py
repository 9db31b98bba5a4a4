"""A posture prior from joint angles."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.commands.shared import motions
from handclean.commands.shared.choices import LearnConfig
from handclean.errors import UsageError
from handclean.ik import prior
from handclean.io.hdf5.prior import write_prior
from handclean.remarks import Remark, remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome

FIGURES = {
    "takes": "motions that were learnt from",
    "frames": "their frames in which all angles are known and trusted",
    "left_out": "frames that are not trusted, or in which an angle is not known",
    "angles": "joint angles of a posture",
    "directions": "directions that are kept",
    "share": "share of the variance the first 1, 2, ... directions hold",
    "covered": "share that all of them hold",
    "held_out_share": "the same, of takes that were held out",
    "held_out_covered": "share of those that all directions hold",
    "held_out_misfit_deg": "RMS angle that all directions leave of those",
}

FEW_FRAMES_PER_ANGLE = 10
"""Frames for each angle; there is a warning of a prior of fewer (chosen)."""


def learn_subspace(sources: tuple[Source, ...], settings: LearnConfig) -> Outcome:
    """Learn a mean and directions, and say what they hold of takes held out.

    D angles take more than D frames: with fewer the directions are those frames.
    """
    odd: list[Remark] = []
    learnt_from = [motion for source in sources for motion in motions.read(source, odd)]
    names = tuple(
        name
        for name in learnt_from[0].names
        if all(name in motion.names for motion in learnt_from)
    )
    if not names:
        raise UsageError("inputs: have no joint angle in common")
    takes = [in_order(names, motion) for motion in learnt_from]
    motions.expect_enough(takes, len(names) + 1, f"a prior of {len(names)} angles")
    takes = [take for take in takes if motions.known([take])]
    found = prior.learn(
        takes,
        names,
        directions=settings.directions or None,
        share=settings.share,
        source=f"{len(takes)} motions, {sources[0].path.name} the first of them",
    )

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_prior(path, found, provenance)

    frames = motions.known(takes)
    figures: dict[str, Any] = {
        "takes": len(takes),
        "frames": frames,
        "left_out": sum(len(motion.poses) for motion in learnt_from) - frames,
        "angles": len(names),
        "directions": len(found.deviations),
        "share": np.cumsum(found.variance_share),
        "covered": float(found.variance_share.sum()),
        **_held_out(sources[0], found, odd),
    }
    return Outcome(
        line=_line(figures),
        figures=figures,
        remarks=_remarks(odd, learnt_from, figures),
        writers=(write,),
    )


def _line(figures: Mapping[str, Any]) -> str:
    line = (
        f"{figures['directions']} directions hold {100 * figures['covered']:.1f} % of "
        f"the variance of {figures['angles']} angles in {figures['takes']} takes"
    )
    if "held_out_covered" in figures:
        line += f", {100 * figures['held_out_covered']:.1f} % of those held out"
    return line


def _remarks(
    odd: Sequence[Remark],
    learnt_from: Sequence[motions.HandMotion],
    figures: Mapping[str, Any],
) -> tuple[Remark, ...]:
    """Remarks on the takes, those left out, and a prior of too few frames."""
    remarks = [*odd, *motions.left_out(learnt_from)]
    frames = figures["frames"]
    if frames < FEW_FRAMES_PER_ANGLE * figures["angles"]:
        remarks.append(
            remark(
                "few",
                f"learnt from {frames} frames only: its directions may be those of "
                "chance",
                count=frames,
            )
        )
    return tuple(remarks)


def in_order(names: tuple[str, ...], motion: motions.HandMotion) -> Floats:
    """(T, D) angles of these names, NaN where unknown or not trusted.

    Raises
    ------
    UsageError
        If a motion lacks one.
    """
    missing = [name for name in names if name not in motion.names]
    if missing:
        raise UsageError(f"--held-out: a take has no angle {missing[0]}")
    return motions.angles(motion, names)


def _held_out(
    source: Source, found: prior.PosturePrior, odd: list[Remark]
) -> dict[str, Any]:
    given = [p for role, p in source.files.items() if role.startswith("held_out")]
    if not given:
        return {}
    taken = [m for path in given for m in motions.read(Source(path=path), odd)]
    odd += motions.left_out(taken, "--held-out: ")
    angles = np.concatenate([in_order(found.names, motion) for motion in taken])
    if motions.known([angles]) < 2:
        raise UsageError("--held-out: fewer than 2 frames are known and trusted")
    share = prior.coverage(found, angles)
    return {
        "held_out_share": share,
        "held_out_covered": float(share[-1]),
        "held_out_misfit_deg": float(np.degrees(prior.misfit(found, angles)[-1])),
    }
