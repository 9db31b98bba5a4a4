"""What values of options should be, in the words of a wrong command line."""

import math

import click


def positive(
    context: click.Context, parameter: click.Parameter, value: float | None
) -> float | None:
    """Expect a number above 0, where one is given."""
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise click.BadParameter(f"should be a number above 0, not {value}")
    return value


def output(
    context: click.Context, parameter: click.Parameter, value: str | None
) -> str | None:
    """Expect a place that can be written to, where one is given."""
    if value is not None and not value.strip():
        raise click.BadParameter("is empty; it should name a file or a folder")
    if value == "-":
        raise click.BadParameter(
            "'-' is no place to write to; outputs are files, './-' a folder so called"
        )
    return value


def suffix(
    context: click.Context, parameter: click.Parameter, value: str | None
) -> str | None:
    """Return a suffix in lower case and with its dot."""
    if value is None:
        return None
    return value.lower() if value.startswith(".") else f".{value.lower()}"
