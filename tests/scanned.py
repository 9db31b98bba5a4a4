"""Crude scans of hands that are not the template, for several tests."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.hand.model import neutral_pose
from handclean.hand.skinning import posed
from handclean.hand.surface import Surface, face_normals, vertex_normals
from handclean.hand.template import template
from handclean.hand.template_surface import landmarks, template_surface
from handclean.simulation.shaping import reshaped
from handclean.subject.scan.cloud import Scan
from handclean.subject.scan.fit import Start
from handclean.tree import JointTree


@dataclass(frozen=True)
class Truth:
    """A hand and what a scanner saw of it."""

    tree: JointTree
    surface: Surface
    pose: np.ndarray
    places: np.ndarray
    scan: Scan
    marks: dict


def coarse_start(side="right"):
    """The template with its coarse skin."""
    tree = template(side)
    fine, surface = template_surface(tree), template_surface(tree, coarse=True)
    rows = {
        name: int(
            np.argmin(np.linalg.norm(surface.vertices - fine.vertices[v], axis=1))
        )
        for name, v in landmarks(tree).items()
    }
    return Start(tree=tree, surface=surface, landmarks=rows)


def scanned(
    seed, side="right", size=1.0, noise=0.0005, count=20_000, start=None, table=True
):
    """Sample a hand of another shape in a slightly bent posture, table and all."""
    rng = np.random.default_rng(seed)
    start = start or coarse_start(side)
    tree = template(side, 0.1872 * size, 0.0849 * size * (1 + 0.04 * rng.normal()))
    offsets = tree.offsets.copy()
    for b in range(1, len(offsets)):
        offsets[b] *= 1.0 + 0.04 * rng.normal()
    tree = replace(tree, offsets=offsets)
    coarse = len(start.surface.vertices) < 6000
    surface = reshaped(template_surface(tree, coarse=coarse), tree, rng)
    pose = neutral_pose(tree)
    pose[:3] = rng.normal(scale=0.1, size=3)
    pose[[4, 5, 6, 3]] = Rotation.random(rng=rng).as_quat()
    pose[7:] = np.radians(
        [
            rng.uniform(3.0, 25.0) if "flexion" in hinge else rng.normal(0.0, 5.0)
            for hinge in tree.hinges
        ]
    )
    places = posed(surface, tree, pose[None])[0]
    points, normals = sampled(places, surface.faces, count, rng)
    points = points + rng.normal(scale=noise, size=points.shape)
    colors = np.tile(np.array([205, 150, 125], dtype=np.uint8), (len(points), 1))
    if table:
        turn = Rotation.from_quat(pose[[4, 5, 6, 3]])
        flat = rng.uniform(-0.3, 0.3, (count // 4, 3)) * [1.0, 1.0, 0.003]
        points = np.vstack([points, turn.apply(flat - [0, 0, 0.03]) + pose[:3]])
        normals = np.vstack([normals, np.tile(turn.apply([0, 0, 1.0]), (len(flat), 1))])
        gray = np.full((len(flat), 3), 120, dtype=np.uint8)
        colors = np.vstack([colors, gray])
    marks = {
        name: places[row] + rng.normal(scale=0.001, size=3)
        for name, row in start.landmarks.items()
    }
    scan = Scan(points=points, normals=normals, colors=colors)
    return Truth(tree, surface, pose, places, scan, marks)


def sampled(vertices, faces, count, rng):
    """Points and normals, evenly over a mesh but for two holes."""
    flat = face_normals(vertices, faces)
    area = np.linalg.norm(flat, axis=1)
    rows = rng.choice(len(faces), count, p=area / area.sum())
    share = rng.dirichlet([1.0, 1.0, 1.0], count)
    points = np.einsum("pk,pkn->pn", share, vertices[faces[rows]])
    smooth = vertex_normals(vertices, faces)
    normals = np.einsum("pk,pkn->pn", share, smooth[faces[rows]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    kept = np.ones(count, dtype=bool)
    for middle in vertices[rng.integers(0, len(vertices), 2)]:
        kept &= np.linalg.norm(points - middle, axis=1) > 0.008
    return points[kept], normals[kept]
