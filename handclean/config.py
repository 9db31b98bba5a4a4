"""Settings put together: defaults, the configuration file, options.

`handclean.settings` says what a setting is. Nothing heavy is imported, so that
``handclean COMMAND --help`` is instant.
"""

import json
import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from handclean.errors import FileError, Place, UnknownSettingError, UsageError, Where
from handclean.settings import Setting, settings_of
from handclean.tomlfile import read_toml

S = TypeVar("S")


@dataclass(frozen=True)
class Layer:
    """Settings that lie above the defaults and beneath whatever is laid on them.

    Attributes
    ----------
    where : what says so, for messages.
    values : by the names of settings.
    """

    where: Where
    values: Mapping[str, Any]


def load(
    path: Path | None,
    table: str,
    cls: type[S],
    /,
    beneath: Layer | None = None,
    **given: object,
) -> S:
    """Put settings together: each layer beats those beneath it, whatever it says.

    Beneath all are the defaults, then comes what a file of the command's own sets, then
    a table of the configuration file, then options.

    Parameters
    ----------
    path : configuration file, or None.
    table : its table; one that is not there counts as empty.
    cls : settings class.
    beneath : what lies beneath the configuration file, if anything does.
    **given : values given as options; ``None`` means "not given".

    Raises
    ------
    UsageError
        If the file cannot be read, a name is unknown, or a value is of the wrong type
        or outside its limits.
    """
    layers = [] if beneath is None else [beneath]
    if path is not None and (part := read(path).get(table)) is not None:
        layers.append(Layer(Place(path, f" [{table}]"), part))
    options = {name: value for name, value in given.items() if value is not None}
    layers.append(Layer(table, options))
    values: dict[str, Any] = {}
    made = cls()
    for layer in layers:
        values |= _checked(layer.where, layer.values, cls)
        made = _made(layer.where, cls, values)
    return made


def check(path: Path, classes: Mapping[str, type]) -> None:
    """Check every table of a file against the settings classes there are.

    Raises
    ------
    UsageError
        As `load`, and if a table is not one of ``classes``.
    """
    for table, part in read(path).items():
        if table not in classes:
            raise UnknownSettingError(path, "table", table, classes)
        where = Place(path, f" [{table}]")
        _made(where, classes[table], _checked(where, part, classes[table]))


def read(path: Path) -> dict[str, dict[str, Any]]:
    """Read the tables of a TOML file.

    Raises
    ------
    UsageError
        If it cannot be read, is not TOML, or has keys outside any table.
    """
    try:
        document = read_toml(path, "is not valid TOML")
    except FileError as error:
        raise UsageError.of(error) from None
    for name, part in document.items():
        if not isinstance(part, dict):
            raise UsageError(
                f"'{name}' stands outside any table; "
                "it should follow a line like [fill-gaps]",
                where=path,
            )
    return document


def to_toml(classes: Mapping[str, type]) -> str:
    """Write the defaults of settings classes as a commented TOML file."""
    lines = ["# Every setting with its default."]
    for table, cls in classes.items():
        lines += ["", f"[{table}]"]
        for setting in settings_of(cls):
            lines += textwrap.wrap(
                setting.help, 86, initial_indent="# ", subsequent_indent="# "
            )
            lines.append(f"{setting.name} = {_toml(setting.default)}")
    return "\n".join(lines) + "\n"


def _made(where: Where, cls: type[S], values: Mapping[str, Any]) -> S:
    try:
        return cls(**values)
    except ValueError as error:
        raise UsageError(f"{error}", where=where) from None


def _checked(where: Where, given: Mapping[str, Any], cls: type) -> dict[str, Any]:
    known = {setting.name: setting for setting in settings_of(cls)}
    former = {one.former: one for one in known.values() if one.former}
    values = {}
    for name, value in given.items():
        if name not in known and name not in former:
            raise UnknownSettingError(where, "setting", name, known)
        setting = known.get(name) or former[name]
        if setting.name in values:
            raise UsageError(
                f"{setting.former} is the former name of {setting.name}; "
                "only one of the two should be given",
                where=where,
            )
        values[setting.name] = _value(where, setting, value)
    return values


def _value(where: Where, setting: Setting, value: Any) -> Any:
    """Return a value as its setting wants it, a list as a tuple, 1 as 1.0."""
    wrong = UsageError(
        f"{setting.name} should be {setting.right}, not {value!r}", where=where
    )
    parts = value if setting.is_tuple else (value,)
    if not isinstance(parts, list | tuple):
        raise wrong
    if setting.count not in (None, len(parts)):
        raise wrong
    if not all(_is(setting.kind, part) for part in parts):
        raise wrong
    plain = tuple(_plain(where, setting, part) for part in parts)
    result = plain if setting.is_tuple else plain[0]
    if broken := setting.broken(result):
        raise UsageError(broken, where=where)
    return result


def _plain(where: Where, setting: Setting, value: Any) -> Any:
    """Return a value of the right kind, a whole number as a float where one is due."""
    try:
        plain = setting.kind(value)
    except OverflowError:
        plain = math.inf
    if setting.kind is float and not math.isfinite(plain):
        raise UsageError(
            f"{setting.name} should be a finite number, not {value}", where=where
        )
    return plain


def _is(kind: type, value: object) -> bool:
    if isinstance(value, bool):
        return kind is bool
    if kind is float:
        return isinstance(value, int | float)
    return isinstance(value, kind)


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)
