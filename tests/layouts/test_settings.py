"""Limits of the settings."""

import pytest

from handclean.layouts.settings import LayoutConfig
from handclean.settings import settings_of


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("markers", 0),
        ("keyframes", 0),
        ("dimensions", -1),
        ("method", "genetic"),
        ("back", "front"),
        ("w1", -1.0),
        ("w2", float("inf")),
        ("share", 0.0),
        ("base_share", 1.5),
        ("normal", 1.0),
        ("particles", 0),
        ("patience", 0),
        ("without_boxes_m", (0.0, 1.0)),
    ],
)
def test_what_cannot_be_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        LayoutConfig(**{name: value})


def test_an_energy_without_terms_is_refused():
    with pytest.raises(ValueError, match="all be 0"):
        LayoutConfig(w1=0.0, w2=0.0)


def test_every_setting_can_be_an_option():
    assert {setting.name for setting in settings_of(LayoutConfig)} >= {"w1", "w2"}
