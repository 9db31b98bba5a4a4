"""Options and settings, from the command line to the step."""

import json
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from takes import take_batch

from handclean.cli import options
from handclean.errors import UsageError
from handclean.simulation.settings import SimulateConfig

from . import program


@pytest.fixture
def call(folder, monkeypatch):
    """Call ``tally`` without running it; return its batch and its settings."""

    def go(*arguments):
        seen = []

        def run(work, batch):
            seen.append((batch, work.settings))
            return 0

        monkeypatch.setattr(program.many, "run", run)
        monkeypatch.setattr(
            options.tables, "TABLES", {"tally": "handclean.cli.tally:TallyConfig"}
        )
        result = CliRunner().invoke(
            program.command, [str(a) for a in arguments], catch_exceptions=False
        )
        return seen[0] if seen else result.output

    return go


def words(line):
    return line.split()


def test_options_that_are_not_given_are_the_defaults(call):
    batch, settings = call()
    assert batch == take_batch()
    assert settings == program.TallyConfig()


def test_every_shared_option_reaches_the_batch(call):
    batch, _ = call(
        *words("a.c3d b.c3d -o out --format CSV --subject l.h5 --subject r.h5"),
        *words("--marker-set han19 --side both --rate 120 --unit mm --manifest -"),
        *words("--recursive --subject-for {parent}/s.h5"),
        *words("-j 3 --scheduler tcp://a:1"),
        *words("--shard 2/5 --fail-fast --failed f.csv --overwrite --seed 7"),
        *["--require", "words<=1", "--require", "draw>0", "--json", "-q", "-v"],
        "--lenient",
    )
    assert batch == take_batch(
        inputs=(Path("a.c3d"), Path("b.c3d")),
        recursive=True,
        subject_for=("{parent}/s.h5",),
        manifest="-",
        output="out",
        format=".csv",
        subjects=(Path("l.h5"), Path("r.h5")),
        marker_set="han19",
        side="both",
        rate_hz=120.0,
        unit="mm",
        lenient=True,
        jobs=3,
        scheduler="tcp://a:1",
        shard="2/5",
        fail_fast=True,
        failed=Path("f.csv"),
        overwrite=True,
        require=("words<=1", "draw>0"),
        seed=7,
        json=True,
        quiet=True,
        verbose=True,
    )


def test_every_setting_is_an_option(call):
    _, settings = call(
        *words("--method by-ear --max-gap-s 2 --times 3 --aloud --words a --words b"),
        *words("--between 1 2.5"),
    )
    assert settings == program.TallyConfig(
        method="by-ear",
        max_gap_s=2.0,
        times=3,
        aloud=True,
        words=("a", "b"),
        between=(1.0, 2.5),
    )


def test_options_beat_the_configuration_file(call):
    Path("my.toml").write_text("[tally]\ntimes = 4\naloud = true\nmethod = 'file'\n")
    _, settings = call("-c", "my.toml", "--times", "5", "--no-aloud")
    assert settings == program.TallyConfig(times=5, aloud=False, method="file")


def test_options_beat_the_file_also_where_they_say_the_default(call):
    Path("my.toml").write_text(
        "[tally]\ntimes = 4\naloud = true\nmethod = 'file'\nwords = ['a']\n"
        "between = [2, 3]\n"
    )
    _, settings = call(
        *words("-c my.toml --times 1 --no-aloud --between 0 1 --words"),
        *["", "--method", "by hand"],
    )
    assert settings == program.TallyConfig()


def test_a_mistake_in_any_table_of_the_file_is_found(call):
    Path("my.toml").write_text("[tall]\ntimes = 4\n")
    with pytest.raises(
        UsageError, match=r"no table is called 'tall'; did you mean tally"
    ):
        call("-c", "my.toml")
    Path("my.toml").write_text("[tally]\ntime = 4\n")
    with pytest.raises(UsageError, match=r"no setting is called 'time'; did you mean"):
        call("-c", "my.toml")


def test_help_tells_settings_with_their_defaults(call):
    text = " ".join(call("--help").split())
    assert "--max-gap-s FLOAT Longest gap. [default: 0.5]" in text
    assert "--aloud / --no-aloud Whether to be heard. [default: no]" in text
    assert "--between FLOAT... From, to. [default: 0.0 1.0]" in text
    assert "--words TEXT Only these. [default: none]" in text


@pytest.mark.parametrize("rate", ["0", "-1", "nan", "inf", "fast"])
def test_a_rate_is_a_number_above_zero(call, rate):
    assert "Invalid value for '--rate'" in call("--rate", rate)


def test_settings_of_several_steps_live_side_by_side(folder):
    received = {}

    @click.command("both")
    @options.batch(options.TELLING)
    @options.settings("tally", program.TallyConfig, prefix="tally", into="first")
    @options.settings("tally", program.TallyConfig, into="second")
    def both(batch, first, second):
        received.update(batch=batch, first=first, second=second)

    line = ["--tally-times", "2", "--times", "3", "--json"]
    CliRunner().invoke(both, line, catch_exceptions=False)
    assert received == {
        "batch": take_batch(json=True),
        "first": program.TallyConfig(times=2),
        "second": program.TallyConfig(times=3),
    }


def test_settings_reach_the_step_and_its_record(program_run, write):
    program_run("tally", *write(a="one"), "-o", "a.csv", "--times", "2", "-q")
    made = json.loads(Path("a.csv.made.json").read_text())["provenance"]
    assert made[-1]["settings"] == {
        "method": "by hand",
        "max_gap_s": 0.5,
        "times": 2,
        "aloud": False,
        "words": [],
        "between": [0.0, 1.0],
    }


@pytest.fixture
def program_run(program):
    def run(*arguments):
        process = program(*arguments)
        out, err = process.communicate(timeout=30)
        assert process.returncode == 0, err
        return out

    return run


def test_what_cannot_be_read_is_left_to_its_own_input(call, folder, monkeypatch):
    for name in ("a.c3d", "s.h5"):
        (folder / name).touch()
    monkeypatch.setattr("os.access", lambda *_: False)
    batch, _ = call("a.c3d", "b.c3d", "--subject", "s.h5", "-o", "out")
    assert batch.inputs == (Path("a.c3d"), Path("b.c3d"))


@pytest.mark.parametrize(
    ("place", "wrong"), [("-", "'-' is no place"), ("", "is empty"), (" ", "is empty")]
)
def test_an_output_has_a_name(call, place, wrong):
    said = " ".join(call("a.c3d", "-o", place).split())
    assert "Invalid value for '-o' / '--output'" in said
    assert wrong in said


def test_the_option_of_a_former_name_is_understood_and_hidden():
    @click.command()
    @options.config_path
    @options.settings("simulate", SimulateConfig, prefix="glove")
    def command(settings):
        click.echo(settings.donnings)

    def call(*arguments):
        return CliRunner().invoke(command, arguments).output

    assert call("--glove-wearings", "5") == call("--glove-donnings", "5") == "5\n"
    assert call() == "2\n"
    assert "--glove-donnings" in call("--help")
    assert "wearings" not in call("--help")
