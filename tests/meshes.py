"""What is asked of meshes of hands, for several tests."""

import numpy as np
from scipy.spatial import cKDTree

from handclean.hand.model import joint_positions, neutral_pose
from handclean.hand.skinning import bone_transforms, posed
from handclean.hand.surface import face_normals, rest_joints
from handclean.hand.template import FINGERS


def sides(vertices, faces):
    """(F, 3) [m] lengths of each triangle's sides, opposite its corners."""
    corners = vertices[faces]
    ends = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    return np.linalg.norm(ends[0] - ends[1], axis=2)


def smallest_angles(vertices, faces):
    """(F,) [degrees]"""
    a, b, c = np.sort(sides(vertices, faces), axis=1).T
    return np.degrees(np.arccos(np.clip((b**2 + c**2 - a**2) / (2 * b * c), -1, 1)))


def edge_variation(vertices, faces):
    """Standard deviation of the edges' lengths against their mean."""
    lengths = sides(vertices, faces)
    return lengths.std() / lengths.mean()


def winding(vertices, faces, points):
    """(N,) how often a closed mesh goes round each of (N, 3) points."""
    out = np.zeros(len(points))
    for n, point in enumerate(points):
        a, b, c = np.moveaxis(vertices[faces] - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        triple = np.einsum("fk,fk->f", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(1) * lc
        below += (b * c).sum(1) * la + (c * a).sum(1) * lb
        out[n] = np.arctan2(triple, below).sum() / (2.0 * np.pi)
    return out


def inside(vertices, faces, points):
    """(N,) whether each of (N, 3) points lies inside a closed mesh."""
    return winding(vertices, faces, points) > 0.5


def fingers_of(tree):
    """(B,) which finger each bone is of, from 1; 0 of none."""
    names = [bone.split("_")[0] for bone in tree.bones]
    return np.array([FINGERS.index(n) + 1 if n in FINGERS else 0 for n in names])


def crossings(tree, skin, vertices):
    """How many vertices of fingers, beyond the webs, the mesh goes round again.

    A vertex is looked at a fifth of a millimetre out of its skin: there the mesh should
    go round nothing.
    """
    normals = face_normals(vertices, skin.faces)
    out = np.zeros(vertices.shape)
    for n in range(3):
        np.add.at(out, skin.faces[:, n], normals)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    finger = fingers_of(tree)[skin.bones[:, 0]]
    suspects = np.zeros(len(vertices), dtype=bool)
    for one in range(2, 6):
        own, other = np.flatnonzero(finger == one), vertices[finger != one]
        far = other[:, 1] > vertices[own, 1].min() - 0.005
        gap, _ = cKDTree(other[far]).query(vertices[own])
        suspects[own[gap < 0.0025]] = True
    out = vertices[suspects] + 2e-4 * out[suspects]
    return int(inside(vertices, skin.faces, out).sum())


def bent(tree, skin, part):
    """Bend one joint of all four fingers of a left hand by a right angle.

    Returns
    -------
    kept : (4,) volume round each joint against that in the zero posture: what lies
        between the joint and the faces that bones of both its sides move, twice as far
        along the finger as the finger is wide.
    over : faces of the back that the skinning turns inside out.
    """
    pose = neutral_pose(tree)
    for d, hinge in enumerate(tree.hinges):
        if hinge.endswith(f"{part}_flexion") and not hinge.startswith("thumb"):
            pose[7 + d] = np.pi / 2.0
    after = posed(skin, tree, pose[None])[0]
    middles = skin.vertices[skin.faces].mean(axis=1)
    before, now = (face_normals(at, skin.faces) for at in (skin.vertices, after))
    joints, moved = rest_joints(tree), joint_positions(tree, pose[None])[0]
    own = fingers_of(tree)[skin.bones[skin.faces[:, 0], 0]]
    kept = []
    for finger in FINGERS[1:]:
        b = tree.joints.index(f"{finger}_{part}")
        along = middles[:, 1] - joints[b, 1]
        near = np.abs(along) < 0.018
        near &= np.abs(middles[:, 0] - joints[b, 0]) < 0.012
        near &= (own == 0) | (own == fingers_of(tree)[b])
        cones = [
            ((at[skin.faces].mean(axis=1) - joint) * normal)[near].sum()
            for at, joint, normal in (
                (skin.vertices, joints[b], before),
                (after, moved[b], now),
            )
        ]
        kept.append(cones[1] / cones[0])
    turn = bone_transforms(tree, pose[None])[0][0]
    blend = np.einsum("vn,vnij->vij", skin.weights, turn[skin.bones])
    expected = np.einsum("fij,fj->fi", blend[skin.faces].mean(axis=1), before)
    over = (expected * now).sum(axis=1) < 0.0
    back = before[:, 2] > 0.5 * np.linalg.norm(before, axis=1)
    return np.array(kept), int((over & back).sum())
