import numpy as np
import pytest

from handclean.errors import ShapeError
from handclean.subject.scan.skin_color import is_like, is_skin


def colors(*rows):
    return np.array(rows, dtype=np.uint8)


def test_skin_of_light_and_medium_tones_is_skin():
    assert is_skin(colors((243, 203, 178), (224, 172, 140), (190, 128, 92))).all()


def test_each_condition_of_the_rule_excludes():
    """One color for each condition that only this one excludes."""
    out = colors(
        (95, 50, 30),  # R > 95
        (110, 40, 30),  # G > 40
        (140, 90, 20),  # B > 20
        (110, 96, 97),  # max - min > 15 and |R - G| > 15
        (150, 140, 90),  # |R - G| > 15
        (120, 150, 60),  # R > G
        (140, 100, 150),  # R > B
    )
    assert not is_skin(out).any()
    assert is_skin(colors((96, 50, 30), (110, 41, 30), (140, 90, 21))).all()


def test_gray_tables_and_blue_sleeves_are_not_skin():
    assert not is_skin(colors((150, 152, 155), (40, 60, 120), (35, 95, 70))).any()


def test_colors_near_81_do_not_overflow():
    assert not is_skin(colors((20, 240, 20))).any()


def test_dark_skin_is_told_from_a_table_by_what_it_is_like(rng):
    tone, table = np.array([100.0, 62.0, 42.0]), np.array([150.0, 152.0, 155.0])
    shade = rng.uniform(0.7, 1.0, (400, 1))
    noise = rng.normal(0.0, 4.0, (400, 3))
    skin = np.clip(tone * shade + noise, 0, 255).astype(np.uint8)
    rest = np.clip(table * shade + noise, 0, 255).astype(np.uint8)
    assert is_like(skin[200:], skin[:200]).mean() > 0.97
    assert not is_like(rest, skin[:200]).any()


def test_colors_have_three_parts():
    with pytest.raises(ShapeError):
        is_skin(np.zeros((4, 4), dtype=np.uint8))
