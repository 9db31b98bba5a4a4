"""Gloves: which sensors there are, which rotation each measures, which affect it.

After Wang & Neff (2013), section 3.3, a rotation is

1S1R    measured by one sensor (``measured_by``),
MS1R    measured by one that others affect (``affected_by``): all of them are inputs,
0S1R    measured by none: it ``follows`` others (a DIP is 2/3 of the PIP, the thumb's
        pronation a T_TMC + b TI_ABD), or stays at ``rest``.

With m the measured rotations, all rotations are r = F m + rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats
from handclean.glove.hands import GloveHand


@dataclass(frozen=True, kw_only=True)
class Correspondence:
    """What tells one rotation.

    Attributes
    ----------
    rotation : its name.
    measured_by : the sensor that measures it, or "".
    affected_by : sensors that affect the measuring one.
    follows : rotations it follows, with factors.
    rest : [rad] where it stays when nothing tells it.
    """

    rotation: str
    measured_by: str = ""
    affected_by: tuple[str, ...] = ()
    follows: Mapping[str, float] | None = None
    rest: float = 0.0

    @property
    def inputs(self) -> tuple[str, ...]:
        """Sensors that tell it, the measuring one first."""
        return (self.measured_by, *self.affected_by) if self.measured_by else ()

    @property
    def kind(self) -> str:
        """The paper's name of such a correspondence."""
        if not self.measured_by:
            return "0S1R"
        return "MS1R" if self.affected_by else "1S1R"


@dataclass(frozen=True, kw_only=True)
class Glove:
    """S sensors on a hand.

    Attributes
    ----------
    name, source : what it is called and where this comes from.
    hand : the rotations of the hands that it is for.
    sensors : S names, in the order of files without a header.
    unused : sensors that tell nothing.
    limits : readings at which the converter is saturated, or None.
    reading : sensor to its readings at the ends of its rotation's active range.
    rows : one per rotation that is told.
    """

    name: str
    source: str
    hand: GloveHand
    sensors: tuple[str, ...]
    unused: tuple[str, ...] = ()
    limits: tuple[float, float] | None = None
    reading: Mapping[str, tuple[float, float]]
    rows: tuple[Correspondence, ...]

    @property
    def measured(self) -> tuple[Correspondence, ...]:
        """Rotations that have a sensor."""
        return tuple(row for row in self.rows if row.measured_by)

    @property
    def used(self) -> tuple[str, ...]:
        """Sensors that tell some rotation, in the glove's order."""
        told = {sensor for row in self.rows for sensor in row.inputs}
        return tuple(sensor for sensor in self.sensors if sensor in told)

    def row(self, rotation: str) -> Correspondence:
        """Return what tells a rotation; one that is not listed rests at zero."""
        found = [row for row in self.rows if row.rotation == rotation]
        return found[0] if found else Correspondence(rotation=rotation)

    def columns(self, row: Correspondence) -> list[int]:
        """Columns of the sensors that tell a rotation."""
        return [self.sensors.index(sensor) for sensor in row.inputs]

    def completion(self) -> tuple[Floats, Floats]:
        """(R, R') factors and (R,) [rad] offsets: all rotations from measured ones."""
        names = [row.rotation for row in self.measured]
        factor = np.zeros((len(self.hand.rotations), len(names)))
        offset = np.zeros(len(self.hand.rotations))
        for r, rotation in enumerate(self.hand.rotations):
            row = self.row(rotation)
            if row.measured_by:
                factor[r, names.index(rotation)] = 1.0
            elif row.follows is None:
                offset[r] = row.rest
            else:
                for other, share in row.follows.items():
                    if other in names:
                        factor[r, names.index(other)] += share
                    else:
                        offset[r] += share * self.row(other).rest
        return factor, offset


def with_coupling(
    glove: Glove,
    affected: Mapping[str, tuple[str, ...]],
    reading: Mapping[str, tuple[float, float]],
    source: str,
) -> Glove:
    """Return a glove whose sensors are affected as an examination found.

    Parameters
    ----------
    affected : measuring sensor to those that affect it; others keep what they have.
    reading : readings at the ends of active ranges, as far as they were found.
    """
    rows = tuple(
        replace(row, affected_by=affected.get(row.measured_by, row.affected_by))
        if row.measured_by
        else row
        for row in glove.rows
    )
    return replace(
        glove, rows=rows, reading={**glove.reading, **reading}, source=source
    )
