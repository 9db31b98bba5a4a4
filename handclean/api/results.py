"""What a step makes of a take."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from handclean.recording import Recording
from handclean.remarks import Remark, remark


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """A take as a step leaves it.

    Attributes
    ----------
    take : the result.
    figures : plain values by name, those that the command's ``FIGURES`` explains.
    warnings : what the owner of the take should know, one line each.
    """

    take: Recording
    figures: Mapping[str, Any]
    warnings: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """The warnings as remarks."""
        return tuple(remark("note", text) for text in self.warnings)
