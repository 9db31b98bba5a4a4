"""Joint angles of a labelled take: the entry of inverse kinematics."""

from dataclasses import replace

import numpy as np

from handclean.hand.subject import Subject
from handclean.ik.doubt import uncertainty_of_take, zero_sigma
from handclean.ik.noise import marker_noise
from handclean.ik.prior import PosturePrior
from handclean.ik.residual_test import plausible
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import markers_of, solve_markers
from handclean.recording import Recording, motion_from_poses


def solve(
    recording: Recording,
    subject: Subject,
    *,
    name: str = "",
    prior: PosturePrior | None = None,
    settings: SolveConfig | None = None,
) -> Recording:
    """Add the joint angles of one hand to a labelled take.

    Residuals, and the fit itself, count measured markers only. A frame is trusted if
    its posture is decided (see `Solution`) and its residual is one that this subject's
    markers may have (see `plausible`). ``angles_sigma`` is what markers and prior leave
    open and the constant error of each joint's zero (see `doubt`); NaN where nothing
    tells of a joint.

    Parameters
    ----------
    name : of the skeleton and motion; the hand's side when not given.

    Raises
    ------
    HandcleanError
        If the take has none of the subject's markers.
    """
    settings = settings or SolveConfig()
    model = subject.model
    positions = markers_of(recording, model)
    solution = solve_markers(model, positions, prior=prior, settings=settings)
    noise = marker_noise(model, positions, solution, subject.marker_sigma)
    sigma = uncertainty_of_take(
        subject, positions, solution.poses, solution, noise, prior, settings.prior_m
    ).hinges
    name = name or model.tree.side or model.tree.kind
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    near = plausible(subject, seen, solution.residual)
    motion = motion_from_poses(
        model.tree.hinges,
        solution.poses,
        angles_sigma=np.sqrt(sigma**2 + zero_sigma(subject) ** 2),
        residual=solution.residual,
        trusted=solution.decided & near,
    )
    return replace(
        recording,
        skeletons={**recording.skeletons, name: model.tree},
        motions={**recording.motions, name: motion},
    )
