"""Options beat files: every setting of every command, also where it is the default."""

import contextlib
import json
from importlib import import_module
from pathlib import Path

import pytest
from click.testing import CliRunner

from handclean import config
from handclean.cli import main as frame
from handclean.cli import options, tables
from handclean.io import files
from handclean.runner import many

ARGUMENTS = {"simulate": ["{scenario}"], "compare": ["a.h5", "b.h5"]}


def others(setting):
    """Values that are not the default and may be allowed."""
    default = setting.default
    if setting.is_tuple:
        yield from (("tripod",), ("index_distal",), (0.0, 0.0, 0.0, 1.0, 1.0, 1.0))
        yield tuple(2 * x + 1 for x in default)
    elif setting.kind is bool:
        yield not default
    elif setting.kind is str:
        known = () if setting.words is None else setting.words.known
        yield from (*known, "left", "maycock26", "han19", "cyberglove18")
        yield "another"
    else:
        yield from (2 * default + 1, default / 2, default + 1, default - 1)


def changed(cls, setting):
    """A value that is allowed and not the default."""
    for value in others(setting):
        value = value if setting.is_tuple else setting.kind(value)
        parts = value if setting.is_tuple else (value,)
        if value == setting.default or not all(type(x) is setting.kind for x in parts):
            continue
        with contextlib.suppress(ValueError):
            cls(**{setting.name: value})
            return value
    raise AssertionError(f"nothing but the default is allowed of {setting.name}")


def flags(name, setting):
    """Options that say the default."""
    flag, value = "--" + name.replace("_", "-"), setting.default
    if setting.kind is bool and not setting.is_tuple:
        return [flag if value else f"--no-{flag[2:]}"]
    if setting.is_tuple and setting.count is None:
        return [word for part in value or ("",) for word in (flag, part)]
    return [flag, *map(str, value if setting.is_tuple else [value])]


def tables_of(command):
    """Prefix and table of all settings of a command, seen in its options."""
    names = {parameter.name for parameter in command.params}
    for table, cls in tables.classes().items():
        for prefix in ("", "label_", "fill_", "solve_", "judge_"):
            if all(
                prefix + setting.name in names for setting in config.settings_of(cls)
            ):
                yield prefix, table, cls


@pytest.mark.parametrize("name", frame.COMMANDS)
def test_an_option_beats_every_file_also_where_it_says_the_default(
    name, folder, monkeypatch
):
    module = import_module(f"handclean.cli.{name.replace(' ', '_').replace('-', '_')}")
    seen = {}
    load = config.load

    def spy(path, table, cls, *more, **given):
        seen[table] = load(path, table, cls, *more, **given)
        return seen[table]

    monkeypatch.setattr(options.config, "load", spy)
    for entry in ("run", "reduce", "run_tasks"):
        monkeypatch.setattr(many, entry, lambda *_: 0)
    for prefix, table, cls in tables_of(module.command):
        for setting in config.settings_of(cls):
            value = changed(cls, setting)
            text = json.dumps(list(value) if setting.is_tuple else value)
            Path("my.toml").write_text(f"[{table}]\n{setting.name} = {text}\n")
            Path("own.toml").write_text(f"kind = 'rom'\n{setting.name} = {text}\n")
            arguments = ARGUMENTS.get(name, ["a.h5"])
            line = [
                *(a.format(scenario="own.toml") for a in arguments),
                "-c",
                "my.toml",
            ]
            for given, wanted in (
                ([], value),
                (flags(prefix + setting.name, setting), setting.default),
            ):
                seen.clear()
                CliRunner().invoke(frame.cli, [*name.split(), *line, *given])
                found = getattr(seen[table], setting.name)
                assert found == wanted, (table, setting.name, given)


def test_a_scenario_with_three_trials_makes_one_where_one_is_asked_for(
    handclean, folder
):
    Path("mine.toml").write_text(
        "kind = 'free'\ntrials = 3\nrate_hz = 50\nduration_s = 0.5\n"
        "occlusion = false\nmarker_set = 'dfki13'\n"
    )
    done = handclean("simulate", "mine.toml", "-o", "one", "--trials", "1", "-q")
    assert done.returncode == 0, done.stderr
    assert [path.name for path in Path("one").glob("*.c3d")] == ["S01_001.c3d"]
    assert files.read(Path("one/S01_001.c3d")).rate == 50.0
    Path("my.toml").write_text("[simulate]\ntrials = 2\nrate_hz = 200.0\n")
    done = handclean("simulate", "mine.toml", "-o", "two", "-c", "my.toml", "-q")
    assert done.returncode == 0, done.stderr
    assert len(list(Path("two").glob("*.c3d"))) == 2
    assert files.read(Path("two/S01_001.c3d")).rate == 200.0
