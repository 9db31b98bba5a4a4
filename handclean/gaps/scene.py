"""What a filler of a hand's markers looks at: samples, model and bridged posture."""

from dataclasses import dataclass, field

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.gaps.posture import Posture
from handclean.gaps.runs import Gap, Limits, seen_in
from handclean.hand.model import Model


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A labelled take with gaps.

    Attributes
    ----------
    positions : (T, M, 3) [m] measured samples of the model's markers, NaN elsewhere.
    model : the hand with these markers.
    posture : the take's posture, bridged.
    limits : what may be bridged.
    noise : (M,) [m] standard deviation of the markers per axis.
    seen : (T, M) which samples are measured.
    """

    positions: Floats
    model: Model
    posture: Posture
    limits: Limits
    noise: Floats
    seen: Bools = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "seen", seen_in(self.positions))

    def seen_through(self, gap: Gap) -> Bools:
        """(M,) which markers are in sight in all of a gap and at both its ends."""
        return np.asarray(self.seen[gap.start - 1 : gap.stop + 1].all(axis=0))
