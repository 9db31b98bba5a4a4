"""The takes of ``sample_sessions/``: two people, each with an exercise and two grasps.

Rates and lengths keep all of it, truth included, under five megabytes.
"""

from handclean.simulation.settings import SimulateConfig

_SEED = 2015
"""Of all sample sessions (chosen)."""

SESSIONS: tuple[tuple[str, SimulateConfig], ...] = (
    (
        "rom",
        SimulateConfig(
            seed=_SEED,
            trials=2,
            subjects=2,
            rate_hz=60.0,
            duration_s=21.0,
            ghosts_per_s=0.0,
            impostors_per_s=0.0,
        ),
    ),
    (
        "grasp",
        SimulateConfig(
            seed=_SEED,
            trials=4,
            subjects=2,
            rate_hz=100.0,
            ghosts_per_s=0.8,
            impostors_per_s=0.3,
        ),
    ),
)
"""Scenario and settings of each; the same seed, so the same two people."""

ABOUT = """# Sample sessions

Made by `make samples` (handclean.factory.samples), the same bytes every time. Nobody
was recorded: hands, motion, cameras and faults are simulated, so that the truth is known.

| file | what |
|---|---|
| `S01_001_rom.c3d` | every joint through its range; 26 named markers, 60 Hz, with gaps: for `handclean calibrate-hand` |
| `S01_001_CLASS.c3d` | one grasp as the cameras gave it: unnamed points, gaps, ghosts; 100 Hz: for `handclean clean` |
| `S01_001_CLASS.labelled.c3d` | the same points under their true names |
| `S01_001_CLASS.truth.h5` | true places of all markers, true joint angles and hand, the object's motion, events |
| `S01.subject.h5` | the true hand: what a calibration should find |

CLASS is the grasp's class in Cutkosky's taxonomy. The hands are neither the template nor
a scaled one; skin slides over their joints.
"""  # noqa: E501
