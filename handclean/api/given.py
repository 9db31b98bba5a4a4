"""Hands as callers give them: subjects, or a marker set on the template hand."""

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handclean.api.hands import Hands, names_of
from handclean.errors import UsageError
from handclean.hand.marker_set import MarkerSet, load_marker_set
from handclean.hand.skeleton import rigid_subject
from handclean.hand.subject import Subject, template_subject
from handclean.io.hdf5.prior import read_prior
from handclean.labels.settings import LEAST_MARKERS
from handclean.runner.records import digest

Subjects = Subject | Iterable[Subject]
"""One subject, or one for each hand of a take."""


def hands(
    subjects: Subjects,
    marker_set: str,
    side: str,
    prior: Path | str | None,
    *,
    least: int = 1,
    with_prior: bool = True,
) -> Hands:
    """Return the hands that a caller gives.

    Parameters
    ----------
    subjects : one, or one for each hand of the take; none for the template hand.
    marker_set : name or file of the markers on the template hand, where no subject is
        given.
    side : of the template hand; "" for the marker set's.
    prior : file of a posture prior; None for the one that ships.
    least : how many markers each hand should have; 0 where none need be given.
    with_prior : whether they are solved with a prior.

    Raises
    ------
    UsageError
        If neither subjects nor a marker set are given or both are, the side is none,
        two subjects are of one side, or one has too few markers.
    HandcleanError
        If the marker set or the prior is not what it should be.
    """
    found = [subjects] if isinstance(subjects, Subject) else list(subjects)
    if (found and marker_set) or (least and not found and not marker_set):
        raise UsageError(
            "give either a subject, which calibrate_hand makes, or a marker_set, which "
            "the template hand then has",
            where="subjects",
        )
    if side not in ("", "left", "right") or (side and not marker_set):
        right = "it is left or right, of the template hand only"
        raise UsageError(f"cannot be '{side}' here; {right}", where="side")
    identities = [identity(subject) for subject in found]
    if marker_set:
        found = [_template(load_marker_set(marker_set), side)]
        of_file = marker_set.endswith(".toml")
        identities = [digest(Path(marker_set)) if of_file else marker_set]
    _expect_one_a_side(found)
    for subject in found:
        if (count := len(subject.model.labels)) < least:
            wrong = f"'{subject.name}' has {count} markers; {least} at least are needed"
            raise UsageError(wrong, where="subjects")
    names = names_of(found)
    file = None if prior is None or not with_prior else Path(prior)
    posture = None
    if with_prior:
        posture = read_prior() if file is None else read_prior(file)
    return Hands(
        subjects=dict(zip(names, found, strict=True)),
        identities=dict(zip(names, identities, strict=True)),
        prior=posture,
        prior_sha256=None if file is None else digest(file),
        is_template=bool(marker_set),
    )


def only_hand(
    subjects: Subjects, marker_set: str, side: str, prior: Path | str | None
) -> Hands:
    """Return the only hand that a caller gives, with markers enough to label.

    Raises
    ------
    UsageError
        If there are several; and as `hands`.
    """
    found = hands(subjects, marker_set, side, prior, least=LEAST_MARKERS)
    if (count := len(found.subjects)) > 1:
        wrong = f"{count} hands cannot be labelled at once yet; give one"
        raise UsageError(wrong, where="subjects")
    return found


def identity(subject: Subject) -> str:
    """Return how records name a subject: by its file's digest, else by its content's.

    A subject that differs in anything has another identity.
    """
    if subject.file_sha256:
        return subject.file_sha256
    found = hashlib.sha256()
    _digest_into(found, subject)
    return found.hexdigest()


def _digest_into(found: "hashlib._Hash", value: Any) -> None:
    """Add a value to a digest, part for part."""
    if isinstance(value, np.ndarray):
        found.update(f"{value.dtype.str}{value.shape}".encode() + value.tobytes())
    elif is_dataclass(value):
        for part in fields(value):
            if part.compare:
                found.update(part.name.encode())
                _digest_into(found, getattr(value, part.name))
    elif isinstance(value, Mapping):
        for key in sorted(value):
            found.update(str(key).encode())
            _digest_into(found, value[key])
    else:
        found.update(f"{value!r};".encode())


def _expect_one_a_side(found: Iterable[Subject]) -> None:
    """Expect a left and a right hand at most."""
    by_side: dict[str, str] = {}
    for subject in found:
        side = subject.model.tree.side
        if side and side in by_side:
            raise UsageError(
                f"'{by_side[side]}' and '{subject.name}' are {side} hands; "
                "give one for each hand of the take",
                where="subjects",
            )
        by_side[side] = subject.name


def _template(marker_set: MarkerSet, side: str) -> Subject:
    if marker_set.kind == "rigid":
        return rigid_subject(marker_set, side)
    return template_subject(marker_set, side)
