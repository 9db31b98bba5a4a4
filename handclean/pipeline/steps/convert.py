"""Any format in, any format out."""

from handclean.io.keeps import kept
from handclean.pipeline import sessions
from handclean.pipeline.batch import Source
from handclean.pipeline.outcome import Outcome
from handclean.recording import Recording

FIGURES = {
    "frames": "frames of the take",
    "rate_hz": "frames per second",
    "markers": "named markers",
    "points": "points that have no name",
    "motions": "hands or objects whose motion is known",
}


def convert(source: Source, settings: None) -> Outcome:
    """Read a take and hand it back as it is; say what of it the new format keeps."""
    recording = sessions.read(source)
    figures = contents(kept(recording, source.target))
    return sessions.outcome(
        recording, in_words(figures), figures, sessions.traps(source, recording)
    )


def contents(recording: Recording) -> dict[str, float]:
    """Count what is in a take."""
    markers, points = recording.markers, recording.unlabelled
    return {
        "frames": recording.frames,
        "rate_hz": recording.rate,
        "markers": len(markers.labels) if markers is not None else 0,
        "points": len(points.frame) if points is not None else 0,
        "motions": len(recording.motions),
    }


def in_words(figures: dict[str, float]) -> str:
    """Say the same in a few words, leaving out what there is none of."""
    parts = [f"{figures['frames']} frames at {figures['rate_hz']:g} Hz"]
    for name in ("markers", "points", "motions"):
        count = figures[name]
        if count:
            parts.append(f"{count} {name if count != 1 else name[:-1]}")
    return ", ".join(parts)
