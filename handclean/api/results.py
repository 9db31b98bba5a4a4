"""What a step makes of a take."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from handclean.recording import Recording
from handclean.remarks import Remark

VERDICTS = frozenset({"anew", "fit", "unobserved", "unseen"})
"""Kinds of remarks on hands that every step makes anew, so that no old one stays."""


@dataclass(frozen=True, kw_only=True)
class StepResult:
    """A take as a step leaves it.

    Attributes
    ----------
    take : the result; its events have no verdict of an earlier run on the hands.
    figures : plain values by name, those that the command's ``FIGURES`` explains.
    remarks : what the owner of the take should know of it.
    """

    take: Recording
    figures: Mapping[str, Any]
    remarks: tuple[Remark, ...] = ()

    def __post_init__(self) -> None:
        kept = tuple(event for event in self.take.events if event.kind not in VERDICTS)
        object.__setattr__(self, "take", replace(self.take, events=kept))
