"""Limits are declared once, on the field; class, file, option and help keep them."""

import math
from dataclasses import dataclass, replace
from typing import Annotated

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from handclean import config
from handclean.cli import tables
from handclean.cli.main import cli
from handclean.errors import UsageError
from handclean.settings import Limits, Words, expect_limits, settings_of

CLASSES = tables.classes()
LIMITED = [
    (table, setting)
    for table, cls in CLASSES.items()
    for setting in settings_of(cls)
    if setting.limits != Limits()
]


@dataclass(frozen=True, kw_only=True)
class Plain:
    """Settings of every kind that has limits."""

    share: Annotated[float, "A share.", Limits(least=0.0, most=0.5)] = 0.25
    part: Annotated[float, "A part.", Limits(above=0.0, below=1.0)] = 0.5
    length_s: Annotated[
        float, "A time.", Limits(least=0.5, most=9.0, or_zero=True, unit="s")
    ] = 0.0
    count: Annotated[int, "A count.", Limits(least=5)] = 5
    pair: Annotated[tuple[float, float], "Two.", Limits(above=0.0)] = (1.0, 2.0)
    word: Annotated[str, "A word.", Words(("a", "b"))] = "a"
    side: Annotated[str, "A side.", Words(("l", "r"), or_empty=True)] = ""
    model: Annotated[str, "A model.", Words(("x",), others=True)] = "x"
    free: Annotated[float, "Any.", Limits()] = 0.0

    def __post_init__(self) -> None:
        expect_limits(self)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("share", 0.6, "share should lie between 0 and 0.5, not 0.6"),
        ("share", -0.1, "share should lie between 0 and 0.5, not -0.1"),
        ("share", math.nan, "share should lie between 0 and 0.5, not nan"),
        ("part", 0.0, "part should be > 0, not 0.0"),
        ("part", 1.0, "part should be < 1, not 1.0"),
        ("length_s", 0.1, "length_s should be 0 or lie between 0.5 and 9 s, not 0.1"),
        ("count", 4, "count should be 5 or more, not 4"),
        ("pair", (1.0, 0.0), "pair should be > 0, not 0.0"),
        ("word", "c", "word should be one of a, b, not 'c'"),
        ("word", "", "word should be one of a, b, not ''"),
        ("side", "m", "side should be one of l, r, not 'm'"),
        ("free", math.nan, "free should be a finite number, not nan"),
        ("free", math.inf, "free should be 1000000000 at most"),
        ("free", -2e9, "free should be 1000000000 at most"),
        ("count", 2**31, "count should be 2147483647 at most"),
    ],
)
def test_class_and_file_refuse_the_same_in_the_same_words(name, value, message):
    with pytest.raises(ValueError, match="should") as caught:
        Plain(**{name: value})
    assert str(caught.value) == message
    if not isinstance(value, float) or math.isfinite(value):
        with pytest.raises(UsageError) as caught:
            config.load(None, "plain", Plain, **{name: value})
        assert str(caught.value) == f"plain: {message}"


def test_bounds_themselves_and_other_words_are_right():
    for name, value in [
        *(("share", value) for value in (0.0, 0.5)),
        *(("length_s", value) for value in (0.0, 0.5, 9.0)),
        ("count", 5),
        ("word", "b"),
        *(("side", value) for value in ("", "l")),
        ("model", "x+y"),
        ("free", 1e9),
    ]:
        assert getattr(Plain(**{name: value}), name) == value


def test_a_file_keeps_limits_that_a_class_forgot_to_check():
    @dataclass(frozen=True, kw_only=True)
    class Forgetful:
        share: Annotated[float, "A share.", Limits(least=0.0)] = 0.0

    with pytest.raises(UsageError, match="share should be >= 0, not -1"):
        config.load(None, "plain", Forgetful, share=-1.0)


def test_help_shows_what_is_no_matter_of_course():
    shown = {setting.name: setting.range for setting in settings_of(Plain)}
    assert shown["share"] == "0 to 0.5"
    assert shown["part"] == "> 0, < 1"
    assert shown["length_s"] == "0 or 0.5 to 9 s"
    assert shown["count"] == "5 or more"
    assert shown["pair"] == shown["word"] == shown["free"] == ""
    said = CliRunner().invoke(cli, ["simulate", "--help"]).output
    assert "[default: 200.0; 10 to 10000 Hz]" in " ".join(said.split())


def outside(limits, kind):
    """Values just outside the limits."""
    step = 1 if kind is int else 1e-6
    if limits.least is not None:
        yield kind(limits.least - step)
    if limits.most is not None:
        yield kind(limits.most + step)
    yield from (kind(one) for one in (limits.above, limits.below) if one is not None)


@pytest.mark.parametrize(
    ("table", "setting"), LIMITED, ids=[f"{t}-{s.name}" for t, s in LIMITED]
)
def test_every_class_keeps_the_limits_it_declares(table, setting):
    cls = CLASSES[table]
    for value in outside(setting.limits, setting.kind):
        with pytest.raises(ValueError, match=f"^{setting.name} should "):
            cls(**{setting.name: value})
        with pytest.raises(UsageError, match=f"^{table}: {setting.name} should "):
            config.load(None, table, cls, **{setting.name: value})


@given(
    value=st.floats(allow_nan=True, allow_infinity=True),
    bounds=st.tuples(*[st.none() | st.floats(-5, 5)] * 4),
)
def test_nothing_is_said_of_a_value_within_its_bounds_only(value, bounds):
    names = ("least", "most", "above", "below")
    given = dict(zip(names, bounds, strict=True))
    least, most, above, below = bounds
    within = (
        (least is None or value >= least)
        and (most is None or value <= most)
        and (above is None or value > above)
        and (below is None or value < below)
    )
    assert (Limits(**given).broken(value, float) == "") == within
    zero = replace(Limits(**given), or_zero=True)
    assert zero.broken(0.0, float) == ""
