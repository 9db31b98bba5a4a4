"""Whose hands a take shows: subjects and posture prior as a source names them."""

from collections.abc import Mapping

from handclean.errors import UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import Subject, template_subject
from handclean.ik.prior import PosturePrior
from handclean.io.prior import read_prior
from handclean.io.subject import read_subject
from handclean.pipeline.batch import Source


def subjects(source: Source) -> Mapping[str, Subject]:
    """Subjects by the name of their skeleton and motion: "right", "right_2".

    Without a subject file the template hand wears the marker set.

    Raises
    ------
    UsageError
        If neither is given, or none of the subjects is of the side asked for.
    HandcleanError
        If a file is not what it should be.
    """
    if not source.subjects:
        found = [_template(source)]
    else:
        found = [read_subject(path) for path in source.subjects]
        if source.side not in ("", "both"):
            found = [s for s in found if s.model.tree.side == source.side]
        if not found:
            raise UsageError(f"--side {source.side}: no subject is of that side")
    named: dict[str, Subject] = {}
    for subject in found:
        name = subject.model.tree.side or subject.model.tree.kind
        count = sum(taken.split("_")[0] == name for taken in named)
        named[f"{name}_{count + 1}" if count else name] = subject
    return named


def only_subject(source: Source) -> tuple[str, Subject]:
    """Return the only subject, and its name as in `subjects`.

    Raises
    ------
    UsageError
        If there are several; and as `subjects`.
    """
    found = list(subjects(source).items())
    if len(found) > 1:
        raise UsageError(
            f"--subject: {len(found)} hands cannot be labelled at once yet; "
            "give one, or choose by --side"
        )
    return found[0]


def remarks(*found: Subject) -> tuple[str, ...]:
    """Say of whom nobody knows the measures."""
    return tuple(
        "nobody calibrated this hand: the template hand stands in for it; "
        "'handclean calibrate-hand markers' makes a subject"
        for subject in found
        if not subject.calibrated
    )


def prior(source: Source) -> PosturePrior:
    """Posture prior of a source; the one that ships when it names none.

    Raises
    ------
    FileError
        If the file is not one.
    """
    given = source.files.get("prior")
    return read_prior() if given is None else read_prior(given)


def _template(source: Source) -> Subject:
    if not source.marker_set:
        raise UsageError(
            "--subject: is missing; 'handclean calibrate-hand markers' makes one, "
            "or --marker-set puts markers on the template hand"
        )
    marker_set = load_marker_set(source.marker_set)
    if source.side == "both":
        raise UsageError("--side both: needs a --subject for each hand")
    return template_subject(marker_set, source.side)
