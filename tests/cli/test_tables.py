"""Configuration files that come with handclean say what the code says."""

from pathlib import Path

import pytest

from handclean import config
from handclean.cli import tables

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.toml")), ids=lambda p: p.name)
def test_every_configuration_loads(path):
    config.check(path, tables.classes())


def test_the_default_configuration_is_the_defaults():
    written = (CONFIGS / "default.toml").read_text(encoding="utf-8")
    assert written == config.to_toml(tables.classes()), "make configs writes it"


def test_every_default_keeps_its_own_limits():
    for cls in tables.classes().values():
        cls()
