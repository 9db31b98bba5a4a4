"""Array types, the letters of their dimensions, and the one shape check.

The letters mean the same everywhere:

====  =======================================================
T     frames
M     markers
P     points (in a frame, or in a list of unlabelled points)
B     bones of a joint tree; each hangs on the joint of its root end
D     hinge angles
K     subspace directions
V, F  vertices, faces
S     glove sensors
N     samples
====  =======================================================

Inside the package everything is in metres, radians, seconds, hertz and float64;
only ``handclean.io`` and ``handclean.report`` know millimetres and degrees.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.errors import ShapeError

Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Ints = NDArray[np.int64]
Ints32 = NDArray[np.int32]
Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]
Bools = NDArray[np.bool_]


def runs(mask: Bools) -> list[tuple[int, int]]:
    """Stretches of true values in a row, in their order.

    Parameters
    ----------
    mask : (T,)

    Returns
    -------
    The first index and the one behind the last of each stretch.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def expect_shape(name: str, array: NDArray[Any], *shape: int | str) -> None:
    """Check that ``array`` has a shape like ``(T, 3)``; letters match any size.

    Raises
    ------
    ShapeError
        If the number of dimensions differs, a number does not match, or the same
        letter stands for two sizes.
    """
    sizes: dict[str, int] = {}
    fits = array.ndim == len(shape)
    for want, size in zip(shape, array.shape, strict=False):
        if isinstance(want, str):
            fits = fits and sizes.setdefault(want, size) == size
        else:
            fits = fits and want == size
    if not fits:
        text = ", ".join(map(str, shape)) + ("," if len(shape) == 1 else "")
        raise ShapeError(f"{name} should have shape ({text}), not {array.shape}")
