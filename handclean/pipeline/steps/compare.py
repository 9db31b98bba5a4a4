"""How far one take is from another."""

from collections.abc import Mapping

from handclean.pipeline import sessions
from handclean.pipeline.batch import Source
from handclean.pipeline.outcome import Outcome
from handclean.report import metrics
from handclean.report.comparison import in_text
from handclean.report.settings import CompareConfig

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
    "missing": "markers and angles only the reference has",
    "extra": "markers and angles only the test has",
}


def compare(sources: tuple[Source, ...], settings: CompareConfig) -> Outcome:
    """Compare a test, the second source, with a reference, the first."""
    reference, test = (sessions.read(source) for source in sources)
    found = metrics.compare(reference, test, settings)
    figures = found.figures()
    return Outcome(
        line=in_words(figures),
        details=in_text(found),
        figures=figures,
        warnings=found.warnings,
    )


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
