"""Postures refined with the markers that are there, each in a place of its own."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.hand.model import Model
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import chain_of
from handclean.kernels import jit
from handclean.kernels.gauss_newton import (
    Anchor,
    Chain,
    Observations,
    StepControl,
    Workspace,
    make_workspace,
    misfit,
    solve_full,
)

ROOT_LEVER_M = 0.1
"""[m] how far from the root's origin a turn of the root moves a marker, about. Chosen:
half a hand."""


class PlacedMarkers(NamedTuple):
    """Markers of N frames, with places that differ from frame to frame.

    targets (N, M, 3) [m]; weight (N, M), 0 where there is no target; places (N, M, 3)
    [m] in their links' frames.
    """

    targets: Floats
    weight: Floats
    places: Floats


@jit
def with_places(tree: Chain, places: Floats) -> Chain:
    """Return a tree whose markers are in other places (M, 3) [m]."""
    return Chain(tree.parent, tree.offset, tree.axis, tree.link, places, tree.limits)


@jit
def refine_frames(
    markers: PlacedMarkers,
    anchor: Floats,
    tree: Chain,
    control: StepControl,
    k: Workspace,
    poses: Floats,
) -> None:
    """Refine poses frame by frame, each from itself.

    Parameters
    ----------
    anchor : (N, D) [m^2/rad^2] what holds each hinge where it is.
    tree : its marker places do not matter.
    poses : (N, 7 + D), overwritten by the result.
    """
    for n in range(poses.shape[0]):
        moved = with_places(tree, markers.places[n])
        seen = Observations(markers.targets[n], markers.weight[n])
        held = Anchor(poses[n, 7:].copy(), anchor[n])
        solve_full(poses[n], seen, held, moved, control, k)


@jit
def place_frames(
    poses: Floats,
    weight: Floats,
    places: Floats,
    tree: Chain,
    k: Workspace,
    out: Floats,
) -> None:
    """Write where markers are whose places differ from frame to frame.

    Parameters
    ----------
    poses : (N, 7 + D); weight : (M,) ones; places : (N, M, 3) [m], as above.
    out : (N, M, 3) [m] overwritten in full.
    """
    for n in range(poses.shape[0]):
        moved = with_places(tree, places[n])
        fit = misfit(poses[n], Observations(out[n], weight), moved, k)
        for m in range(out.shape[1]):
            for i in range(3):
                out[n, m, i] = poses[n, i] + fit.point[m, i]


def refined(
    model: Model,
    poses: Floats,
    targets: Floats,
    weight: Floats,
    moved: Floats,
    anchor: Floats,
    settings: SolveConfig,
) -> Floats:
    """(N, 7 + D) poses that fit targets as far as the anchors let them.

    Parameters
    ----------
    poses : (N, 7 + D) to start from; its angles are where the anchors hold.
    targets : (N, M, 3) [m], anything where there is none; weight : (N, M) there 0.
    moved : (N, M, 3) [m] what to add to the markers' places on their bones.
    anchor : (N, D) [m^2/rad^2]
    """
    out = poses.copy()
    markers = PlacedMarkers(
        targets=np.where(weight[:, :, None] > 0.0, targets, 0.0),
        weight=weight,
        places=model.link_at + moved,
    )
    control = StepControl(settings.damping, settings.enough_m, settings.iterations)
    work = make_workspace(len(model.tree.hinges), len(model.labels))
    refine_frames(markers, anchor, chain_of(model), control, work, out)
    return out


def placed(model: Model, poses: Floats, moved: Floats) -> Floats:
    """(N, M, 3) [m] where markers are whose places on their bones are moved."""
    points = np.zeros(moved.shape)
    work = make_workspace(len(model.tree.hinges), len(model.labels))
    ones = np.ones(len(model.labels))
    place_frames(poses, ones, model.link_at + moved, chain_of(model), work, points)
    return points


@dataclass(frozen=True)
class Targets:
    """The markers in sight, to fit poses to.

    Attributes
    ----------
    positions : (T, M, 3) [m]; seen : (T, M)
    moved : (T, M, 3) [m] what to add to the markers' places on their bones.
    noise : (M,) [m] their standard deviation per axis.
    """

    model: Model
    positions: Floats
    seen: Bools
    moved: Floats
    noise: Floats
    settings: SolveConfig

    def fitted(
        self, frames: Ints, poses: Floats, held: Floats, root: Floats | None = None
    ) -> Floats:
        """(N, 7 + D) poses of some frames, fitted.

        Parameters
        ----------
        poses : (T, 7 + D) to start from.
        held : (T, D) [rad^2] variance of the angles there, 0 where they are free.
        root : (T, 2) [m^2], [rad^2] variance of the root there, 0 where it is free;
            where it is not, missing markers count at the places they have there.
        """
        usual = float(np.median(self.noise)) ** 2
        rows, moved = poses[frames], self.moved[frames]
        targets = self.positions[frames]
        weight = self.seen[frames].astype(np.float64)
        if root is not None and (root[frames, 0] > 0.0).any():
            loose = root[frames, 0] + ROOT_LEVER_M**2 * root[frames, 1]
            absent = ~self.seen[frames] & (loose[:, None] > 0.0)
            targets = np.where(
                absent[:, :, None], placed(self.model, rows, moved), targets
            )
            share = usual / np.where(loose > 0.0, loose, 1.0)
            weight = np.where(absent, share[:, None], weight)
        anchor = np.zeros(held[frames].shape)
        np.divide(usual, held[frames], out=anchor, where=held[frames] > 0.0)
        return refined(self.model, rows, targets, weight, moved, anchor, self.settings)
