"""The Cholesky factor of small symmetric matrices, and solving with it, in place.

A positive definite A = L L^T, with L a lower triangle (Golub and Van Loan, Matrix
Computations, 4.2). Only the lower triangle of A is read; L replaces it.
"""

import math

import numpy as np

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
def forward_vector(lower: Floats, vector: Floats, first: int) -> None:
    """Replace (P,) ``vector`` by inv(L) vector, L a lower triangle (P, P).

    Parameters
    ----------
    first : the vector is 0 before it, and stays so.
    """
    for a in range(first, lower.shape[0]):
        for k in range(first, a):
            vector[a] -= lower[a, k] * vector[k]
        vector[a] /= lower[a, a]


@jit
def backward(lower: Floats, vector: Floats) -> None:
    """Replace (P,) ``vector`` by inv(L)^T vector, L a lower triangle (P, P)."""
    for a in range(lower.shape[0] - 1, -1, -1):
        vector[a] /= lower[a, a]
        for k in range(a):
            vector[k] -= lower[a, k] * vector[a]


@jit
def backward_by_rows(lower: Floats, vector: Floats) -> None:
    """Do what `backward` does, summing in the other order.

    Sums that are rounded differently lead some takes of two markers per finger into
    another posture, so that each caller keeps its own order.
    """
    for a in range(lower.shape[0] - 1, -1, -1):
        for k in range(a + 1, lower.shape[0]):
            vector[a] -= lower[k, a] * vector[k]
        vector[a] /= lower[a, a]


@jit
def solve(square: Floats, vector: Floats) -> bool:
    """Replace (P,) ``vector`` by inv(A) vector; A's lower triangle is overwritten.

    Returns
    -------
    Whether A was positive definite; if not, the vector is not changed.
    """
    if not factor(square):
        return False
    forward_vector(square, vector, 0)
    backward(square, vector)
    return True


@jit
def invert(square: Floats, out: Floats) -> bool:
    """Write inv(A), both triangles; A's lower triangle is overwritten.

    Returns
    -------
    Whether A was positive definite; if not, ``out`` is NaN.
    """
    size = square.shape[0]
    if not factor(square):
        out[:] = np.nan
        return False
    for c in range(size):  # inv(L), then inv(L)^T inv(L)
        for i in range(size):
            total = 1.0 if i == c else 0.0
            if i >= c:
                for n in range(c, i):
                    total -= square[i, n] * out[n, c]
                out[i, c] = total / square[i, i]
            else:
                out[i, c] = 0.0
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for n in range(i, size):
                total += out[n, i] * out[n, j]
            square[i, j] = total
    for i in range(size):
        for j in range(i + 1):
            out[i, j] = square[i, j]
            out[j, i] = square[i, j]
    return True
