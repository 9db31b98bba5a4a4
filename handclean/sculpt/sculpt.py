"""Makes the template's skin: the mesh that ships, its weights and its landmarks.

Tubes round the skeleton of the spread hand are blended (`anatomy`), meshed
(`tetrahedra`) and remeshed to even triangles (`remesh`); every vertex gets its bones by
where it lies along the fingers, and goes to the zero posture (`weights`).
"""

from pathlib import Path

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.hand.surface import is_closed
from handclean.hand.template import template
from handclean.sculpt.anatomy import Anatomy, anatomy
from handclean.sculpt.landmarks import landmark_vertices, nails
from handclean.sculpt.remesh import remesh
from handclean.sculpt.tetrahedra import closed_mesh
from handclean.sculpt.weights import closed_up, finger_shares, skin_weights

EDGE = 0.00207
"""[m] wanted edge length, for about 12 000 vertices."""

COARSE_EDGE = 0.00414
"""[m] the same of the coarse twin, for about 3 000."""

_CELL = 0.002
_LOW, _HIGH = np.array([-0.10, -0.045, -0.05]), np.array([0.11, 0.21, 0.04])


def make_template(
    folder: Path, edge: float = EDGE, coarse: float = COARSE_EDGE
) -> list[Path]:
    """Write the template's skin into a folder, and say which files.

    Parameters
    ----------
    edge, coarse : [m] wanted edge lengths.
    """
    flesh = anatomy()
    vertices, faces = spread_mesh(flesh, edge)
    landmarks = landmark_vertices(flesh, vertices)
    arrays = {
        "bones": np.array(list(template("left").bones)),
        **_arrays(flesh, vertices, faces, ""),
        "nails": nails(flesh, vertices),
        "landmark_names": np.array(list(landmarks)),
        "landmarks": np.array(list(landmarks.values()), dtype=np.int32),
        **_arrays(flesh, *spread_mesh(flesh, coarse), "coarse_"),
    }
    mesh, toml = folder / "template_hand.npz", folder / "template_landmarks.toml"
    np.savez_compressed(mesh, allow_pickle=False, **arrays)
    toml.write_text(landmark_text(landmarks, arrays["vertices"]))
    return [mesh, toml]


def spread_mesh(flesh: Anatomy, edge: float) -> tuple[Floats, Ints]:
    """Return the spread hand's skin: vertices (V, 3) [m] and faces (F, 3)."""
    vertices, faces = closed_mesh(flesh.distance, _LOW, _HIGH, min(_CELL, edge))
    assert is_closed(faces), "the grid should be fine enough for the webs"
    vertices = flesh.onto_skin(vertices, steps=3)
    vertices, faces = remesh(vertices, faces, edge, flesh.onto_skin)
    return flesh.onto_skin(vertices, steps=3), faces


def _arrays(
    flesh: Anatomy, vertices: Floats, faces: Ints, prefix: str
) -> dict[str, Floats]:
    shares = finger_shares(flesh, vertices)
    bone, weights = skin_weights(shares)
    zero = closed_up(flesh, vertices, shares)
    return {
        f"{prefix}vertices": np.round(zero, 6),
        f"{prefix}faces": faces.astype(np.int32),
        f"{prefix}bone": bone.astype(np.uint8),
        f"{prefix}weights": weights,
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
