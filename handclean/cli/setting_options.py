"""An option for a setting: its type, its help and how a shell completes it."""

from collections.abc import Callable
from typing import Any

import click

from handclean.cli import completion
from handclean.settings import Setting

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def option(name: str, setting: Setting, *, hidden: bool = False) -> Decorator:
    """Make the option of a setting, which says its default in its help.

    Parameters
    ----------
    name : of the option, in the letters of a parameter: ``max_gap_s``.
    hidden : whether help leaves it out, as of a name that the setting had.
    """
    flag = "--" + name.replace("_", "-")
    shown = setting.default
    if setting.is_tuple:
        shown = " ".join(map(str, setting.default)) or "none"
    if setting.kind is bool and not setting.is_tuple:
        shown = "yes" if setting.default else "no"
    words = setting.words.known if setting.words else ()
    limits = f"; {setting.range}" if setting.range else ""
    about: dict[str, Any] = {
        "default": None,
        "shell_complete": completion.SETTINGS.get(
            setting.name, completion.words(words)
        ),
        "help": f"{setting.help}  [default: {shown}{limits}]",
        "hidden": hidden,
    }
    if setting.kind is bool and not setting.is_tuple:
        return click.option(f"{flag}/--no-{flag[2:]}", name, **about)
    if setting.is_tuple and setting.count is None:
        return _several(name, flag, setting, **about)
    if setting.is_tuple:
        about["nargs"] = setting.count
    return click.option(flag, name, type=setting.kind, **about)


def _several(name: str, flag: str, setting: Setting, **about: Any) -> Decorator:
    """Make an option of a setting that is any number of values.

    A single empty text is none of them, to beat a file that has some.
    """
    each = click.types.convert_type(setting.kind)

    def convert(
        context: click.Context, parameter: click.Parameter, value: tuple[str, ...]
    ) -> tuple[Any, ...]:
        if value == ("",):
            return ()
        return tuple(each.convert(part, parameter, context) for part in value)

    shown = each.name.upper()
    return click.option(
        flag, name, metavar=shown, multiple=True, callback=convert, **about
    )
