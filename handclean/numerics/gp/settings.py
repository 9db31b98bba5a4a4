"""Settings of the fits; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, expect_limits


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """Settings of a fit by Gaussian process."""

    starts: Annotated[
        int, "Starting points of the hyperparameters.", Limits(least=1)
    ] = 3
    pseudo_inputs: Annotated[
        int, "Pseudo-inputs of the sparse model (M).", Limits(least=1)
    ] = 100
    subset: Annotated[
        int, "Samples on which the starting points are compared.", Limits(least=16)
    ] = 128
    evaluations: Annotated[
        int, "Evaluations of the evidence with all samples, at most.", Limits(least=1)
    ] = 130
    least_noise: Annotated[
        float,
        "Least noise of a target, a standard deviation in its unit.",
        Limits(least=0.0),
    ] = 0.0
    max_samples: Annotated[
        int,
        "Most samples for a full model; its memory grows with their square.",
        Limits(least=2),
    ] = 8000

    def __post_init__(self) -> None:
        expect_limits(self)
