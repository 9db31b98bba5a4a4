"""What every step keeps to."""

import inspect
import pkgutil
from importlib import import_module

import pytest

from handclean import commands

NAMES = [
    module.name
    for module in pkgutil.iter_modules(commands.__path__)
    if not module.ispkg and module.name != "table"  # it lists the steps
]
TAKEN = {"input", "output", "status", "error", "seconds", "warnings"}


@pytest.mark.parametrize("name", NAMES)
def test_a_step_is_the_function_of_its_modules_name(name):
    module = import_module(f"handclean.commands.{name}")
    parameters = list(inspect.signature(getattr(module, name)).parameters)
    assert parameters in (["source", "settings"], ["sources", "settings"])


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_has_a_name_of_its_own_and_a_meaning(name):
    figures = import_module(f"handclean.commands.{name}").FIGURES
    assert not TAKEN & set(figures)
    assert all(figures.values())
