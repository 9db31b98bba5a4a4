"""Gloves as TOML files: those that ship, one's own, and how they are written."""

from pathlib import Path

import numpy as np

from handclean.errors import UnknownNameError
from handclean.glove.gloves import Correspondence, Glove
from handclean.glove.hands import GloveHand, load_hand
from handclean.tomlfile import Table, find_file, read_table, shipped_names
from handclean.tomltext import key_of, parse_toml, quoted

SHIPPED = Path(__file__).parents[1] / "data" / "gloves"

_KEYS = {"name", "source", "hand", "sensors", "unused", "limits", "reading", "rotation"}
_ROTATION = {"name", "measured_by", "affected_by", "follows", "rest"}
_TELLING = ("measured_by", "follows", "rest")


def shipped() -> tuple[str, ...]:
    """Names of the gloves that come with handclean."""
    return tuple(name for name in shipped_names(SHIPPED) if name != "key_poses")


def load_glove(name: str | Path) -> Glove:
    """Load a glove by its shipped name or from a TOML file.

    Parameters
    ----------
    name : of a glove that ships, or a file; angles in it are degrees.

    Raises
    ------
    FileError, UnknownNameError
        If there is none, or it is not one.
    """
    path = find_file(name, SHIPPED, "--glove", "glove", shipped())
    return _glove(read_table(path, "not a glove"))


def glove_from_text(path: Path, content: str) -> Glove:
    """Make a glove of the text of its TOML file.

    Parameters
    ----------
    path : of the file, for errors; content : its text.

    Raises
    ------
    FileError, UnknownNameError
        If it is not one.
    """
    return _glove(Table(path, parse_toml(path, content, "not a glove")))


def _glove(content: Table) -> Glove:
    content.expect_keys(_KEYS)
    hand = load_hand(content.name("hand"))
    sensors = content.texts("sensors")
    if not sensors or len(set(sensors)) != len(sensors):
        raise content.error("sensors should have names of their own")
    rows = content.tables("rotation", _ROTATION)
    if not rows:
        raise content.error("no [[rotation]]", "a glove has at least one")
    reading = content.table("reading", "write sensor = [low, high] in it")
    glove = Glove(
        name=content.name("name"),
        source=content.text("source", ""),
        hand=hand,
        sensors=sensors,
        unused=content.texts("unused"),
        limits=_pair(content, "limits") if "limits" in content else None,
        reading={sensor: _pair(reading, sensor) for sensor in reading},
        rows=tuple(_correspondence(row, hand) for row in rows),
    )
    _expect_known_sensors(content, glove)
    _expect_plain_followers(rows, glove)
    return glove


def _pair(table: Table, key: str) -> tuple[float, float]:
    low, high = table.vector(key, 2)
    return low, high


def _correspondence(row: Table, hand: GloveHand) -> Correspondence:
    """Read what tells one rotation."""
    name = row.name("name")
    hand.index(name, row.where)
    given = [key for key in _TELLING if key in row]
    if len(given) != 1:
        raise row.error(
            f"{name} has {', '.join(given) or 'nothing that tells it'}",
            f"give one of {', '.join(_TELLING)}",
        )
    follows = None
    if "follows" in row:
        table = row.table("follows", "write follows = { rotation = factor }")
        follows = table.numbers()
        for other in follows:
            hand.index(other, table.where)
    return Correspondence(
        rotation=name,
        measured_by=row.name("measured_by") if "measured_by" in row else "",
        affected_by=row.texts("affected_by"),
        follows=follows,
        rest=float(np.radians(row.number("rest", 0.0))),
    )


def _expect_known_sensors(content: Table, glove: Glove) -> None:
    """Expect only sensors that the glove has."""
    told = [sensor for row in glove.rows for sensor in row.inputs]
    for sensor in (*told, *glove.unused, *glove.reading):
        if sensor not in glove.sensors:
            raise UnknownNameError(content.where, "sensor", sensor, glove.sensors)


def _expect_plain_followers(rows: tuple[Table, ...], glove: Glove) -> None:
    """Expect each rotation once, following none that follows others."""
    names = [row.rotation for row in glove.rows]
    for row, told in zip(rows, glove.rows, strict=True):
        if names.count(told.rotation) > 1:
            raise row.error(f"{told.rotation} is listed twice")
        for other in told.follows or ():
            if glove.row(other).follows is not None:
                raise row.error(
                    f"{told.rotation} follows {other}, which follows others",
                    "name rotations that are measured",
                )


def to_toml(glove: Glove) -> str:
    """Write a glove as the text of its TOML file, which `glove_from_text` reads."""
    lines = [f"name = {quoted(glove.name)}", f"source = {quoted(glove.source)}"]
    lines += [f"hand = {quoted(glove.hand.name)}", f"sensors = {_list(glove.sensors)}"]
    if glove.unused:
        lines.append(f"unused = {_list(glove.unused)}")
    if glove.limits is not None:
        lines.append(f"limits = [{glove.limits[0]:g}, {glove.limits[1]:g}]")
    if glove.reading:
        lines += ["", "[reading]   # at the ends of the active range"]
        lines += [
            f"{key_of(name)} = [{low:.2f}, {high:.2f}]"
            for name, (low, high) in glove.reading.items()
        ]
    for row in glove.rows:
        lines += ["", "[[rotation]]", f"name = {quoted(row.rotation)}"]
        if row.measured_by:
            lines.append(f"measured_by = {quoted(row.measured_by)}")
            if row.affected_by:
                lines.append(f"affected_by = {_list(row.affected_by)}")
        elif row.follows is not None:
            shares = ", ".join(f"{key_of(k)} = {v!r}" for k, v in row.follows.items())
            lines.append(f"follows = {{ {shares} }}")
        else:
            lines.append(f"rest = {float(np.degrees(row.rest)):.12g}")
    return "\n".join(lines) + "\n"


def _list(names: tuple[str, ...]) -> str:
    return "[" + ", ".join(map(quoted, names)) + "]"
