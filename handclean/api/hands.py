"""Whose hands a step looks for in a take, and what it expects of their posture."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior
from handclean.remarks import Remark, remark


@dataclass(frozen=True, kw_only=True)
class Hands:
    """Subjects that a take shows, and the posture prior they are solved with.

    Attributes
    ----------
    subjects : by the name of their skeleton and motion: "right", "right_2".
    identities : by the same names, how records name each subject: the digest of its
        file, or the marker set that a template has.
    prior : None to do without one.
    is_template : whether no subject is given, only a marker set.
    prior_sha256 : digest of the prior's file; None for the prior that ships.
    """

    subjects: Mapping[str, Subject]
    identities: Mapping[str, str]
    prior: PosturePrior | None
    prior_sha256: str | None = None
    is_template: bool = False

    @property
    def only(self) -> tuple[str, Subject]:
        """The name and the subject of a take of one hand."""
        ((name, subject),) = self.subjects.items()
        return name, subject


def names_of(subjects: Iterable[Subject]) -> tuple[str, ...]:
    """Name subjects as their skeletons and motions are: "right", "right_2".

    Returns
    -------
    one name for each subject, in their order
    """
    names: list[str] = []
    for subject in subjects:
        name = subject.model.tree.side or subject.model.tree.kind
        count = sum(taken.split("_")[0] == name for taken in names)
        names.append(f"{name}_{count + 1}" if count else name)
    return tuple(names)


def uncalibrated(subjects: Iterable[Subject]) -> tuple[Remark, ...]:
    """Remark on subjects whose measures nobody knows."""
    return tuple(
        remark(
            "subject",
            "nobody calibrated this hand: the template hand stands in for it; "
            "'handclean calibrate-hand markers' makes a subject",
        )
        for subject in subjects
        if not subject.calibrated
    )
