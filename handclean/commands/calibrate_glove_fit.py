"""A calibration from samples, rotation by rotation, side by side."""

import multiprocessing
import signal
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np

from handclean.api import glove_files
from handclean.commands.shared.choices import GloveFitting
from handclean.errors import HandcleanError, UnknownSettingError
from handclean.glove import samples as samples_of
from handclean.glove.calibrate import FitTask, assemble, fit_tasks, run_task
from handclean.glove.calibration import RotationFit
from handclean.glove.gloves import Glove
from handclean.glove.models import KINDS
from handclean.remarks import Remark, remark
from handclean.runner import progress
from handclean.runner.batch import Source
from handclean.runner.outcome import Entry, Outcome

FIGURES = {
    "glove": "its name",
    "model": "kind of the models",
    "samples": "samples there were",
    "rotations": "rotations that are calibrated",
    "nlml": "negative log marginal likelihood, summed over rotations",
    "noise_deg": "noise of each rotation's samples [degrees]",
    "floor_deg": "what samples of one recording are off together [degrees]",
    "each": "of each rotation: samples FK and IK, NLML, noise, evaluations",
}


def calibrate_glove_fit(sources: tuple[Source, ...], settings: GloveFitting) -> Outcome:
    """Learn what readings mean."""
    if settings.fit.model not in KINDS:
        raise UnknownSettingError("--model", "model", settings.fit.model, KINDS)
    read = [glove_files.read_samples(source.path) for source in sources]
    samples = samples_of.merged([one for one, _ in read])
    glove = read[0][1]
    tasks, remarks = fit_tasks(glove, samples, settings.fit, sources[0].seed)
    jobs = min(int(getattr(settings, "workers", 1)), len(tasks))
    try:
        fits = _in_processes(tasks, jobs) if jobs > 1 else _here(tasks)
    finally:
        progress.done()
    found = assemble(glove, samples, settings.fit, fits)

    def write(path: Path, provenance: tuple[Entry, ...]) -> None:
        glove_files.write_calibration(path, found, provenance)

    noise = {one.rotation: float(np.degrees(one.fitted.noise)) for one in found.fits}
    nlml = float(np.sum([one.fitted.nlml for one in found.fits]))
    return Outcome(
        line=f"{len(found.fits)} of {len(glove.measured)} rotations of {glove.name} by "
        f"{settings.fit.model} from {len(samples.readings)} samples, NLML {nlml:.4g}",
        figures={
            "glove": glove.name,
            "model": settings.fit.model,
            "samples": len(samples.readings),
            "rotations": len(found.fits),
            "nlml": nlml,
            "noise_deg": noise,
            "floor_deg": {
                one.rotation: float(np.degrees(one.floor)) for one in found.fits
            },
            "each": {one.rotation: _each(one) for one in found.fits},
        },
        remarks=(
            *remarks,
            *(said for one in found.fits for said in _remarks_on(one)),
            *_other_gloves(glove, [other for _, other in read]),
        ),
        writers=(write,),
    )


def _each(fit: RotationFit) -> dict[str, Any]:
    """Figures of one rotation."""
    return {
        "fk": fit.fk,
        "ik": fit.ik,
        "nlml": fit.fitted.nlml,
        "noise_deg": float(np.degrees(fit.fitted.noise)),
        "evaluations": fit.fitted.figures.evaluations,
    }


def _remarks_on(fit: RotationFit) -> list[Remark]:
    """Say what was odd about the samples of one rotation."""
    remarks: list[Remark] = []
    figures = fit.fitted.figures
    if figures.jitter > 0.0:
        twice = (
            f"{figures.duplicates} of {figures.samples} samples have the readings "
            "of another; "
        )
        remarks.append(
            remark(
                "fit",
                f"{fit.rotation}: {twice if figures.duplicates else ''}"
                "a singular covariance was eased",
                rotation=fit.rotation,
            )
        )
    still = [s for s, c in zip(fit.sensors, figures.constant, strict=True) if c]
    if still:
        remarks.append(
            remark(
                "sensor",
                f"{fit.rotation}: {', '.join(still)} never changed",
                rotation=fit.rotation,
                sensors=still,
            )
        )
    return remarks


def _other_gloves(glove: Glove, others: Sequence[Glove]) -> list[Remark]:
    if all(tuple(other.rows) == tuple(glove.rows) for other in others):
        return []
    text = "the samples' gloves differ in what affects their sensors; the first counts"
    return [remark("fit", text)]


def _here(tasks: Sequence[FitTask]) -> list[RotationFit]:
    fits: list[RotationFit] = []
    for task in tasks:
        progress.tell(f"fitting {task.rotation}, {len(fits) + 1} of {len(tasks)}")
        fits.append(run_task(task))
    return fits


def _in_processes(tasks: Sequence[FitTask], jobs: int) -> list[RotationFit]:
    """Fit rotations side by side; largest first."""
    order = sorted(tasks, key=lambda task: -task.inputs.size)
    pool = ProcessPoolExecutor(
        jobs, multiprocessing.get_context("spawn"), initializer=_deaf
    )
    done = False
    try:
        waiting = [pool.submit(run_task, task) for task in order]
        fits: list[RotationFit] = []
        for ended in as_completed(waiting):
            fits.append(ended.result())
            progress.tell(f"fitted {len(fits)} of {len(tasks)} rotations")
        done = True
        return fits
    except BrokenProcessPool:
        raise HandcleanError(
            "samples: a worker process was killed, perhaps for want of memory; "
            "--most fewer samples, or --model spgp, takes less"
        ) from None
    finally:
        pool.shutdown(wait=done, cancel_futures=True)
        if not done:
            for child in multiprocessing.active_children():
                child.kill()


def _deaf() -> None:
    """Let the command alone take signals; it ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
