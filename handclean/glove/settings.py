"""Settings of ``calibrate-glove``; imports nothing heavy, so that help is instant."""

from dataclasses import dataclass
from typing import Annotated

from handclean.settings import Limits, Words, expect_limits

_CUTOFF = "Readings are smoothed: what is faster than this goes. 0: as they are."

USES = {"all": "FK and IK samples", "fk": "of any wearer", "ik": "of this subject"}

MODELS = ("lmc-gpr", "spgp", "linear", "two-pose")
"""The usual ones; `handclean.glove.models` knows pairs, too."""


@dataclass(frozen=True, kw_only=True)
class GloveSampleConfig:
    """Settings of ``calibrate-glove sample``."""

    most: Annotated[
        int, "Most samples of one recording, evenly spread.", Limits(least=1)
    ] = 250
    skip_s: Annotated[
        float, "Left out at the start and at the end of a recording.", Limits(least=0.0)
    ] = 0.2
    max_offset_s: Annotated[
        float,
        "Most by which the clocks of glove and markers may differ.",
        Limits(least=0.0),
    ] = 10.0
    reach_m: Annotated[
        float,
        "Frames whose fingertips stay farther apart than this are left out.",
        Limits(least=0.0),
    ] = 0.0005
    cutoff_hz: Annotated[float, _CUTOFF, Limits(least=0.0)] = 8.0

    def __post_init__(self) -> None:
        expect_limits(self)


@dataclass(frozen=True, kw_only=True)
class GloveExamineConfig:
    """Settings of ``calibrate-glove examine``."""

    coupled_sd: Annotated[
        float,
        "Share of the active range whose standard deviation means coupling.",
        Limits(above=0.0, below=10.0),
    ] = 0.05
    coupled_most: Annotated[
        float,
        "Share of the active range that a single deviation may not reach.",
        Limits(above=0.0, below=10.0),
    ] = 0.12

    def __post_init__(self) -> None:
        expect_limits(self)


@dataclass(frozen=True, kw_only=True)
class GloveFitConfig:
    """Settings of ``calibrate-glove fit``."""

    model: Annotated[
        str,
        "lmc-gpr, spgp, linear, two-pose, or a pair such as m0-seard+seard.",
        Words(MODELS, others=True),
    ] = "spgp"
    use: Annotated[str, "Samples to learn from: all, fk or ik.", Words(USES)] = "all"
    pseudo_inputs: Annotated[
        int, "Pseudo-inputs of the sparse model (M).", Limits(least=1)
    ] = 100
    starts: Annotated[
        int, "Starting points of the hyperparameters.", Limits(least=1)
    ] = 3
    evaluations: Annotated[
        int, "Evaluations of the evidence, at most.", Limits(least=1)
    ] = 130
    most: Annotated[
        int, "Most samples per rotation, evenly spread; 0: all.", Limits(least=0)
    ] = 2000
    noise_deg: Annotated[
        float,
        "No sample's angle is known better than this: least noise of a model.",
        Limits(least=0.0, below=90.0, unit="degrees"),
    ] = 0.5
    repeat_deg: Annotated[
        float,
        "What putting the glove on again changes: one standard deviation.",
        Limits(least=0.0, below=90.0, unit="degrees"),
    ] = 1.5

    def __post_init__(self) -> None:
        expect_limits(self)


@dataclass(frozen=True, kw_only=True)
class GloveApplyConfig:
    """Settings of ``calibrate-glove apply``."""

    max_sigma_deg: Annotated[
        float,
        "Frames with a measured rotation less sure than this are not trusted.",
        Limits(above=0.0),
    ] = 15.0
    cutoff_hz: Annotated[float, _CUTOFF, Limits(least=0.0)] = 8.0
    chunk: Annotated[int, "Frames in memory at a time.", Limits(least=1)] = 20_000

    def __post_init__(self) -> None:
        expect_limits(self)
