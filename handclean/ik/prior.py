"""The posture prior: hand postures as a mean and a few directions (PCA)."""

from dataclasses import dataclass

from handclean.arrays import Floats, expect_shape


@dataclass(frozen=True, kw_only=True)
class PosturePrior:
    """A posture subspace (Schroeder 2016 section 3.2).

    Attributes
    ----------
    names : D hinge names.
    mean : (D,) [rad]
    components : (D, K) orthonormal directions, the most varied first.
    deviations : (K,) [rad] standard deviation along each.
    variance_share : (K,) share of the training variance each direction holds.
    source : what it was learnt from.
    """

    names: tuple[str, ...]
    mean: Floats
    components: Floats
    deviations: Floats
    variance_share: Floats
    source: str = ""

    def __post_init__(self) -> None:
        hinges, directions = len(self.names), len(self.deviations)
        expect_shape("mean", self.mean, hinges)
        expect_shape("components", self.components, hinges, directions)
        expect_shape("variance_share", self.variance_share, directions)
