"""How far off filled samples are, learnt from pseudo-gaps of the same take.

A filler gives a spread for each sample, right up to a factor. For each kind of gap (its
length, and whether it has one end or two) the ratios r = |error per axis| / spread of
the pseudo-gaps give that factor: sigma is the spread times the 0.68 quantile of r, and
q95 the 0.95 quantile of r over its 0.68 quantile, since such errors have heavier tails
than a normal distribution (which has 1.97). Every pseudo-gap counts alike, whatever its
length.

Of n pseudo-gaps the first quantile is taken at 0.68 (n + 1/2) / n, as one more gap of
their kind lies a little less often within what n others span.

A kind with few pseudo-gaps leans on all kinds of the take: its logarithmic quantiles
are means of its own and theirs, weighed by the number of its pseudo-gaps against
`BORROWED_68` and `BORROWED_95`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.pseudo import Kind, PseudoGap, errors
from handclean.gaps.tracks import Path, Tracks

BORROWED_68, BORROWED_95 = 4.0, 32.0
"""Pseudo-gaps that all kinds together count for in one kind (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Law:
    """Quantiles for one kind of gap: 0.68 of r, 0.95 over 0.68; how many gaps tell."""

    q68: float
    q95: float
    gaps: int


Doubt = Mapping[Kind, Law]
"""What the pseudo-gaps of a take say of a filler; nothing of kinds not tried."""


def learn(
    tracks: Tracks,
    tried: Mapping[Kind, Sequence[tuple[PseudoGap, Path | None]]],
) -> Doubt:
    """Learn from pseudo-gaps and the paths a filler laid through them."""
    ratios = {
        kind: [_ratios(tracks, one, path) for one, path in pairs if path is not None]
        for kind, pairs in tried.items()
    }
    everything = [ratio for part in ratios.values() for ratio in part]
    if not everything:
        return {}
    q68, q95 = quantiles(everything)
    laws = {}
    for kind, part in ratios.items():
        if part:
            own68, own95 = quantiles(part)
            laws[kind] = Law(
                q68=_leaning(own68, q68, len(part), BORROWED_68),
                q95=_leaning(own95 / own68, q95 / q68, len(part), BORROWED_95),
                gaps=len(part),
            )
    return laws


def _ratios(tracks: Tracks, one: PseudoGap, path: Path) -> Floats:
    """(N', 3) r where something was measured."""
    ratios = np.abs(errors(tracks, one, path)) / path.spread[:, None]
    return np.asarray(ratios[np.isfinite(ratios[:, 0])])


def quantiles(ratios: Sequence[Floats]) -> tuple[float, float]:
    """0.68 and 0.95 quantile of ratios (N, 3) of several gaps that count alike.

    The first is for one more gap, see the module.
    """
    values = np.concatenate([ratio.ravel() for ratio in ratios])
    weight = np.concatenate([np.full(r.size, 1.0 / r.size) for r in ratios])
    order = np.argsort(values, kind="stable")
    share = (np.cumsum(weight[order]) - 0.5 * weight[order]) / len(ratios)
    more = (len(ratios) + 0.5) / len(ratios)
    found = np.interp((0.68 * more, 0.95), share, values[order])
    return float(max(found[0], 1e-9)), float(max(found[1], 1e-9))


def _leaning(own: float, usual: float, count: int, borrowed: float) -> float:
    logs = count * np.log(own) + borrowed * np.log(usual)
    return float(np.exp(logs / (count + borrowed)))
