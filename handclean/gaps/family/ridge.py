"""The yardstick: ridge regression of a hidden marker on those that are seen.

With donors F and hidden places Y in the body's coordinates, less their means over the
N frames to learn from, slopes B minimise ::

    |Y - F B|^2 + N r |B|^2 ,    hence    (F^T F + N r I) B = F^T Y .

(Hoerl and Kennard, Ridge regression, Technometrics 12 (1970).)
"""

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.family.rule import prepare_rule
from handclean.gaps.tracks import Fill, Tracks

SHRINK_M2 = 5e-8
"""[m^2] r of the formula: 0.05 mm^2 (chosen, before the takes it is judged by)."""


def prepare(tracks: Tracks) -> Fill:
    """Fill by ridge regression on all markers that are seen throughout."""
    return prepare_rule(tracks, ridge_slopes)


def ridge_slopes(donors: Floats, places: Floats) -> Floats:
    """(3 V, 3) B of the module's formula.

    Parameters
    ----------
    donors : (N, V, 3) [m]; places : (N, 3) [m]; in the body's coordinates.
    """
    rows = (donors - donors.mean(axis=0)).reshape(len(donors), -1)
    square = rows.T @ rows
    square[np.diag_indices(len(square))] += SHRINK_M2 * len(rows)
    return np.linalg.solve(square, rows.T @ (places - places.mean(axis=0)))
