"""What is said of hands that were solved: do the markers fit, is it this hand?"""

from collections.abc import Mapping

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.errors import TAKE, HandcleanError
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.subject import Subject
from handclean.ik import bad_markers, residual_test, unobserved
from handclean.ik.prior import PosturePrior, knowing
from handclean.ik.residual_test import plausible
from handclean.ik.solve import markers_of
from handclean.ik.wrong_side import expect_side
from handclean.labels.checks.unit import markers_unit_hint
from handclean.recording import Recording
from handclean.remarks import Remark, length_in_words, remark
from handclean.tree import ROOT_DOFS

MIN_MARKERS_OF_POSE = ROOT_DOFS // 2
"""Markers in sight at once that say where a hand is: three places are what the six
numbers of a root need."""


def expect_seen(
    recording: Recording, found: Mapping[str, Subject]
) -> tuple[Remark, ...]:
    """Expect some frame to show enough markers of some hand to say where it is.

    Returns
    -------
    remarks on those of several hands that are never seen

    Raises
    ------
    HandcleanError
        If none is seen, or one has no marker in the take.
    """
    never = {name: _unseen(recording, subject) for name, subject in found.items()}
    if all(never.values()):
        raise HandcleanError(
            f"{' and '.join(never.values())}; {MIN_MARKERS_OF_POSE} or more say where "
            "a hand is",
            where=TAKE,
        )
    return tuple(
        remark("unseen", f"{name}: {why}: it has no pose", model=name)
        for name, why in never.items()
        if why
    )


def _unseen(recording: Recording, subject: Subject) -> str:
    """Say that no frame shows enough markers of a hand; "" where some does."""
    seen = np.isfinite(markers_of(recording, subject.model)).all(axis=2)
    most = int(seen.sum(axis=1).max(initial=0))
    if most >= MIN_MARKERS_OF_POSE:
        return ""
    if most == 0:
        return f"none of the markers of '{subject.name}' is in sight in any frame"
    markers = "marker" if most == 1 else "markers"
    return f"no frame shows more than {most} {markers} of '{subject.name}'"


def expect_sides(
    recording: Recording, found: Mapping[str, Subject], prior: PosturePrior | None
) -> None:
    """Expect solved hands to be of their subjects' sides; see `wrong_side`."""
    for name, subject in found.items():
        residual = recording.motions[name].residual
        assert residual is not None
        expect_side(subject, markers_of(recording, subject.model), residual, prior)


def expect_fits(recording: Recording, found: Mapping[str, Subject]) -> None:
    """Expect some frame of each hand to fit, where its markers are not of its size.

    Raises
    ------
    HandcleanError
        If none does, and markers are ten or more times too far apart, or too close, or
        residuals are longer than the hand, or than all its markers in the take.
    """
    for name, subject in found.items():
        model, residual = subject.model, recording.motions[name].residual
        positions = markers_of(recording, model)
        seen = np.asarray(np.isfinite(positions).all(axis=2))
        if residual is None or not np.isfinite(residual).any():
            continue
        usual = float(np.nanmedian(residual))
        near = plausible(subject, seen, residual) & np.isfinite(residual)
        wrong = "" if near.any() else markers_unit_hint(positions, model)
        if not wrong and not near.any() and usual > _least_span(model, positions, seen):
            wrong = "are these its markers, and is the unit right? (--unit)"
        if wrong:
            raise HandcleanError(
                f"no frame fits the hand of '{subject.name}' (residual "
                f"{length_in_words(usual)}); {wrong}",
                where=TAKE,
            )


def _least_span(model: Model, positions: Floats, seen: Bools) -> float:
    """[m] the longest side of the box around a hand's markers.

    Of the model or, if that is shorter, of (T, M, 3) positions in the usual frame that
    shows two or more. Infinite if neither has a length.
    """
    spans = [np.ptp(marker_positions(model, neutral_pose(model.tree)[None])[0], axis=0)]
    several = seen.sum(axis=1) > 1
    if several.any():
        some, there = positions[several], seen[several][:, :, None]
        low = np.where(there, some, np.inf).min(axis=1)
        high = np.where(there, some, -np.inf).max(axis=1)
        spans.append(np.median((high - low).max(axis=1)))
    return min(
        (float(np.max(span)) for span in spans if np.max(span) > 0.0), default=np.inf
    )


def doubts(recording: Recording, found: Mapping[str, Subject]) -> tuple[Remark, ...]:
    """Remark on solved hands that hardly look like the subject they were solved with.

    And whether the unit of length may be the reason.
    """
    remarks: list[Remark] = []
    for name, subject in found.items():
        if unlike := residual_test.doubts(recording, subject, name):
            remarks += unlike
            hint = markers_unit_hint(
                markers_of(recording, subject.model), subject.model
            )
            remarks += [remark("unit", hint, model=name)] if hint else []
    return tuple(remarks)


def misplaced(
    recording: Recording, found: Mapping[str, Subject], prior: PosturePrior | None
) -> tuple[Remark, ...]:
    """Remark on markers that do not fit for a while; see `suspects`."""
    remarks: list[Remark] = []
    for name, subject in found.items():
        positions = markers_of(recording, subject.model)
        remarks += bad_markers.misfits(recording, subject, name, positions, prior)
    return tuple(remarks)


def untold(
    recording: Recording,
    found: Mapping[str, Subject],
    prior: PosturePrior | None,
    *,
    filled: bool = False,
) -> tuple[Remark, ...]:
    """Remark on fingers that had no marker; see `unobserved`."""
    remarks: list[Remark] = []
    for name, subject in found.items():
        known = knowing(prior, subject.model.tree.hinges) is not None
        remarks += unobserved.unobserved(
            recording, subject, name, filled=filled, prior=known
        )
    return tuple(remarks)
