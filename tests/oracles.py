"""Obvious, slow twins of what the package does fast."""

import numpy as np
from scipy.spatial.transform import Rotation


def bone_transforms(tree, pose):
    """4 x 4 laboratory transforms of all bones, one plain product per hinge."""
    world = []
    for b in range(len(tree.bones)):
        local = np.eye(4)
        local[:3, 3] = tree.offsets[b]
        for d in np.flatnonzero(tree.hinge_bone == b):
            hinge = np.eye(4)
            turn = Rotation.from_rotvec(pose[7 + d] * tree.axes[d])
            hinge[:3, :3] = turn.as_matrix()
            local = local @ hinge
        if tree.parents[b] < 0:
            root = np.eye(4)
            root[:3, 3] = pose[:3]
            w, x, y, z = pose[3:7]
            root[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix()
            world.append(root @ local)
        else:
            world.append(world[tree.parents[b]] @ local)
    return np.array(world)


def random_tree(rng, bones, max_hinges=2, **parts):
    """Any joint tree: random parents, offsets, axes; some joints without hinges."""
    from handclean.tree import JointTree

    parents = np.array([-1, *(int(rng.integers(0, b)) for b in range(1, bones))])
    hinge_bone = np.sort(
        np.concatenate(
            [np.full(rng.integers(0, max_hinges + 1), b) for b in range(1, bones)]
            or [np.zeros(0)]
        )
    ).astype(np.int64)
    axes = rng.normal(size=(len(hinge_bone), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    limits = np.tile([-2.0, 2.0], (len(hinge_bone), 1))
    offsets = rng.normal(scale=0.03, size=(bones, 3))
    offsets[0] = 0.0
    return JointTree(
        kind="hand",
        side="",
        bones=tuple(f"b{b}" for b in range(bones)),
        joints=tuple(f"j{b}" for b in range(bones)),
        parents=parents,
        offsets=offsets,
        hinges=tuple(f"h{d}" for d in range(len(hinge_bone))),
        hinge_bone=hinge_bone,
        axes=axes,
        limits=limits,
        **parts,
    )


def random_pose(rng, tree, spread=0.6):
    """A pose anywhere, turned anyhow."""
    q = rng.normal(size=4)
    angles = rng.normal(scale=spread, size=len(tree.hinges))
    return np.concatenate([rng.normal(size=3), q / np.linalg.norm(q), angles])
