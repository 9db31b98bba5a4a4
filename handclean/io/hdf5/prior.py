"""Posture priors: the mean and directions of a learnt posture subspace (HDF5)."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.ik.prior import PosturePrior
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Array, Part, expect_finite
from handclean.io.hdf5.provenance import provenance_item

FORMAT = "handclean posture prior"

SHIPPED = Path(__file__).parents[2] / "data" / "default_prior.h5"
"""The prior that comes with handclean, learnt from simulated grasps."""


def write_prior(
    path: Path, prior: PosturePrior, provenance: Sequence[Mapping[str, Any]] = ()
) -> None:
    """Write a posture prior."""
    items: dict[str, Any] = {
        "names": list(prior.names),
        "mean": Array(prior.mean, "rad"),
        "components": Array(prior.components),
        "deviations": Array(prior.deviations, "rad"),
        "variance_share": Array(prior.variance_share),
        **provenance_item(provenance),
    }
    write_h5(path, FORMAT, Part({"source": prior.source}, items))


def read_prior(path: Path = SHIPPED) -> PosturePrior:
    """Read a posture prior; the shipped one by default.

    Raises
    ------
    FileError
        If the file is not one.
    """
    part = read_h5(path, FORMAT, shipped=path == SHIPPED)
    expect_finite(part)
    names = part.names("names")
    deviations = part.array("deviations", "rad", np.float64, None)
    hinges, directions = len(names), len(deviations)
    return PosturePrior(
        names=names,
        mean=part.array("mean", "rad", np.float64, hinges),
        components=part.array("components", "", np.float64, hinges, directions),
        deviations=deviations,
        variance_share=part.array("variance_share", "", np.float64, directions),
        source=part.text("source", ""),
    )
