"""``make data``: writes what ships in ``handclean/data`` and is made by code.

Run as ``python -m handclean.factory.shipped FOLDER``. The default prior is learnt from
simulated grasps of many people; how much of other motion it covers is measured by
``tests/bench/bench_simulation.py``.
"""

import sys
from dataclasses import asdict
from pathlib import Path

from handclean import __version__
from handclean.factory.published_sets import write_sets
from handclean.factory.sculpt.sculpt import make_template
from handclean.ik.prior import PosturePrior, learn
from handclean.io.hdf5.prior import write_prior
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

GRASPS = SimulateConfig(
    seed=1989,
    trials=360,
    subjects=90,
    rate_hz=60.0,
    occlusion=False,
    dropouts_per_s=0.0,
    ghosts_per_s=0.0,
    impostors_per_s=0.0,
)
"""What the default prior is learnt from."""

PRIOR_VARIANCE_SHARE = 0.95
"""Share of the variance of these grasps that the default prior holds (chosen)."""


def default_prior(settings: SimulateConfig = GRASPS) -> PosturePrior:
    """Learn the prior that ships."""
    trials = list(simulate("grasp", settings))
    motions = [trial.truth.motions["right"] for trial in trials]
    return learn(
        [motion.angles for motion in motions],
        motions[0].names,
        share=PRIOR_VARIANCE_SHARE,
        source=f"{settings.trials} simulated grasps of {settings.subjects} hands",
    )


def make_data(folder: Path) -> list[Path]:
    """Write marker sets, default prior and the template's skin, and say which files."""
    written = write_sets(folder / "marker_sets")
    path = folder / "default_prior.h5"
    entry = {
        "command": "learn subspace",
        "version": __version__,
        "settings": asdict(GRASPS),
        "inputs": [f"simulate grasp, trials 1 to {GRASPS.trials}"],
        "seed": GRASPS.seed,
    }
    write_prior(path, default_prior(), (entry,))
    return [*written, path, *make_template(folder)]


if __name__ == "__main__":
    make_data(Path(sys.argv[1]))
