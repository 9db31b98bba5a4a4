"""How far off fillers are on a take of one's own; nothing is filled.

A take is cut where nothing is missing (`cuts`), every filler fills the same gaps, and
its paths are compared with what was measured there. A filler is given the take without
what was cut, so that what was hidden cannot be read.

Whoever has a filler of his own, as the contract of `gaps.tracks` has it, judges it
beside these::

    rounds = plan_cuts(tracks)
    judged = judge(tracks, rounds, {"ridge": named("ridge"), "mine": of(prepare)})
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.gaps import pseudo
from handclean.gaps.cuts import Cut
from handclean.gaps.fill_tracks import JudgedGap, by_sources
from handclean.gaps.hand import HandOfTake, bridge_hand
from handclean.gaps.runs import Gap
from handclean.gaps.settings import (
    CAUSAL_METHODS,
    METHODS,
    POSTURE_METHODS,
    FillConfig,
)
from handclean.gaps.sources import Source, sources_of
from handclean.gaps.tracks import Prepare, Tracks
from handclean.hand.subject import Subject

YARDSTICK = "ridge"
"""The filler that others are compared with."""

Filler = Callable[[Tracks, Sequence[Gap]], list[JudgedGap]]
"""Fills gaps of a take, with sigma; those it refuses have no path."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One filler at one cut.

    Attributes
    ----------
    mean_m, last_m : [m] mean distance over the gap and on its last frame, of all its
        markers, where these were measured; NaN where it is refused.
    expected_m : [m] root mean square sigma.
    within, within_q95 : share of errors per axis within sigma, within q95 sigmas.
    by : the source that filled it.
    refused : why not all of its markers are filled, or "".
    """

    cut: Cut
    filler: str
    mean_m: float = float("nan")
    last_m: float = float("nan")
    expected_m: float = float("nan")
    within: float = float("nan")
    within_q95: float = float("nan")
    by: str = ""
    refused: str = ""


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """All fillers at all cuts.

    Attributes
    ----------
    rows : by filler, in order of rounds and time.
    seconds : [s] of processor time by filler, pseudo-gaps and preparing among them.
    """

    rows: Sequence[Judged]
    seconds: Mapping[str, float]


MOST_FOLLOWED = 20_000
"""[frames] of a take that fillers are judged on where the posture of a hand is followed
(chosen; solving it again and again takes minutes)."""

ROUNDS_FOLLOWED = 4
"""Rounds there, at most (chosen)."""


def methods_to_judge(
    method: str, *, hands: bool, causal: bool = False
) -> tuple[str, ...]:
    """Name the fillers to judge, the yardstick first.

    Parameters
    ----------
    method : the only one beside the yardstick, or "" for all.
    hands : whether the posture of a hand can be followed.
    causal : whether those only that look at nothing after the frame they fill.
    """
    if method:
        return tuple(dict.fromkeys([YARDSTICK, method]))
    if causal:
        return (YARDSTICK, "auto", *CAUSAL_METHODS)
    left_out = () if hands else POSTURE_METHODS
    all_of = [name for name in METHODS if name not in left_out]
    return tuple(dict.fromkeys([YARDSTICK, "take", "auto", *all_of]))


def named(
    method: str,
    hands: Sequence[HandOfTake] = (),
    max_sigma_m: float = FillConfig.max_sigma_m,
    *,
    causal: bool = False,
) -> Filler:
    """Return the filler that ``fill-gaps`` has by a name.

    Parameters
    ----------
    hands : whose posture can be followed; only some methods look at them.
    max_sigma_m : [m] as of ``fill-gaps``; where "auto" asks its next source.
    causal : whether "auto" looks at nothing after the frame it fills.
    """

    def fill(tracks: Tracks, gaps: Sequence[Gap]) -> list[JudgedGap]:
        if method == "auto" and hands and not causal:
            found = by_sources(tracks, gaps, sources_of("take", []), max_sigma_m)
            if all(one.expected_m <= max_sigma_m for one in found):
                return found  # no other source is asked, so the hand is not solved
        followed = method in POSTURE_METHODS or (method == "auto" and not causal)
        bridged = [bridge_hand(hand, tracks) for hand in hands if followed]
        sources = sources_of(method, bridged, causal=causal)
        return by_sources(tracks, gaps, sources, max_sigma_m)

    return fill


def of(prepare: Prepare, name: str = "mine") -> Filler:
    """Return a filler of somebody's own, its sigma learnt from pseudo-gaps."""
    sources = {name: Source(prepare=prepare)}
    return lambda tracks, gaps: by_sources(tracks, gaps, sources, np.inf)


def judge(
    tracks: Tracks,
    rounds: Sequence[Sequence[Cut]],
    fillers: Mapping[str, Filler],
    tell: Callable[[str], None] = lambda text: None,
) -> Judgement:
    """Judge fillers at cuts of a take.

    Parameters
    ----------
    tell : is told how far it is.
    """
    rows: list[Judged] = []
    seconds = dict.fromkeys(fillers, 0.0)
    holes = [
        pseudo.punched(tracks, [one for cut in cuts for one in cut.parts])
        for cuts in rounds
    ]
    for name, fill in fillers.items():
        for number, (cuts, given) in enumerate(zip(rounds, holes, strict=True)):
            tell(f"{name}: round {number + 1} of {len(rounds)}")
            gaps = [one.gap for cut in cuts for one in cut.parts]
            begun = time.process_time()
            found = iter(fill(given, gaps))
            seconds[name] += time.process_time() - begun
            for cut in cuts:
                rows.append(
                    _judged(tracks, name, cut, [next(found) for _ in cut.parts])
                )
    return Judgement(rows=rows, seconds=seconds)


def _judged(
    tracks: Tracks, filler: str, cut: Cut, found: Sequence[JudgedGap]
) -> Judged:
    refused = next((one.gap.refused for one in found if one.path is None), "")
    if refused:
        return Judged(cut=cut, filler=filler, refused=refused)
    distances, within, beyond, square = [], [], [], []
    for part, one in zip(cut.parts, found, strict=True):
        assert one.path is not None
        errors = pseudo.errors(tracks, part, one.path)
        measured = np.isfinite(errors[:, 0])
        errors = errors[measured]
        distances.append(np.linalg.norm(errors, axis=1))
        ratio = np.abs(errors) / one.path.spread[measured, None]
        within.append(np.mean(ratio <= 1.0))
        beyond.append(np.mean(ratio <= one.q95))
        square.append(one.expected_m**2)
    return Judged(
        cut=cut,
        filler=filler,
        mean_m=float(np.mean(np.concatenate(distances))),
        last_m=float(np.mean([part[-1] for part in distances])),
        expected_m=float(np.sqrt(np.mean(square))),
        within=float(np.mean(within)),
        within_q95=float(np.mean(beyond)),
        by=" ".join(sorted({one.source for one in found})),
    )


def beginning(tracks: Tracks, frames: int) -> Tracks:
    """Return the first frames of a take."""
    return Tracks(
        positions=tracks.positions[:frames], rate=tracks.rate, bones=tracks.bones
    )


def limbs_of(labels: Sequence[str], subjects: Mapping[str, Subject]) -> list[Ints]:
    """Find the columns of the markers of each limb (finger) of subjects."""
    found = []
    for subject in subjects.values():
        limbs = subject.model.tree.limbs()[subject.model.bone]
        of_label = dict(zip(subject.model.labels, limbs.tolist(), strict=True))
        own = np.array([of_label.get(label, -1) for label in labels])
        found += [np.flatnonzero(own == limb) for limb in sorted(set(own) - {-1})]
    return found


def errors_of(judgement: Judgement, filler: str, *, last: bool = False) -> Floats:
    """(N,) [m] errors of a filler at all cuts, NaN where it refuses."""
    return np.array(
        [
            row.last_m if last else row.mean_m
            for row in judgement.rows
            if row.filler == filler
        ]
    )
