"""Names of markers in a take against those of a hand: what is missing, what is near.

A marker is told as misspelt only where the take has a name of no other marker that is
nearly the same: case, spaces and punctuation apart, letters are left out or exchanged,
or one of a word is wrong; digits are the same, and the hand is not the other one.

What a program puts before a name (``Bob:R_INDEX_TIP``) and the case of letters do not
count where each name has one counterpart without them: then markers are taken for those
of the hand, and that is said.
"""

import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from difflib import SequenceMatcher

from handclean.errors import TAKE, HandcleanError, Where
from handclean.hand.marker_set import load_marker_set, shipped
from handclean.hand.subject import Subject
from handclean.recording import Recording
from handclean.remarks import Remark, first_of, remark

MISSPELT_SIMILARITY = 0.8
"""[-] similarity (of `difflib`) of two names from which on one may be the other,
misspelt (chosen)."""

MIN_SET_SHARE = 0.5
"""Share of a set's markers that a take must have for the set to be proposed
(chosen)."""


def matched(
    recording: Recording, labels: Iterable[str]
) -> tuple[Recording, tuple[Remark, ...]]:
    """Call a take's markers as a hand's are, where prefix and case are the difference.

    Parameters
    ----------
    labels : the hand's markers.

    Returns
    -------
    the take, and a remark on what was matched, if anything was
    """
    has, known = labels_of(recording), set(labels)
    wanted, free = _by_bare(known - set(has)), _by_bare(set(has) - known)
    called = {
        there[0]: wanted[bare][0]
        for bare, there in free.items()
        if len(there) == len(wanted.get(bare, ())) == 1
    }
    if not called or recording.markers is None:
        return recording, ()
    first = next(label for label in has if label in called)
    markers = replace(
        recording.markers, labels=tuple(called.get(label, label) for label in has)
    )
    count = f"{len(called)} markers are" if len(called) > 1 else "a marker is"
    told = f"{count} known without prefix and case: '{first}' is '{called[first]}'"
    more = ", ..." if len(called) > 1 else ""
    said = remark("names", told + more, matched=called)
    return replace(recording, markers=markers), (said,)


def _by_bare(labels: Iterable[str]) -> dict[str, list[str]]:
    """Group labels by what is left without prefix and case."""
    groups: dict[str, list[str]] = defaultdict(list)
    for label in labels:
        groups[label.rpartition(":")[2].strip().casefold()].append(label)
    return groups


def near(name: str, others: Iterable[str]) -> str:
    """Find the name that is this one, misspelt; "" when none is."""
    scores = [(_likeness(name, other), other) for other in others]
    score, best = max(scores, default=(0.0, ""))
    return best if score >= MISSPELT_SIMILARITY else ""


def _likeness(one: str, other: str) -> float:
    """Share of two names that is the same; 0 where they are those of two markers."""
    a, b = _plain(one), _plain(other)
    if a == b:
        return 1.0
    if re.findall(r"\d", one) != re.findall(r"\d", other):
        return 0.0
    if _sideless(a) == _sideless(b) or not _slipped(one, other):
        return 0.0
    return SequenceMatcher(None, a, b).ratio()


def _slipped(one: str, other: str) -> bool:
    """Whether letters were left out, exchanged, or one within a word mistaken."""
    a, b = sorted((_plain(one), _plain(other)), key=len)
    rest = iter(b)
    if all(letter in rest for letter in a) or sorted(a) == sorted(b):
        return True
    words = zip(re.split(r"[\W_]+", one), re.split(r"[\W_]+", other), strict=False)
    short = any(len(x) < 3 and x.casefold() != y.casefold() for x, y in words)
    differing = sum(x != y for x, y in zip(a, b, strict=False))
    return len(a) == len(b) and differing == 1 and not short


def _plain(name: str) -> str:
    return re.sub(r"[\W_]", "", name.rpartition(":")[2].casefold())


def _sideless(name: str) -> str:
    """Write a name so that the other hand's marker has the same."""
    return re.sub("left|right|[lr]", "*", name)


def misspelt(
    recording: Recording, subjects: Mapping[str, Subject]
) -> tuple[Remark, ...]:
    """Remark on markers of the subjects that the take seems to have misspelt."""
    has = labels_of(recording)
    known = known_to(subjects)
    free = [label for label in has if label not in known]
    remarks: list[Remark] = []
    for label in sorted(known - set(has)):
        if found := near(label, free):
            remarks.append(
                remark(
                    "names",
                    f"marker '{label}' of the subject is not in the take; "
                    f"the take has '{found}'",
                    marker=label,
                    found=found,
                )
            )
    return tuple(remarks)


def known_to(subjects: Mapping[str, Subject]) -> set[str]:
    """Labels of all markers of some subjects."""
    return {label for s in subjects.values() for label in s.model.labels}


def labels_of(recording: Recording) -> tuple[str, ...]:
    """Labels of a take."""
    return recording.markers.labels if recording.markers is not None else ()


def expect_any(recording: Recording, subjects: Mapping[str, Subject]) -> None:
    """Expect at least one marker of the subjects in a take.

    Raises
    ------
    HandcleanError
        If there is none; says which shipped set the take fits instead.
    """
    has = labels_of(recording)
    known = known_to(subjects)
    if has and not known.intersection(has):
        sets = " or ".join(sorted({s.marker_set for s in subjects.values()}))
        few = ", ".join(sorted(known)[:4])
        raise HandcleanError(
            f"none of the subject's markers ({few}, ...) are in it; "
            f"{_several(has, known) or _fitting(has, sets)}",
            where=TAKE,
        )


def expect_set(where: Where, has: Sequence[str], name: str) -> None:
    """Expect every marker of a set in a take that is to teach it.

    Raises
    ------
    HandcleanError
        If one is not there; says what the take has instead, or which set it fits.
    """
    marker_set = load_marker_set(name)
    missing = [label for label in marker_set.labels if label not in has]
    if not missing or not has:
        return
    free = [label for label in has if label not in marker_set.labels]
    whole = len(marker_set.labels)
    if (found := near(missing[0], free)) and len(missing) <= whole // 2:
        raise HandcleanError(
            f"marker '{missing[0]}' of marker set {marker_set.name} is not "
            f"in it; it has '{found}'",
            where=where,
        )
    few = first_of(missing)
    raise HandcleanError(
        f"{len(missing)} of the {whole} markers of marker set "
        f"{marker_set.name} are not in it ({few}); "
        f"{_several(has, missing) or _fitting(has, marker_set.name)}",
        where=where,
    )


def larger_set(has: Collection[str], name: str) -> tuple[Remark, ...]:
    """Remark that a shipped set names more of a take's markers than the one given."""
    given = set(load_marker_set(name).labels)
    best, labels = name, given
    for other in shipped():
        all_of_it = set(load_marker_set(other).labels)
        if labels < all_of_it and all_of_it.issubset(has):
            best, labels = other, all_of_it
    if best == name:
        return ()
    text = (
        f"the take has all {len(labels)} markers of {best}, {len(labels - given)} more "
        f"than are used: --marker-set {best} would use them"
    )
    return (remark("names", text, marker_set=best),)


def _several(has: Sequence[str], missing: Iterable[str]) -> str:
    """Say that a take has markers of several people under the names sought, if so."""
    there = _by_bare(has)
    found = next(
        (
            there[bare]
            for bare in _by_bare(sorted(missing))
            if len(there.get(bare, ())) > 1
        ),
        [],
    )
    if not found:
        return ""
    return f"it has {' and '.join(sorted(found))}, of which one should be left"


def _fitting(has: Collection[str], but: str) -> str:
    """Say which shipped set a take fits best, or what it has."""
    fits = []
    for name in shipped():
        labels = load_marker_set(name).labels
        count = sum(label in has for label in labels)
        if name != but and count >= MIN_SET_SHARE * len(labels):
            fits.append((count, -len(labels), name))
    if fits:
        count, whole, best = max(fits)
        return f"it has {count} of the {-whole} of {best}: --marker-set {best}"
    few = first_of(list(has))
    return f"it has {few}; --marker-set should name these"
