"""``handclean simulate``."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import click

from handclean.cli import completion, options
from handclean.commands.shared.choices import Simulating
from handclean.commands.table import work_of
from handclean.errors import UsageError
from handclean.runner import manifest, many, places
from handclean.runner.batch import Batch
from handclean.simulation.scenarios import Scenario, find_scenario
from handclean.simulation.settings import SCENARIOS, SimulateConfig


def _scenario(
    context: click.Context, parameter: click.Parameter, value: str
) -> Scenario:
    return find_scenario(value)


@click.command("simulate")
@click.argument(
    "scenario",
    callback=_scenario,
    shell_complete=completion.words(SCENARIOS, files=True),
)
@options.settings("simulate", SimulateConfig, beneath="scenario")
@options.batch(
    [options.output, options.overwrite],
    [options.jobs, options.scheduler, options.shard, options.fail_fast],
    options.TELLING,
)
def command(batch: Batch, scenario: Scenario, settings: SimulateConfig) -> int:
    """Make takes, scans and readings of gloves with known truth.

    SCENARIO is grasp, rom, free, demo, scan, glove, or a TOML file with a kind and
    settings, which --config and options beat. Into the folder OUT go what the cameras
    recorded (.c3d), the same with labels (labelled/), the truth (truth/), and the
    subjects (subjects/); of scan, what the scanner saw (.ply), landmarks (landmarks/),
    the truth, and the subjects; of glove, what it read (.csv), the truth, and the
    subjects.

    \b
    Example:
        handclean simulate grasp -o sim --trials 18 --subjects 18
        handclean simulate scan -o scans
        handclean simulate glove -o glove
    """
    if batch.output is None:
        raise UsageError("-o: is missing; it should name a folder")
    chosen = Simulating(scenario=scenario.name, kind=scenario.kind, simulate=settings)
    work = replace(work_of("simulate", batch, chosen), seed=settings.seed)
    steps = import_module(work.command.step)  # late, so that help is instant
    tasks = steps.tasks(chosen, Path(batch.output))
    places.expect_apart(tasks, work.command.records, batch.reads)
    return many.run_tasks(work, batch, manifest.shard(tasks, batch.shard), ())
