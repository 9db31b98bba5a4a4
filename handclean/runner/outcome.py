"""What a step hands back.

A step is a function of its module's name in ``handclean.commands``:
``convert(source, settings) -> Outcome`` when its command maps, and
``learn_subspace(sources, settings) -> Outcome`` when it reduces. It reads, calls the
algorithms and says what came out; it neither prints nor writes. Beside it stands
``FIGURES``, the name and meaning of every figure it may report; a star in a name stands
for anything.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from handclean.remarks import Remark

Entry = Mapping[str, Any]
"""One entry of a provenance: plain JSON values."""

Writer = Callable[[Path, tuple[Entry, ...]], tuple[Remark, ...] | None]
"""Writes one output to a path of the right suffix, with its provenance inside it where
the format has a place for that (HDF5); may remark on what the format could not
hold."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The result of a step.

    Attributes
    ----------
    line : what was done, in a few words: "filled 31 gaps, left 4 open".
    details : the same at length, for people, on lines of their own.
    figures : plain values by name; the same input gives the same figures, so how
        long it took is none of them.
    remarks : what the owner of the input should know.
    writers : one for each output of the task.
    differs : whether the step compared and found a difference, which the exit status
        tells (1), though nothing failed.
    history : provenance of what was read; the step's own entry comes after it.
    """

    line: str
    details: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    remarks: tuple[Remark, ...] = ()
    writers: tuple[Writer, ...] = ()
    differs: bool = False
    history: tuple[Entry, ...] = ()
