"""The template's skin drawn onto the scan: nonrigid registration.

Minimised is (Schroeder et al. 2017, equations 14 to 17)

    E(X) = l_lm E_lm + l_fit E_fit + l_reg E_reg,
    E_lm = mean over landmarks |x_l - p_l|^2,   E_fit = mean over pairs |x_c - p_c|^2,
    E_reg = mean over vertices |(Delta x)_v - R_v (Delta rest)_v|^2,

with the Laplacian of the undeformed mesh (``numerics.laplacian``) and rotations R_v
that carry the rings of edges best. For fixed R the minimum is one linear system with
three right-hand sides,

    (l_reg / V  D'D + diag(w)) X = l_reg / V  D' (R D rest) + diag(w) P,

D being the matrix of Delta and w the weights of landmarks and pairs; for fixed X the
rotations are known. Both are done in turn; the system is factored once for all turns in
which neither l_reg nor the pairs change.

**Rotations.** Those of the rings are not the minimum of E_reg over R, so a new R may
raise E a little where each solution lowers it. Rotations that carry the one vector
(Delta rest)_v to (Delta x)_v are that minimum, and with them E only falls; but they
know nothing of their neighbours. Where the posture was right they fit as well; where
fingers were some 15 degrees off, skin slid 3.3 mm along the scan in the mean instead of
1.8, and joints were 1.8 mm off instead of 1.5 (no rotations at all: 2.9 and 1.9).

**Unit.** Delta x is an inverse length, so l_reg is a length to the fourth; taken in
what unit the paper does not say. Here it is the length of the hand: l_reg = 1e-8 lets
the skin bend freely over 1e-8^(1/4) = 1 % of it (2 mm), l_reg = 1 only as a whole.

**Schedule.** l_reg falls from 1 to 1e-6 with landmarks alone, then to 1e-8 with pairs,
which are found anew at every value.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags

from handclean.arrays import Floats, Ints, expect_shape
from handclean.hand.surface import vertex_normals
from handclean.numerics.laplacian import Dissected, laplacian, turns_of_rings
from handclean.numerics.rotations import rotated
from handclean.subject.scan.cloud import Pairs

Find = Callable[[Floats, Floats], Pairs]
"""Finds pairs for vertices (V, 3) [m] with normals (V, 3)."""

SOLUTIONS_PER_FACTOR = 2
"""Solutions with the same factors at every value of l_reg (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One solution of the linear system.

    Attributes
    ----------
    stiffness : l_reg; pairs : how many vertices have a counterpart in the scan.
    before, after : E with the rotations that were solved with, before and after.
    landmark_m, fit_m : [m] RMS distance left to landmarks and pairs; NaN without any.
    """

    stiffness: float
    pairs: int
    before: float
    after: float
    landmark_m: float
    fit_m: float


@dataclass(frozen=True, kw_only=True)
class Registered:
    """The fitted skin.

    Attributes
    ----------
    vertices : (V, 3) [m]
    pairs : the last ones.
    stages : every solution, in order.
    """

    vertices: Floats
    pairs: Pairs
    stages: tuple[Stage, ...]


NO_PAIRS = Pairs(rows=np.zeros(0, dtype=np.int64), places=np.zeros((0, 3)))


class Registration:
    """A mesh being deformed; ``vertices`` [m] are its present state."""

    def __init__(
        self, rest: Floats, faces: Ints, landmarks: Pairs, unit_m: float
    ) -> None:
        """Start at the undeformed mesh.

        Parameters
        ----------
        rest, faces : (V, 3) [m], (F, 3)
        landmarks : vertices with where they belong.
        unit_m : [m] the length of the hand.
        """
        expect_shape("rest", rest, "V", 3)
        self.vertices = rest.copy()
        self.stages: list[Stage] = []
        self.pairs = NO_PAIRS
        self._faces = faces
        self._unit = unit_m
        self._rest = rest / unit_m
        self._landmarks = landmarks
        self._of = laplacian(self._rest, faces)
        self._bend = self._of.matrix @ self._rest
        self._square: csr_matrix = (self._of.matrix.T @ self._of.matrix).tocsr()
        self._solver = Dissected(self._square, self._rest)

    def relax(
        self,
        stiffness: float,
        landmark: float,
        find: Find | None,
        turns: int = SOLUTIONS_PER_FACTOR,
    ) -> None:
        """Find the best shape for one l_reg, with pairs if they can be found."""
        if find is not None:
            normals = vertex_normals(self.vertices, self._faces)
            self.pairs = find(self.vertices, normals)
        count = len(self._rest)
        weight, target = self._data(landmark)
        stiff = stiffness / count
        self._solver.factor((stiff * self._square + diags(weight)).tocsr())
        for _ in range(turns):
            now = self.vertices / self._unit
            turned = turns_of_rings(self._rest, now, self._of)
            bend = rotated(turned, self._bend)
            right = stiff * (self._of.matrix.T @ bend) + target
            solved = self._solver.solve(right)
            before, after = (
                self._energy(at, bend, stiffness, landmark) for at in (now, solved)
            )
            self.vertices = solved * self._unit
            self.stages.append(self._stage(stiffness, before, after))

    def _data(self, landmark: float) -> tuple[Floats, Floats]:
        """(V,) weights of landmarks and pairs, and (V, 3) weights times places."""
        weight, target = np.zeros(len(self._rest)), np.zeros(self._rest.shape)
        for pairs, share in ((self._landmarks, landmark), (self.pairs, 1.0)):
            each = share / max(len(pairs.rows), 1)
            np.add.at(weight, pairs.rows, each)
            np.add.at(target, pairs.rows, each * pairs.places / self._unit)
        return weight, target

    def _energy(
        self, at: Floats, bend: Floats, stiffness: float, landmark: float
    ) -> float:
        """E, in units of the hand's length, with given R D rest."""
        off = self._of.matrix @ at - bend
        total = stiffness * float(np.sum(off**2)) / len(at)
        for pairs, share in ((self._landmarks, landmark), (self.pairs, 1.0)):
            away = at[pairs.rows] - pairs.places / self._unit
            total += share * float(np.sum(away**2)) / max(len(pairs.rows), 1)
        return total

    def _stage(self, stiffness: float, before: float, after: float) -> Stage:
        return Stage(
            stiffness=stiffness,
            pairs=len(self.pairs.rows),
            before=before,
            after=after,
            landmark_m=_rms(self.vertices, self._landmarks),
            fit_m=_rms(self.vertices, self.pairs),
        )

    def registered(self) -> Registered:
        """Return the outcome."""
        return Registered(
            vertices=self.vertices, pairs=self.pairs, stages=tuple(self.stages)
        )


def _rms(vertices: Floats, pairs: Pairs) -> float:
    """[m] RMS distance of vertices from where they belong; NaN without any."""
    if not len(pairs.rows):
        return np.nan
    away = vertices[pairs.rows] - pairs.places
    return float(np.sqrt(np.mean(np.sum(away**2, axis=1))))


def falling(start: float, stop: float, each: int) -> Floats:
    """Values from ``start`` down to ``stop``, ``each`` for a factor of ten."""
    count = max(round(each * np.log10(start / stop)), 0) + 1
    return np.geomspace(start, stop, count)
