"""Whose hands a take shows: subjects and posture prior as a source names them."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from handclean.api.hands import Hands, names_of
from handclean.commands.shared import needs
from handclean.commands.shared.take_options import TakeOptions, options_of
from handclean.errors import HandcleanError, UsageError, Where
from handclean.hand.marker_set import MarkerSet, load_marker_set
from handclean.hand.skeleton import rigid_subject
from handclean.hand.subject import Subject, template_subject
from handclean.ik.prior import PosturePrior
from handclean.io.hdf5 import seal
from handclean.io.hdf5.prior import read_prior
from handclean.io.hdf5.subject import read_subject
from handclean.labels.settings import LEAST_MARKERS
from handclean.runner.batch import Batch, Source
from handclean.runner.records import digest


def check(batch: Batch, *, marked: bool = False, least: int = 1) -> None:
    """Look at what the command line says of hands before anything is done with it.

    Parameters
    ----------
    marked : whether subjects should have markers.
    least : markers that a subject or the marker set should have, if any.

    Raises
    ------
    UsageError
        If a subject, the marker set or the prior is not there or not one, if two
        subjects are of the same side, or if one has too few markers.
    """
    options = options_of(batch)
    with seal.tolerated(options.lenient):
        _check(options, batch.files.get("prior"), marked=marked, least=least)


def _check(
    options: TakeOptions, prior: Path | None, *, marked: bool, least: int
) -> None:
    found = []
    for path in options.subjects:
        with _usage("--subject"):
            digest(path)
            found.append((path, read_subject(path)))
    _of_side(found, options.side)
    if marked:
        _expect_markers(found, least)
    if options.marker_set:
        with _usage("--marker-set"):
            markers = load_marker_set(options.marker_set)
        labels = markers.labels
        if marked:
            _expect_enough(f"--marker-set {options.marker_set}", len(labels), least)
            _expect_marker_set(options.marker_set, found)
        if marked and not found and options.side != "both":
            _on_nobody(markers, options.side)
    if prior is not None:
        with _usage("--prior"):
            digest(prior)
            read_prior(prior)


@contextmanager
def _usage(option: str) -> Iterator[None]:
    """Let what is wrong with a file or a name be wrong with the option it stands in."""
    try:
        yield
    except HandcleanError as error:
        raise UsageError.of(error, option) from None


def subjects(
    source: Source, *, marked: bool = False, least: int = 1
) -> Mapping[str, Subject]:
    """Subjects by the name of their skeleton and motion, see `named`."""
    found = named(source, marked=marked, least=least)
    return {name: subject for name, (subject, _) in found.items()}


def named(
    source: Source, *, marked: bool = False, least: int = 1
) -> Mapping[str, tuple[Subject, Path | None]]:
    """Subjects and their files by the name of skeleton and motion: "right", "right_2".

    Without a subject file it is the template hand with the marker set.

    Parameters
    ----------
    marked : whether they should have markers.
    least : how many, if so.

    Raises
    ------
    UsageError
        If neither is given, none of the subjects is of the side asked for, two are
        of the same side, or one has too few markers.
    HandcleanError
        If a file is not what it should be.
    """
    found: list[tuple[Path | None, Subject]] = []
    options = options_of(source)
    if not options.subjects:
        template = _template(options)
        if marked:
            count = len(template.model.labels)
            _expect_enough(f"--marker-set {options.marker_set}", count, least)
        found.append((None, template))
    else:
        read = [(path, read_subject(path)) for path in options.subjects]
        found += _of_side(read, options.side)
        if marked:
            _expect_markers(read, least)
    names = names_of(subject for _, subject in found)
    return {
        name: (subject, file)
        for name, (file, subject) in zip(names, found, strict=True)
    }


def _of_side(
    found: Sequence[tuple[Path, Subject]], side: str
) -> list[tuple[Path, Subject]]:
    """Choose the subjects of a side; there may be one for each hand."""
    found = list(found)
    if side not in ("", "both"):
        chosen = [(path, s) for path, s in found if s.model.tree.side == side]
        if found and not chosen:
            raise UsageError(f"--side {side}: no subject is of that side")
        found = chosen
    sides = {subject.model.tree.side for _, subject in found}
    if side == "both" and found and not sides >= {"left", "right"}:
        given = " and ".join(sorted(sides - {""})) or "no"
        raise UsageError(
            f"--side both: of the subjects there is a {given} hand only; give a "
            "--subject for each hand"
        )
    paths = defaultdict(list)
    for path, subject in found:
        paths[subject.model.tree.side].append(str(path))
    for hand in ("left", "right"):
        if len(paths[hand]) > 1:
            raise UsageError(
                f"--subject: {' and '.join(paths[hand])} are {hand} hands; "
                "give one for each hand of the take"
            )
    return found


def _expect_markers(found: Sequence[tuple[Path, Subject]], least: int) -> None:
    """Expect markers on every subject; those of a scan have none yet."""
    for path, subject in found:
        if not subject.model.labels:
            right = f"calibrate-hand markers --subject {path} finds them"
            raise UsageError(f"has no markers; {right}", where=path)
        _expect_enough(path, len(subject.model.labels), least)


def _expect_enough(where: Where, count: int, least: int) -> None:
    if count < least:
        raise UsageError(
            f"has {count} marker{'s' * (count != 1)}; labelling needs {least} "
            "at least ('solve' takes fewer, of takes that are labelled)",
            where=where,
        )


def _expect_marker_set(name: str, found: Sequence[tuple[Path, Subject]]) -> None:
    """Expect subjects to have a marker set; their own places hold in any case.

    Raises
    ------
    UsageError
        If one has another.
    """
    wanted = load_marker_set(name).name
    for path, subject in found:
        if subject.marker_set != wanted:
            own = subject.marker_set or "markers of its own"
            raise UsageError(
                f"--marker-set {name}: {path} has {own}; a subject knows its "
                "markers: leave --marker-set out, or --subject"
            )


def of_source(source: Source, *, least: int = 1, with_prior: bool = True) -> Hands:
    """Return the hands with markers that a source names, see `named`.

    Parameters
    ----------
    least : how many markers they should have.
    with_prior : whether they are solved with a posture prior.

    Raises
    ------
    UsageError
        As `named`.
    HandcleanError
        If a file is not what it should be.
    """
    found = named(source, marked=True, least=least)
    given = source.files.get("prior") if with_prior else None
    return Hands(
        subjects={name: subject for name, (subject, _) in found.items()},
        identities={name: _identity(source, file) for name, (_, file) in found.items()},
        prior=prior(source) if with_prior else None,
        prior_sha256=None if given is None else digest(given),
        is_template=not options_of(source).subjects,
    )


def of_source_if_any(source: Source) -> Hands:
    """Return the hands of a source that may name none; as `of_source` else."""
    options = options_of(source)
    if options.subjects or options.marker_set:
        return of_source(source)
    return Hands(subjects={}, identities={}, prior=None)


def of_only_source(source: Source) -> Hands:
    """Return the only hand of a source, with markers enough to label.

    Raises
    ------
    UsageError
        If there are several; and as `of_source`.
    """
    found = of_source(source, least=LEAST_MARKERS)
    if len(found.subjects) > 1:
        raise UsageError(
            f"--subject: {len(found.subjects)} hands cannot be labelled at once yet; "
            "give one, or choose by --side"
        )
    return found


def _identity(source: Source, file: Path | None) -> str:
    """Name who has which markers, as records do: by the digest of a file."""
    if file is not None:
        return digest(file)
    options = options_of(source)
    of_set = options.marker_set_file
    return options.marker_set if of_set is None else digest(of_set)


def prior(source: Source) -> PosturePrior:
    """Posture prior of a source; the one that ships when it names none.

    Raises
    ------
    FileError
        If the file is not one.
    """
    given = source.files.get("prior")
    return read_prior() if given is None else read_prior(given)


def _template(options: TakeOptions) -> Subject:
    if not options.marker_set:
        raise needs.no_hand()
    marker_set = load_marker_set(options.marker_set)
    if options.side == "both":
        raise UsageError("--side both: needs a --subject for each hand")
    return _on_nobody(marker_set, options.side)


def _on_nobody(marker_set: MarkerSet, side: str) -> Subject:
    """Put a marker set on the template hand, or make a rigid one a thing of one bone.

    Raises
    ------
    UsageError
        If a thing is asked for on a side it does not have.
    """
    if marker_set.kind == "rigid":
        return rigid_subject(marker_set, side)
    return template_subject(marker_set, side)
