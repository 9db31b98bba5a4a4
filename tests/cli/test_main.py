"""The command line itself: help is instant, every mistake is one line."""

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from handclean import __version__
from handclean.cli import main as frame
from handclean.commands.table import compiling
from handclean.errors import UsageError

from .program import boxes

HEAVY = {"numpy", "scipy", "numba", "h5py", "c3d", "trimesh", "matplotlib"}


@pytest.fixture
def call(capfd, folder):
    def go(*arguments):
        status = frame.main(arguments)
        out, err = capfd.readouterr()
        return status, out, err

    return go


@pytest.mark.parametrize("command", frame.COMMANDS)
def test_help_of_a_command_agrees_with_the_list(call, command):
    status, out, err = call(*command.split(), "--help")
    assert (status, err) == (0, "")
    assert out.startswith(f"Usage: handclean {command} ")
    assert frame.COMMANDS[command] in " ".join(out.split())
    assert f"handclean {command}" in out.split("Example", 1)[1], "has an example"


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("fill-gaps", "Markers are filled from each other"),
        ("compare", "each sample that no camera saw counts as missed"),
        ("simulate", "handclean simulate scan -o"),
        ("simulate", "handclean simulate glove -o"),
        ("calibrate-hand markers", "--side [left|right] "),
        ("calibrate-hand scan", "--side [left|right] "),
    ],
)
def test_help_says_what_a_command_needs_and_what_it_makes(call, command, said):
    _, out, _ = call(*command.split(), "--help")
    assert said in " ".join(out.split())


DRAWING = {"calibrate-glove fit", "optimize-layout", "simulate"}


@pytest.mark.parametrize("command", [c for c in frame.COMMANDS if c != "warm"])
def test_a_seed_is_shown_where_something_is_drawn_and_accepted_everywhere(
    call, command
):
    _, out, _ = call(*command.split(), "--help")
    assert ("--seed INTEGER" in out) == (command in DRAWING)
    _, _, err = call(*command.split(), "--seed", "7", "--no-such-option")
    assert "No such option '--no-such-option'" in err
    _, _, err = call(*command.split(), "--seed", "x")
    assert "Invalid value for '--seed'" in err


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("solve", "--per-frame Means nothing so far: "),
        ("solve", "So far 'both' means no more than that there should be a --subject"),
        ("label", "So far 'both' means no more than that there should be a --subject"),
    ],
)
def test_help_says_what_means_nothing_so_far(call, command, said):
    _, out, _ = call(*command.split(), "--help")
    assert said in " ".join(out.split())


def test_help_lists_every_command(call):
    status, out, _ = call("--help")
    assert status == 0
    for command, text in frame.COMMANDS.items():
        if " " not in command:
            assert f"{command} " in out
            assert text[:30] in out


def test_help_imports_nothing_heavy():
    modules = [c.replace(" ", "_").replace("-", "_") for c in frame.COMMANDS]
    imports = "".join(f"import handclean.cli.{name}\n" for name in modules)
    code = f"{imports}import sys; print(*({HEAVY} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == "\n"


SAMPLES = Path(__file__).parents[2] / "sample_sessions"
INSPECTED = ("001_thumb_4_finger.c3d", "001_thumb_4_finger.truth.h5", "001_rom.c3d")


@pytest.mark.parametrize("name", [f"S01_{name}" for name in INSPECTED])
def test_inspecting_a_take_compiles_nothing_and_imports_no_compiler(name):
    code = "import sys; from handclean.cli.main import main; main(sys.argv[1:])\n"
    code += "print(*{'numba', 'scipy', 'matplotlib'} & set(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code, "inspect", str(SAMPLES / name)],
        capture_output=True,
        text=True,
        check=True,
    )
    told, imported = done.stdout.splitlines()
    assert f"{name}: " in told
    assert (imported, done.stderr) == ("", "")


def test_the_version_is_that_of_the_package(call):
    assert call("--version") == (0, f"handclean, version {__version__}\n", "")


def test_without_a_command_help_is_shown_and_the_status_is_2(call):
    status, out, err = call()
    assert (status, out) == (2, "")
    assert "Usage: handclean" in err


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            "conver a.c3d",
            "handclean: no command is called 'conver'; did you mean convert?",
        ),
        ("convert --outptu a", "No such option '--outptu'. Did you mean '--output'?"),
        ("convert a.c3d --unit km", "'km' is not one of 'mm', 'cm', 'm'"),
        ("convert a.c3d -j 0", "0 is not in the range x>=1"),
        ("convert a.c3d", "-o: is missing"),
        ("convert -o b.h5", "inputs: there are none"),
        ("convert a.c3d -o b.h55", "did you mean .h5"),
        ("convert a.c3d b.c3d -o b.h5", "-o should name a folder"),
        ("convert a.c3d a.trc -o b", "would be written twice"),
        ("convert a.h5 -o a.h5", "is read as well as written"),
        ("convert --manifest none.csv -o b", "none.csv: no such file"),
        ("convert a.c3d -o b.h5 --shard 3/2", "--shard should be I/N"),
        ("convert a.c3d -o b.h5 -c none.toml", "none.toml: no such file"),
        ("convert a.c3d -o b.h5 --require fram<=1", "no figure is called 'fram'"),
        ("convert a.c3d -o b.h5 --failed none/f", "--failed should name a file"),
        ("simulate graps -o b", "is called 'graps'; did you mean grasp?"),
        ("simulate none.toml -o b", "none.toml: no such file"),
        ("solve a.c3d -o b.h5 --marker-set han18", "did you mean han19?"),
        ("solve a.c3d -o b.h5 --subject s.h5", "--subject s.h5: no such file"),
        ("solve a.c3d -o b.h5 --prior p.h5", "--prior p.h5: no such file"),
        ("label a.c3d -o b.h5 --subject s.h5", "--subject s.h5: no such file"),
        ("clean a.c3d -o b.h5 --marker-set m.toml", "m.toml: no such file"),
        ("fill-gaps a.c3d -o b.h5 --max-gap-s nan", "a finite number, not nan"),
        ("clean a.c3d -o b.h5 --fill-max-gap-s inf", "a finite number, not inf"),
        ("clean a.c3d -o b.h5 --max-gap-s inf", "a finite number, not inf"),
        ("clean a.c3d -o b.h5 --strict nan", "a finite number, not nan"),
        ("calibrate-hand markers a.c3d -o b.h5 --marker-set x", "is called 'x'"),
    ],
)
def test_wrong_usage_is_one_line_and_status_2(call, line, said):
    status, out, err = call(*line.split())
    assert (status, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_help_of_a_chain_shows_each_setting_once(call):
    text = call("clean", "--help")[1]
    assert "--fill-max-sigma-m" in text
    assert " --max-sigma-m" not in text


def test_a_misspelt_key_of_a_configuration_is_one_line_and_status_2(call):
    Path("my.toml").write_text("[fil-gaps]\nmax_gap_s = 1.0\n")
    status, _, err = call("convert", "a.c3d", "-o", "b.h5", "-c", "my.toml")
    assert status == 2
    assert err.startswith("my.toml: no table is called 'fil-gaps';")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (UsageError("x: is\nwrong"), 2, "x: is wrong\n"),
        (OSError(28, "No space left", "f.h5"), 1, "f.h5: no space left\n"),
        (
            KeyError("x"),
            1,
            "handclean: internal error, please report it: KeyError: 'x'\n",
        ),
    ],
)
def test_no_error_is_a_traceback(call, monkeypatch, error, status, said):
    def fail(*arguments):
        raise error

    monkeypatch.setattr(frame.cli, "invoke", fail)
    assert call("warm") == (status, "", said)


@pytest.mark.parametrize("jobs", ["-j1", "-j2"])
@pytest.mark.parametrize("closed", [(1,), (2,), (1, 2), (0, 1, 2)], ids=str)
def test_a_stream_that_is_closed_hinders_nothing(program, write, closed, jobs):
    names = write(a="one", b="prints") if jobs == "-j2" else write(a="prints")
    process = program(
        "tally", *names, "-o", "out", jobs,
        preexec_fn=lambda: [os.close(fd) for fd in closed],
    )  # fmt: skip
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0
    assert "internal" not in err
    assert (out == "") == (1 in closed)
    for name in names:
        assert boxes.RECORDS.intact((Path("out") / name).with_suffix(".box"))


@pytest.mark.parametrize(
    ("line", "status", "said"),
    [
        ("inspect --manifest -", 2, "stdin: is empty"),
        ("--help", 0, ""),
        ("inspect none.c3d", 1, "none.c3d: no such file"),
    ],
)
def test_a_command_without_streams_fails_in_its_own_words(program, line, status, said):
    process = program(*line.split(), preexec_fn=lambda: [os.close(0), os.close(1)])
    out, err = process.communicate(timeout=300)
    assert (process.returncode, out) == (status, "")
    assert err.startswith(said)


def test_a_full_disk_behind_stdout_is_named(program, write):
    with open("/dev/full", "w") as full:
        process = program(
            "tally", *write(a="one"), "-o", "a.csv",
            preexec_fn=lambda: os.dup2(full.fileno(), 1),
        )  # fmt: skip
        _, err = process.communicate(timeout=300)
    assert (process.returncode, err) == (1, "stdout: no space left on device\n")


def test_an_error_is_one_safe_line_of_at_most_500_characters(call):
    status, _, err = call("convert", "\x1b[31m" + "x" * 900, "-o", "a\x1b[2J.h55")
    assert (status, err.count("\n"), "\x1b" in err) == (2, 1, False)
    assert err.startswith("a\\x1b[2J.h55: no format")
    for line in (["\x1b" * 900], ["convert", "a", "--unit", "m" * 900]):
        _, _, err = call(*line)
        assert len(err) <= 501
        assert "\x1b" not in err


def test_python_m_handclean_is_handclean(handclean):
    done = handclean("--version")
    assert (done.returncode, done.stdout) == (0, f"handclean, version {__version__}\n")


def test_every_command_has_its_module_and_its_step():
    for command in frame.COMMANDS:
        name = command.replace(" ", "_").replace("-", "_")
        assert (
            import_module(f"handclean.cli.{name}").command.name == command.split()[-1]
        )


@pytest.mark.parametrize("jobs", [(), ("-j2", "--json")], ids=["alone", "workers"])
def test_the_first_run_says_that_it_compiles_and_the_second_does_not(
    handclean, tmp_path, jobs
):
    line = ["simulate", "free", "-o", "out", "--duration-s", "0.5", "--rate-hz", "50"]
    line += ["--no-occlusion", "--trials", str(1 + len(jobs)), "--overwrite", *jobs]
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    said = [handclean(*line, env=env) for _ in range(2)]
    assert [done.returncode for done in said] == [0, 0]
    count = "3 done\n" if jobs else ""
    assert [done.stderr for done in said] == [f"{compiling()}\n{count}", count]
    assert said[0].stdout.count("\n") == 1 + len(jobs)
    assert "compiling" not in said[0].stdout


LEAVING = """
import atexit, sys, threading, time
from handclean.cli import main
atexit.register(lambda: print("at exit"))
def late():
    time.sleep(0.3)
    print("late")
if len(sys.argv) > 3:
    threading.Thread(target=late).start()
main.program()
print("not left")
"""


@pytest.mark.parametrize("thread", [[], ["a thread"]], ids=["alone", "thread"])
def test_the_program_leaves_when_all_is_told_and_closed(thread):
    line = [sys.executable, "-c", LEAVING, "inspect", "no such file.c3d", *thread]
    done = subprocess.run(line, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.startswith("no such file.c3d: no such file")
    assert done.stdout == ("late\n" if thread else "") + "at exit\n"


def test_verbose_tells_what_the_steps_of_a_take_took(handclean, tmp_path):
    table = tmp_path / "take.csv"
    table.write_text("frame,A.x,A.y,A.z\n1,1,2,3\n2,1,2,3\n")
    line = ["convert", table, "-o", tmp_path / "take.trc", "--rate", "60"]
    assert handclean(*line, "--unit", "mm").stderr == ""
    told = handclean(*line, "--unit", "m", "-v").stderr
    steps = r"import [0-9.]+, read [0-9.]+, write [0-9.]+"
    assert re.search(rf"take\.csv: done in [0-9.]+ s \({steps}\)\n", told), told
