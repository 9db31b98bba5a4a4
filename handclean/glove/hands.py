"""The hand as gloves see it: rotations, and what they are in the pose vector's hinges.

A rotation r is a combination of hinge angles h, r = B h; most are one hinge, abduction
is between neighbouring fingers (Wang & Neff 2013, section 3.2). Hinges that no rotation
needs (``reference``: the middle finger's abduction) are zero, so that B without their
columns is square and h = B^-1 r.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, HandcleanError, UnknownNameError, Where
from handclean.hand.model import Model
from handclean.hand.pronation import with_pronation
from handclean.hand.template import FINGERS, distal_length
from handclean.tomlfile import Table, find_file, read_table, shipped_names
from handclean.tree import JointTree

SHIPPED = Path(__file__).parents[1] / "data" / "gloves" / "hands"

_KEYS = {"name", "source", "pronation", "reference", "rotation"}
_ROTATION = {"name", "paper", "range", "is"}


@dataclass(frozen=True, kw_only=True)
class GloveHand:
    """R rotations of a hand.

    Attributes
    ----------
    name : of the definition.
    rotations : R names.
    ranges : (R, 2) [rad] active range of each.
    parts : R mappings, from hinge to its factor in the rotation.
    reference : hinges that are zero.
    pronation : whether the thumb has a fifth rotation.
    """

    name: str
    rotations: tuple[str, ...]
    ranges: Floats
    parts: tuple[Mapping[str, float], ...]
    reference: tuple[str, ...]
    pronation: bool

    def index(self, rotation: str, where: Where = "") -> int:
        """Number of a rotation.

        Raises
        ------
        UnknownNameError
            If there is none of that name.
        """
        if rotation not in self.rotations:
            known = self.rotations
            raise UnknownNameError(where or self.name, "rotation", rotation, known)
        return self.rotations.index(rotation)

    @property
    def hinges(self) -> tuple[str, ...]:
        """Hinges that are told from rotations, without those that are zero."""
        return tuple(
            dict.fromkeys(
                h for part in self.parts for h in part if h not in self.reference
            )
        )

    def from_hinges(self, names: Sequence[str]) -> Floats:
        """(R, D) matrix from hinge angles to rotations; NaN rows lack a hinge."""
        out = np.zeros((len(self.rotations), len(names)))
        for r, part in enumerate(self.parts):
            for hinge, factor in part.items():
                if hinge in names:
                    out[r, list(names).index(hinge)] = factor
                elif hinge not in self.reference:
                    out[r] = np.nan
        return out

    def to_hinges(self, names: Sequence[str]) -> Floats:
        """(D, R) matrix from rotations to hinge angles; zero rows for other hinges."""
        own = self.hinges
        inverse = np.linalg.inv(
            self.from_hinges([*own, *self.reference])[:, : len(own)]
        )
        out = np.zeros((len(names), len(self.rotations)))
        for row, name in enumerate(names):
            if name in own:
                out[row] = inverse[own.index(name)]
        return out

    def told(self, names: Sequence[str]) -> tuple[bool, ...]:
        """Whether each hinge is told from rotations."""
        own = self.hinges
        return tuple(name in own for name in names)

    def tree(self, tree: JointTree) -> JointTree:
        """Return a hand's tree with the hinges this definition needs."""
        return with_pronation(tree) if self.pronation else tree


def load_hand(name: str | Path) -> GloveHand:
    """Load a hand by its shipped name or from a TOML file.

    Raises
    ------
    FileError, UnknownNameError
        If there is none, or it is not one.
    """
    kind = "hand of gloves"
    path = find_file(name, SHIPPED, kind, kind, shipped_names(SHIPPED))
    content = read_table(path, f"not a {kind}")
    content.expect_keys(_KEYS)
    rows = content.tables("rotation", _ROTATION)
    names = tuple(row.name("name") for row in rows)
    ranges = [row.vector("range", 2) for row in rows]
    hand = GloveHand(
        name=path.stem,
        rotations=names,
        ranges=np.radians(np.array(ranges).reshape(-1, 2)),
        parts=tuple(map(_hinge_factors, rows)),
        reference=content.texts("reference"),
        pronation=content.flag("pronation", False),
    )
    if len(set(names)) != len(names) or not names:
        raise FileError(path, "rotations should have names of their own")
    if np.any(hand.ranges[:, 0] >= hand.ranges[:, 1]):
        raise FileError(path, "a range should go from low to high")
    square = hand.from_hinges([*hand.hinges, *hand.reference])[:, : len(hand.hinges)]
    if square.shape[0] != square.shape[1] or np.linalg.cond(square) > 1e6:
        raise FileError(
            path,
            f"{len(names)} rotations do not tell {len(hand.hinges)} hinges",
            "name the hinges that are zero as reference",
        )
    return hand


def _hinge_factors(row: Table) -> dict[str, float]:
    """Hinges and their factors in a rotation; one that names none is its own hinge."""
    if "is" not in row:
        return {row.name("name"): 1.0}
    return row.table("is", "write is = { hinge = factor }").numbers()


def fingertips(tree: JointTree) -> Model:
    """Return a hand with a marker ``FINGER_tip`` at the end of every finger.

    Parameters
    ----------
    tree : of the hand; the last segments' lengths are `distal_length`.

    Raises
    ------
    HandcleanError
        If the tree is no hand's.
    """
    bones, places = [], []
    for finger in FINGERS:
        try:
            bone = tree.bone(f"{finger}_distal")
        except KeyError:
            raise HandcleanError(
                f"hand of '{tree.subject}': has no bone {finger}_distal"
            ) from None
        along = tree.offsets[bone] / np.linalg.norm(tree.offsets[bone])
        bones.append(bone)
        places.append(distal_length(tree, finger) * along)
    return Model(
        tree=tree,
        labels=tuple(f"{finger}_tip" for finger in FINGERS),
        bone=np.array(bones, dtype=np.int64),
        at=np.array(places),
    )
