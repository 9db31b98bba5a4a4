"""Covariance functions: sums of terms, with derivatives.

The terms of Wang & Neff (2013), equation 8, each with the logarithms of its
hyperparameters (S inputs):

===== ============================================ ======================
lard  sum_d beta_d a_d b_d                         beta_1 ... beta_S
rbf   eta exp(-gamma / 2 |a - b|^2)                eta, gamma
seard eta exp(-1/2 sum_d gamma_d (a_d - b_d)^2)    eta, gamma_1 ... gamma_S
polyP (c + sum_d beta_d a_d b_d)^P                 c, beta_1 ... beta_S
===== ============================================ ======================

``gram`` gives a term's matrix K (n, m) between inputs A (n, S) and B (m, S); ``pull``
takes a matrix G (n, m), the derivative of some number f with respect to K, to the
derivatives of f with respect to the term's logarithms and to B. For seard, with
W = G * K, all of it follows from the column sums of W and from W^T A, W^T (A * A):

    df/d log eta      = sum_ij W_ij
    df/d log gamma_d  = -gamma_d / 2  sum_ij W_ij (A_id - B_jd)^2
    df/d B_jd         =  gamma_d  sum_i W_ij (A_id - B_jd)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from handclean.arrays import Floats
from handclean.errors import UnknownNameError


class Term(Protocol):
    """One summand of a covariance function of S inputs."""

    def names(self, inputs: int) -> list[str]:
        """Names of the hyperparameters."""

    def gram(
        self, logs: Floats, a: Floats, b: Floats, out: Floats | None = None
    ) -> Floats:
        """(n, m) covariance between a (n, S) and b (m, S), in ``out`` if given."""

    def diagonal(self, logs: Floats, a: Floats) -> Floats:
        """(n,) covariance of each of a (n, S) with itself."""

    def pull(
        self, logs: Floats, a: Floats, b: Floats, gram: Floats, up: Floats
    ) -> tuple[Floats, Floats]:
        """Derivatives by the logarithms and by b (m, S), ``up`` being that by gram."""

    def pull_diagonal(self, logs: Floats, a: Floats, up: Floats) -> Floats:
        """Derivatives by the logarithms, ``up`` (n,) being that by the diagonal."""


class Linear:
    """Term ``lard``."""

    def names(self, inputs: int) -> list[str]:
        """Names of the hyperparameters."""
        return [f"beta_{d + 1}" for d in range(inputs)]

    def gram(
        self, logs: Floats, a: Floats, b: Floats, out: Floats | None = None
    ) -> Floats:
        """(n, m) covariance."""
        gram: Floats = np.matmul(a * np.exp(logs), b.T, out=out)
        return gram

    def diagonal(self, logs: Floats, a: Floats) -> Floats:
        """(n,) covariance of each with itself."""
        diagonal: Floats = (a * a) @ np.exp(logs)
        return diagonal

    def pull(
        self, logs: Floats, a: Floats, b: Floats, gram: Floats, up: Floats
    ) -> tuple[Floats, Floats]:
        """Derivatives by the logarithms and by b."""
        pulled = np.exp(logs) * (up.T @ a)
        return (b * pulled).sum(axis=0), pulled

    def pull_diagonal(self, logs: Floats, a: Floats, up: Floats) -> Floats:
        """Derivatives by the logarithms."""
        pulled: Floats = np.exp(logs) * (up @ (a * a))
        return pulled


@dataclass(frozen=True)
class SquaredExponential:
    """Terms ``rbf`` (one length for all inputs) and ``seard`` (one each)."""

    each: bool

    def names(self, inputs: int) -> list[str]:
        """Names of the hyperparameters."""
        if not self.each:
            return ["eta", "gamma"]
        return ["eta", *(f"gamma_{d + 1}" for d in range(inputs))]

    def _gamma(self, logs: Floats, inputs: int) -> Floats:
        gamma: Floats = np.broadcast_to(np.exp(logs[1:]), (inputs,))
        return gamma

    def gram(
        self, logs: Floats, a: Floats, b: Floats, out: Floats | None = None
    ) -> Floats:
        """(n, m) covariance."""
        root = np.sqrt(self._gamma(logs, a.shape[1]))
        a, b = a * root, b * root
        one_a, one_b = np.ones((len(a), 1)), np.ones((len(b), 1))
        half_a = logs[0] - 0.5 * (a * a).sum(axis=1, keepdims=True)
        half_b = -0.5 * (b * b).sum(axis=1, keepdims=True)
        gram: Floats = np.matmul(
            np.hstack([a, half_a, one_a]), np.hstack([b, one_b, half_b]).T, out=out
        )
        np.minimum(gram, logs[0], out=gram)
        np.exp(gram, out=gram)
        return gram

    def diagonal(self, logs: Floats, a: Floats) -> Floats:
        """(n,) covariance of each with itself."""
        return np.full(len(a), np.exp(logs[0]))

    def pull(
        self, logs: Floats, a: Floats, b: Floats, gram: Floats, up: Floats
    ) -> tuple[Floats, Floats]:
        """Derivatives by the logarithms and by b."""
        inputs = a.shape[1]
        gamma = self._gamma(logs, inputs)
        sums = (up * gram).T @ np.hstack([a, a * a, np.ones((len(a), 1))])
        first, second, column = sums[:, :inputs], sums[:, inputs:-1], sums[:, -1:]
        apart = (second + b * (column * b - 2.0 * first)).sum(axis=0)
        by_gamma = -0.5 * gamma * apart
        if not self.each:
            by_gamma = by_gamma.sum(keepdims=True)
        by_logs = np.concatenate([[column.sum()], by_gamma])
        return by_logs, gamma * (first - column * b)

    def pull_diagonal(self, logs: Floats, a: Floats, up: Floats) -> Floats:
        """Derivatives by the logarithms."""
        by_logs = np.zeros(len(logs))
        by_logs[0] = np.exp(logs[0]) * up.sum()
        return by_logs


@dataclass(frozen=True)
class Polynomial:
    """Terms ``poly2``, ``poly3``: a polynomial of a degree (section 8.1)."""

    degree: int

    def names(self, inputs: int) -> list[str]:
        """Names of the hyperparameters."""
        return ["c", *(f"beta_{d + 1}" for d in range(inputs))]

    def gram(
        self, logs: Floats, a: Floats, b: Floats, out: Floats | None = None
    ) -> Floats:
        """(n, m) covariance."""
        gram: Floats = np.power(self._base(logs, a, b), self.degree, out=out)
        return gram

    def _base(self, logs: Floats, a: Floats, b: Floats) -> Floats:
        base: Floats = (a * np.exp(logs[1:])) @ b.T + np.exp(logs[0])
        return base

    def diagonal(self, logs: Floats, a: Floats) -> Floats:
        """(n,) covariance of each with itself."""
        base = (a * a) @ np.exp(logs[1:]) + np.exp(logs[0])
        diagonal: Floats = base**self.degree
        return diagonal

    def pull(
        self, logs: Floats, a: Floats, b: Floats, gram: Floats, up: Floats
    ) -> tuple[Floats, Floats]:
        """Derivatives by the logarithms and by b."""
        slope = self.degree * self._base(logs, a, b) ** (self.degree - 1) * up
        pulled = np.exp(logs[1:]) * (slope.T @ a)
        by_c = np.exp(logs[0]) * slope.sum()
        return np.concatenate([[by_c], (b * pulled).sum(axis=0)]), pulled

    def pull_diagonal(self, logs: Floats, a: Floats, up: Floats) -> Floats:
        """Derivatives by the logarithms."""
        beta, c = np.exp(logs[1:]), np.exp(logs[0])
        slope = self.degree * ((a * a) @ beta + c) ** (self.degree - 1) * up
        return np.concatenate([[c * slope.sum()], beta * (slope @ (a * a))])


TERMS: dict[str, Term] = {
    "lard": Linear(),
    "rbf": SquaredExponential(each=False),
    "seard": SquaredExponential(each=True),
    "poly2": Polynomial(degree=2),
    "poly3": Polynomial(degree=3),
}


@dataclass(frozen=True)
class Kernel:
    """A sum of terms of S inputs; its logarithms are theirs, one after the other.

    Attributes
    ----------
    terms : names, of `TERMS`.
    inputs : S.
    """

    terms: tuple[str, ...]
    inputs: int

    def __post_init__(self) -> None:
        for name in self.terms:
            if name not in TERMS:
                raise UnknownNameError("kernel", "covariance term", name, TERMS)

    @cached_property
    def _parts(self) -> list[tuple[Term, slice]]:
        parts, end = [], 0
        for name in self.terms:
            begin, end = end, end + len(TERMS[name].names(self.inputs))
            parts.append((TERMS[name], slice(begin, end)))
        return parts

    @property
    def size(self) -> int:
        """How many hyperparameters there are."""
        return len(self.names)

    @cached_property
    def names(self) -> list[str]:
        """Names of the hyperparameters; a term's place stands before its own."""
        several = len(self.terms) > 1
        return [
            f"{place + 1}.{name}" if several else name
            for place, term in enumerate(self.terms)
            for name in TERMS[term].names(self.inputs)
        ]

    def grams(
        self, logs: Floats, a: Floats, b: Floats, out: Sequence[Floats] | None = None
    ) -> list[Floats]:
        """(n, m) covariance between a (n, S) and b (m, S), term by term.

        ``out``, a matrix per term, saves asking the system for memory each time, which
        takes longer than the arithmetic.
        """
        into: Sequence[Floats | None] = out or [None] * len(self.terms)
        return [
            term.gram(logs[part], a, b, matrix)
            for (term, part), matrix in zip(self._parts, into, strict=True)
        ]

    def gram(self, logs: Floats, a: Floats, b: Floats) -> Floats:
        """(n, m) covariance between a (n, S) and b (m, S)."""
        return total(self.grams(logs, a, b))

    def diagonal(self, logs: Floats, a: Floats) -> Floats:
        """(n,) covariance of each of a (n, S) with itself."""
        return total([term.diagonal(logs[part], a) for term, part in self._parts])

    def pull(
        self, logs: Floats, a: Floats, b: Floats, grams: Sequence[Floats], up: Floats
    ) -> tuple[Floats, Floats]:
        """Derivatives by the logarithms and by b (m, S), ``up`` being that by gram."""
        by_logs, by_b = np.zeros(self.size), np.zeros(b.shape)
        for (term, part), gram in zip(self._parts, grams, strict=True):
            by_logs[part], more = term.pull(logs[part], a, b, gram, up)
            by_b += more
        return by_logs, by_b

    def pull_diagonal(self, logs: Floats, a: Floats, up: Floats) -> Floats:
        """Derivatives by the logarithms, ``up`` (n,) being that by the diagonal."""
        return np.concatenate(
            [term.pull_diagonal(logs[part], a, up) for term, part in self._parts]
        )


def total(matrices: Sequence[Floats]) -> Floats:
    """Sum of matrices, in a new one or the only one."""
    if len(matrices) == 1:
        return matrices[0]
    result: Floats = matrices[0] + matrices[1]
    for matrix in matrices[2:]:
        result += matrix
    return result
