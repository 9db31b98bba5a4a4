"""Settings of ``calibrate-glove``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

_CUTOFF = "Readings are smoothed: what is faster than this goes. 0: as they are."

USES = {"all": "FK and IK samples", "fk": "of any wearer", "ik": "of this subject"}

MODELS = ("lmc-gpr", "spgp", "linear", "two-pose")
"""The usual ones; `handclean.glove.models` knows pairs, too."""


@dataclass(frozen=True, kw_only=True)
class GloveSampleConfig:
    """Settings of ``calibrate-glove sample``."""

    most: Annotated[int, "Most samples of one recording, evenly spread."] = 250
    skip_s: Annotated[float, "Left out at the start and at the end of a recording."] = (
        0.2
    )
    max_offset_s: Annotated[
        float, "Most by which the clocks of glove and markers may differ."
    ] = 10.0
    reach_m: Annotated[
        float, "Frames whose fingertips stay farther apart than this are left out."
    ] = 0.0005
    cutoff_hz: Annotated[float, _CUTOFF] = 8.0

    def __post_init__(self) -> None:
        if self.most < 1:
            raise ValueError(f"most should be >= 1, not {self.most}")
        for name in ("skip_s", "max_offset_s", "reach_m", "cutoff_hz"):
            if getattr(self, name) < 0.0:
                raise ValueError(f"{name} should be >= 0, not {getattr(self, name)}")


@dataclass(frozen=True, kw_only=True)
class GloveExamineConfig:
    """Settings of ``calibrate-glove examine``."""

    coupled_sd: Annotated[
        float, "Share of the active range whose standard deviation means coupling."
    ] = 0.05
    coupled_most: Annotated[
        float, "Share of the active range that a single deviation may not reach."
    ] = 0.12

    def __post_init__(self) -> None:
        for name in ("coupled_sd", "coupled_most"):
            if not 0.0 < getattr(self, name) < 10.0:
                value = getattr(self, name)
                raise ValueError(f"{name} should be a share above 0, not {value}")


@dataclass(frozen=True, kw_only=True)
class GloveFitConfig:
    """Settings of ``calibrate-glove fit``."""

    model: Annotated[
        str,
        "lmc-gpr, spgp, linear, two-pose, or a pair such as m0-seard+seard.",
        MODELS,
    ] = "spgp"
    use: Annotated[str, "Samples to learn from: all, fk or ik.", USES] = "all"
    pseudo_inputs: Annotated[int, "Pseudo-inputs of the sparse model (M)."] = 100
    starts: Annotated[int, "Starting points of the hyperparameters."] = 3
    evaluations: Annotated[int, "Evaluations of the evidence, at most."] = 130
    most: Annotated[int, "Most samples per rotation, evenly spread; 0: all."] = 2000
    noise_deg: Annotated[
        float, "No sample's angle is known better than this: least noise of a model."
    ] = 0.5
    repeat_deg: Annotated[
        float, "What putting the glove on again changes: one standard deviation."
    ] = 1.5

    def __post_init__(self) -> None:
        for name in ("noise_deg", "repeat_deg"):
            if not 0.0 <= getattr(self, name) < 90.0:
                value = getattr(self, name)
                raise ValueError(f"{name} should be 0 to 90 degrees, not {value}")
        if self.use not in USES:
            raise ValueError(f"use should be all, fk or ik, not '{self.use}'")
        for name, least in (
            ("pseudo_inputs", 1),
            ("starts", 1),
            ("evaluations", 1),
            ("most", 0),
        ):
            if getattr(self, name) < least:
                value = getattr(self, name)
                raise ValueError(f"{name} should be >= {least}, not {value}")


@dataclass(frozen=True, kw_only=True)
class GloveApplyConfig:
    """Settings of ``calibrate-glove apply``."""

    max_sigma_deg: Annotated[
        float, "Frames with a measured rotation less sure than this are not trusted."
    ] = 15.0
    cutoff_hz: Annotated[float, _CUTOFF] = 8.0
    chunk: Annotated[int, "Frames in memory at a time."] = 20_000

    def __post_init__(self) -> None:
        if self.max_sigma_deg <= 0.0:
            wrong = f"max_sigma_deg should be above 0, not {self.max_sigma_deg}"
            raise ValueError(wrong)
        if self.cutoff_hz < 0.0:
            raise ValueError(f"cutoff_hz should be >= 0, not {self.cutoff_hz}")
        if self.chunk < 1:
            raise ValueError(f"chunk should be >= 1, not {self.chunk}")
