"""Where on the skin a marker may sit (Schroeder 2016, section 4.2).

A vertex v of the zero posture is feasible if its normal n looks out of the back,
``n . h > 0.9``, so that a marker neither touches what is held nor the next finger, and
if one bone alone moves it (weight 1), so that the skin does not slide under it.

The papers have one h for the whole hand. Of the palm and the fingers that is also the
back of each bone; but the thumb's nail looks sideways, and skin of the thumb that looks
where the hand's back does lies on its side. By default h is therefore the back of the
vertex's own bone; ``back = "hand"`` goes by the papers' letter.

Skin behind the wrist joint is the forearm's, whatever moves it in the mesh: nothing
there is feasible.
"""

from collections import Counter
from collections.abc import Iterable

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.errors import HandcleanError, UnknownNameError
from handclean.hand.surface import BACK, Surface, vertex_normals
from handclean.hand.template import bone_frame
from handclean.layouts.settings import LayoutConfig
from handclean.tree import MIRROR, JointTree

_ONE_BONE_WEIGHT = 1.0 - 1e-6
"""[-] weight from which on a bone counts as the only one (1, less rounding)."""


def feasible(
    surface: Surface,
    tree: JointTree,
    settings: LayoutConfig,
    mask: Bools | None = None,
) -> Ints:
    """(N,) vertices on which a marker may sit.

    Parameters
    ----------
    surface : of the hand ``tree``.
    settings : normal, back, without_bones, without_boxes_m; markers.
    mask : (V,) vertices that are allowed, painted by hand; all if None.

    Raises
    ------
    UnknownNameError
        If a bone to leave out does not exist.
    HandcleanError
        If fewer vertices than markers are left.
    """
    for name in settings.without_bones:
        if name not in tree.bones:
            raise UnknownNameError("without_bones", "bone", name, tree.bones)
    bone = surface.bones[:, 0]
    allowed = surface.weights[:, 0] >= _ONE_BONE_WEIGHT
    normals = vertex_normals(surface.vertices, surface.faces)
    allowed &= (normals * _backs(tree, settings.back)[bone]).sum(
        axis=1
    ) > settings.normal
    allowed &= ~np.isin(bone, [tree.bone(name) for name in settings.without_bones])
    allowed &= surface.vertices[:, 1] > 0.0
    allowed &= ~_boxed(surface.vertices, tree, settings.without_boxes_m)
    if mask is not None:
        expect_shape("mask", mask, len(surface.vertices))
        allowed &= mask
    rows: Ints = np.flatnonzero(allowed)
    if len(rows) < settings.markers:
        raise HandcleanError(
            f"{len(rows)} vertices are feasible for {settings.markers} markers; leave "
            f"out less, or lower normal ({settings.normal:g})"
        )
    return rows


def counts(tree: JointTree, bones: Iterable[int]) -> dict[str, int]:
    """How many candidates each bone has that moves any skin, by name.

    Parameters
    ----------
    bones : of the candidates.
    """
    found = Counter(int(bone) for bone in bones)
    return {name: found[b] for b, name in enumerate(tree.bones) if name != "forearm"}


def _backs(tree: JointTree, back: str) -> Floats:
    """(B, 3) out of the back of each bone in the zero posture, in the root's frame."""
    if back == "hand":
        return np.tile(BACK, (len(tree.bones), 1))
    mirror = MIRROR if tree.side == "right" else np.ones(3)
    return np.array([bone_frame(name)[:, 2] * mirror for name in tree.bones])


def _boxed(vertices: Floats, tree: JointTree, boxes: tuple[float, ...]) -> Bools:
    """(V,) which vertices lie in a box."""
    free = vertices * (MIRROR if tree.side == "right" else 1.0)
    ends = np.array(boxes, dtype=np.float64).reshape(-1, 1, 2, 3)
    inside = (free >= ends[:, :, 0]) & (free <= ends[:, :, 1])
    out: Bools = np.asarray(inside.all(axis=2).any(axis=0))
    return out
