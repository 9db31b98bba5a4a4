"""What a table of numbers says of itself before its rows begin."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from handclean.io.text.csv_columns import Layout
from handclean.remarks import Remark


@dataclass(frozen=True, kw_only=True)
class Described:
    """A table whose head has been read.

    Attributes
    ----------
    layout : which column holds what.
    names : of the columns, as far as they have some.
    delimiter : what parts the cells.
    said : what the file states: ``rate_hz``, ``unit``, ``first_frame``,
        ``start_time_s``, ``up_axis``, ``motions``; what is not there it does not say.
    is_own : whether handclean wrote it.
    program : that wrote it, "" where that is not known.
    facts : what else the head tells, as plain JSON values.
    rows : how many the head claims, None where it does not say.
    remarks : what was odd.
    """

    layout: Layout
    names: list[str]
    delimiter: bytes
    said: Mapping[str, Any] = field(default_factory=dict)
    is_own: bool = False
    program: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)
    rows: int | None = None
    remarks: tuple[Remark, ...] = ()


def subjects_of(labels: Mapping[str, object]) -> list[str]:
    """Return the subjects in labels such as ``Subject:MARKER``, each once."""
    parted = (label.rpartition(":") for label in labels)
    return list(dict.fromkeys(subject for subject, mark, _ in parted if mark))
