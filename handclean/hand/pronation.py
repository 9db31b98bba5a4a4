"""A fifth rotation of the thumb: pronation, about its metacarpal's own axis.

Wang & Neff (2013), section 3.2, after Griffin et al. (2000): a virtual joint, measured
by no sensor, that turns the thumb's pad to the fingers as the thumb comes across the
palm.
"""

from dataclasses import replace

import numpy as np

from handclean.tree import JointTree

PRONATION = "thumb_cmc_pronation"

_LIMITS_DEG = (-30.0, 60.0)
"""[degrees] (chosen)."""


def with_pronation(tree: JointTree) -> JointTree:
    """Return the hand with pronation as the last hinge of the thumb's first joint.

    A tree that has it already is returned as it is.

    Parameters
    ----------
    tree : of a hand.

    References
    ----------
    Wang & Neff (2013), section 3.2.
    """
    if PRONATION in tree.hinges:
        return tree
    at = tree.hinges.index("thumb_cmc_flexion") + 1
    along = tree.offsets[tree.bone("thumb_proximal")]
    turn = -1.0 if tree.side == "right" else 1.0  # axes are axial, see tree.MIRROR
    axis = turn * along / np.linalg.norm(along)
    hinges = list(tree.hinges)
    hinges.insert(at, PRONATION)
    return replace(
        tree,
        hinges=tuple(hinges),
        hinge_bone=np.insert(tree.hinge_bone, at, tree.bone("thumb_metacarpal")),
        axes=np.insert(tree.axes, at, axis, axis=0),
        limits=np.insert(tree.limits, at, np.radians(_LIMITS_DEG), axis=0),
    )
