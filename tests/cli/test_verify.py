"""``inspect --verify``: exit statuses, lines and JSON."""

import json

import pytest

from tests.io.c3d.c3d_oracles import c3d_bytes, take


@pytest.fixture
def files(folder, rng):
    raw, words = take(rng)
    odd = words.copy()
    odd[3, 1] = 65535
    for name, content in {
        "same": c3d_bytes(raw, words, first=11),
        "odd": c3d_bytes(raw, odd, first=11),
        "unread": c3d_bytes(raw, words, zeros_before=512),
    }.items():
        (folder / f"{name}.c3d").write_bytes(content)
    return folder


def test_equal_files_exit_with_0_and_say_so(handclean, files):
    done = handclean("inspect", "--verify", files / "same.c3d")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.strip().endswith("; equal by the c3d package")


def test_different_files_exit_with_1_and_say_where(handclean, files):
    done = handclean("inspect", "--verify", files / "odd.c3d", files / "same.c3d")
    assert done.returncode == 1
    first, second, _ = done.stdout.splitlines()
    assert first.endswith("; 1 values differ by the c3d package")
    assert second == "  missing samples: 1 of 60 differ, in frames 14"


def test_a_file_that_c3d_cannot_read_is_no_difference(handclean, files):
    done = handclean("inspect", "--verify", files / "unread.c3d")
    assert (done.returncode, done.stderr) == (0, "")
    assert "; the c3d package cannot read it (AssertionError" in done.stdout
    wanted = ("--require", "verify_differing<=0")
    done = handclean("inspect", "--verify", files / "unread.c3d", *wanted)
    assert done.returncode == 3
    assert handclean("inspect", "--verify", files / "same.c3d", *wanted).returncode == 0


def test_json_has_the_same_as_data(handclean, files):
    done = handclean("inspect", "--verify", "--json", *sorted(files.glob("*.c3d")))
    assert done.returncode == 1
    odd, same, unread = map(json.loads, done.stdout.splitlines())
    assert [line["status"] for line in (odd, same, unread)] == ["done"] * 3
    assert odd["verify"]["status"] == "different"
    assert odd["verify"]["parts"]["missing samples"] == {
        "compared": 60,
        "differing": 1,
        "frames": [[14, 14]],
    }
    assert (odd["verify_differing"], same["verify_differing"]) == (1, 0)
    assert same["verify"]["status"] == "equal"
    assert unread["verify"]["status"] == "unread"
    assert unread["verify_differing"] is None


def test_only_c3d_files_are_verified(handclean, files):
    (files / "a.trc").write_text("x")
    done = handclean("inspect", "--verify", files / "a.trc")
    assert done.returncode == 2
    assert done.stderr.strip().endswith("a.trc: --verify compares C3D files")


def test_without_the_option_nothing_is_compared(handclean, files):
    done = handclean("inspect", "--json", files / "odd.c3d")
    assert done.returncode == 0
    assert not {"verify", "verify_differing"} & json.loads(done.stdout).keys()
