"""A plot of fillers' errors by the length of gaps."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from handclean.errors import UnknownSettingError

SUFFIXES = (".png", ".pdf", ".svg")

_LINES = ("-", "--", ":")


def expect_plot(path: Path) -> None:
    """Expect a plot's name to end in one of `SUFFIXES`.

    Raises
    ------
    UnknownSettingError
        If it does not.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UnknownSettingError(path, "format for plots", path.suffix, SUFFIXES)


def plot_errors(
    path: Path,
    panels: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]],
    title: str,
) -> None:
    """Draw error by length, a line for each filler and a panel for each pattern.

    Parameters
    ----------
    panels : by pattern and filler, lengths [s] and mean errors [mm] of gaps.
    """
    from matplotlib.figure import Figure  # late: it takes 0.3 s

    wide = max(len(panels), 1)
    figure = Figure(figsize=(2.6 * wide + 2.0, 4.0), layout="constrained")
    axes = figure.subplots(1, wide, sharey=True, squeeze=False)[0]
    names = list(dict.fromkeys(name for panel in panels.values() for name in panel))
    for axis, (pattern, panel) in zip(axes, panels.items(), strict=False):
        for number, name in enumerate(names):
            points = sorted(panel.get(name, ()))
            axis.plot(
                [length for length, _ in points],
                [error for _, error in points],
                _LINES[number // 10 % len(_LINES)],
                marker=".",
                color=f"C{number % 10}",
                label=name,
            )
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_title(f"hidden: {pattern}", fontsize=9)
        axis.set_xlabel("gap [s]")
        axis.grid(which="both", alpha=0.2)
    axes[0].set_ylabel("mean error [mm]")
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside right upper", fontsize=8)
    figure.suptitle(title, fontsize=10)
    figure.savefig(
        path, format=path.suffix[1:].lower(), metadata=_undated(path.suffix.lower())
    )


def _undated(suffix: str) -> dict[str, None]:
    """Return what keeps the time of writing out, so that bytes come out the same."""
    return {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(suffix, {})
