"""Scans with known truth: a hand held still before eight cameras.

What photogrammetry makes of it (schroeder2017, figure 16): points with normals and
colours where two cameras or more see the skin at a fair angle past fingers and palm,
denser where more do; noise; holes where the skin shows no texture; a forearm that ends
in a sleeve; a table; points that float beside the hand's outlines in mixed colours.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Bytes, Floats, Ints
from handclean.hand.model import Model, neutral_pose
from handclean.hand.skinning import posed
from handclean.hand.subject import Subject
from handclean.hand.surface import Surface, face_normals, vertex_normals
from handclean.hand.template_surface import landmarks, template_surface
from handclean.numerics.triangles import box_tree, hidden_behind
from handclean.simulation.people import Person, without_forearm
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.shaping import reshaped
from handclean.tree import JointTree

_LEAST_COSINE = 0.3
"""Cosine of the angle between skin and line of sight above which a camera uses it
(chosen)."""

_TONES = np.array([[243, 203, 178], [224, 172, 140], [190, 128, 92], [120, 74, 50]])
_SLEEVES = np.array([[40, 60, 120], [70, 70, 74], [225, 226, 224], [30, 90, 60]])
_TABLES = np.array([[35, 95, 70], [150, 152, 155], [120, 84, 56], [60, 60, 66]])
"""Colours of skins, sleeves and tables: red, green, blue, 0 to 255 (chosen)."""

_HOLES, _FLOATER_SHARE = 14, 0.015
"""How many holes a scan has, and the share of its points that float beside the hand
(chosen)."""

_CLICK_SD_M = 0.0015
"""[m] error of a landmark set by hand, along the skin (chosen)."""

_WRIST_HEIGHT_M = 0.24
"""[m] of the wrist above the table (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Scan:
    """P points of a hand, and what is true.

    Attributes
    ----------
    points : (P, 3) [m]; normals : (P, 3); colors : (P, 3) red, green, blue.
    landmarks : (3,) [m] by name, set by hand.
    subject : joints and skin in the zero posture, no markers.
    pose : (7 + D,) in which the hand was held.
    skin : (V, 3) [m] the subject's vertices in that pose.
    """

    points: Floats
    normals: Floats
    colors: Bytes
    landmarks: dict[str, Floats]
    subject: Subject
    pose: Floats
    skin: Floats


def true_surface(
    person: Person, side: str, rng: np.random.Generator
) -> tuple[JointTree, Surface]:
    """Joint tree (no forearm) and skin of a simulated person's hand."""
    tree = without_forearm(person.tree)
    surface = reshaped(template_surface(tree), tree, rng)
    if side == "right":
        return tree.mirrored(), surface.mirrored()
    return tree, surface


def make_scan(
    person: Person,
    side: str,
    settings: SimulateConfig,
    shape: np.random.Generator,
    rng: np.random.Generator,
) -> Scan:
    """Scan a person's hand, which is held up over a table, fingers spread a little.

    Parameters
    ----------
    shape : draws the person's flesh; rng : all that differs from scan to scan.
    """
    tree, surface = true_surface(person, side, shape)
    pose = _posture(tree, rng)
    skin = posed(surface, tree, pose[None])[0]
    eyes = _rig(settings.scan_cameras, pose[:3], rng)
    tone = _TONES[int(rng.integers(len(_TONES)))] * rng.uniform(0.92, 1.05)
    points, normals = _seen(skin, surface, eyes, settings.scan_points, rng)
    hand = points
    parts = [(points, normals, np.tile(tone, (len(points), 1)))]
    parts += [_floaters(points, normals, tone, rng)]
    parts += _surroundings(pose, tone, rng)
    points, normals, colors = (
        np.concatenate([part[n] for part in parts]) for n in range(3)
    )
    shade = 0.72 + 0.28 * np.clip(normals @ np.array([0.3, -0.5, 0.81]), 0.0, 1.0)
    colors = colors * shade[:, None] + rng.normal(0.0, 6.0, colors.shape)
    normals = normals + rng.normal(0.0, 0.12, normals.shape)
    clicked = {
        name: _click(skin[vertex], hand, rng)
        for name, vertex in landmarks(tree).items()
    }
    order = rng.permutation(len(points))
    return Scan(
        points=(points + rng.normal(0.0, settings.scan_noise_m, points.shape))[order],
        normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True))[order],
        colors=np.clip(np.rint(colors), 0, 255).astype(np.uint8)[order],
        landmarks=clicked,
        subject=Subject(
            name=person.name,
            model=Model(
                tree=tree,
                labels=(),
                bone=np.zeros(0, dtype=np.int64),
                at=np.zeros((0, 3)),
            ),
            marker_set="",
            marker_sigma=np.zeros(0),
            surface=surface,
        ),
        pose=pose,
        skin=skin,
    )


def _posture(tree: JointTree, rng: np.random.Generator) -> Floats:
    """(7 + D,) upright, fingers spread, each joint a few degrees bent."""
    pose = neutral_pose(tree)
    pose[:3] = [*rng.normal(0.0, 0.02, 2), _WRIST_HEIGHT_M]
    upright = Rotation.from_euler("x", 90.0, degrees=True)
    tilt = Rotation.from_euler("zyx", rng.normal(0.0, [90.0, 6.0, 6.0]), degrees=True)
    pose[3:7] = np.roll((tilt * upright).as_quat(), 1)
    spread = {"index": 9.0, "middle": 1.0, "ring": -7.0, "little": -15.0}
    for d, hinge in enumerate(tree.hinges):
        finger = hinge.split("_")[0]
        usual = 6.0 if hinge.endswith("flexion") else spread.get(finger, 8.0)
        pose[7 + d] = np.radians(usual + rng.normal(0.0, 4.0))
    limits = tree.limits
    pose[7:] = np.clip(pose[7:], limits[:, 0], limits[:, 1])
    return pose


def _rig(count: int, wrist: Floats, rng: np.random.Generator) -> Floats:
    """(C, 3) [m] cameras around the hand, high and low in turns."""
    turn = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count)) / count
    up = np.radians(np.where(np.arange(count) % 2, 42.0, 4.0))
    way = np.column_stack(
        [np.cos(turn) * np.cos(up), np.sin(turn) * np.cos(up), np.sin(up)]
    )
    out: Floats = wrist + [0.0, 0.0, 0.09] + 0.65 * way
    return out


def _seen(
    skin: Floats,
    surface: Surface,
    eyes: Floats,
    count: int,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Draw points of the skin that cameras reconstruct, with their normals."""
    flat = face_normals(skin, surface.faces)
    area = np.linalg.norm(flat, axis=1)
    face = rng.choice(len(area), 3 * count, p=area / area.sum())
    mix = rng.dirichlet([1.0, 1.0, 1.0], len(face))
    corners = surface.faces[face]
    points = np.einsum("pc,pck->pk", mix, skin[corners])
    smooth = vertex_normals(skin, surface.faces)
    normals = np.einsum("pc,pck->pk", mix, smooth[corners])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    views = _views(points, flat[face] / area[face, None], eyes, skin, surface)
    keep = rng.random(len(points)) < np.clip((views - 1) / 3.0, 0.0, 1.0)
    for centre in points[rng.choice(np.flatnonzero(keep), _HOLES)]:
        away = np.linalg.norm(points - centre, axis=1)
        keep &= away > rng.uniform(0.002, 0.006)
    rows = np.flatnonzero(keep)[:count]
    return points[rows], normals[rows]


def _views(
    points: Floats, normals: Floats, eyes: Floats, skin: Floats, surface: Surface
) -> Ints:
    """(P,) how many cameras see each point at a fair angle."""
    way = eyes - points[:, None]
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    fair = np.einsum("pck,pk->pc", way, normals) > _LEAST_COSINE
    tree = box_tree(skin, surface.faces)
    hidden = hidden_behind(skin[None], tree, points[None], eyes, skip_m=2e-4)[0]
    count: Ints = (fair & ~hidden).sum(axis=1)
    return count


def _surroundings(
    pose: Floats, tone: Floats, rng: np.random.Generator
) -> list[tuple[Floats, Floats, Floats]]:
    """Points, normals, colours of forearm, sleeve, table, and of what floats."""
    upright = Rotation.from_quat(np.roll(pose[3:7], -1))
    sleeve = _SLEEVES[int(rng.integers(len(_SLEEVES)))]
    table = _TABLES[int(rng.integers(len(_TABLES)))]
    parts = []
    for start, stop, grow, count, color in (
        (0.024, 0.065, 1.0, 14000, tone),
        (0.065, 0.19, 1.22, 12000, sleeve),
    ):
        turn = rng.uniform(0.0, 2.0 * np.pi, count)
        down = rng.uniform(start, stop, count)
        wide = grow * (1.0 + 1.5 * down)
        around = np.column_stack([np.cos(turn), np.zeros(count), np.sin(turn)])
        at = around * np.column_stack([0.028 * wide, down, 0.0205 * wide])
        at[:, 1] = -down
        at[:, 2] -= 0.002
        parts.append(
            (
                upright.apply(at) + pose[:3],
                upright.apply(around),
                np.tile(color, (count, 1)).astype(np.float64),
            )
        )
    count = 24000
    away, turn = 0.35 * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
    at = np.column_stack([away * np.cos(turn), away * np.sin(turn), np.zeros(count)])
    up = np.tile([0.0, 0.0, 1.0], (count, 1))
    parts.append((at, up, np.tile(table, (count, 1)).astype(np.float64)))
    return parts


def _floaters(
    points: Floats, normals: Floats, tone: Floats, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Points beside the outlines of the hand: places, normals, mixed colours."""
    rows = rng.choice(len(points), int(_FLOATER_SHARE * len(points)))
    off = rng.exponential(0.004, len(rows))[:, None]
    way = normals[rows] + rng.normal(0.0, 0.5, (len(rows), 3))
    grey = np.array([95.0, 98.0, 105.0])
    mix = rng.uniform(0.0, 1.0, (len(rows), 1))
    return points[rows] + off * way, normals[rows], tone * (1.0 - mix) + grey * mix


def _click(place: Floats, hand: Floats, rng: np.random.Generator) -> Floats:
    """(3,) [m] the point of the scan somebody takes for a landmark."""
    meant = place + rng.normal(0.0, _CLICK_SD_M / np.sqrt(2.0), 3)
    out: Floats = hand[int(np.argmin(((hand - meant) ** 2).sum(axis=1)))]
    return out
