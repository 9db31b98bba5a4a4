"""A scan as points with normals, and where on it a point of the skin belongs.

A vertex' counterpart is its foot on the plane through the nearest points whose normals
agree with its own: the closest point of the surface they sample, less its noise. There
is none where normals disagree, where it is too far, and beside the points instead of
among them: over a hole, the nearest points all lie on one side, and would pull the skin
to the hole's edge.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from handclean.arrays import Bools, Bytes, Floats, Ints, expect_shape

PLANE_POINTS = 6
"""Points a plane goes through (chosen)."""

MOST_ASIDE_SPREADS = 1.0
"""How far a foot may lie from the middle of its points, against their spread
(chosen)."""

LEAST_PLANE_POINTS = 3
"""Points that a plane goes through at least: three fix it."""


@dataclass(frozen=True, kw_only=True)
class Scan:
    """What a scanner measured.

    Attributes
    ----------
    points : (P, 3) [m]
    normals : (P, 3) looking out of the skin, of any length, or None.
    colors : (P, 3) red, green, blue, or None.
    """

    points: Floats
    normals: Floats | None = None
    colors: Bytes | None = None

    def __post_init__(self) -> None:
        expect_shape("points", self.points, "P", 3)
        if self.normals is not None:
            expect_shape("normals", self.normals, len(self.points), 3)
        if self.colors is not None:
            expect_shape("colors", self.colors, len(self.points), 3)

    def only(self, rows: Bools | Ints) -> "Scan":
        """Return some of the points."""
        return Scan(
            points=self.points[rows],
            normals=None if self.normals is None else self.normals[rows],
            colors=None if self.colors is None else self.colors[rows],
        )


@dataclass(frozen=True, kw_only=True)
class Pairs:
    """C vertices with where they belong.

    Attributes
    ----------
    rows : (C,) vertices; places : (C, 3) [m]
    """

    rows: Ints
    places: Floats


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """Points with unit normals that look out of the skin.

    Attributes
    ----------
    points, normals : (P, 3) [m], (P, 3)
    """

    points: Floats
    normals: Floats
    tree: cKDTree = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        expect_shape("points", self.points, "P", 3)
        expect_shape("normals", self.normals, len(self.points), 3)
        object.__setattr__(self, "tree", cKDTree(self.points))

    def pairs(
        self, vertices: Floats, normals: Floats, reach_m: float, angle_rad: float
    ) -> Pairs:
        """Find where vertices belong.

        Parameters
        ----------
        vertices, normals : (V, 3) [m], (V, 3) unit.
        reach_m : [m] how far it may be at most.
        angle_rad : by how much normals may differ.
        """
        count = min(PLANE_POINTS, len(self.points))
        away, near = self.tree.query(vertices, k=count, distance_upper_bound=reach_m)
        away, near = away.reshape(-1, count), near.reshape(-1, count)
        there = np.isfinite(away)
        near = np.where(there, near, 0)
        turned = np.einsum("vnk,vk->vn", self.normals[near], normals)
        there &= turned > np.cos(angle_rad)
        rows = np.flatnonzero(there.sum(axis=1) >= min(LEAST_PLANE_POINTS, count))
        share = there[rows] / there[rows].sum(axis=1, keepdims=True)
        around = self.points[near[rows]]
        middle = np.einsum("vn,vnk->vk", share, around)
        normal = np.einsum("vn,vnk->vk", share, self.normals[near[rows]])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        gone = np.einsum("vk,vk->v", middle - vertices[rows], normal)
        feet = vertices[rows] + gone[:, None] * normal
        spread = np.einsum(
            "vn,vn->v", share, np.linalg.norm(around - middle[:, None], axis=2)
        )
        aside = np.linalg.norm(feet - middle, axis=1)
        kept = (aside <= MOST_ASIDE_SPREADS * spread) & (np.abs(gone) <= reach_m)
        return Pairs(rows=rows[kept], places=feet[kept])

    def snapped(self, places: Floats) -> Floats:
        """(N, 3) [m] places moved onto the planes through their nearest points."""
        _, near = self.tree.query(places, k=min(PLANE_POINTS, len(self.points)))
        near = near.reshape(len(places), -1)
        middle = self.points[near].mean(axis=1)
        normal = self.normals[near].mean(axis=1)
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        normal /= np.where(size > 0.0, size, 1.0)
        gone = np.einsum("nk,nk->n", middle - places, normal)
        out: Floats = places + gone[:, None] * normal
        return out
