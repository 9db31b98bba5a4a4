"""What a hand is modelled from: tubes with changing oval cross-sections, blended.

A tube runs along the y axis of its frame from ``at[0]`` to ``at[-1]``. At y its
cross-section is made of two half ellipses, as wide as ``half`` to either side, as high
as ``back`` above the axis (z > 0) and as deep as ``palm`` below it, all monotone
cubics between knots; its ends are half ellipsoids as long as ``caps``. Distance, to
first order at the skin, with (x, e, z) how far a place lies from the axis (e: beyond
the start of a cap) and r the half axes there:

    d = k0 (k0 - 1) / k1,    k0 = |x / r|,    k1 = |x / r^2|

Two distances are blended by the quadratic smooth minimum of width k,
``min(a, b) - max(k - |a - b|, 0)^2 / (4 k)``.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from handclean.arrays import Floats

_LEAST_M = 1e-9
"""[m] keeps a place on the axis from dividing by zero (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Tube:
    """A tube with N knots.

    Attributes
    ----------
    origin : (3,) [m] zero of the axis.
    frame : (3, 3) its directions as columns: across, along, out of the back.
    at : (N,) [m] knots along the axis, rising; the caps' tips are the first and last.
    half, back, palm : (N,) [m] width to a side, height and depth at the knots.
    caps : (2,) [m] lengths of the rounded ends.
    sizes : the last three at any place along the axis.
    """

    origin: Floats
    frame: Floats
    at: Floats
    half: Floats
    back: Floats
    palm: Floats
    caps: tuple[float, float]
    sizes: PchipInterpolator = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rows = np.column_stack([self.half, self.back, self.palm])
        object.__setattr__(self, "sizes", PchipInterpolator(self.at, rows))

    def local(self, points: Floats) -> Floats:
        """(N, 3) [m] places in the tube's frame: across, along, out of the back."""
        out: Floats = (points - self.origin) @ self.frame
        return out

    def distance(self, points: Floats) -> Floats:
        """(N,) [m] how far (N, 3) [m] places lie outside."""
        x, y, z = self.local(points).T
        start, stop = self.at[0] + self.caps[0], self.at[-1] - self.caps[1]
        inner = np.clip(y, start, stop)
        e = y - inner
        half, back, palm = self.sizes(inner).T
        rx, rz = half, np.where(z > 0.0, back, palm)
        re = np.where(e < 0.0, *self.caps)
        x = np.abs(x) + _LEAST_M
        k0 = np.sqrt((x / rx) ** 2 + (e / re) ** 2 + (z / rz) ** 2)
        k1 = np.sqrt((x / rx**2) ** 2 + (e / re**2) ** 2 + (z / rz**2) ** 2)
        out: Floats = k0 * (k0 - 1.0) / k1
        return out


def blend(a: Floats, b: Floats, width: float) -> Floats:
    """(N,) [m] smooth minimum of two distances, equal to the least where they differ.

    Parameters
    ----------
    width : [m] difference up to which they are blended.
    """
    near = np.maximum(width - np.abs(a - b), 0.0)
    out: Floats = np.minimum(a, b) - near**2 / (4.0 * width)
    return out
