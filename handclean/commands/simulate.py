"""Takes with known truth.

A trial is four files: what cameras recorded, the same with its labels, the truth, and,
with the first trial of each subject, the subject. A scan is four, too: the points, the
landmarks somebody set on them, the pose the hand was held in, and the subject. A
session with a glove is many recordings, each with its truth.
"""

from pathlib import Path

import numpy as np

from handclean.commands.shared import sessions
from handclean.commands.shared.choices import Simulating
from handclean.errors import HandcleanError, UsageError
from handclean.glove.poses import key_poses
from handclean.hand.subject import Subject
from handclean.io.glove.write_readings import write_readings
from handclean.io.hdf5.subject import write_subject
from handclean.io.landmarks import write_landmarks
from handclean.io.mesh.meshes import Mesh, write_mesh
from handclean.recording import Motion, Recording, motion_from_poses
from handclean.runner import staging
from handclean.runner.batch import Source, Task
from handclean.runner.outcome import Entry, Outcome, Writer
from handclean.simulation.glove import (
    GLOVE_RATE_HZ,
    GloveSession,
    GloveTake,
    simulate_glove,
    takes_of,
)
from handclean.simulation.glove_sensors import sensors_of
from handclean.simulation.scan import Scan
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate_one, simulate_scan

FIGURES = {
    "trial": "name of the trial, with what is done in it",
    "frames": "frames of the take",
    "markers": "markers of the hand",
    "points": "points that were recorded",
    "ghosts": "points that are no marker",
    "missing": "share of the markers' samples that were not recorded",
    "landmarks": "landmarks set on a scan",
    "takes": "recordings of a session with a glove",
    "sensors": "sensors of the glove",
}


def tasks(settings: Simulating, folder: Path) -> list[Task]:
    """List the trials of a scenario with their files.

    Raises
    ------
    UsageError
        If there is no such glove.
    """
    kind, config = settings.kind, settings.simulate
    try:
        if kind == "glove":
            sensors_of(config.glove)  # is there one?
    except HandcleanError as error:
        raise UsageError.of(error) from None
    planned = []
    for number in range(config.trials):
        subject = f"S{number % config.subjects + 1:02d}"
        name = f"{subject}_{number + 1:03d}"
        raw = (f"{name}.c3d", f"labelled/{name}.c3d")
        if kind == "scan":
            raw = (f"{name}.ply", f"landmarks/{name}.toml")
        outputs = [folder / part for part in (*raw, f"truth/{name}.h5")]
        if kind == "glove":
            outputs = _glove_files(folder, name, config)
        if number < config.subjects:
            outputs.append(folder / "subjects" / f"{subject}.h5")
        source = Source(
            path=Path(settings.scenario),
            is_file=settings.scenario.endswith(".toml"),
            number=number + 1,
        )
        planned.append(
            Task(sources=(source,), outputs=tuple(outputs), token=staging.token())
        )
    return planned


def simulate(source: Source, settings: Simulating) -> Outcome:
    """Make one trial."""
    assert source.number is not None
    number = source.number - 1
    kind, config = settings.kind, settings.simulate
    first = number < config.subjects
    if kind == "glove":
        return _glove(simulate_glove(config, number, key_poses()), number, first)
    if kind == "scan":
        return _scan(simulate_scan(kind, config, number), number, first)
    trial = simulate_one(kind, config, number)
    writers = [
        sessions.writer(take, silent=True)  # the truth has what a C3D has no place for
        for take in (trial.unlabelled, trial.labelled, trial.truth)
    ]
    if first:
        writers.append(_writes(trial.subject))
    markers, points = trial.labelled.markers, trial.unlabelled.unlabelled
    assert markers is not None
    assert points is not None
    measured = int(np.count_nonzero(markers.measured))
    missing = 1.0 - float(markers.measured.mean())
    figures = {
        "trial": trial.name,
        "frames": trial.truth.frames,
        "markers": len(markers.labels),
        "points": len(points.frame),
        "ghosts": len(points.frame) - measured,
        "missing": missing,
    }
    line = (
        f"{trial.name}, {figures['frames']} frames, "
        f"{100 * missing:.1f} % of samples missing, "
        f"{figures['ghosts']} ghost points"
    )
    return Outcome(line=line, figures=figures, writers=tuple(writers))


def _scan(scan: Scan, number: int, first: bool) -> Outcome:
    tree = scan.subject.model.tree
    motion = motion_from_poses(tree.hinges, scan.pose[None])
    truth = Recording(
        rate=1.0,
        frames=1,
        up_axis="+z",
        motions={tree.side: motion},
        skeletons={tree.side: tree},
    )
    cloud = Mesh(
        vertices=scan.points,
        faces=np.zeros((0, 3), dtype=np.int64),
        normals=scan.normals,
        colors=scan.colors,
    )
    writers: list[Writer] = [
        lambda path, _: write_mesh(path, cloud),
        lambda path, _: write_landmarks(path, scan.landmarks),
        sessions.writer(truth),
    ]
    if first:
        writers.append(_writes(scan.subject))
    figures = {
        "trial": f"{scan.subject.name}_{number + 1:03d}_scan",
        "points": len(scan.points),
        "landmarks": len(scan.landmarks),
    }
    line = (
        f"{figures['trial']}, {tree.side} hand, {len(scan.points)} points, "
        f"{len(scan.landmarks)} landmarks"
    )
    return Outcome(line=line, figures=figures, writers=tuple(writers))


def _glove_files(folder: Path, name: str, config: SimulateConfig) -> list[Path]:
    takes = takes_of(config.glove, config.donnings)
    readings = [folder / name / f"{take}.csv" for take in takes]
    return readings + [folder / "truth" / name / f"{take}.h5" for take in takes]


def _glove(session: GloveSession, number: int, first: bool) -> Outcome:
    tree, glove = session.wearer.tree, session.glove
    writers: list[Writer] = [_readings(session, take) for take in session.takes]
    for take in session.takes:
        frames = len(take.times)
        truth = Recording(
            rate=GLOVE_RATE_HZ,
            frames=frames,
            up_axis="+z",
            motions={tree.side: Motion(names=tree.hinges, angles=take.angles)},
            skeletons={tree.side: tree},
        )
        writers.append(sessions.writer(truth))
    if first:
        subject = Subject(
            name=session.wearer.name,
            model=session.wearer.tips,
            marker_set="fingertips",
            marker_sigma=np.zeros(len(session.wearer.tips.labels)),
        )
        writers.append(_writes(subject))
    figures = {
        "trial": f"{session.wearer.name}_{number + 1:03d}_glove",
        "frames": sum(len(take.times) for take in session.takes),
        "takes": len(session.takes),
        "sensors": len(session.sensors),
    }
    line = (
        f"{figures['trial']}, {glove}, {figures['takes']} recordings, "
        f"{figures['frames']} frames"
    )
    return Outcome(line=line, figures=figures, writers=tuple(writers))


def _readings(session: GloveSession, take: GloveTake) -> Writer:
    facts: dict[str, object] = {"glove": session.glove, "subject": session.wearer.name}
    if take.moved:
        facts["moved"] = "+".join(take.moved)

    def write(path: Path, _: tuple[Entry, ...]) -> None:
        times = take.times + take.late
        write_readings(path, times, take.readings, session.sensors, facts)

    return write


def _writes(subject: Subject) -> Writer:
    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_subject(path, subject, provenance)

    return write
