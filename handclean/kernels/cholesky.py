"""Cholesky factors of small symmetric matrices, and solving with them in place."""

import math

from handclean.arrays import Floats
from handclean.kernels import jit


@jit
def factor(square: Floats) -> bool:
    """Turn the lower triangle of a symmetric matrix into its Cholesky factor.

    Returns
    -------
    Whether the matrix was positive definite; if not, it is left half done.
    """
    for a in range(square.shape[0]):
        for b in range(a + 1):
            total = square[a, b]
            for k in range(b):
                total -= square[a, k] * square[b, k]
            if a > b:
                square[a, b] = total / square[b, b]
            elif total > 0.0:
                square[a, a] = math.sqrt(total)
            else:
                return False
    return True


@jit
def forward(lower: Floats, rows: Floats) -> None:
    """Replace (P, N) ``rows`` by inv(L) rows, L a lower triangle (P, P)."""
    for a in range(lower.shape[0]):
        for k in range(a):
            if lower[a, k] != 0.0:
                for n in range(rows.shape[1]):
                    rows[a, n] -= lower[a, k] * rows[k, n]
        for n in range(rows.shape[1]):
            rows[a, n] /= lower[a, a]


@jit
def backward(lower: Floats, vector: Floats) -> None:
    """Replace (P,) ``vector`` by inv(L)^T vector, L a lower triangle (P, P)."""
    for a in range(lower.shape[0] - 1, -1, -1):
        vector[a] /= lower[a, a]
        for k in range(a):
            vector[k] -= lower[a, k] * vector[a]
