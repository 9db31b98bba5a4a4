"""Gaps filled from the take's own markers: the entry of this package."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.body import Motion
from handclean.gaps.pseudo import PseudoGap
from handclean.gaps.regression.covariance import CLOCK_HZ
from handclean.gaps.regression.features import (
    ROWS_OF_DISTANCE,
    Seen,
    Window,
    look,
    rigidity,
)
from handclean.gaps.regression.process import (
    Scales,
    guess,
    likeliest_residual,
    scales_of,
)
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Path, Refused, Tracks

BLOCK = 1000
"""[1/120 s] the take in blocks: one learns from its own and one beside it on each side.
Three times as much gains nothing (ratio to the ridge 0.741 and 0.742 on two takes)."""

ENOUGH_ROWS = 400
"""Frames to learn from; where there are fewer, more blocks are looked at (chosen)."""

NOISE_ROWS = 250
"""Frames beside a gap that noise is judged by (chosen)."""

MARGIN = 3
"""[frames] beside a gap in which features should be seen, too."""

FEWEST_OTHERS = 3
"""Other markers needed throughout a gap."""

MOST_FEATURES = 16
"""Markers that tell of a hidden one, at most: those most nearly rigid with it. All 60
of a body tell far worse of a finger than these; 12 as well in a body, a little worse
in a hand."""

FEWEST_ROWS = 30
"""Frames needed to learn from."""

TOO_FEW = "seen with the other markers in too few frames"

LEAST_SEEN = 0.5
"""Share of a gap in which a feature should be seen; it is imputed in the rest."""

LEAST_USUAL = 0.2
"""Share of the frames that show a marker in which a feature should be seen (chosen)."""

WINDOWS_KEPT = 8


_Key = tuple[int, tuple[int, int], bytes, bytes]


@dataclass(frozen=True)
class Regression:
    """Fills gaps of one take.

    Windows of it are kept for the gaps to come; and of each marker which others are
    most nearly rigid with it, how features are smoothed and how large residuals are.
    """

    tracks: Tracks
    windows: "OrderedDict[_Key, tuple[Window, Scales]]" = field(
        default_factory=OrderedDict
    )
    weights: dict[int, Floats] = field(default_factory=dict)
    shown: dict[int, tuple[Bools, int]] = field(default_factory=dict)
    smoothings: dict[int, float] = field(default_factory=dict)
    residuals: dict[int, float] = field(default_factory=dict)

    def __call__(self, gap: Gap) -> Path:
        """Fill a gap.

        Raises
        ------
        Refused
            If fewer than three other markers are seen throughout, or the hidden marker
            is hardly ever seen with them.
        """
        nothing = np.zeros(self.tracks.seen.shape[1], dtype=bool)
        return self.pretend(
            PseudoGap(gap=gap, hidden=nothing, start=gap.start, stop=gap.stop)
        )

    def pretend(self, one: PseudoGap) -> Path:
        """Fill a pseudo-gap; what was measured in it is not looked at."""
        tracks, gap = self.tracks, one.gap
        always, features = self._features(gap, one.hidden)
        window, scales = self._window(gap, always, features)
        inside = slice(gap.start - window.first, gap.stop - window.first)
        known = window.known.copy()
        known[max(one.start - window.first, 0) : one.stop - window.first] = False
        if np.count_nonzero(known) < FEWEST_ROWS:
            raise Refused(TOO_FEW)
        found = guess(window, scales, inside, known, tracks.rate)
        motion = Motion(window.motion.turn[inside], window.motion.shift[inside])
        return Path(motion.to_laboratory(found.places), found.deviation)

    def _features(self, gap: Gap, hidden: Bools) -> tuple[Ints, Ints]:
        """Markers seen throughout, and those with such that are seen mostly."""
        rows = slice(max(gap.start - MARGIN, 0), gap.stop + MARGIN)
        share = self.tracks.seen[rows].mean(axis=0)
        share[hidden] = 0.0
        share[gap.column] = 0.0
        inside = self.tracks.seen[gap.start : gap.stop].mean(axis=0)
        tells = (share > 0.0) & (inside >= LEAST_SEEN)
        order = np.argsort(-self._rigidity(gap.column), kind="stable")
        near = order[tells[order]][:MOST_FEATURES]
        features = np.isin(np.arange(len(tells)), near)
        always = features & (share == 1.0)
        if np.count_nonzero(always) < FEWEST_OTHERS:
            raise Refused("fewer than three other markers are seen throughout")
        shown, every = self._shown(gap.column)
        kept = np.flatnonzero(always)
        while True:
            both = shown[:, kept]
            whole = np.count_nonzero(both.all(axis=1))
            if whole >= 0.5 * len(both) or len(kept) == FEWEST_OTHERS:
                break
            missing = np.count_nonzero(~both, axis=0)
            kept = np.delete(kept, int(np.argmax(missing)))
        if every * whole < FEWEST_ROWS:
            raise Refused(TOO_FEW)
        features &= shown.mean(axis=0) > LEAST_USUAL
        features[kept] = True
        return kept, np.flatnonzero(features)

    def _shown(self, column: int) -> tuple[Bools, int]:
        """(N, M) markers seen in each n-th frame that shows a marker, and n."""
        if column not in self.shown:
            mine = np.flatnonzero(self.tracks.seen[:, column])
            every = max(1, len(mine) // ROWS_OF_DISTANCE)
            self.shown[column] = self.tracks.seen[mine[::every]], every
        return self.shown[column]

    def _rigidity(self, column: int) -> Floats:
        """(M,) how near-rigid with a marker each marker is; 0 itself."""
        if column not in self.weights:
            weight = np.zeros(self.tracks.seen.shape[1])
            others = np.delete(np.arange(len(weight)), column)
            step = max(1, len(self.tracks.seen) // ROWS_OF_DISTANCE)
            near = rigidity(self.tracks.positions[::step], column, others)
            weight[others] = near
            self.weights[column] = weight
        return self.weights[column]

    def _window(self, gap: Gap, always: Ints, features: Ints) -> tuple[Window, Scales]:
        size = round(BLOCK * self.tracks.rate / CLOCK_HZ)
        blocks = gap.start // size, (gap.stop - 1) // size + 1
        key = gap.column, blocks, always.tobytes(), features.tobytes()
        if key in self.windows:
            self.windows.move_to_end(key)
            return self.windows[key]
        rows = self._rows(blocks, size, np.append(always, gap.column))
        weight = self._rigidity(gap.column)[features]
        seen = Seen(
            column=gap.column,
            features=features,
            always=always,
            weight=weight / weight.max(),
            rows=rows,
        )
        if gap.column not in self.smoothings:
            self.smoothings[gap.column] = self._smoothing(gap, seen)
        window = look(self.tracks, seen, self.smoothings[gap.column])
        if gap.column not in self.residuals:
            residual = likeliest_residual(window, self.tracks.rate)
            self.residuals[gap.column] = residual
        self.windows[key] = window, scales_of(window, self.residuals[gap.column])
        if len(self.windows) > WINDOWS_KEPT:
            self.windows.popitem(last=False)
        return self.windows[key]

    def _smoothing(self, gap: Gap, seen: Seen) -> float:
        """Return how features of a marker are smoothed, judged by frames near a gap."""
        first = max(gap.start - NOISE_ROWS, seen.rows.start)
        near = slice(first, min(gap.stop + NOISE_ROWS, seen.rows.stop))
        return look(self.tracks, replace(seen, rows=near)).smoothing

    def _rows(self, blocks: tuple[int, int], size: int, columns: Ints) -> slice:
        """Rows about blocks that show markers often enough, if the take does."""
        frames = len(self.tracks.seen)
        for beside in range(1, frames // size + 2):
            first = max((blocks[0] - beside) * size, 0)
            rows = slice(first, min((blocks[1] + beside) * size, frames))
            whole = self.tracks.seen[rows][:, columns].all(axis=1)
            if np.count_nonzero(whole) >= ENOUGH_ROWS:
                break
        return rows


def regression(tracks: Tracks) -> Regression:
    """Prepare to fill gaps of a take from its own markers."""
    return Regression(tracks)


def pretended(fill: Regression, trials: Sequence[PseudoGap]) -> list[Path | None]:
    """Fill pseudo-gaps as `gaps.pseudo.filled` does, without preparing anew."""
    paths: list[Path | None] = []
    for one in trials:
        try:
            paths.append(fill.pretend(one))
        except Refused:
            paths.append(None)
    return paths
