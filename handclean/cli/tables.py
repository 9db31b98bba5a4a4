"""The tables a configuration file may have, and the settings each stands for.

``python -m handclean.cli.tables FILE`` writes them all with their defaults.
"""

import sys
from importlib import import_module
from pathlib import Path

from handclean import config

TABLES: dict[str, str] = {
    "label": "handclean.labels.settings:LabelConfig",
    "fill-gaps": "handclean.gaps.settings:FillConfig",
    "solve": "handclean.ik.settings:SolveConfig",
    "calibrate-hand-markers": "handclean.subject.settings:CalibrateConfig",
    "calibrate-hand-scan": "handclean.subject.scan.settings:ScanConfig",
    "calibrate-glove-examine": "handclean.glove.settings:GloveExamineConfig",
    "calibrate-glove-sample": "handclean.glove.settings:GloveSampleConfig",
    "calibrate-glove-fit": "handclean.glove.settings:GloveFitConfig",
    "calibrate-glove-apply": "handclean.glove.settings:GloveApplyConfig",
    "learn-subspace": "handclean.commands.shared.choices:LearnConfig",
    "optimize-layout": "handclean.layouts.settings:LayoutConfig",
    "evaluate-layout": "handclean.layouts.evaluate_settings:EvaluateConfig",
    "compare": "handclean.report.settings:CompareConfig",
    "simulate": "handclean.simulation.settings:SimulateConfig",
}
"""Table of the file and its settings class, as "module:class"; imported on demand."""


def classes() -> dict[str, type]:
    """Import the settings class of every table."""
    found = {}
    for table, place in TABLES.items():
        module, name = place.split(":")
        found[table] = getattr(import_module(module), name)
    return found


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(config.to_toml(classes()), encoding="utf-8")
