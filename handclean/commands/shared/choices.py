"""What steps are set to beyond the settings of one algorithm; imports nothing heavy."""

from dataclasses import InitVar, dataclass
from typing import Annotated

from handclean.gaps.settings import FillConfig
from handclean.glove.settings import (
    GloveApplyConfig,
    GloveExamineConfig,
    GloveFitConfig,
    GloveSampleConfig,
)
from handclean.ik.settings import SolveConfig
from handclean.labels.settings import LabelConfig
from handclean.layouts.evaluate_settings import EvaluateConfig
from handclean.layouts.settings import LayoutConfig
from handclean.settings import Limits, expect_limits
from handclean.simulation.settings import SimulateConfig
from handclean.subject.scan.settings import ScanConfig
from handclean.subject.settings import CalibrateConfig

EVALUATION_ROWS, EVALUATION_TABLE = "evaluation.csv", "table.txt"
EVALUATION_PLOT = "errors.png"
"""Files of a take that ``fill-gaps --evaluate`` writes."""


@dataclass(frozen=True, kw_only=True)
class LearnConfig:
    """Settings of ``learn subspace``."""

    directions: Annotated[
        int,
        "How many directions to keep; 0: as many as hold the share.",
        Limits(least=0),
    ] = 0
    share: Annotated[
        float, "Share of the variance the directions hold.", Limits(above=0.0, most=1.0)
    ] = 0.95

    def __post_init__(self) -> None:
        expect_limits(self)


@dataclass(frozen=True, kw_only=True)
class Solving:
    """Settings of inverse kinematics, and whether it does without the prior."""

    solve: SolveConfig
    standard: bool


@dataclass(frozen=True, kw_only=True)
class Filling:
    """Settings of filling, and of the inverse kinematics it rests on."""

    fill: FillConfig
    solve: SolveConfig


@dataclass(frozen=True, kw_only=True)
class JudgingFillers:
    """Settings of judging fillers, and what is written of it.

    Attributes
    ----------
    method : the only filler beside the yardstick, or "" for all.
    written : names of the files of each take; those beside are plots.
    """

    fill: FillConfig
    solve: SolveConfig
    method: str
    written: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Cleaning:
    """Settings of the chain."""

    label: LabelConfig
    fill: FillConfig
    solve: SolveConfig


@dataclass(frozen=True, kw_only=True)
class Calibrating:
    """Settings of a calibration, and whose hand it is."""

    calibrate: CalibrateConfig
    name: str


@dataclass(frozen=True, kw_only=True)
class Scanning:
    """Settings of fitting a hand to a scan, and whose hand it is."""

    scan: ScanConfig
    name: str


@dataclass(frozen=True, kw_only=True)
class Inspecting:
    """Whether a C3D is also read by the ``c3d`` package and compared."""

    verify: bool = False


@dataclass(frozen=True, kw_only=True)
class Converting:
    """Whose joints a skinned hand has: a shipped joint map or a file; what else.

    ``unnamed``: points without a name go into a TRC, too. ``bvh_up``: the axis that
    points up in a BVH.
    """

    joint_map: str = ""
    unnamed: bool = False
    bvh_up: str = "+y"


@dataclass(frozen=True, kw_only=True)
class Simulating:
    """Settings of a simulation, and of what: a scenario's name or file, and its kind.

    A scenario's own settings are among them already.
    """

    scenario: str
    kind: str
    simulate: SimulateConfig


@dataclass(frozen=True, kw_only=True)
class GloveExamining:
    """Settings of an examination of a glove's sensors, and of which glove."""

    examine: GloveExamineConfig
    glove: str
    moved: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class GloveSampling:
    """Settings of sampling, and what was known while readings were recorded.

    Attributes
    ----------
    pose : name of a key pose, or ""; holds : "ROTATION=DEGREES" of widgets.
    touch : fingers that touch, "thumb,index", or "".
    glove : name of a shipped one, or "" for what the readings say.
    """

    sample: GloveSampleConfig
    pose: str
    holds: tuple[str, ...]
    touch: str
    glove: str


@dataclass(frozen=True, kw_only=True)
class GloveFitting:
    """Settings of a calibration; ``jobs`` processes do not change what comes out."""

    fit: GloveFitConfig
    jobs: InitVar[int] = 1

    def __post_init__(self, jobs: int) -> None:
        object.__setattr__(self, "workers", jobs)


@dataclass(frozen=True, kw_only=True)
class GloveRewearing:
    """Nothing to set: what is to be adapted stands among the files."""


@dataclass(frozen=True, kw_only=True)
class GloveApplying:
    """Settings of applying a calibration, and whether fingertips are wanted."""

    apply: GloveApplyConfig
    tips: bool


@dataclass(frozen=True, kw_only=True)
class LayingOut:
    """Settings of a layout.

    Attributes
    ----------
    name : of the marker set, or "" for the file's.
    from_set : name or file of the set whose markers are to choose from, or "".
    marker_mm : diameter of the markers.
    by_error : try several numbers of directions and keep the best layout.
    beside : suffixes of what is written beside the set: sheets and hands.
    """

    layout: LayoutConfig
    name: str
    from_set: str
    marker_mm: float
    by_error: bool
    beside: tuple[str, ...]

    def __post_init__(self) -> None:
        if not 0.0 <= self.marker_mm <= 50.0:
            raise ValueError(
                f"--marker-mm: should lie between 0 and 50 mm, not {self.marker_mm}"
            )


@dataclass(frozen=True, kw_only=True)
class JudgingLayouts:
    """Settings of judging layouts, and the one with which the skin is solved."""

    evaluate: EvaluateConfig
    anchor: bool
    solve: SolveConfig
