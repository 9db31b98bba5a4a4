"""The first half of a BVH file: joints in braces, read line by line."""

import numpy as np

from handclean.errors import FileError
from handclean.io.shared.lines import Lines
from handclean.io.shared.reading import check_unique, text

PLACES = {"Xposition": 0, "Yposition": 1, "Zposition": 2}
TURNS = {"Xrotation": "x", "Yrotation": "y", "Zrotation": "z"}
_MOST_JOINTS = 10_000
"""Joints of a hierarchy, at most (chosen: far more than a body has)."""

MOST_NUMBER = 1e12
"""No length and no angle is larger, whatever its unit (chosen): numbers computed from
them stay numbers."""


class Hierarchy:
    """What the lines from HIERARCHY to MOTION say, joint by joint.

    Attributes
    ----------
    names : J joint names, parents before children.
    parents : J indices, -1 for a root.
    offsets : J places in the parent's frame [unit of the file].
    channels : J lists of channel names.
    ends : place of the end site of those joints that have one.
    """

    def __init__(self, lines: Lines) -> None:
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list[list[float]] = []
        self.channels: list[list[str]] = []
        self.ends: dict[int, list[float]] = {}
        self._lines = lines
        self._open: list[int] = []  # joints; -1 - j stands for the end site of j
        self._braced = True
        if [cell.upper() for cell in lines.cells(None)] != [b"HIERARCHY"]:
            right = "it should begin with 'HIERARCHY'"
            raise FileError(lines.path, "is not a BVH file", right)
        while self._line([text(word) for word in lines.cells(None)]):
            pass
        if not all(self.offsets):
            name = self.names[self.offsets.index([])]
            raise FileError(lines.path, f"joint '{name}' has no OFFSET")
        check_unique(lines.path, "joints", self.names)

    def _line(self, words: list[str]) -> bool:
        """Take in one line; False when it was the last one."""
        at = self._open[-1] if self._open and self._braced else None
        match words:
            case []:
                pass
            case ["MOTION"] if not self._open and self.names:
                return False
            case ["{"] if not self._braced:
                self._braced = True
            case ["}"] if at is not None:
                self._open.pop()
            case ["ROOT", _, *_] if not self._open and self._braced:
                self._joint(-1, words)
            case ["JOINT", _, *_] if at is not None and at >= 0:
                self._joint(at, words)
            case ["End", "Site"] if at is not None and at >= 0:
                self._open.append(-1 - at)
                self._braced = False
            case ["OFFSET", _, _, _] if at is not None:
                offset = [self._number(word) for word in words[1:]]
                if at < 0:
                    self.ends[-1 - at] = offset
                else:
                    self.offsets[at] = offset
            case ["CHANNELS", count, *kinds] if at is not None and at >= 0:
                self._check_channels(count, kinds)
                self.channels[at] = kinds
            case _:
                shown = " ".join(words)[:40]
                raise FileError(self._lines.where, f"'{shown}' does not belong here")
        return True

    def _joint(self, parent: int, words: list[str]) -> None:
        self._open.append(len(self.names))
        self._braced = False
        self.names.append(" ".join(words[1:]))
        self.parents.append(parent)
        self.offsets.append([])
        self.channels.append([])
        if len(self.names) > _MOST_JOINTS:
            raise FileError(self._lines.path, f"has more than {_MOST_JOINTS} joints")

    def _number(self, word: str) -> float:
        try:
            value = float(word)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise FileError(self._lines.where, f"'{word[:20]}' is not a number")
        if abs(value) > MOST_NUMBER:
            raise FileError(self._lines.where, f"'{word[:20]}' is too large a number")
        return value

    def _check_channels(self, count: str, kinds: list[str]) -> None:
        where = self._lines.where
        if count != str(len(kinds)):
            raise FileError(where, f"says {count[:9]} channels, names {len(kinds)}")
        for kind in kinds:
            if kind not in PLACES and kind not in TURNS:
                raise FileError(where, f"no channel is called '{kind[:20]}'")
        if len(set(kinds)) != len(kinds):
            raise FileError(where, "names a channel twice")
