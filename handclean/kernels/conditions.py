"""Condition numbers of small symmetric matrices that are not negative.

A matrix is brought to tridiagonal form by Householder reflections (Golub and Van Loan,
Matrix computations, 8.3.1). Of the tridiagonal matrix only the smallest and the largest
eigenvalue are wanted: Laguerre's iteration on the characteristic polynomial, begun on
either side of all its roots, goes to the nearest root monotonically and cubically,
since all roots are real (Parlett, The symmetric eigenvalue problem, 7.5).

What is smaller than n eps times the largest eigenvalue is rounding: a matrix with such
an eigenvalue has no inverse, and its condition number is infinite.
"""

import math

from handclean.arrays import Floats
from handclean.kernels import jit

_MACHINE_EPSILON = 2.220446049250313e-16
"""Of float64."""

_ZERO_BELOW = 1e-250
"""Numbers below count as 0, so that no quotient overflows (chosen)."""

_STEP_SHARE = 1e-7
"""A step this small, relative to the root, is the last: the method converges cubically,
so that what is left is below rounding (chosen)."""

_MOST_STEPS = 60
"""Steps to an eigenvalue, at most (chosen; no matrix met needed as many)."""


@jit
def condition(a: Floats, d: Floats, e: Floats) -> float:
    """Return the condition number of a symmetric matrix without negative eigenvalues.

    Parameters
    ----------
    a : (n, n), n <= 30; only the lower triangle is read; destroyed.
    d, e : (n,) work space.

    Returns
    -------
    float : at least 1; infinite if the matrix has no inverse.
    """
    tridiagonal(a, d, e)
    n = d.shape[0]
    if n == 1:
        return 1.0 if d[0] > 0.0 else math.inf
    bound = 0.0
    for i in range(n):
        size = abs(d[i])
        if i > 0:
            size += abs(e[i - 1])
        if i < n - 1:
            size += abs(e[i])
        bound = max(bound, size)
    if not bound > 0.0:
        return math.inf
    for i in range(n):
        d[i] /= bound
        e[i] = (e[i] / bound) ** 2
    noise = n * _MACHINE_EPSILON
    low = outer_root(d, e, -noise, -1.0)
    high = outer_root(d, e, 1.0 + noise, 1.0)
    if not low > noise * high:
        return math.inf
    return high / low


@jit
def tridiagonal(a: Floats, d: Floats, e: Floats) -> None:
    """Write the tridiagonal form of a symmetric matrix.

    Parameters
    ----------
    a : (n, n); only the lower triangle is read; destroyed.
    d : (n,) the diagonal; e : (n,) what is beside it, the last entry 0; overwritten.
    """
    n = d.shape[0]
    for k in range(n - 2):
        d[k] = a[k, k]
        square = 0.0
        for i in range(k + 1, n):
            square += a[i, k] * a[i, k]
        size = math.sqrt(square)
        if a[k + 1, k] > 0.0:
            size = -size
        e[k] = size
        half = square - a[k + 1, k] * size  # u'u / 2, u the mirror's normal
        if half < _ZERO_BELOW:
            continue
        a[k + 1, k] -= size
        along = 0.0
        for i in range(k + 1, n):  # row k, above the diagonal: A u, then q
            total = 0.0
            for j in range(k + 1, i + 1):
                total += a[i, j] * a[j, k]
            for j in range(i + 1, n):
                total += a[j, i] * a[j, k]
            a[k, i] = total / half
            along += a[k, i] * a[i, k]
        along /= 2.0 * half
        for i in range(k + 1, n):
            a[k, i] -= along * a[i, k]
        for i in range(k + 1, n):
            u, q = a[i, k], a[k, i]
            for j in range(k + 1, i + 1):
                a[i, j] -= u * a[k, j] + q * a[j, k]
    if n > 1:
        d[n - 2], e[n - 2] = a[n - 2, n - 2], a[n - 1, n - 2]
    d[n - 1], e[n - 1] = a[n - 1, n - 1], 0.0


@jit
def outer_root(d: Floats, squares: Floats, start: float, side: float) -> float:
    """Return the smallest or largest eigenvalue of a tridiagonal matrix.

    Parameters
    ----------
    d : (n,) the diagonal; squares : (n,) of what is beside it; both scaled so that
        eigenvalues are about 1 or less.
    start : where to begin: outside all eigenvalues, on their side.
    side : -1 for the smallest, from the left; 1 for the largest, from the right.
    """
    x, n = start, d.shape[0]
    for _ in range(_MOST_STEPS):
        p0, p1 = 1.0, d[0] - x
        s0, s1 = 0.0, -1.0  # first derivative
        c0, c1 = 0.0, 0.0  # second
        for i in range(1, n):
            away, square = d[i] - x, squares[i - 1]
            p2 = away * p1 - square * p0
            s2 = away * s1 - p1 - square * s0
            c2 = away * c1 - 2.0 * s1 - square * c0
            p0, p1, s0, s1, c0, c1 = p1, p2, s1, s2, c1, c2
        if not abs(p1) > _ZERO_BELOW:
            return x
        slope = s1 / p1
        if not slope * side > 0.0:  # rounding has carried x past the root
            return x
        bend = slope * slope - c1 / p1
        inner = (n - 1) * (n * bend - slope * slope)
        step = n / (slope + side * math.sqrt(max(inner, 0.0)))
        x -= step
        if abs(step) <= _STEP_SHARE * abs(x):
            return float(x)
    return float(x)
