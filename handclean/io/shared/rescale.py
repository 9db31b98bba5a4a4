"""A take whose lengths are in another unit than its file says."""

from dataclasses import replace
from typing import Any

import numpy as np

from handclean.arrays import Floats32
from handclean.io.shared.settle import METRES
from handclean.recording import Motion, Points, Recording, Trajectories
from handclean.tree import JointTree


def rescaled(take: Recording, factor: float) -> Recording:
    """Return a take with all its lengths multiplied.

    What it keeps of a C3D is kept with the unit that fits, if there is one.
    """
    markers, points = take.markers, take.unlabelled
    return replace(
        take,
        markers=None if markers is None else _markers(markers, factor),
        unlabelled=None if points is None else _points(points, factor),
        motions={name: _motion(one, factor) for name, one in take.motions.items()},
        skeletons={name: _tree(one, factor) for name, one in take.skeletons.items()},
        parameters=_parameters(dict(take.parameters), factor),
    )


def _times(values: Floats32 | None, factor: float) -> Floats32 | None:
    return None if values is None else values * np.float32(factor)


def _markers(markers: Trajectories, factor: float) -> Trajectories:
    return replace(
        markers,
        positions=markers.positions * factor,
        sigma=_times(markers.sigma, factor),
        residual=_times(markers.residual, factor),
        raw=None if markers.raw is None else markers.raw * factor,
    )


def _points(points: Points, factor: float) -> Points:
    return replace(
        points,
        positions=points.positions * factor,
        residual=_times(points.residual, factor),
    )


def _motion(motion: Motion, factor: float) -> Motion:
    place, residual = motion.translation, motion.residual
    return replace(
        motion,
        translation=None if place is None else place * factor,
        residual=None if residual is None else residual * factor,
    )


def _tree(tree: JointTree, factor: float) -> JointTree:
    return replace(tree, offsets=tree.offsets * factor, scale=tree.scale * factor)


def _parameters(parameters: dict[str, Any], factor: float) -> dict[str, Any]:
    kept = parameters.pop("c3d", None)
    if not isinstance(kept, dict) or str(kept.get("unit")).lower() not in METRES:
        return parameters
    metres = METRES[str(kept["unit"]).lower()] * factor
    for unit in ("m", "dm", "cm", "mm", "um"):
        if np.isclose(METRES[unit], metres, rtol=1e-9):
            return {**parameters, "c3d": {**kept, "unit": unit}}
    return parameters
