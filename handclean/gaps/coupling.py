"""What the other joints did in a gap that nobody could have foreseen.

A path of least acceleration misses what happened between its ends. Joints that are
known through the gap can be bridged over the same frames too, and what they did beside
their own paths, d, tells about the joint h that is not known: joints of a hand move
together. The best linear guess is ::

    path_h + w . d,      w = (E_v^T E_v + ridge)^-1 E_v^T e_h

with E the errors of such bridges in stretches of the take in which all is known (see
`trial`), e_h those of the joint and E_v those of the known ones. It needs no posture
prior, only the take; and d vanishes with its velocity at both ends of the gap, as a
correction of the path must.

Measured (tests/bench/bench_gaps.py): no gain in gaps under 0.25 s; in gaps of 0.5 and
1 s up to a quarter less error on two real recordings, but now and then up to a sixth
more, there and in simulation, and more where there are so few markers that the joints
which are known are hardly so. It gains more, where gaps are long, than it loses where
they are short: hence the method ``auto`` follows it where it asks the posture.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.gaps.cross_validation import errors_of, lengths_to_try
from handclean.gaps.min_acceleration import EndFit, bridge
from handclean.gaps.runs import Cluster, Gap

WINDOWS = 240
"""Stretches tried per length (chosen)."""

ENOUGH = 40
"""Errors a guess needs (chosen)."""

RIDGE = 0.3
"""Of the mean variance of the known joints' errors; keeps the weights small
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """How the joints of a take go together.

    Attributes
    ----------
    errors : (W, D) [rad] per length of gap [frames]: what bridges missed, window by
        window, NaN where a joint was not known.
    """

    errors: dict[int, Floats]

    def guess(
        self, angles: Floats, known: Bools, gap: Gap, fit: EndFit, reach: int
    ) -> tuple[Floats, float]:
        """(N,) [rad] what to add to a path, and the share of its variance left then.

        Parameters
        ----------
        angles : (T, D) read where ``known``; the gap's column is the joint's.
        """
        nothing = np.zeros(gap.frames), 1.0
        around = slice(max(gap.start - fit.frames, 0), gap.stop + fit.frames)
        others = np.asarray(known[around].all(axis=0))
        others[gap.column] = False
        length = min(self.errors, key=lambda n: abs(np.log((n + 1) / (gap.frames + 1))))
        errors = self.errors[length]
        whole = np.isfinite(errors[:, others]).all(axis=1)
        whole &= np.isfinite(errors[:, gap.column])
        if not others.any() or np.count_nonzero(whole) < ENOUGH:
            return nothing
        theirs, own = errors[whole][:, others], errors[whole, gap.column]
        square = theirs.T @ theirs
        ridge = RIDGE * np.trace(square) / len(square) + 1e-30
        weights = np.linalg.solve(square + ridge * np.eye(len(square)), theirs.T @ own)
        left = float(np.sum((own - theirs @ weights) ** 2) / (np.sum(own**2) + 1e-30))
        left = min(1.0, left * (1.0 + len(square) / len(own)))
        outside = np.ones(len(known), dtype=bool)
        outside[gap.start : gap.stop] = False
        known_angles = angles[:, others]
        paths = bridge(known_angles, outside, Cluster(gaps=(gap,)), fit, reach)
        beside = known_angles[gap.start : gap.stop] - paths[0].path
        return np.asarray(beside @ weights), left


def couple(angles: Floats, known: Bools, longest: int, fit: EndFit) -> Coupling:
    """Learn from a take how its joints go together.

    Parameters
    ----------
    angles, known : (T, D)
    longest : [frames] longest gap that will be bridged.
    """
    samples = np.where(known, angles, np.nan)
    return Coupling(
        errors={
            int(frames): errors_of(samples, int(frames), fit, WINDOWS)[0]
            for frames in lengths_to_try(longest)
        }
    )
