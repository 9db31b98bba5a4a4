"""How far one take is from another, or one subject."""

from collections.abc import Mapping

from handclean.commands.shared import sessions, shapes
from handclean.commands.shared.take_options import options_of, with_options
from handclean.errors import UsageError
from handclean.io.hdf5.subject import read_subject
from handclean.recording import Recording
from handclean.report import metrics
from handclean.report.comparison import in_text
from handclean.report.settings import CompareConfig
from handclean.report.subjects import compare_subjects
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "frames": "frames that were compared",
    "precision": "share of labelled samples that are labelled right",
    "recall": "share of the reference's samples that are labelled right",
    "f1": "harmonic mean of both",
    "correct": "samples labelled right",
    "labelled": "samples the test labels",
    "expected": "samples the reference labels",
    "swapped": "labelled samples that are another marker's",
    "ghosts": "labelled samples that are nobody's",
    "swaps": "stretches of swapped samples",
    "measured_*": "distances of markers the test measured",
    "filled_*": "distances of markers the test filled",
    "*angles_*_deg": "absolute differences of all joint angles; of several motions, "
    "each has its name and a dot before, and angles_mean_deg is that of all",
    "*_deg": "mean absolute difference of a joint angle",
    "*root_*": "differences of the root",
    "length_*_mm": "of two subjects: absolute differences of bone lengths",
    "joint_*_mm": "distances of joints, hands laid onto each other in one posture",
    "marker_*_mm": "distances of markers, likewise",
    "length.*_mm": "length of the bone before a joint, the test's less the reference's",
    "joint.*_mm": "distance of a joint",
    "marker.*_mm": "distance of a marker",
    "missing": "markers and angles only the reference has",
    "extra": "markers and angles only the test has",
}


def compare(sources: tuple[Source, ...], settings: CompareConfig) -> Outcome:
    """Compare a test, the second source, with a reference, the first."""
    if any(are := [shapes.is_subject(source) for source in sources]):
        if not all(are):
            subject, take = sources if are[0] else sources[::-1]
            raise UsageError(
                f"is a subject, but {take.name} is none; "
                "two takes or two subjects can be compared",
                where=subject.path,
            )
        return _subjects(sources)
    reference, test = _read(sources)
    found = metrics.compare(reference, test, settings)
    figures = found.figures()
    return Outcome(
        line=in_words(figures),
        details=in_text(found),
        figures=figures,
        remarks=(*found.remarks, *reference.remarks, *test.remarks),
    )


def _subjects(sources: tuple[Source, ...]) -> Outcome:
    found = compare_subjects(*(read_subject(source.path) for source in sources))
    figures = found.figures()
    words = [
        f"{what} differ by {figures[f'{name}_mean_mm']:.2f} mm on average, "
        f"{figures[f'{name}_max_mm']:.2f} mm at most"
        for name, what in (
            ("length", "bone lengths"),
            ("joint", "joint places"),
            ("marker", "marker places"),
        )
        if f"{name}_mean_mm" in figures
    ]
    return Outcome(line="; ".join(words), details=found.in_text(), figures=figures)


def _read(sources: tuple[Source, ...]) -> list[Recording]:
    """Read takes; the rate and the unit given are those of the files that say none.

    Raises
    ------
    UsageError
        If a file needs what is not given, or a rate that none needs contradicts them
        all. A unit that none needs and all contradict is taken.
    """
    takes, needed = [], []
    for source in sources:
        for names in ((), ("unit",), ("rate_hz",), ("rate_hz", "unit")):
            one = _with_only(source, names)
            try:
                takes.append(sessions.read(one))
            except UsageError:
                if one == source:
                    raise
                continue
            needed.append(one)
            break
    if all(options_of(one).rate_hz is None for one in needed):
        _expect_agreement(sources, needed)
    unit = options_of(sources[0]).unit
    if unit is not None and all(options_of(one).unit is None for one in needed):
        again = [
            sessions.read(with_options(one, unit=options_of(source).unit))
            for source, one in zip(sources, needed, strict=True)
        ]
        if all(map(sessions.is_overruled, again)):
            return again
    used = zip(sources, takes, strict=True)  # not those that were read to try
    return [sessions.remember(source, take) for source, take in used]


def _with_only(source: Source, names: tuple[str, ...]) -> Source:
    """Return a source with only these of its options of reading."""
    options = options_of(source)
    return with_options(
        source,
        rate_hz=options.rate_hz if "rate_hz" in names else None,
        unit=options.unit if "unit" in names else None,
    )


def _expect_agreement(sources: tuple[Source, ...], needed: list[Source]) -> None:
    """Expect a rate that no file needed to be what one of them says.

    Raises
    ------
    UsageError
        If it contradicts them all.
    """
    if options_of(sources[0]).rate_hz is None:
        return
    wrong: UsageError | None = None
    for source, one in zip(sources, needed, strict=True):
        try:
            sessions.read(with_options(one, rate_hz=options_of(source).rate_hz))
        except UsageError as error:
            wrong = wrong or error
        else:
            return
    if wrong is not None:
        raise wrong


def in_words(figures: Mapping[str, float]) -> str:
    """Say the figures in a few words."""
    words = [f"{figures['frames']:.0f} frames"]
    for name, text in (
        ("f1", "label F1 {:.4f}"),
        ("swaps", "{:.0f} swaps"),
        ("measured_mean_mm", "measured markers {:.3f} mm"),
        ("filled_mean_mm", "filled {:.3f} mm"),
        ("angles_mean_deg", "angles {:.3f} deg"),
        ("angles_p95_deg", "95 % of them below {:.3f}"),
    ):
        if name in figures:
            words.append(text.format(figures[name]))
    return ", ".join(words)
