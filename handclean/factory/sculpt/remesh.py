"""Even triangles: a closed mesh is split, collapsed, flipped and relaxed.

Botsch and Kobbelt, A remeshing approach to multiresolution modeling, SGP (2004): with
a wanted edge length l, edges over 4/3 l are split at their middle, edges under 4/5 l
collapse into theirs, edges are flipped where that brings their four vertices nearer to
six neighbours, and vertices move along the surface to the mean of their neighbours.
Every step keeps a closed manifold closed and manifold.

Lengths may count elsewhere than where the surface is known: the hand is modelled with
its fingers spread, and its triangles should be even when they are not.
"""

from collections.abc import Callable
from math import dist, sqrt

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.surface import edges_of, vertex_normals
from handclean.numerics.rotations import rotated

Project = Callable[[Floats], Floats]
Measured = Callable[[Floats], tuple[Floats, Floats]]

_Place = tuple[float, float, float]

_LONG_EDGES, _SHORT_EDGES = 4.0 / 3.0, 4.0 / 5.0
"""[-] of the wanted edge length, to split and to collapse (Botsch and Kobbelt 2004)."""


class _Mesh:
    """A closed mesh that can be cut: triangles by number, and those of each vertex.

    Vertices are ``own`` on the surface, and ``at`` where lengths count.
    """

    def __init__(self, vertices: Floats, faces: Ints, at: Floats) -> None:
        self.own: list[_Place] = [(x, y, z) for x, y, z in vertices.tolist()]
        self.at: list[_Place] = [(x, y, z) for x, y, z in at.tolist()]
        self.faces: dict[int, tuple[int, int, int]] = {
            n: (int(a), int(b), int(c)) for n, (a, b, c) in enumerate(faces)
        }
        self.of: list[set[int]] = [set() for _ in self.at]
        for n, face in self.faces.items():
            for v in face:
                self.of[v].add(n)
        self.next = len(self.faces)

    def add(self, a: int, b: int, c: int) -> None:
        self.faces[self.next] = (a, b, c)
        for v in (a, b, c):
            self.of[v].add(self.next)
        self.next += 1

    def drop(self, n: int) -> None:
        for v in self.faces.pop(n):
            self.of[v].discard(n)

    def around(self, v: int) -> set[int]:
        """Neighbours of a vertex."""
        return {w for n in self.of[v] for w in self.faces[n]} - {v}

    def across(self, a: int, b: int) -> tuple[int, int, int, int]:
        """Return the faces left and right of edge ab and their third vertices."""
        for n in self.of[a] & self.of[b]:
            face = self.faces[n]
            third = sum(face) - a - b
            if face[(face.index(a) + 1) % 3] == b:
                left, above = n, third
            else:
                right, below = n, third
        return left, right, above, below

    def edges(self) -> list[tuple[int, int]]:
        faces = np.array(list(self.faces.values()), dtype=np.int64)
        return [(int(a), int(b)) for a, b in edges_of(faces)]

    def edge_length(self, a: int, b: int) -> float:
        return dist(self.at[a], self.at[b])

    def arrays(self) -> tuple[Floats, Ints]:
        """Return vertices and faces without what was dropped."""
        faces = np.array(list(self.faces.values()), dtype=np.int64)
        used = np.unique(faces)
        number = np.full(len(self.at), -1)
        number[used] = np.arange(len(used))
        out: Ints = number[faces]
        return np.array(self.own)[used], out


def remesh(
    vertices: Floats,
    faces: Ints,
    edge: float,
    project: Project,
    measured: Measured,
    rounds: int = 8,
) -> tuple[Floats, Ints]:
    """Return a closed mesh with edges of about one length.

    Parameters
    ----------
    vertices, faces : (V, 3) [m], (F, 3) a closed manifold.
    edge : [m] wanted length.
    project : brings (V, 3) [m] places back onto the surface.
    measured : (V, 3) [m] where lengths count, of (V, 3) [m] places; and the turns
        (V, 3, 3) from there to the places.
    """
    for _ in range(rounds):
        mesh = _Mesh(vertices, faces, measured(vertices)[0])
        _split(mesh, _LONG_EDGES * edge)
        _collapse(mesh, _SHORT_EDGES * edge, _LONG_EDGES * edge)
        _flip(mesh)
        vertices, faces = mesh.arrays()
        vertices = relax(vertices, faces, project, measured, 3)
    mesh = _Mesh(vertices, faces, measured(vertices)[0])
    _flip(mesh)
    vertices, faces = mesh.arrays()
    return relax(vertices, faces, project, measured, 20), faces


def relax(
    vertices: Floats, faces: Ints, project: Project, measured: Measured, rounds: int
) -> Floats:
    """(V, 3) [m] vertices moved along the surface to the mean of their neighbours."""
    ends = edges_of(faces)
    both = np.vstack([ends, ends[:, ::-1]])
    degree = np.bincount(both[:, 0], minlength=len(vertices))
    for _ in range(rounds):
        at, turn = measured(vertices)
        mean = np.zeros(vertices.shape)
        for k in range(3):
            mean[:, k] = np.bincount(both[:, 0], at[both[:, 1], k]) / degree
        normal = vertex_normals(at, faces)
        step = mean - at
        step -= (step * normal).sum(axis=1, keepdims=True) * normal
        step = rotated(turn, step)
        vertices = project(vertices + 0.6 * step)
    return vertices


def _split(mesh: _Mesh, longest: float) -> None:
    for a, b in mesh.edges():
        if mesh.edge_length(a, b) <= longest:
            continue
        left, right, above, below = mesh.across(a, b)
        middle = len(mesh.at)
        mesh.at.append(_middle(mesh.at[a], mesh.at[b]))
        mesh.own.append(_middle(mesh.own[a], mesh.own[b]))
        mesh.of.append(set())
        mesh.drop(left)
        mesh.drop(right)
        mesh.add(a, middle, above)
        mesh.add(middle, b, above)
        mesh.add(b, middle, below)
        mesh.add(middle, a, below)


def _collapse(mesh: _Mesh, shortest: float, longest: float) -> None:
    gone: set[int] = set()
    for a, b in mesh.edges():
        if a in gone or b in gone or mesh.edge_length(a, b) >= shortest:
            continue
        near_a, near_b = mesh.around(a), mesh.around(b)
        if b not in near_a or len(near_a & near_b) != 2:
            continue
        if any(len(mesh.of[v]) <= 3 for v in near_a & near_b):
            continue
        middle = _middle(mesh.at[a], mesh.at[b])
        if max(dist(mesh.at[v], middle) for v in (near_a | near_b) - {a, b}) > longest:
            continue
        left, right, _, _ = mesh.across(a, b)
        if _would_turn_over(mesh, a, b, middle):
            continue
        mesh.drop(left)
        mesh.drop(right)
        for n in sorted(mesh.of[b]):
            face = mesh.faces[n]
            mesh.drop(n)
            mesh.add(*(a if v == b else v for v in face))
        mesh.at[a] = middle
        mesh.own[a] = _middle(mesh.own[a], mesh.own[b])
        gone.add(b)


def _would_turn_over(mesh: _Mesh, a: int, b: int, middle: _Place) -> bool:
    """Whether a triangle would look another way if a and b met in the middle."""
    for n in mesh.of[a] ^ mesh.of[b]:
        face = mesh.faces[n]
        before = _normal(*(mesh.at[v] for v in face))
        after = _normal(*(middle if v in (a, b) else mesh.at[v] for v in face))
        if _cosine(before, after) <= 0.3:
            return True
    return False


def _middle(a: _Place, b: _Place) -> _Place:
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


def _normal(a: _Place, b: _Place, c: _Place) -> _Place:
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def _cosine(a: _Place, b: _Place) -> float:
    """Cosine of the angle between two directions, 0 if one has no length."""
    sizes = (a[0] ** 2 + a[1] ** 2 + a[2] ** 2) * (b[0] ** 2 + b[1] ** 2 + b[2] ** 2)
    inner = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return inner / sqrt(sizes) if sizes > 0.0 else 0.0


def _flip(mesh: _Mesh) -> None:
    for a, b in mesh.edges():
        if b not in mesh.around(a):
            continue
        left, right, above, below = mesh.across(a, b)
        ends = (a, b, above, below)
        change = (-1, -1, 1, 1)
        degrees = [len(mesh.of[v]) - 6 for v in ends]
        before = sum(d * d for d in degrees)
        after = sum((d + c) ** 2 for d, c in zip(degrees, change, strict=True))
        if after >= before or above in mesh.around(below):
            continue
        pa, pb, pc, pd = (mesh.at[v] for v in ends)
        old = (_normal(pa, pb, pc), _normal(pb, pa, pd))
        new = (_normal(pa, pd, pc), _normal(pb, pc, pd))
        if min(_cosine(one, two) for one in old for two in new) < 0.7:
            continue
        mesh.drop(left)
        mesh.drop(right)
        mesh.add(a, below, above)
        mesh.add(b, above, below)
