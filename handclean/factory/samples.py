"""``make samples``: writes ``sample_sessions/``.

Run as ``python -m handclean.factory.samples FOLDER``.
"""

import sys
from dataclasses import asdict, replace
from pathlib import Path

from handclean import __version__
from handclean.factory.sample_takes import ABOUT, SESSIONS
from handclean.io import files
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Recording
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import Trial, simulate


def make_samples(
    folder: Path, sessions: tuple[tuple[str, SimulateConfig], ...] = SESSIONS
) -> list[Path]:
    """Write the sample sessions into a folder, and say which files.

    Parameters
    ----------
    sessions : scenario and settings of each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    readme = folder / "README.md"
    readme.write_text(ABOUT, encoding="utf-8")
    written = [readme]
    for scenario, settings in sessions:
        for number, trial in enumerate(simulate(scenario, settings), start=1):
            entry = {
                "command": "simulate",
                "version": __version__,
                "settings": {"scenario": scenario, "simulate": asdict(settings)},
                "inputs": [{"role": "input", "built_in": scenario, "number": number}],
                "seed": settings.seed,
            }
            for name, recording in _parts(scenario, trial):
                path = folder / name
                files.write(path, replace(recording, provenance=(entry,)))
                written.append(path)
            path = folder / f"{trial.subject.name}.subject.h5"
            if path not in written:
                write_subject(path, trial.subject, (entry,))
                written.append(path)
    return written


def _parts(scenario: str, trial: Trial) -> list[tuple[str, Recording]]:
    """Names and content of a take's files."""
    if scenario == "rom":
        return [(f"{trial.name}.c3d", trial.labelled)]
    return [
        (f"{trial.name}.c3d", trial.unlabelled),
        (f"{trial.name}.labelled.c3d", trial.labelled),
        (f"{trial.name}.truth.h5", trial.truth),
    ]


if __name__ == "__main__":
    make_samples(Path(sys.argv[1]))
