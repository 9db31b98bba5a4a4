"""Gaps of marker trajectories filled, each with the error to expect of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats, runs
from handclean.gaps import pseudo
from handclean.gaps.doubt import learn
from handclean.gaps.hand import BridgedHand
from handclean.gaps.runs import THROUGHOUT, TOO_LONG, Gap
from handclean.gaps.settings import FillConfig
from handclean.gaps.sources import Source, sources_of
from handclean.gaps.tracks import Path, Refused, Tracks

TOO_UNSURE = "its expected error is over max_sigma_m ="

UNTRIED = "nothing in the take is like it, to learn an error from"


@dataclass(frozen=True, kw_only=True)
class JudgedGap:
    """A gap with what became of it.

    Attributes
    ----------
    gap : with the reason why it stays open, "" if it is filled.
    path : its places and their sigma, None where nothing could fill it.
    source : what filled it, or would.
    q95 : how many sigmas hold 95 % of the errors.
    """

    gap: Gap
    path: Path | None = None
    source: str = ""
    q95: float = float("nan")

    @property
    def expected_m(self) -> float:
        """[m] root mean square sigma over the gap; infinite where nothing fills it."""
        if self.path is None:
            return float("inf")
        return float(np.sqrt(np.mean(self.path.spread**2)))


@dataclass(frozen=True, kw_only=True)
class FilledTracks:
    """All gaps of a take with what became of them.

    Attributes
    ----------
    gaps : by marker, then by time.
    q95 : (K, 2) length of gaps [s] and how many sigmas hold 95 % of the errors.
    """

    gaps: Sequence[JudgedGap]
    q95: Floats


def fill_tracks(
    tracks: Tracks, bridged: Sequence[BridgedHand], settings: FillConfig
) -> FilledTracks:
    """Fill the gaps of a take's markers.

    Parameters
    ----------
    bridged : hands whose posture can be followed; may be empty.
    """
    gaps = gaps_of_take(tracks, settings.max_gap_s)
    asked = [gap for gap in gaps if not gap.refused]
    sources = sources_of(settings.method, bridged, causal=settings.causal)
    enough_m = settings.max_sigma_m
    found = by_sources(tracks, asked, sources, enough_m)
    judged = {gap: JudgedGap(gap=gap) for gap in gaps}
    judged |= dict(zip(asked, found, strict=True))
    why = f"{TOO_UNSURE} {enough_m:.3g} m"
    for gap in asked:
        if judged[gap].path is not None and judged[gap].expected_m > enough_m:
            judged[gap] = replace(judged[gap], gap=replace(gap, refused=why))
    done = [judged[gap] for gap in gaps]
    return FilledTracks(gaps=done, q95=_q95(tracks, done))


def by_sources(
    tracks: Tracks, gaps: Sequence[Gap], sources: Mapping[str, Source], enough_m: float
) -> list[JudgedGap]:
    """Fill gaps by one source after another, each where those before are too unsure.

    Parameters
    ----------
    enough_m : [m] expected error up to which no other source is asked.
    """
    judged = {gap: JudgedGap(gap=gap) for gap in gaps}
    left = list(gaps)
    for name, source in sources.items():
        found = by_source(tracks, left, name, source)
        for gap, one in zip(left, found, strict=True):
            first = not judged[gap].gap.refused and judged[gap].path is None
            if first or one.expected_m < judged[gap].expected_m:
                judged[gap] = one
        left = [gap for gap in left if judged[gap].expected_m > enough_m]
    return [judged[gap] for gap in gaps]


def by_source(
    tracks: Tracks, gaps: Sequence[Gap], name: str, source: Source
) -> list[JudgedGap]:
    """Fill gaps by one source, with sigma as its pseudo-gaps tell it."""
    if not gaps:
        return []
    try:
        fill = source.fill(tracks)
    except Refused as no:
        return [JudgedGap(gap=replace(gap, refused=str(no))) for gap in gaps]
    doubt = learn(tracks, source.tried(tracks, pseudo.draw(tracks, gaps), fill))
    found = []
    for gap in gaps:
        try:
            path = fill(gap)
        except Refused as no:
            found.append(JudgedGap(gap=replace(gap, refused=str(no))))
            continue
        law = doubt.get(pseudo.kind_of(tracks, gap))
        if law is None:
            found.append(JudgedGap(gap=replace(gap, refused=UNTRIED)))
            continue
        path = path._replace(spread=path.spread * law.q68)
        found.append(JudgedGap(gap=gap, path=path, source=name, q95=law.q95))
    return found


def gaps_of_take(tracks: Tracks, max_gap_s: float) -> list[Gap]:
    """Find every gap of every marker; refused are those nothing is to be tried at.

    Parameters
    ----------
    max_gap_s : [s] longest gap to fill; 0 for no limit.
    """
    frames, gaps = len(tracks.seen), []
    longest = round(max_gap_s * tracks.rate, 6)
    for column in range(tracks.seen.shape[1]):
        for start, stop in runs(~tracks.seen[:, column]):
            why = ""
            if stop - start == frames:
                why = THROUGHOUT
            elif 0.0 < longest < stop - start:
                why = f"{TOO_LONG} {max_gap_s:.3g} s"
            gaps.append(Gap(column=column, start=start, stop=stop, refused=why))
    return gaps


def _q95(tracks: Tracks, done: Sequence[JudgedGap]) -> Floats:
    """(K, 2) length [s] and mean q95 of gaps that are filled."""
    of_length: dict[float, list[float]] = {}
    for one in done:
        if not one.gap.refused:
            length = pseudo.kind_of(tracks, one.gap).length_s
            of_length.setdefault(length, []).append(one.q95)
    rows = [(length, float(np.mean(of_length[length]))) for length in sorted(of_length)]
    return np.array(rows).reshape(-1, 2)
