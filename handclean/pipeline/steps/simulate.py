"""Takes with known truth.

A trial is four files: what cameras recorded, the same with its labels, the truth, and,
with the first trial of each subject, the subject.
"""

from pathlib import Path

import numpy as np

from handclean.errors import HandcleanError, UsageError
from handclean.hand.subject import Subject
from handclean.io.subject import write_subject
from handclean.pipeline import plan, sessions
from handclean.pipeline.batch import Source, Task
from handclean.pipeline.choices import Simulating
from handclean.pipeline.outcome import Entry, Outcome, Writer
from handclean.simulation.simulate import load_scenario, simulate_one

FIGURES = {
    "trial": "name of the trial, with what is done in it",
    "frames": "frames of the take",
    "markers": "markers of the hand",
    "points": "points that were recorded",
    "ghosts": "points that are no marker",
    "missing": "share of the markers' samples that were not recorded",
}


def tasks(settings: Simulating, folder: Path) -> list[Task]:
    """List the trials of a scenario with their files.

    Raises
    ------
    UsageError
        If there is no such scenario.
    """
    try:
        _, config = load_scenario(settings.scenario, settings.simulate)
    except HandcleanError as error:
        raise UsageError(str(error)) from None
    planned = []
    for number in range(config.trials):
        subject = f"S{number % config.subjects + 1:02d}"
        name = f"{subject}_{number + 1:03d}"
        outputs = [
            folder / f"{name}.c3d",
            folder / "labelled" / f"{name}.c3d",
            folder / "truth" / f"{name}.h5",
        ]
        if number < config.subjects:
            outputs.append(folder / "subjects" / f"{subject}.h5")
        source = Source(
            path=Path(settings.scenario),
            is_file=settings.scenario.endswith(".toml"),
            number=number + 1,
        )
        planned.append(
            Task(sources=(source,), outputs=tuple(outputs), token=plan.token())
        )
    return planned


def simulate(source: Source, settings: Simulating) -> Outcome:
    """Make one trial."""
    assert source.number is not None
    number = source.number - 1
    _, config = load_scenario(settings.scenario, settings.simulate)
    trial = simulate_one(settings.scenario, settings.simulate, number)
    writers = [
        sessions.writer(take, silent=True)  # the truth has what a C3D has no place for
        for take in (trial.unlabelled, trial.labelled, trial.truth)
    ]
    if number < config.subjects:
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


def _writes(subject: Subject) -> Writer:
    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        write_subject(path, subject, provenance)

    return write
