"""A pose moved by a step: the counterpart of ``chain.marker_jacobian``."""

import numpy as np

from handclean.arrays import Floats
from handclean.kernels import jit
from handclean.kernels.rotations import compose, exponential


@jit
def move(pose: Floats, step: Floats, out: Floats) -> None:
    """Write ``pose`` (7 + D,) moved by ``step`` (6 + D,), the root as exp(w) R."""
    turn = np.zeros(4)
    exponential(step[3:6], turn)
    compose(turn, pose[3:7], out[3:7])
    for n in range(3):
        out[n] = pose[n] + step[n]
    for d in range(6, step.shape[0]):
        out[1 + d] = pose[1 + d] + step[d]
