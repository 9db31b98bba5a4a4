"""What fills gaps, by method: a filler, and how pseudo-gaps try it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handclean.errors import TAKE, HandcleanError
from handclean.gaps import pseudo
from handclean.gaps.family.table import BASELINES
from handclean.gaps.hand import BridgedHand, follower, following
from handclean.gaps.pseudo import Kind, PseudoGap
from handclean.gaps.regression.fill import pretended, regression
from handclean.gaps.runs import Gap
from handclean.gaps.settings import CAUSAL_METHODS, POSTURE_METHODS
from handclean.gaps.tracks import Fill, Path, Prepare, Refused, Tracks


@dataclass(frozen=True, kw_only=True)
class Source:
    """A filler, and how it is tried on pseudo-gaps.

    Attributes
    ----------
    prepare : as the contract of `gaps.tracks` has it.
    ready : the same filler prepared for the take itself, if it is already.
    quick : fills pseudo-gaps by the filler that ``prepare`` made, if it can do so
        without being prepared anew.
    """

    prepare: Prepare
    ready: Fill | None = None
    quick: Callable[[Any, Sequence[PseudoGap]], list[Path | None]] | None = None

    def fill(self, tracks: Tracks) -> Fill:
        """Return the filler, prepared for a take."""
        return self.ready or self.prepare(tracks)

    def tried(
        self, tracks: Tracks, trials: pseudo.Trials, fill: Fill
    ) -> dict[Kind, list[tuple[PseudoGap, Path | None]]]:
        """Fill pseudo-gaps of every kind.

        Parameters
        ----------
        fill : what `fill` gave for the take.
        """
        everything = [one for part in trials.values() for one in part]
        order = sorted(range(len(everything)), key=lambda i: everything[i].start)
        in_time = [everything[i] for i in order]
        if self.quick is not None:
            paths = self.quick(fill, in_time)
        else:
            paths = pseudo.filled(self.prepare, tracks, in_time)
        of = {id(one): path for one, path in zip(in_time, paths, strict=True)}
        return {
            kind: [(one, of[id(one)]) for one in part] for kind, part in trials.items()
        }


def sources_of(
    method: str, bridged: Sequence[BridgedHand], *, causal: bool = False
) -> dict[str, Source]:
    """Return what fills gaps by a method, in the order in which it is asked.

    Parameters
    ----------
    causal : whether "auto" looks at nothing after the frame that is filled.

    Raises
    ------
    HandcleanError
        If the method needs a hand and there is none.
    """
    if causal and method == "auto":
        names = CAUSAL_METHODS
        return {name: Source(prepare=BASELINES[name].prepare) for name in names}
    take = Source(prepare=regression, quick=pretended)
    if method == "take":
        return {"take": take}
    if method not in ("auto", *POSTURE_METHODS):
        return {method: Source(prepare=BASELINES[method].prepare)}
    hands = [hand.hand for hand in bridged]
    posture = Source(prepare=following(hands), ready=follower(bridged))
    if method == "auto":
        cubic = {"cubic": Source(prepare=_beside_others(BASELINES["cubic"].prepare))}
        return {"take": take} | ({"posture": posture} if hands else {}) | cubic
    if not hands:
        raise HandcleanError(
            f"method '{method}' follows the posture of a hand: give its subject or "
            "marker set, or another method",
            where=TAKE,
        )
    return {method: posture}


def _beside_others(prepare: Prepare) -> Prepare:
    """Return a filler that leaves gaps open in which all other markers are gone.

    A marker alone may be led through a gap; of a whole hand or body that is not seen
    nothing is known, however smoothly it moved before and after.
    """

    def prepared(tracks: Tracks) -> Fill:
        fill = prepare(tracks)

        def refuse_or_fill(gap: Gap) -> Path:
            others = np.delete(tracks.seen, gap.column, axis=1)
            inside = others[gap.start : gap.stop]
            if others.any() and not inside.any(axis=1).all():
                raise Refused("no other marker is seen in part of it")
            return fill(gap)

        return refuse_or_fill

    return prepared
