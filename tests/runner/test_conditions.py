"""Conditions on figures."""

import math

import pytest

from handclean.errors import UsageError
from handclean.runner import conditions

FIGURES = {"residual_mm": 0.5, "label_f1": 1, "note": "text", "nothing": None}


@pytest.mark.parametrize(
    ("text", "met"),
    [
        ("residual_mm<=0.5", True),
        ("residual_mm < 0.5", False),
        ("residual_mm<0.51", True),
        ("label_f1>=0.99", True),
        ("label_f1 > 1", False),
        ("label_f1==1", True),
        ("residual_mm<=inf", True),
        ("residual_mm<=nan", False),
        ("nothing<=1", False),
        ("note<=1", False),
    ],
)
def test_a_condition_compares_a_figure_with_a_number(text, met):
    condition = conditions.parse(text, FIGURES)
    assert (condition.unmet(FIGURES) == "") == met


def test_a_star_stands_for_anything():
    condition = conditions.parse("right.angles_mean_deg<=1", ["*angles_*_deg"])
    assert condition.figure == "right.angles_mean_deg"
    with pytest.raises(UsageError):
        conditions.parse("right.angles_mean_mm<=1", ["*angles_*_deg"])


def test_what_is_unmet_says_what_it_is():
    assert conditions.parse("residual_mm<=0.1", FIGURES).unmet(FIGURES) == (
        "residual_mm is 0.5, required <= 0.1"
    )
    assert "is not known" in conditions.parse("nothing<=1", FIGURES).unmet(FIGURES)
    assert "is not known" in conditions.parse("nothing<=1", FIGURES).unmet({})
    assert "nan" in conditions.parse("nothing<=1", FIGURES).unmet({"nothing": math.nan})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("residual<=1", "no figure is called 'residual'; did you mean residual_mm?"),
        ("zzz<=1", "no figure is called 'zzz'; known: label_f1, note"),
        ("residual_mm=1", "should be NAME<=VALUE"),
        ("residual_mm<=", "should be NAME<=VALUE"),
        ("<=1", "should be NAME<=VALUE"),
        ("residual_mm<=one", "the value should be a number, not 'one'"),
    ],
)
def test_a_condition_that_is_none_is_a_usage_error(text, message):
    with pytest.raises(UsageError) as caught:
        conditions.parse(text, FIGURES)
    assert message in str(caught.value)
