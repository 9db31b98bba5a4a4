"""Settings of the fits; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """Settings of a fit by Gaussian process."""

    starts: Annotated[int, "Starting points of the hyperparameters."] = 3
    pseudo_inputs: Annotated[int, "Pseudo-inputs of the sparse model (M)."] = 100
    subset: Annotated[int, "Samples on which the starting points are compared."] = 128
    evaluations: Annotated[
        int, "Evaluations of the evidence with all samples, at most."
    ] = 130
    least_noise: Annotated[
        float, "Least noise of a target, a standard deviation in its unit."
    ] = 0.0
    max_samples: Annotated[
        int, "Most samples for a full model; its memory grows with their square."
    ] = 8000

    def __post_init__(self) -> None:
        least = {
            "starts": 1,
            "pseudo_inputs": 1,
            "subset": 16,
            "evaluations": 1,
            "max_samples": 2,
        }
        if not self.least_noise >= 0.0:
            raise ValueError(f"least_noise should be >= 0, not {self.least_noise}")
        for name, smallest in least.items():
            value = getattr(self, name)
            if value < smallest:
                raise ValueError(f"{name} should be >= {smallest}, not {value}")
