"""How far one take is from another, or one subject."""

from typing import Any, overload

from handclean.api.settings import sorted_settings
from handclean.errors import UsageError
from handclean.hand.subject import Subject
from handclean.recording import Recording
from handclean.report import metrics
from handclean.report.comparison import Comparison
from handclean.report.settings import CompareConfig
from handclean.report.subjects import SubjectComparison, compare_subjects


@overload
def compare(reference: Recording, test: Recording, **settings: Any) -> Comparison: ...


@overload
def compare(
    reference: Subject, test: Subject, **settings: Any
) -> SubjectComparison: ...


def compare(
    reference: Recording | Subject, test: Recording | Subject, **settings: Any
) -> Comparison | SubjectComparison:
    """Compare a take with a reference, or a subject, as ``handclean compare``.

    Parameters
    ----------
    reference, test : Recording or Subject
        Two takes, compared where their frame numbers overlap; or two subjects.
    **settings
        Fields of `handclean.report.settings.CompareConfig`, of takes.

    Returns
    -------
    Comparison or SubjectComparison
        Of takes: ``labels``, ``markers`` (how far those ``measured`` and ``filled`` are
        off [m]) and ``motions`` (``angles`` [rad], root). Of subjects: ``lengths``,
        ``joints``, ``markers`` [m]. ``figures()`` has everything as flat names and
        numbers, in millimetres and degrees.

    Raises
    ------
    HandcleanError
        If the rates differ, no frames overlap, or there is nothing both takes have.
    UsageError
        If one is a take and the other a subject, or a setting is wrong.

    References
    ----------
    Joint angles as in figure 6 of Maycock et al. (2015).

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=0.5, rate_hz=50.0)[0]
    >>> hc.compare(trial.labelled, trial.labelled).labels.f1
    1.0
    """
    if isinstance(reference, Subject) and isinstance(test, Subject):
        sorted_settings("compare", {}, settings)
        return compare_subjects(reference, test)
    if isinstance(reference, Subject) or isinstance(test, Subject):
        raise UsageError(
            "one is a subject, the other a take; "
            "two takes or two subjects can be compared",
            where="compare",
        )
    chosen = sorted_settings("compare", {"compare": CompareConfig}, settings)
    return metrics.compare(reference, test, chosen["compare"])
