"""Settings: defaults, then the file, then options; every mistake is one clear line."""

import subprocess
import sys
import tomllib
from dataclasses import asdict, dataclass
from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean import config
from handclean.errors import UsageError
from handclean.settings import Formerly, Limits, expect_limits, settings_of


@dataclass(frozen=True, kw_only=True)
class FillConfig:
    """Settings of a step, one of each kind."""

    method: Annotated[str, "How to fill."] = "cubic"
    max_gap_s: Annotated[float, "Longest gap to fill.", Limits(least=0.0, unit="s")] = (
        0.5
    )
    samples: Annotated[int, "Samples on each side."] = 3
    ends: Annotated[bool, "Fill open ends."] = False
    markers: Annotated[tuple[str, ...], "Only these."] = ()
    range_s: Annotated[tuple[float, float], "From, to."] = (0.0, 1.5)

    def __post_init__(self) -> None:
        expect_limits(self)


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "my.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_without_anything_the_defaults_hold():
    assert config.load(None, "fill-gaps", FillConfig) == FillConfig()


def test_the_file_beats_defaults_and_options_beat_the_file(written):
    path = written('[fill-gaps]\nmethod = "linear"\nmax_gap_s = 0.25\n')
    loaded = config.load(path, "fill-gaps", FillConfig, max_gap_s=0.1)
    assert loaded == FillConfig(method="linear", max_gap_s=0.1)


def test_options_that_were_not_given_change_nothing(written):
    path = written("[fill-gaps]\nsamples = 7\nmarkers = ['a', 'b']\n")
    loaded = config.load(path, "fill-gaps", FillConfig, samples=None, method=None)
    assert loaded == FillConfig(samples=7, markers=("a", "b"))


def test_what_is_given_beats_the_file_also_where_it_is_the_default(written):
    path = written("[fill-gaps]\nsamples = 7\nmarkers = ['a', 'b']\nends = true\n")
    given = {"samples": 3, "markers": (), "ends": False}
    assert config.load(path, "fill-gaps", FillConfig, **given) == FillConfig()


def test_what_lies_beneath_is_beaten_by_the_file_and_by_options(written):
    path = written("[fill-gaps]\nsamples = 3\n")
    beneath = config.Layer("own.toml", {"samples": 7, "ends": True, "max_gap_s": 1})
    loaded = config.load(path, "fill-gaps", FillConfig, beneath, max_gap_s=0.5)
    assert loaded == FillConfig(ends=True)
    for wrong in ({"sample": 1}, {"samples": 1.5}, {"max_gap_s": -1.0}):
        with pytest.raises(UsageError, match=r"^own\.toml: "):
            config.load(path, "fill-gaps", FillConfig, config.Layer("own.toml", wrong))


def test_a_mistake_is_blamed_on_whoever_made_it(written):
    path = written("[fill-gaps]\nmax_gap_s = 0.2\n")
    with pytest.raises(UsageError, match=r"^fill-gaps: max_gap_s should be >= 0 s"):
        config.load(path, "fill-gaps", FillConfig, max_gap_s=-1.0)


def test_a_whole_number_is_a_float_and_a_list_a_tuple(written):
    path = written("[fill-gaps]\nmax_gap_s = 2\nrange_s = [1, 2]\n")
    loaded = config.load(path, "fill-gaps", FillConfig)
    assert loaded == FillConfig(max_gap_s=2.0, range_s=(1.0, 2.0))
    assert isinstance(loaded.max_gap_s, float)


def test_tables_of_other_commands_are_left_alone(written):
    path = written("[label]\nwhatever = 1\n")
    assert config.load(path, "fill-gaps", FillConfig) == FillConfig()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[fill-gaps]\nmax_gap = 1.0", "no setting is called 'max_gap'; did you mean"),
        ("[fill-gaps]\nzzz = 1.0", "no setting is called 'zzz'; known: ends, markers"),
        ("[fill-gaps]\nmax_gap_s = '0.5'", "max_gap_s should be a float, not '0.5'"),
        (
            "[fill-gaps]\nmax_gap_s = nan",
            "max_gap_s should be a finite number, not nan",
        ),
        ("[fill-gaps]\nmax_gap_s = -inf", "should be a finite number, not -inf"),
        ("[fill-gaps]\nmax_gap_s = 1" + "0" * 400, "a whole number is beyond 64 bits"),
        ("[fill-gaps]\nrange_s = [0.0, inf]", "range_s should be a finite number"),
        ("[fill-gaps]\nmax_gap_s = 1e300", "max_gap_s should be 1000000000 at most"),
        ("[fill-gaps]\nsamples = 2147483648", "samples should be 2147483647 at most"),
        ("[fill-gaps]\nsamples = -2147483649", "should be 2147483647 at most"),
        ("[fill-gaps]\nsamples = 1.0", "samples should be an int, not 1.0"),
        ("[fill-gaps]\nsamples = true", "samples should be an int, not True"),
        ("[fill-gaps]\nends = 1", "ends should be a bool, not 1"),
        ("[fill-gaps]\nmarkers = 'a'", "markers should be a list of strs, not 'a'"),
        ("[fill-gaps]\nmarkers = [1]", "markers should be a list of strs, not [1]"),
        ("[fill-gaps]\nrange_s = [1.0]", "range_s should be a list of 2 floats"),
        ("[fill-gaps]\nmax_gap_s = -1.0", "max_gap_s should be >= 0 s, not -1.0"),
        ("[fil-gaps]\n", "no table is called 'fil-gaps'; did you mean fill-gaps?"),
        ("max_gap_s = 1.0", "'max_gap_s' stands outside any table"),
        ("[fill-gaps\n", "is not valid TOML"),
    ],
)
def test_a_mistake_in_the_file_is_one_line_that_names_it(written, text, message):
    path = written(text)
    with pytest.raises(UsageError) as caught:
        config.check(path, {"fill-gaps": FillConfig})
    assert str(caught.value).startswith(str(path))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_status == 2


def test_load_finds_the_mistakes_of_its_own_table(written):
    path = written("[fill-gaps]\nmax_gap = 1.0")
    with pytest.raises(UsageError, match=r"\[fill-gaps\]: no setting .* max_gap_s"):
        config.load(path, "fill-gaps", FillConfig)


def test_a_limit_broken_by_an_option_is_a_usage_error():
    with pytest.raises(UsageError, match="fill-gaps: max_gap_s should be >= 0"):
        config.load(None, "fill-gaps", FillConfig, max_gap_s=-1.0)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_number_without_end_or_sense_is_a_usage_error(value):
    message = f"fill-gaps: max_gap_s should be a finite number, not {value}"
    with pytest.raises(UsageError, match=message):
        config.load(None, "fill-gaps", FillConfig, max_gap_s=value)


def test_a_file_that_cannot_be_read_is_a_usage_error(tmp_path):
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(UsageError, match=str(path)):
            config.load(path, "fill-gaps", FillConfig)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="is not text"):
        config.load(tmp_path / "bytes.toml", "fill-gaps", FillConfig)


@given(
    method=st.text(st.characters(exclude_categories=["Cc", "Cs"])),
    max_gap_s=st.floats(min_value=0.0, allow_nan=False, allow_infinity=False),
    samples=st.integers(-(2**40), 2**40),
    ends=st.booleans(),
    markers=st.lists(st.sampled_from(["R_INDEX_TIP", "Wan-1", 'a"b', "ä b"])),
)
def test_defaults_written_as_toml_read_back_the_same(tmp_path_factory, **values):
    values["markers"] = tuple(values["markers"])
    annotations = {
        name: Annotated[FillConfig.__annotations__[name].__origin__, "Help."]
        for name in values
    }
    changed = dataclass(frozen=True, kw_only=True)(
        type("Changed", (), {"__annotations__": annotations, **values})
    )
    text = config.to_toml({"fill-gaps": changed})
    read = tomllib.loads(text)["fill-gaps"]
    assert {k: tuple(v) if isinstance(v, list) else v for k, v in read.items()} == (
        asdict(changed())
    )


@dataclass(frozen=True, kw_only=True)
class RenamedConfig:
    """Settings of which one had another name."""

    donnings: Annotated[int, "How often.", Limits(least=1), Formerly("wearings")] = 2


def test_a_former_name_is_understood_in_files_and_options(written):
    path = written("[simulate]\nwearings = 3\n")
    config.check(path, {"simulate": RenamedConfig})
    assert config.load(path, "simulate", RenamedConfig) == RenamedConfig(donnings=3)
    given = config.load(path, "simulate", RenamedConfig, wearings=5)
    assert given == config.load(path, "simulate", RenamedConfig, donnings=5)
    assert given == RenamedConfig(donnings=5)
    assert "wearings" not in config.to_toml({"simulate": RenamedConfig})


def test_a_setting_under_both_of_its_names_is_a_usage_error(written):
    path = written("[simulate]\nwearings = 3\ndonnings = 3\n")
    with pytest.raises(UsageError, match="wearings is the former name of donnings"):
        config.load(path, "simulate", RenamedConfig)
    with pytest.raises(UsageError, match="donnings should be 1 or more, not 0"):
        config.load(None, "simulate", RenamedConfig, wearings=0)


def test_a_field_that_is_no_setting_is_refused():
    @dataclass(frozen=True)
    class Nested:
        inner: Annotated[dict, "A table."] = None

    @dataclass(frozen=True)
    class Misplaced:
        name: Annotated[str, "A text.", Limits(least=0)] = ""

    with pytest.raises(TypeError, match="inner"):
        settings_of(Nested)
    with pytest.raises(TypeError, match="name should have Limits, Words or"):
        settings_of(Misplaced)


def test_settings_import_nothing_heavy():
    code = "import handclean.config, sys; print('numpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"
