"""Any format in, any format out."""

from handclean.commands.shared import sessions, shapes, skins
from handclean.commands.shared.choices import Converting
from handclean.commands.shared.take_options import options_of
from handclean.io.keeps import kept
from handclean.io.take_remarks import wrong_size
from handclean.recording import Recording
from handclean.remarks import Remark
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "frames": "frames of the take",
    "rate_hz": "frames per second",
    "markers": "named markers",
    "points": "points that have no name",
    "motions": "hands or objects whose motion is known",
    "side": "of a subject's hand",
    "length_mm": "of a subject's hand",
    "vertices": "of a mesh, or of a subject's own skin",
    "faces": "triangles of it",
}


def convert(source: Source, settings: Converting | None) -> Outcome:
    """Read a take and hand it back as it is; say what of it the new format keeps.

    So with a mesh and a subject; a skinned hand becomes a subject.
    """
    if shapes.is_skinned(source):
        return shapes.skinned(source, settings.joint_map if settings else "")
    if shapes.is_mesh(source):
        return shapes.mesh(source)
    if shapes.is_subject(source):
        return shapes.subject_file(source)
    recording = sessions.read(source)
    settings = settings or Converting()
    unnamed = settings.unnamed
    figures = contents(kept(recording, source.target, unnamed=unnamed))
    surfaces = None
    odd: tuple[Remark, ...] = ()
    if source.target == ".glb" and options_of(source).subjects:
        surfaces, odd = skins.skins_of(source, recording)
    return sessions.outcome(
        recording,
        in_words(figures),
        figures,
        (*wrong_size(recording), *odd),
        surfaces,
        unnamed=unnamed,
        bvh_up=settings.bvh_up,
    )


def contents(recording: Recording) -> dict[str, float]:
    """Count what is in a take."""
    markers, points = recording.markers, recording.unlabelled
    return {
        "frames": recording.frames,
        "rate_hz": recording.rate,
        "markers": len(set(markers.labels)) if markers is not None else 0,
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
