"""How far off fillers are on a take: gaps cut where nothing is missing, and judged."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from handclean.api import names
from handclean.api.verdicts import expect_seen
from handclean.commands.shared import filler_tables, hands, sessions
from handclean.commands.shared.choices import (
    EVALUATION_ROWS,
    EVALUATION_TABLE,
    JudgingFillers,
)
from handclean.commands.shared.filler_tables import Found
from handclean.errors import TAKE, HandcleanError
from handclean.gaps.cuts import LENGTHS_S, MOST_ROUNDS, PER_CELL, Cut, plan_cuts
from handclean.gaps.evaluate import (
    MOST_FOLLOWED,
    ROUNDS_FOLLOWED,
    YARDSTICK,
    Filler,
    beginning,
    judge,
    limbs_of,
    methods_to_judge,
    named,
)
from handclean.gaps.fill import hands_of, names_of, tracks_of
from handclean.gaps.hand import HandOfTake
from handclean.gaps.measured import clean_measured
from handclean.gaps.scores import cells_of, score, winner
from handclean.gaps.settings import POSTURE_METHODS
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.recording import Recording
from handclean.remarks import Remark, remark
from handclean.report.filler_errors import plot_errors
from handclean.runner import progress
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome, Writer
from handclean.runner.steps import step

FIGURES = {
    "gaps": "gaps that were cut",
    "rounds": "rounds in which they were cut, several at once",
    "per_cell": "gaps of one length and pattern, at most",
    "fillers": "what each filler makes of them: mean error over a gap and on its last "
    "frame [mm], its ratio to the ridge's with 95 % intervals, shares refused, too "
    "unsure, and within sigma, milliseconds of processor time a gap",
    "cells": "the same by what is hidden and how long, and who won there",
    "best": "the filler of the least mean error",
    "best_mm": "its mean error",
    "best_ratio": "its error against the ridge's, geometric mean",
}


def evaluate_fillers(source: Source, settings: JudgingFillers) -> Outcome:
    """Judge fillers on one take; nothing is filled."""
    recording = sessions.read(source)
    sought = hands.of_source_if_any(source)
    recording, same = names.matched(recording, names.known_to(sought.subjects))
    if sought.subjects:
        names.expect_any(recording, sought.subjects)
        expect_seen(recording, sought.subjects)
    recording = clean_measured(recording, settings.fill).take
    with step("judge"):
        try:
            found, rounds = _found(recording, sought.subjects, sought.prior, settings)
        finally:
            progress.done()
    best = found.best
    figures = {
        "gaps": sum(map(len, rounds)),
        "rounds": len(rounds),
        "per_cell": PER_CELL,
        **filler_tables.figures(found),
        "best": best.filler if best else None,
        "best_mm": 1e3 * best.mean_m if best else None,
        "best_ratio": best.against.geometric.value if best else None,
    }
    return Outcome(
        line=_line(found, figures),
        details=filler_tables.in_text(found),
        figures=figures,
        remarks=(*recording.remarks, *same, *_shortened(recording, found)),
        writers=tuple(_writers(source, found, settings)),
    )


def _found(
    recording: Recording,
    subjects: Mapping[str, Subject],
    prior: PosturePrior | None,
    settings: JudgingFillers,
) -> tuple[Found, list[list[Cut]]]:
    if not recording.rate > 0.0:
        raise HandcleanError(
            f"its rate is {recording.rate} Hz; lengths of gaps need it, so it should "
            "be above 0",
            where=TAKE,
        )
    methods = methods_to_judge(
        settings.method, hands=bool(subjects), causal=settings.fill.causal
    )
    tracks, most_rounds = tracks_of(recording, subjects), MOST_ROUNDS
    if _is_followed(methods, subjects, settings):
        tracks, most_rounds = beginning(tracks, MOST_FOLLOWED), ROUNDS_FOLLOWED
    limbs = limbs_of(names_of(recording), subjects)
    rounds = plan_cuts(tracks, limbs, most_rounds=most_rounds)
    if not rounds:
        raise HandcleanError(
            "has no room for a gap to judge by: a marker should be seen for "
            f"{LENGTHS_S[0]} s at a stretch, and a fifth of the take be as long",
            where=TAKE,
        )
    fillers: dict[str, Filler] = {
        method: _filler(method, recording, subjects, prior, settings)
        for method in methods
    }
    judgement = judge(tracks, rounds, fillers, progress.tell)
    max_sigma_m = settings.fill.max_sigma_m
    found = Found(
        judgement=judgement,
        labels=names_of(recording),
        frames=len(tracks.seen),
        numbering=recording.numbering,
        overall={name: score(judgement, name, max_sigma_m) for name in fillers},
        by_cell={
            cell: {
                name: score(judgement, name, max_sigma_m, [cell]) for name in fillers
            }
            for cell in cells_of(judgement)
        },
    )
    return found, rounds


def _is_followed(
    methods: Sequence[str], subjects: Mapping[str, Subject], settings: JudgingFillers
) -> bool:
    """Whether a filler solves a hand."""
    following = {*POSTURE_METHODS, *([] if settings.fill.causal else ["auto"])}
    return bool(subjects) and bool(following & set(methods))


def _shortened(recording: Recording, found: Found) -> tuple[Remark, ...]:
    """Remark on frames that were left out."""
    judged = found.frames
    if judged == recording.frames:
        return ()
    text = (
        f"fillers are judged on the first {judged} of {recording.frames} frames, as "
        "some follow the posture of a hand"
    )
    return (remark("left-out", text, judged=judged),)


def _filler(
    method: str,
    recording: Recording,
    subjects: Mapping[str, Subject],
    prior: PosturePrior | None,
    settings: JudgingFillers,
) -> Filler:
    fill = replace(settings.fill, method=method, causal=False)
    own: Sequence[HandOfTake] = list(
        hands_of(recording, subjects, prior, fill, settings.solve).values()
    )
    return named(method, own, fill.max_sigma_m, causal=settings.fill.causal)


def _line(found: Found, figures: Mapping[str, Any]) -> str:
    best = found.best
    judged = f"{figures['gaps']} gaps cut in {figures['rounds']} rounds"
    if best is None:
        return f"{judged}; no filler fills any of them"
    won = [winner(list(of.values())) for of in found.by_cell.values()]
    cells = sum(one is not None and one.filler == best.filler for one in won)
    against = ""
    if best.filler != YARDSTICK:
        against = f", {best.against.geometric.value:.2f} times the ridge's error"
    return (
        f"{judged}; {best.filler} is best: {1e3 * best.mean_m:.2f} mm in the mean"
        f"{against}, first in {cells} of {len(won)} cells"
    )


def _writers(source: Source, found: Found, settings: JudgingFillers) -> list[Writer]:
    """Return what writes the files that are asked for, in their order."""
    known = {EVALUATION_ROWS: _write_rows, EVALUATION_TABLE: _write_table}
    return [
        partial(known.get(name, _write_plot), found=found, title=source.path.name)
        for name in settings.written
    ]


def _write_rows(
    path: Path, history: tuple[Entry, ...], *, found: Found, title: str
) -> None:
    filler_tables.write_rows(path, found)


def _write_table(
    path: Path, history: tuple[Entry, ...], *, found: Found, title: str
) -> None:
    text = f"{title}\n\n{filler_tables.at_length(found)}\n"
    path.write_text(text, encoding="utf-8")


def _write_plot(
    path: Path, history: tuple[Entry, ...], *, found: Found, title: str
) -> None:
    panels: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for cell, of in found.by_cell.items():
        for name, one in of.items():
            if one.mean_m > 0.0:
                line = panels.setdefault(cell.pattern, {}).setdefault(name, [])
                line.append((cell.length_s, 1e3 * one.mean_m))
    plot_errors(path, panels, title)
