"""Joint trees: what a hand, a forearm or a rigid object is to the solver.

A tree has B bones. Bone 0 is the root and floats freely; every other bone hangs
on its parent by a joint at ``offsets[b]`` (metres, in the parent's frame) and turns
there about its hinges, in the order in which they are listed. In the zero posture
the frames of all bones are parallel to the root's, so no rest rotations are needed:
a hinge axis is given in that common orientation.

The frame of every bone is right-handed: y runs to the fingers and z out of the back
of the hand, hence x = y cross z runs to the *little finger* of a right hand and to the
thumb of a left one. Template data are written side-free as (towards the thumb, towards
the fingers, out of the back); see ``handclean.hand.template``, which mirrors them.

A pose is a row ``[translation (3) m, unit quaternion w x y z (4), angles (D) rad]``;
the rotation turns root coordinates into laboratory coordinates.
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats, Ints, expect_shape
from handclean.errors import HandcleanError, ShapeError
from handclean.tomlfile import LONGEST_NAME

ROOT_DOFS = 6
"""Degrees of freedom of a floating root: three translations, three rotations."""

POSE_HEAD = 7
"""Numbers of a pose row that come before its angles: translation and quaternion."""


@dataclass(frozen=True, kw_only=True)
class JointTree:
    """Bones, joints and hinges of one articulated or rigid thing.

    Attributes
    ----------
    kind : "hand" or "rigid"
    side : "left", "right" or ""
    bones : names of the B bones, a parent before its children; the root first.
    joints : names of the B joints, joint b being the root end of bone b.
    parents : (B,) bone each bone hangs on, -1 for the root.
    offsets : (B, 3) [m] joint b in the frame of its parent bone (root: zeros).
    hinges : names of the D hinge angles, in the order of the pose vector.
    hinge_bone : (D,) the bone each hinge turns; in the order of the pose vector.
    axes : (D, 3) unit axis of each hinge in the zero posture, root orientation.
    limits : (D, 2) [rad] lower and upper limit.
    subject : whose hand it is, for the record.
    scale : size against the template (hand length over template hand length).
    """

    kind: str
    side: str
    bones: tuple[str, ...]
    joints: tuple[str, ...]
    parents: Ints
    offsets: Floats
    hinges: tuple[str, ...]
    hinge_bone: Ints
    axes: Floats
    limits: Floats
    subject: str = ""
    scale: float = 1.0

    def __post_init__(self) -> None:
        size, hinges = len(self.bones), len(self.hinges)
        if problem := _oversized(self):
            raise self._unusable(problem)
        if len(self.joints) != size:
            raise ShapeError(f"joints should be {size} names, not {len(self.joints)}")
        expect_shape("parents", self.parents, size)
        expect_shape("offsets", self.offsets, size, 3)
        expect_shape("hinge_bone", self.hinge_bone, hinges)
        expect_shape("axes", self.axes, hinges, 3)
        expect_shape("limits", self.limits, hinges, 2)
        if problem := _problem(self):
            raise self._unusable(problem)

    def _unusable(self, problem: str) -> HandcleanError:
        called = (self.subject or self.kind)[:40]
        return HandcleanError(f"joint tree of '{called}': {problem}")

    @property
    def dofs(self) -> int:
        """Degrees of freedom: six of the root and one per hinge."""
        return ROOT_DOFS + len(self.hinges)

    def bone(self, name: str) -> int:
        """Index of the bone called ``name``.

        Raises
        ------
        KeyError
            If there is none.
        """
        try:
            return self.bones.index(name)
        except ValueError:
            raise KeyError(name) from None

    def carried_by(self) -> Bools:
        """(B, D) whether hinge d lies between bone b and the root."""
        carried = np.zeros((len(self.bones), len(self.hinges)), dtype=bool)
        for b in range(len(self.bones)):
            if self.parents[b] >= 0:
                carried[b] = carried[self.parents[b]]
            carried[b] |= self.hinge_bone == b
        return carried

    def limbs(self) -> Ints:
        """(B,) the limb each bone is on, by its innermost hinge; -1 on none."""
        out = np.full(len(self.bones), -1)
        for b in range(1, len(self.bones)):
            own = np.flatnonzero(self.hinge_bone == b)
            up = out[self.parents[b]]
            out[b] = own[0] if up < 0 and len(own) else up
        return out

    def mirrored(self) -> "JointTree":
        """Return the mirror image: the same angles mean the same posture."""
        sides = {"left": "right", "right": "left", "": ""}
        return replace(
            self,
            side=sides[self.side],
            offsets=self.offsets * MIRROR,
            axes=self.axes * -MIRROR,
        )


def rigid_tree(subject: str = "") -> JointTree:
    """Return the tree of a rigid thing: one bone called "root" and no hinges.

    Parameters
    ----------
    subject : what it is called, for the record.
    """
    return JointTree(
        kind="rigid",
        side="",
        bones=("root",),
        joints=("root",),
        parents=np.array([-1]),
        offsets=np.zeros((1, 3)),
        hinges=(),
        hinge_bone=np.zeros(0, dtype=np.int64),
        axes=np.zeros((0, 3)),
        limits=np.zeros((0, 2)),
        subject=subject,
    )


MOST_SCALE = 1000.0
"""[-] times the template; nothing that cameras follow is larger (chosen)."""

MOST_BONES = 1000
"""Bones and hinges of a tree; no body has so many (chosen)."""

MIRROR = np.array([-1.0, 1.0, 1.0])
"""Mirrors places in a hand's frame; an axis, being axial, takes the opposite sign."""


def _oversized(tree: JointTree) -> str:
    """Say what makes a tree too large to be looked at, or nothing."""
    if max(len(tree.bones), len(tree.hinges)) > MOST_BONES:
        return (
            f"{len(tree.bones)} bones and {len(tree.hinges)} hinges, but "
            f"{MOST_BONES} are the most"
        )
    names = (*tree.bones, *tree.joints, *tree.hinges)
    if max(map(len, names), default=0) > LONGEST_NAME:
        return f"a name has more than {LONGEST_NAME} characters"
    return ""


def _problem(tree: JointTree) -> str:
    """Say what makes a tree unusable, or nothing."""
    size = len(tree.bones)
    if size == 0:
        return "there should be at least one bone"
    if not 0.0 < tree.scale <= MOST_SCALE:
        return f"scale should be above 0, {MOST_SCALE:g} at most, not {tree.scale:g}"
    if len(set(tree.bones)) != size or len(set(tree.hinges)) != len(tree.hinges):
        return "names of bones and hinges should be unique"
    if tree.side not in ("left", "right", ""):
        return f"side should be left or right, not '{tree.side[:20]}'"
    if tree.parents[0] != -1 or np.any(tree.parents[1:] < 0):
        return "only the first bone should be without a parent"
    if np.any(tree.parents >= np.arange(size)):
        return "a bone should come after its parent"
    if np.any((tree.hinge_bone < 1) | (tree.hinge_bone >= size)):
        return "every hinge should turn a bone other than the root"
    last = np.full(size, -1)
    for hinge, bone in enumerate(tree.hinge_bone):
        last[bone] = hinge
    for hinge, bone in enumerate(tree.hinge_bone):
        if last[tree.parents[bone]] > hinge:
            return "hinges should be listed from the root outwards"
    finite = (tree.offsets, tree.axes, tree.limits)
    if not all(np.isfinite(array).all() for array in finite):
        return "offsets, axes and limits should be finite numbers"
    if not np.allclose(np.linalg.norm(tree.axes, axis=1), 1.0, atol=1e-6):
        return "hinge axes should have length 1"
    if np.any(tree.limits[:, 0] > tree.limits[:, 1]):
        return "lower limits should not lie above upper limits"
    return ""
