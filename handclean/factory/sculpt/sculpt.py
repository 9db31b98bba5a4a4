"""Makes the template's skin: the mesh that ships, its weights and its landmarks.

Tubes round the skeleton of the spread hand are blended (`anatomy`), meshed
(`tetrahedra`) and remeshed to even triangles (`remesh`); every vertex gets its bones by
where it lies along the fingers, and goes to the zero posture (`weights`).
"""

from pathlib import Path

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.factory.sculpt.anatomy import Anatomy, anatomy
from handclean.factory.sculpt.landmarks import landmark_vertices, nails
from handclean.factory.sculpt.remesh import remesh
from handclean.factory.sculpt.tetrahedra import closed_mesh
from handclean.factory.sculpt.weights import (
    closed_up,
    finger_shares,
    skin_weights,
    soothed,
    webs,
)
from handclean.hand.template import template

EDGE_M = 0.00199
"""[m] wanted edge length (chosen: about 12 000 vertices)."""

COARSE_EDGE_M = 0.00398
"""[m] the same of the coarse twin (chosen: about 3 000)."""

CELL_M = 0.002
"""[m] of the grid on which the flesh is meshed first (chosen; webs need a fine one)."""

_LOW_M, _HIGH_M = np.array([-0.10, -0.045, -0.05]), np.array([0.11, 0.21, 0.04])
"""[m] corners of that grid (chosen)."""


def make_template(
    folder: Path,
    edge: float = EDGE_M,
    coarse: float = COARSE_EDGE_M,
    cell: float = CELL_M,
) -> list[Path]:
    """Write the template's skin into a folder, and say which files.

    Parameters
    ----------
    edge, coarse : [m] wanted edge lengths.
    cell : [m] of the grid on which the flesh is meshed first.
    """
    flesh = anatomy()
    vertices, faces = evened(flesh, *spread_mesh(flesh, cell), edge)
    landmarks = landmark_vertices(flesh, vertices)
    arrays = {
        "bones": np.array(list(template("left").bones)),
        **_arrays(flesh, vertices, faces, ""),
        "nails": nails(flesh, vertices),
        "landmark_names": np.array(list(landmarks)),
        "landmarks": np.array(list(landmarks.values()), dtype=np.int32),
        **_arrays(flesh, *evened(flesh, vertices, faces, coarse), "coarse_"),
    }
    mesh, toml = folder / "template_hand.npz", folder / "template_landmarks.toml"
    np.savez_compressed(mesh, allow_pickle=False, **arrays)
    toml.write_text(landmark_text(landmarks, 1e-6 * arrays["vertices_um"]))
    return [mesh, toml]


def spread_mesh(flesh: Anatomy, cell: float) -> tuple[Floats, Ints]:
    """Return the spread hand's skin, raw: vertices (V, 3) [m] and faces (F, 3)."""
    vertices, faces = closed_mesh(flesh.distance, _LOW_M, _HIGH_M, cell)
    return flesh.onto_skin(vertices, steps=3), faces


def evened(
    flesh: Anatomy, vertices: Floats, faces: Ints, edge: float
) -> tuple[Floats, Ints]:
    """Return the spread hand's skin in triangles that are even in the zero posture."""

    def measured(places: Floats) -> tuple[Floats, Floats]:
        return closed_up(flesh, places, finger_shares(flesh, places))

    vertices, faces = remesh(vertices, faces, edge, flesh.onto_skin, measured)
    return flesh.onto_skin(vertices, steps=3), faces


def _arrays(
    flesh: Anatomy, vertices: Floats, faces: Ints, prefix: str
) -> dict[str, Floats]:
    shares = finger_shares(flesh, vertices)
    web = webs(shares, faces)
    bone, weights = skin_weights(soothed(np.hstack(shares), faces, web, 3))
    zero = soothed(closed_up(flesh, vertices, shares)[0], faces, web, 2)
    return {
        f"{prefix}vertices_um": np.round(1e6 * zero).astype(np.int32),
        f"{prefix}faces": faces.astype(np.uint16),
        f"{prefix}bone": bone.astype(np.uint8),
        f"{prefix}weights_1e4": weights.astype(np.uint16),
    }


def landmark_text(landmarks: dict[str, int], vertices: Floats) -> str:
    """Return the landmarks as TOML: millimetres on the template's right hand."""
    lines = [
        "# Landmarks on the template's right hand in the zero posture [mm]: x to the",
        "# little finger, y to the finger tips, z out of the back. Made by make data.",
    ]
    for name, vertex in landmarks.items():
        x, y, z = 1e3 * vertices[vertex] * [-1.0, 1.0, 1.0]
        lines.append(f"{name} = [{x:.2f}, {y:.2f}, {z:.2f}]")
    return "\n".join(lines) + "\n"
