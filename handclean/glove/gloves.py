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
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.errors import FileError, Place, UnknownNameError
from handclean.glove import toml
from handclean.glove.hands import GloveHand, load_hand

SHIPPED = Path(__file__).parents[1] / "data" / "gloves"

_KEYS = {"name", "source", "hand", "sensors", "unused", "limits", "reading", "rotation"}
_ROTATION = {"name", "measured_by", "affected_by", "follows", "rest"}


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
    hand : the rotations it is worn on.
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


def shipped() -> tuple[str, ...]:
    """Names of the gloves that come with handclean."""
    return tuple(
        sorted(p.stem for p in SHIPPED.glob("*.toml") if p.stem != "key_poses")
    )


def load_glove(name: str | Path) -> Glove:
    """Load a glove by its shipped name or from a TOML file.

    Raises
    ------
    FileError, UnknownNameError
        If there is none, or it is not one.
    """
    if str(name) not in shipped() and Path(name).suffix != ".toml":
        raise UnknownNameError("--glove", "glove", str(name), shipped())
    path, content = toml.load(name, SHIPPED, "glove", "rotation")
    return _glove(path, content)


def glove_from_text(path: Path, content: str) -> Glove:
    """Make a glove of the text of its TOML file, which ``path`` holds.

    Raises
    ------
    FileError, UnknownNameError
        If it is not one.
    """
    return _glove(path, toml.parse(path, content, "glove", "rotation"))


def _glove(path: Path, content: dict[str, Any]) -> Glove:
    toml.check_keys(path, content, _KEYS)
    hand = load_hand(toml.text(path, "hand", content))
    sensors = toml.texts(path, "sensors", content)
    if not sensors or len(set(sensors)) != len(sensors):
        raise FileError(path, "sensors should have names of their own")
    limits = content.get("limits")
    rows = tuple(
        _row(path, row, hand)
        for row in toml.tables(path, "rotation", content, _ROTATION)
    )
    glove = Glove(
        name=toml.text(path, "name", content),
        source=str(content.get("source", "")),
        hand=hand,
        sensors=sensors,
        unused=toml.texts(path, "unused", content),
        limits=None if limits is None else _pair(path, "limits", limits),
        reading={
            sensor: _pair(path, f"reading of {sensor}", ends)
            for sensor, ends in _readings(path, content.get("reading", {})).items()
        },
        rows=rows,
    )
    _check(path, glove)
    return glove


def _readings(path: Path, found: Any) -> dict[str, Any]:
    if not isinstance(found, dict):
        right = "write sensor = [low, high] in it"
        raise FileError(path, "reading is no table", right)
    return found


def _pair(path: Path, key: str, value: Any) -> tuple[float, float]:
    low, high = toml.numbers(path, key, value, 2)
    return float(low), float(high)


def _row(path: Path, row: dict[str, Any], hand: GloveHand) -> Correspondence:
    name = toml.text(path, "name", row)
    hand.index(name, path)
    follows = row.get("follows")
    if follows is not None:
        where = Place(path, f" {name}")
        follows = toml.factors(where, follows)
        for other in follows:
            hand.index(other, where)
    given = [key for key in ("measured_by", "follows", "rest") if key in row]
    if len(given) != 1:
        raise FileError(
            Place(path, f" {name}"),
            f"has {', '.join(given) or 'nothing that tells it'}",
            "give one of measured_by, follows, rest",
        )
    rest = toml.numbers(path, "rest", [row.get("rest", 0.0)], 1)
    return Correspondence(
        rotation=name,
        measured_by=str(row.get("measured_by", "")),
        affected_by=toml.texts(path, "affected_by", row),
        follows=follows,
        rest=float(np.radians(rest[0])),
    )


def _check(path: Path, glove: Glove) -> None:
    names = [row.rotation for row in glove.rows]
    if len(set(names)) != len(names):
        raise FileError(path, "a rotation is listed twice")
    known = glove.sensors
    for row in glove.rows:
        for sensor in row.inputs:
            if sensor not in known:
                raise UnknownNameError(
                    Place(path, f" {row.rotation}"), "sensor", sensor, known
                )
        for other in row.follows or ():
            if glove.row(other).follows is not None:
                raise FileError(
                    Place(path, f" {row.rotation}"),
                    f"follows {other}, which follows others",
                    "name rotations that are measured",
                )
    for sensor in (*glove.unused, *glove.reading):
        if sensor not in known:
            raise UnknownNameError(path, "sensor", sensor, known)


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


def to_toml(glove: Glove) -> str:
    """Write a glove as the text of its TOML file."""

    def names(values: tuple[str, ...]) -> str:
        return "[" + ", ".join(f'"{value}"' for value in values) + "]"

    def quoted(value: str) -> str:
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'

    lines = [f"name = {quoted(glove.name)}", f"source = {quoted(glove.source)}"]
    lines += [f'hand = "{glove.hand.name}"', f"sensors = {names(glove.sensors)}"]
    if glove.unused:
        lines.append(f"unused = {names(glove.unused)}")
    if glove.limits is not None:
        lines.append(f"limits = [{glove.limits[0]:g}, {glove.limits[1]:g}]")
    if glove.reading:
        lines += ["", "[reading]   # at the ends of the active range"]
        lines += [f"{s} = [{a:.2f}, {b:.2f}]" for s, (a, b) in glove.reading.items()]
    for row in glove.rows:
        lines += ["", "[[rotation]]", f'name = "{row.rotation}"']
        if row.measured_by:
            lines.append(f'measured_by = "{row.measured_by}"')
            if row.affected_by:
                lines.append(f"affected_by = {names(row.affected_by)}")
        elif row.follows is not None:
            shares = ", ".join(f"{k} = {v!r}" for k, v in row.follows.items())
            lines.append(f"follows = {{ {shares} }}")
        else:
            lines.append(f"rest = {float(np.degrees(row.rest)):.12g}")
    return "\n".join(lines) + "\n"
