"""Settings given to a function by name, sorted to the classes they belong to."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from handclean import config
from handclean.errors import UnknownSettingError
from handclean.settings import settings_of


def sorted_settings(
    where: str, classes: Mapping[str, type], given: Mapping[str, Any]
) -> dict[str, Any]:
    """Make one object of each settings class from settings given by name.

    As on the command line, a setting is called with its class's name before it,
    ``label_alpha``; without it, where no other class has one of the same name.

    Parameters
    ----------
    where : the function, for messages.
    classes : settings classes by the name that stands before their settings; "" for
        none.
    given : values by name.

    Raises
    ------
    UnknownSettingError
        If no class has such a setting.
    UsageError
        If a value is of the wrong type or outside its limits.
    """
    names = {key: settings_of(cls) for key, cls in classes.items()}
    count = Counter(setting.name for some in names.values() for setting in some)
    known: dict[str, tuple[str, str]] = {}
    for key, some in names.items():
        for setting in some:
            if key:
                known[f"{key}_{setting.name}"] = (key, setting.name)
            if count[setting.name] == 1:
                known[setting.name] = (key, setting.name)
    found: dict[str, dict[str, Any]] = {key: {} for key in classes}
    for name, value in given.items():
        if name not in known:
            raise UnknownSettingError(where, "setting", name, known)
        key, own = known[name]
        found[key][own] = value
    return {
        key: config.load(None, where, cls, **found[key]) for key, cls in classes.items()
    }
