"""What a benchmark tells `run.py` beside its rows: its counts, and what was not there.

``SEEDS = counted("seeds", 3, quick=1)`` is 3 of a full run, 1 of a quick one, and says
so in the section. ``absent("GPy")`` says that something outside the project was not
there: what an earlier table has of it is kept then, with its date and commit.
"""

import os

MODES = ("full", "quick", "tiny")
"""How much: what README's figures are of, the same rows in minutes, only whether it
runs."""

VARIABLE = "HANDCLEAN_BENCH"
MODE = os.environ.get(VARIABLE, "full")
COUNTS: dict[str, tuple[int, int]] = {}
ABSENT: list[str] = []


def counted(name, full, quick, tiny=1):
    """A count of this run; ``tiny`` is at most ``quick``."""
    chosen = {"full": full, "quick": quick, "tiny": min(tiny, quick)}[MODE]
    COUNTS[name] = (chosen, full)
    return chosen


def absent(*names):
    """Note what was not there, by what a title or a cell of its tables begins with."""
    ABSENT.extend(name for name in names if name not in ABSENT)


def counts():
    """One line: the counts of this run, and beside them the full ones if others."""
    parts = [
        f"{name} {chosen}" + (f" instead of {full}" if chosen != full else "")
        for name, (chosen, full) in COUNTS.items()
    ]
    return ", ".join(parts)
