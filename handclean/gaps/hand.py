"""One hand of a take: its posture bridged through gaps, and what follows from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.gaps.follow_posture import follow
from handclean.gaps.posture import SolvedTake, bridge_posture
from handclean.gaps.runs import Gap, Limits, gaps_of, seen_in
from handclean.gaps.scene import Scene
from handclean.gaps.tracks import Fill, Path, Prepare, Refused, Tracks
from handclean.hand.model import marker_positions
from handclean.hand.subject import Subject
from handclean.ik.decide import DECIDED_SD
from handclean.ik.doubt import AngleUncertainty, uncertainty_of_take, zero_sigma
from handclean.ik.noise import marker_noise
from handclean.ik.prior import PosturePrior
from handclean.ik.residual_test import plausible
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import Solution, solve_markers
from handclean.recording import Motion, motion_from_poses


@dataclass(frozen=True, kw_only=True)
class HandOfTake:
    """A subject in a take, and how its posture is bridged.

    Attributes
    ----------
    columns : the take's column of each of the subject's markers that the take has.
    prior : posture subspace, of this subject's hinges; or None.
    limits : what of its joints may be bridged.
    coupled : whether paths of joints follow the joints that are known.
    """

    subject: Subject
    columns: Mapping[int, int]
    prior: PosturePrior | None
    limits: Limits
    coupled: bool
    solve: SolveConfig

    def positions(self, tracks: Tracks) -> Floats:
        """(T, M', 3) [m] samples of the subject's own M' markers."""
        found = np.full((len(tracks.seen), len(self.subject.model.labels), 3), np.nan)
        for own, column in self.columns.items():
            found[:, own] = tracks.positions[:, column]
        return found


@dataclass(frozen=True, kw_only=True)
class BridgedHand:
    """A hand's posture in all of a take.

    Attributes
    ----------
    solution : inverse kinematics of what is measured.
    scene : the bridged posture with the samples it was made from.
    gaps : of the hand's markers; refused are those that were not bridged.
    """

    hand: HandOfTake
    solution: Solution
    scene: Scene
    gaps: Sequence[Gap]


def bridge_hand(hand: HandOfTake, tracks: Tracks) -> BridgedHand:
    """Solve a hand from what is measured and bridge its posture through gaps."""
    model, positions = hand.subject.model, hand.positions(tracks)
    seen = seen_in(positions)
    gaps = [gap for gap in gaps_of(seen, hand.limits) if gap.column in hand.columns]
    solution = solve_markers(model, positions, prior=hand.prior, settings=hand.solve)
    noise = marker_noise(model, positions, solution, hand.subject.marker_sigma)
    posture = bridge_posture(
        SolvedTake(
            model=model,
            positions=positions,
            expected=_expected(seen, gaps),
            solution=solution,
            noise=noise,
        ),
        hand.limits,
        follows=hand.prior is not None,
        coupled=hand.coupled,
        settings=hand.solve,
    )
    scene = Scene(
        positions=positions,
        model=model,
        posture=posture,
        limits=hand.limits,
        noise=noise,
    )
    return BridgedHand(hand=hand, solution=solution, scene=scene, gaps=gaps)


def _expected(seen: Bools, gaps: Sequence[Gap]) -> Bools:
    """(T, M') samples that are measured or missing only in a gap that is bridged."""
    expected = seen.copy()
    for gap in gaps:
        if not gap.refused:
            expected[gap.start : gap.stop, gap.column] = True
    return expected


def following(hands: Sequence[HandOfTake]) -> Prepare:
    """Return a filler that lets markers follow the bridged posture of their hand."""

    def prepare(tracks: Tracks) -> Fill:
        return follower([bridge_hand(hand, tracks) for hand in hands])

    return prepare


def follower(bridged: Sequence[BridgedHand]) -> Fill:
    """Return what fills the gaps of hands whose posture is bridged."""
    own = {
        column: (hand, marker)
        for hand in bridged
        for marker, column in hand.hand.columns.items()
    }

    judged = {
        (hand.hand.columns[gap.column], gap.start, gap.stop): gap.refused
        for hand in bridged
        for gap in hand.gaps
    }

    def fill(gap: Gap) -> Path:
        if gap.column not in own:
            raise Refused("it belongs to no subject")
        why = judged.get((gap.column, gap.start, gap.stop), "its ends are not known")
        if why:
            raise Refused(why)
        hand, marker = own[gap.column]
        scene = hand.scene
        of_hand = Gap(column=marker, start=gap.start, stop=gap.stop)
        places = follow(scene, of_hand)
        square = scene.posture.marker_variance[gap.start : gap.stop, marker]
        # square [m^2] is of the distance: a third of it is that of one axis.
        variance = square / 3.0 + scene.posture.leftovers.at(gap.frames)
        return Path(places, np.sqrt(variance))

    return fill


def motion_of(bridged: BridgedHand) -> Motion:
    """Return the bridged motion.

    A frame is trusted if all of these hold:

    - markers and prior decide the posture, as in `solve`, or it was bridged;
    - the root is known;
    - with a prior, no doubt about root or hinges is beyond `DECIDED_SD`;
    - the residual is one that the subject's markers may have.
    """
    hand, posture, solution = bridged.hand, bridged.scene.posture, bridged.solution
    subject, positions = hand.subject, bridged.scene.positions
    uncertainty = _uncertainty(bridged)
    away = positions - marker_positions(subject.model, posture.poses)
    square = np.sum(away * away, axis=2)
    seen = np.isfinite(square)
    count = seen.sum(axis=1)
    mean = np.nansum(square, axis=1) / np.maximum(count, 1)
    residual = np.where(count > 0, np.sqrt(mean), np.nan)
    sigma = uncertainty.hinges
    known = solution.decided | posture.bridged_root
    if hand.prior is not None:
        known |= posture.bridged.any(axis=1)
        known &= (uncertainty.root <= DECIDED_SD.root_rad) & (
            sigma <= DECIDED_SD.hinge_rad
        ).all(axis=1)
        known &= (uncertainty.off <= DECIDED_SD.hinge_rad).all(axis=1)
    known &= ~posture.open_root
    return motion_from_poses(
        subject.model.tree.hinges,
        posture.poses,
        angles_sigma=np.sqrt(sigma**2 + zero_sigma(subject) ** 2),
        trusted=known & plausible(subject, seen, residual),
        residual=residual,
    )


def _uncertainty(bridged: BridgedHand) -> AngleUncertainty:
    """How uncertain angles are, without the constant offset of each angle.

    See `uncertainty_of_take`; what is bridged is as sure as its path. A 0 for a bridged
    frame says that its path has been judged already.
    """
    hand, posture = bridged.hand, bridged.scene.posture
    found = uncertainty_of_take(
        hand.subject,
        bridged.scene.positions,
        posture.poses,
        bridged.solution,
        bridged.scene.noise,
        hand.prior,
        hand.solve.prior_m,
    )
    return AngleUncertainty(
        root=np.where(posture.bridged_root, 0.0, found.root),
        hinges=np.where(posture.bridged, posture.sigma, found.hinges),
        off=np.where(posture.bridged, 0.0, found.off),
    )
