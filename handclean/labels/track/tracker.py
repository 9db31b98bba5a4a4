"""A target made ready for tracking: its joint tree, variances, branches and rules."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handclean.arrays import Floats, Ints
from handclean.ik.settings import SolveConfig
from handclean.kernels.gauss_newton import (
    Chain,
    StepControl,
    Workspace,
    make_workspace,
)
from handclean.labels.settings import LabelConfig
from handclean.labels.target import TrackTarget

REFERENCE_ERROR_M = 1e-3
"""[m] prediction error at which the logarithm in the cost of a pair is zero. A unit
only: it cancels between the costs of pairs and the price of no point."""

HAND_VOLUME_M3 = 8e-3
"""[m^3] the volume that ``ghosts_per_hand`` counts in: a cube of 0.2 m, about the
length of a hand. Chosen."""

SEEN_ODDS, UNSEEN_ODDS = 99.0, 0.03
"""Odds that a marker is in view which was, or was not, in the frame before. Chosen."""

MIN_PREDICTION_ERROR_M = 2e-4
"""[m] least prediction error of a marker, at any frame rate. Chosen: the noise of a
motion capture system."""

ACCELERATION_SHARE = 0.25
"""Share of the step ``acceleration / rate^2`` that a prediction errs by, one sd.
Chosen."""

LOST_AFTER_S = 0.25
"""[s] without enough markers after which the target is lost and looked for anew.
Chosen."""

MAX_HINGE_SPEED_RAD_S = 40.0
"""[rad/s] a hinge that turns faster has jumped to another solution. Chosen: about
twice the fastest finger movements."""

USUAL_HINGE_SPEED_RAD_S = 8.0
"""[rad/s] speed of a hinge out of sight, one sd. Chosen."""

BRANCH_RESTART_POSTURES = 4
"""How many of a target's start postures a finger is tried in when it does not fit.
Chosen: the whole-hand postures that `start_postures` lists first."""

SOLVER_STEPS = 20
"""Gauss-Newton steps of a solve at most. Chosen."""

NEIGHBOUR_DEPTH_WEIGHT = 1e-3
"""Weight of a marker's distance along its bone [m], against whole bones, when the
markers of a finger are put in order; under 1, so that bones come first. Chosen."""


class TrackRules(NamedTuple):
    """Numbers of the tracker at one frame rate; see `LabelConfig`.

    seen_price, unseen_price : cost of no point for a marker that was, was not, in view
    before. min_error_m : [m] least prediction error. drift_m : [m] its growth per frame
    out of sight. reach_m : [m] farthest that a marker reappears. strict, small_m : of
    the residual gate. lever_m : [m] of the test for open joints, see
    `find_open_hinges`. lost_after : frames without enough markers after which the
    target is lost. max_turn_rad, usual_turn_rad : [rad] of a hinge in a frame.
    """

    seen_price: float
    unseen_price: float
    min_error_m: float
    drift_m: float
    reach_m: float
    strict: float
    small_m: float
    lever_m: float
    lost_after: float
    max_turn_rad: float
    usual_turn_rad: float


@dataclass(frozen=True, kw_only=True)
class TrackSetup:
    """Settings of labelling and of inverse kinematics, and the rules they give.

    Attributes
    ----------
    labelling, solving : the settings.
    rate : [Hz] of the take.
    rules : the tracker's numbers at that rate.
    """

    labelling: LabelConfig
    solving: SolveConfig
    rate: float
    rules: TrackRules


class Tracker(NamedTuple):
    """What does not change while a target is tracked, and the solver's workspace.

    chain, work : joint tree with markers, and room, of the kernels. mean (D,), basis
    (D, K), no_basis (D, 0) : posture prior, and none. prior_m : [m] its weight. steps :
    how the solver steps and stops. variance (M,) [m^2] : of the markers' distances from
    their points. branch (M,) : finger that each marker is on, from 1; 0 for the root.
    rank (M,) : how many markers of its branch lie further out. hinge_branch (D,) :
    finger of each hinge. starts (S, D) [rad] : postures to restart a finger from.
    """

    chain: Chain
    work: Workspace
    mean: Floats
    basis: Floats
    no_basis: Floats
    prior_m: float
    steps: StepControl
    rules: TrackRules
    variance: Floats
    branch: Ints
    rank: Ints
    hinge_branch: Ints
    starts: Floats


def track_setup(settings: LabelConfig, solving: SolveConfig, rate: float) -> TrackSetup:
    """Return settings with the tracker's numbers for a frame rate.

    Parameters
    ----------
    settings : of labelling; solving : of inverse kinematics.
    rate : [Hz]
    """
    ghosts = settings.ghosts_per_hand / HAND_VOLUME_M3
    volume = (2.0 * math.pi) ** 1.5 * REFERENCE_ERROR_M**3
    step = ACCELERATION_SHARE * settings.acceleration_m_s2 / rate**2
    rules = TrackRules(
        seen_price=2.0 * math.log(SEEN_ODDS / (ghosts * volume)),
        unseen_price=2.0 * math.log(UNSEEN_ODDS / (ghosts * volume)),
        min_error_m=math.hypot(MIN_PREDICTION_ERROR_M, step),
        drift_m=settings.drift_m_s / rate,
        reach_m=settings.reach_m,
        strict=settings.strict,
        small_m=settings.small_m,
        lever_m=solving.lever_m,
        lost_after=LOST_AFTER_S * rate,
        max_turn_rad=MAX_HINGE_SPEED_RAD_S / rate,
        usual_turn_rad=USUAL_HINGE_SPEED_RAD_S / rate,
    )
    return TrackSetup(labelling=settings, solving=solving, rate=rate, rules=rules)


def make_tracker(target: TrackTarget, setup: TrackSetup) -> Tracker:
    """Return a target with its numbers and the solver's workspace."""
    markers, hinges = len(target.sigma), len(target.mean)
    solving, rules = setup.solving, setup.rules
    branch_of_link = _branch_of_links(target.chain)
    return Tracker(
        chain=target.chain,
        work=make_workspace(hinges, markers, target.basis.shape[1]),
        mean=target.mean,
        basis=target.basis,
        no_basis=np.zeros((hinges, 0)),
        prior_m=solving.prior_m,
        steps=StepControl(solving.damping, solving.enough_m, SOLVER_STEPS),
        rules=rules,
        variance=target.sigma**2 + (0.5 * rules.small_m) ** 2,
        branch=branch_of_link[target.chain.link],
        rank=_rank_on_branch(target.chain, branch_of_link),
        hinge_branch=branch_of_link[1:],
        starts=target.starts[:BRANCH_RESTART_POSTURES],
    )


def _branch_of_links(chain: Chain) -> Ints:
    """(D + 1,) branch of the root each link is on, from 1; 0 for the root itself."""
    parent = chain.parent
    branch = np.zeros(len(parent), dtype=np.int64)
    branches = 0
    for link in range(1, len(parent)):
        if parent[link] == 0:
            branches += 1
            branch[link] = branches
        else:
            branch[link] = branch[parent[link]]
    return branch


def _rank_on_branch(chain: Chain, branch_of_link: Ints) -> Ints:
    """(M,) how many markers of its branch lie further out than each."""
    depth = NEIGHBOUR_DEPTH_WEIGHT * np.linalg.norm(chain.at, axis=1)
    for m, link in enumerate(chain.link):
        up = int(link)
        while up > 0:
            depth[m] += 1.0
            up = int(chain.parent[up])
    rank = np.zeros(len(depth), dtype=np.int64)
    for branch in range(1, int(branch_of_link.max()) + 1):
        rows = np.flatnonzero(branch_of_link[chain.link] == branch)
        rank[rows[np.argsort(-depth[rows], kind="stable")]] = np.arange(len(rows))
    return rank
