"""A subject with a skin of its own, from a scan with landmarks."""

from pathlib import Path

from handclean.commands.shared.choices import Scanning
from handclean.commands.shared.take_options import options_of
from handclean.errors import UsageError
from handclean.io.hdf5.subject import write_subject
from handclean.io.landmarks import read_landmarks
from handclean.io.mesh.meshes import read_mesh
from handclean.runner import progress
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome
from handclean.subject.scan.cloud import Scan
from handclean.subject.scan.fit import fit_scan

FIGURES = {
    "side": "of the hand",
    "size": "length of the hand against the template's",
    "points": "points of the scan",
    "points_used": "points of the hand",
    "left_out_color": "points near the hand that are not of the color of skin",
    "left_out_lonely": "points far from others",
    "left_out_apart": "points that hang together with no landmark",
    "landmarks": "landmarks on the scan",
    "aligned_landmark_mm": "RMS distance of landmarks after alignment and posture",
    "landmarks_mm": "distance of each landmark from the template's then",
    "aligned_fit_mm": "RMS distance of the skin from the scan then",
    "landmark_mm": "RMS distance of landmarks in the end",
    "fit_mean_mm": "mean distance of the hand's points from the skin",
    "fit_p95_mm": "19 of 20 points are nearer",
    "fit_max_mm": "the largest distance",
    "covered": "share of the skin that the scan shows",
    "lengths_mm": "distance of each joint from the one before it",
}


def calibrate_hand_scan(sources: tuple[Source, ...], settings: Scanning) -> Outcome:
    """Fit the template to a scan: skin, joints, and both in the zero posture."""
    if len(sources) != 1:
        raise UsageError(f"inputs: are {len(sources)}; a hand is fitted to one scan")
    (source,) = sources
    given = source.files.get("landmarks")
    if given is None:
        raise UsageError(
            "--landmarks: is missing; a TOML file with name = [x, y, z] for places "
            "such as thumb_tip, index_tip, index_knuckle in the scan"
        )
    progress.tell(f"reading {source.path.name}")
    mesh = read_mesh(source.path, unit=options_of(source).unit)
    marks = read_landmarks(given, mesh.unit)
    try:
        fitted = fit_scan(
            Scan(points=mesh.vertices, normals=mesh.normals, colors=mesh.colors),
            marks,
            settings.scan,
            side=options_of(source).side or "right",
            name=settings.name,
            progress=progress.tell,
        )
    finally:
        progress.done()
    report = fitted.report

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_subject(path, fitted.subject, provenance)

    line = (
        f"{report.side} hand, {100 * report.size:.0f} % of the template's length; "
        f"skin {1e3 * report.fit_mean_m:.2f} mm from {report.points_used} points in "
        f"the mean, {100 * report.covered:.0f} % of it covered"
    )
    figures = {
        name: 1e3 * getattr(report, f"{name[:-2]}m")
        if name.endswith("_mm") and name not in ("lengths_mm", "landmarks_mm")
        else getattr(report, name, None)
        for name in FIGURES
    }
    figures["landmarks_mm"] = {k: 1e3 * v for k, v in report.landmarks_away_m.items()}
    figures["lengths_mm"] = {k: 1e3 * v for k, v in report.lengths_m.items()}
    return Outcome(
        line=line,
        figures=figures,
        remarks=(*mesh.remarks, *report.remarks),
        writers=(write,),
    )
