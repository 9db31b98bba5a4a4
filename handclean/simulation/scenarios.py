"""Scenarios by name or from a TOML file, with the settings they bring.

What a scenario sets lies beneath the configuration file and the options: these beat it,
whatever they say (see `handclean.config.load`). Imports nothing heavy.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from handclean.config import Layer, load
from handclean.errors import FileError, UnknownSettingError, UsageError
from handclean.simulation.settings import SCENARIOS, SimulateConfig
from handclean.tomlfile import read_table

PRESETS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"demo": {"rate_hz": 100.0}}
)
"""What scenarios that ship set, where they set anything."""


@dataclass(frozen=True)
class Scenario:
    """A scenario.

    Attributes
    ----------
    name : as it was given, a name or a path.
    kind : the name of the one that ships and that it is like.
    settings : by name, what it sets.
    """

    name: str
    kind: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def layer(self) -> Layer:
        """Its settings, to lie beneath others."""
        is_file = self.name not in SCENARIOS
        return Layer(Path(self.name) if is_file else self.name, self.settings)


def find_scenario(name: str | Path) -> Scenario:
    """Find a scenario by its name, or read it from a TOML file.

    Parameters
    ----------
    name : of one that ships, or a file with ``kind`` and any of the settings.

    Raises
    ------
    UsageError
        If there is none, or its file says what nobody understands.
    """
    name = str(name)
    if name in SCENARIOS:
        return Scenario(name, name, PRESETS.get(name, {}))
    path = Path(name)
    if path.suffix != ".toml":
        raise UnknownSettingError("simulate", "scenario", name, tuple(SCENARIOS))
    try:
        right = "give a scenario's name or file"
        content = read_table(path, "not a scenario", right)
        kind = content.text("kind", "grasp")
    except FileError as error:
        raise UsageError.of(error) from None
    if kind not in SCENARIOS:
        raise UnknownSettingError(path, "kind of scenario", kind, tuple(SCENARIOS))
    own = {key: value for key, value in content.values.items() if key != "kind"}
    return Scenario(name, kind, {**PRESETS.get(kind, {}), **own})


def settings_for(scenario: Scenario, **given: object) -> SimulateConfig:
    """Put settings together: defaults, then the scenario's, then those given.

    Raises
    ------
    UsageError
        If the scenario has a name or a value that is wrong.
    """
    return load(None, "simulate", SimulateConfig, scenario.layer, **given)
