"""Many inputs: every one is reported, none stops the others, nothing half-written."""

import csv
import errno
import json
import os
import resource
import time
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from boxes import Whose, opened, tally, write_box

from handclean.errors import UsageError
from handclean.runner import many, plan, provenance, records, staging
from handclean.runner.batch import Batch
from handclean.runner.command import Work
from handclean.runner.execute import execute


def tree(folder):
    """Bytes of every file of a folder, hidden ones too, by name."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(Path(folder).rglob("*"))
        if path.is_file()
    }


def test_each_input_gives_its_output_and_one_line(inputs, run):
    paths = inputs(a="one", b="one two")
    status, objects, err = run(*paths, output="out", format=".csv")
    assert status == 0
    assert [(o["input"], o["output"], o["words"]) for o in objects] == [
        ("in/a.txt", "out/a.csv", 1),
        ("in/b.txt", "out/b.csv", 2),
    ]
    assert all(o["status"] == "done" and o["error"] is None for o in objects)
    assert all(o["seconds"] >= 0 and o["gap"] is None for o in objects)
    assert Path("out/b.csv").read_text() == "ONE TWO"
    assert sorted(tree("out")) == [
        "a.csv", "a.csv.made.json", "b.csv", "b.csv.made.json",
    ]  # fmt: skip
    assert err == "2 done\n"


def test_text_has_one_line_per_result(inputs, run):
    paths = inputs(a="one", b="wrong", c="one odd")
    status, lines, err = run(*paths, output="out", json=False)
    assert status == 1
    assert lines == ["in/a.txt -> out/a.box: 1 words", "in/c.txt -> out/c.box: 2 words"]
    assert err.splitlines() == [
        "in/b.txt: is wrong; it should be right",
        "in/c.txt: warning: is odd",
        "2 done, 1 failed",
    ]


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("way", ["wrong", "bug", "memory", "numpy", "unfit", "full"])
def test_what_was_odd_about_a_take_is_told_also_if_its_task_fails(
    inputs, run, way, jobs
):
    paths = inputs(a=f"{way} read", b="one read", c="wrong")
    _, objects, err = run(*paths, output="out", format=".csv", jobs=jobs)
    assert [o["status"] for o in objects] == [
        "done" if way == "numpy" else "failed", "done", "failed"
    ]  # fmt: skip
    assert [o["warnings"] for o in objects] == [["was read oddly"]] * 2 + [[]]
    told = [line for line in err.splitlines() if "oddly" in line]
    assert told == [f"in/{name}.txt: warning: was read oddly" for name in "ab"]


def test_of_several_takes_of_a_task_that_fails_each_is_named(inputs, capfd):
    paths = inputs(a="wicked read", b="two")
    batch = Batch(inputs=paths, output="out.csv", json=True)
    assert many.reduce(Work(command=tally()), batch) == 1
    out, err = capfd.readouterr()
    told = [f"{path}: was read oddly" for path in paths]
    assert json.loads(out)["warnings"] == told
    assert [line for line in err.splitlines() if "oddly" in line] == [
        f"out.csv: warning: {text}" for text in told
    ]


def test_a_last_line_says_how_many_inputs_went_how_unless_it_was_one(inputs, run):
    paths = inputs(a="one", b="two", c="wrong")
    run(paths[0], output="out/a.box")
    _, objects, err = run(*paths, output="out")
    assert [o["status"] for o in objects] == ["skipped", "done", "failed"]
    assert err.splitlines()[-1] == "1 done, 1 skipped, 1 failed"
    assert run(*paths[:2], output="out", quiet=True)[2] == ""
    assert run(paths[0], output="out")[2] == ""


def test_what_a_format_cannot_hold_is_a_warning_and_again_on_a_rerun(inputs, run):
    paths = inputs(a="lossy odd")
    for status in ("done", "skipped"):
        _, (o,), err = run(*paths, output="a.csv")
        assert (o["status"], o["warnings"]) == (
            status,
            ["is odd", "angles are left out"],
        )
        assert len(err.splitlines()) == 2


def test_quiet_keeps_warnings_back_but_not_errors(inputs, run):
    _, _, err = run(*inputs(a="odd", b="wrong"), output="out", quiet=True)
    assert err == "in/b.txt: is wrong; it should be right\n"


def test_whatever_happens_to_one_input_the_others_are_done(inputs, run):
    paths = inputs(
        a="fine",
        b="wrong",
        c="killed",
        d="exit",
        e="bug",
        f="memory",
        g="full",
        h="ok",
        i="unfit",
    )
    status, objects, err = run(*paths, Path("in/none.txt"), output="out", format=".csv")
    assert status == 1
    said = {Path(o["input"]).stem: o["error"] for o in objects}
    assert list(said) == [*"abcdefghi", "none"]
    assert said["a"] is None
    assert said["h"] is None
    assert "is wrong" in said["b"]
    assert "killed (SIGKILL)" in said["c"]
    assert "ended with status 7" in said["d"]
    assert "internal error" in said["e"]
    assert "ZeroDivisionError: two lines" in said["e"]
    assert "not enough memory" in said["f"]
    assert said["g"] == "out/g.csv: no space left on device"
    assert said["i"] == "out/i.csv: cannot hold this"
    assert said["none"] == "in/none.txt: no such file"
    assert len(err.splitlines()) == 9
    assert "Traceback" not in err
    assert sorted(tree("out")) == [
        "a.csv", "a.csv.made.json", "h.csv", "h.csv.made.json",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["m", "7", "is", "wrong"])
def test_a_file_is_named_whatever_it_is_called(folder, run, name):
    for word, said in [
        ("take", f"{name}: has no rate"),
        ("nowhere", f"{name}: has no rate"),
        ("elsewhere", f"{name}: other.toml line 7: is wrong"),
        ("wrong", f"{name}: is wrong; it should be right"),
        ("part", f"{name} line 7: is wrong"),
    ]:
        Path(name).write_text(word)
        assert run(Path(name), output="out.csv")[1][0]["error"] == said


def test_an_error_of_one_of_several_takes_names_its_file(inputs, capfd):
    batch = Batch(inputs=inputs(a="second", b="two"), output="all.csv")
    many.reduce(Work(command=tally()), batch)
    assert capfd.readouterr().err == "in/b.txt: has no rate\n"


def test_results_depend_neither_on_jobs_nor_on_shards(inputs, run, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    texts = {f"S{i % 2}__t{i}": f"slow 0.0{9 - i} {i}" for i in range(7)}
    paths = inputs(**texts)
    _, one, _ = run(*paths, output="one")
    _, four, _ = run(*paths, output="four", jobs=4)
    shards = [run(*paths, output="parts", shard=f"{i}/3")[1] for i in (1, 2, 3)]
    assert [len(part) for part in shards] == [3, 2, 2]
    assert tree("one") == tree("four") == tree("parts")
    assert sorted(tree("one"))[0] == "S0/t0.box"
    assert (
        [o["input"] for o in one] == [o["input"] for o in four] == list(map(str, paths))
    )
    assert len({o["draw"] for o in one}) == 7


def test_without_a_source_date_only_the_time_in_the_record_differs(inputs, run):
    paths = inputs(a="one two")
    run(*paths, output="one", format=".csv")
    time.sleep(1.1)
    run(*paths, output="two", format=".csv")
    one, two = tree("one"), tree("two")
    assert one["a.csv"] == two["a.csv"]
    differing = [
        (a, b)
        for a, b in zip(
            one["a.csv.made.json"].splitlines(),
            two["a.csv.made.json"].splitlines(),
            strict=True,
        )
        if a != b
    ]
    assert [a.split(b":")[0].strip() for a, _ in differing] == [b'"made"']


@pytest.mark.parametrize("suffix", [".csv", ".box"])
def test_a_rerun_skips_what_it_made_and_touches_it(inputs, run, suffix):
    (path,) = inputs(a="one odd")
    output = Path("out.box").with_suffix(suffix)
    _, (first,), _ = run(path, output=str(output))
    before = output.read_bytes()
    os.utime(output, (1, 1))
    status, (again,), err = run(path, output=str(output))
    assert status == 0
    assert again["status"] == "skipped"
    assert output.stat().st_mtime > time.time() - 60
    assert output.read_bytes() == before
    assert {**again, "status": "done", "seconds": 0} == {**first, "seconds": 0}
    assert "is odd" in err


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"word": "linear"},
        {"given": Whose(mood="good")},
        {"given": Whose(style="plain")},
        {"given": Whose(style="who.box")},
        {"given": Whose(who=(Path("who.box"),))},
        {"files": {"prior": Path("who.box")}},
    ],
    ids=str,
)
def test_a_rerun_that_is_not_the_same_replaces_what_it_made(inputs, folder, change):
    (path,) = inputs(a="one")
    Path("who.box").write_bytes(b"who")
    given = dict(change)
    settings = Settings(word=given.pop("word", "cubic"))
    assert once(path, Batch(), Settings(word="cubic")) == "done"
    assert once(path, Batch(**given), settings) == "done"
    assert once(path, Batch(**given), settings) == "skipped"


@dataclass(frozen=True, kw_only=True)
class Settings:
    word: str


def once(path, batch, settings):
    """Status of doing ``path`` with these settings."""
    batch = replace(batch, inputs=(path,), output="out.csv")
    (task,) = plan.mapping(batch, plan.lines_of(batch), tally())
    return execute(Work.of(tally(), batch, settings), task).status


def test_a_changed_input_is_done_again(inputs, run):
    run(*inputs(a="one"), output="out.csv")
    _, (o,), _ = run(*inputs(a="one two"), output="out.csv")
    assert (o["status"], Path("out.csv").read_text()) == ("done", "ONE TWO")


def test_overwrite_makes_an_output_anew(inputs, run):
    paths = inputs(a="one")
    run(*paths, output="out.csv")
    assert run(*paths, output="out.csv", overwrite=True)[1][0]["status"] == "done"


@pytest.mark.parametrize("name", ["out.csv", "out.box"])
def test_a_file_handclean_did_not_make_is_refused(inputs, run, name):
    paths = inputs(a="one")
    Path(name).write_text("mine")
    before = Path(name).read_bytes()
    status, (o,), _ = run(*paths, output=name)
    assert status == 1
    assert "--overwrite replaces it" in o["error"]
    assert Path(name).read_bytes() == before
    status, (o,), _ = run(*paths, output=name, overwrite=True)
    assert status == 0
    assert o["warnings"] == [f"the {name} that stood there is kept as {name}~"]
    assert Path(f"{name}~").read_bytes() == before
    _, (o,), _ = run(*paths, output=name)
    assert (o["status"], o["warnings"]) == ("skipped", [])


def test_what_was_kept_is_never_lost_to_what_is_kept_next(inputs, run):
    paths = inputs(a="one")
    for text in ("first", "second", "first", "third"):
        Path("out.csv").write_text(text)
        assert run(*paths, output="out.csv", overwrite=True)[0] == 0
        assert Path("out.csv").read_text() == "ONE"
    assert run(*paths, output="out.csv", overwrite=True)[1][0]["warnings"] == []
    kept = {path.name: path.read_text() for path in Path().glob("*~*")}
    assert kept == {"out.csv~": "first", "out.csv~2": "second", "out.csv~3": "third"}


def test_without_hard_links_it_is_kept_all_the_same(inputs, run, monkeypatch):
    def link(source, target):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(os, "link", link)
    Path("out.csv~").write_text("older")
    Path("out.csv").write_text("mine")
    assert run(*inputs(a="one"), output="out.csv", overwrite=True)[0] == 0
    assert Path("out.csv~").read_text() == "older"
    assert Path("out.csv~2").read_text() == "mine"


def test_what_stands_in_the_place_of_a_record_is_kept(inputs, run):
    paths = inputs(a="one")
    beside = Path("out.csv.made.json")
    beside.write_text("mine")
    status, (o,), _ = run(*paths, output="out.csv")
    assert (status, Path("out.csv").exists()) == (1, False)
    assert o["error"].startswith("out.csv.made.json: is there already")
    assert run(*paths, output="out.csv", overwrite=True)[0] == 0
    assert Path("out.csv.made.json~").read_text() == "mine"
    assert run(*paths, output="out.csv")[1][0]["status"] == "skipped"
    beside.write_text("mine")
    assert run(*paths, output="out.csv")[0] == 1
    assert beside.read_text() == "mine"


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize("edited", [False, True])
def test_what_an_input_was_made_from_is_never_replaced(folder, run, overwrite, edited):
    raw, made, again = Path("raw.csv"), Path("made.csv"), Path("again.csv")
    raw.write_text("one")
    Path("way.csv").symlink_to(raw)
    run(raw, output=str(made))
    run(made, output=str(again))
    if edited:
        for path in (made, again):
            path.write_text("edited")
    for path in (raw, Path("way.csv"), Path("none/../raw.csv")):
        for given in (made, again):
            status, (o,), _ = run(given, output=str(path), overwrite=overwrite)
            assert status == 2
            assert o["error"].startswith(f"{path}: is what an input was made from")
    assert sorted(tree(".")) == [
        "again.csv", "again.csv.made.json", "made.csv", "made.csv.made.json",
        "raw.csv", "way.csv",
    ]  # fmt: skip
    assert raw.read_text() == "one"


def test_what_a_file_beside_the_input_was_made_from_is_never_replaced(folder, run):
    for name in ("rom.csv", "take.txt"):
        Path(name).write_text("one")
    run(Path("rom.csv"), output="map.csv")
    given = {"files": {"joint_map": Path("map.csv")}}
    status, (o,), _ = run(Path("take.txt"), output="rom.csv", overwrite=True, **given)
    assert (status, Path("rom.csv").read_text()) == (2, "one")
    assert o["error"].startswith("rom.csv: is what an input was made from")


def test_what_has_the_bytes_of_an_input_but_was_made_of_it_is_replaced(folder, run):
    raw = Path("raw.csv")
    raw.write_text("ONE")
    run(raw, output="mid.csv")
    run(Path("mid.csv"), output="copy.csv")
    assert Path("copy.csv").read_bytes() == raw.read_bytes()
    for given in ({"seed": 1}, {"overwrite": True}):
        status, (o,), _ = run(Path("mid.csv"), output="copy.csv", **given)
        assert (status, o["status"], o["warnings"]) == (0, "done", [])


@pytest.mark.parametrize("overwrite", [False, True])
def test_no_file_is_replaced_by_one_of_another_kind(inputs, run, overwrite):
    paths = inputs(a="one", b="two")
    write_box(Path("S01.box"), "subject", "Ada", [{"command": "learn", "inputs": []}])
    before = Path("S01.box").read_bytes()
    status, (o,), _ = run(paths[0], output="S01.box", overwrite=overwrite)
    assert status == 2
    assert o["error"] == (
        "S01.box: is a subject, which a tally never replaces; "
        "-o should name another place"
    )
    assert tree(".").keys() == {"S01.box", *map(str, paths)}
    assert Path("S01.box").read_bytes() == before


def test_what_appears_while_an_output_is_made_is_not_replaced(inputs, run):
    paths = inputs(a="appears out.csv")
    status, (o,), _ = run(*paths, output="out.csv")
    assert (status, o["error"]) == (1, "out.csv: was made by somebody else meanwhile")
    assert Path("out.csv").read_text() == "theirs"


def test_what_a_killed_run_left_of_an_output_goes(inputs, run, monkeypatch):
    (path,) = inputs(a="one")
    monkeypatch.setattr(staging, "_started", lambda pid: "1")
    for name in ("a.csv", "b.csv"):
        half = staging.temporary(Path("out", name).absolute(), staging.token(), 0)
        half.write_text("half")
    monkeypatch.undo()
    os.chdir(half.parent)
    assert run(path, output="out", format=".csv")[0] == 0
    assert [p.name for p in Path().glob(".handclean*")] == [half.name]


def test_an_output_that_was_edited_is_no_longer_handcleans(inputs, run):
    paths = inputs(a="one")
    run(*paths, output="out.csv")
    Path("out.csv").write_text("edited by hand")
    status, _, _ = run(*paths, output="out.csv")
    assert status == 1
    assert Path("out.csv").read_text() == "edited by hand"


def test_what_carries_its_record_and_was_edited_is_no_longer_handcleans(inputs, run):
    paths = inputs(a="one")
    output = Path("out.box")
    run(*paths, output=str(output))
    output.write_text(output.read_text().replace('"one"', '"two"'))
    before = output.read_bytes()
    for seed in (0, 1):
        status, (o,), _ = run(*paths, output=str(output), seed=seed)
        assert status == 1
        assert "--overwrite replaces it" in o["error"]
    assert output.read_bytes() == before
    assert run(*paths, output=str(output), overwrite=True)[0] == 0
    assert run(*paths, output=str(output))[1][0]["status"] == "skipped"


def test_what_cannot_tell_whether_it_was_edited_is_made_anew(inputs, run):
    paths = inputs(a="one")
    run(*paths, output="out.box")
    held = opened(Path("out.box"))
    del held["sha256"]
    Path("out.box").write_text(json.dumps(held))
    assert run(*paths, output="out.box")[1][0]["status"] == "done"
    assert run(*paths, output="out.box")[1][0]["status"] == "skipped"


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo], ids=["folder", "pipe"])
def test_an_output_that_is_no_file_is_refused(inputs, run, make):
    inputs(a="one")
    make("taken.csv")
    Path("list.csv").write_text("input,output\nin/a.txt,taken.csv\n")
    status, (o,), _ = run(manifest="list.csv", overwrite=True)
    assert status == 1
    assert o["error"] == "taken.csv: is not a file; name one that can be written"


def test_a_failing_input_makes_no_folder(inputs, run):
    status, _, _ = run(*inputs(a="full"), output="new/deep/out.csv")
    assert status == 1
    assert not Path("new").exists()
    assert list(Path().glob(".handclean*")) == []


def test_an_output_behind_a_link_goes_where_the_link_leads(inputs, run):
    Path("real").mkdir()
    Path("out.csv").symlink_to("real/out.csv")
    assert run(*inputs(a="one"), output="out.csv")[0] == 0
    assert Path("out.csv").is_symlink()
    assert Path("real/out.csv").read_text() == "ONE"
    assert run(*inputs(a="one"), output="out.csv")[1][0]["status"] == "skipped"


def test_fail_fast_begins_nothing_more_but_hides_nothing(inputs, run):
    paths = inputs(a="one", b="wrong", c="one", d="one")
    status, objects, _ = run(*paths, output="out", fail_fast=True, failed=Path("f.csv"))
    assert status == 1
    assert [o["status"] for o in objects] == ["done", "failed", "failed", "failed"]
    assert "not begun" in objects[2]["error"]
    rows = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert [row["input"] for row in rows] == [str(path) for path in paths[1:]]
    assert sorted(tree("out")) == ["a.box"]


@pytest.mark.parametrize("fail_fast", [False, True])
def test_when_every_input_fails_by_wrong_usage_the_status_is_2(inputs, run, fail_fast):
    paths = inputs(a="misused", b="misused", c="misused")
    assert run(*paths, output="out", fail_fast=fail_fast)[0] == 2
    paths = inputs(a="misused", b="wrong")
    assert run(*paths, output="out")[0] == 1
    paths = inputs(a="misused", b="one")
    assert run(*paths, output="out")[0] == 1


def refuse(number):
    def go(*arguments, **options):
        raise OSError(number, os.strerror(number), str(arguments[0]))

    return go


@pytest.mark.parametrize(
    ("what", "number", "said"),
    [
        ((os, "replace"), errno.EROFS, "read-only file system"),
        ((os, "fsync"), errno.ENOSPC, "no space left on device"),
        ((records, "write_sidecar"), errno.ENOSPC, "no space left on device"),
        ((Path, "mkdir"), errno.EACCES, "permission denied"),
    ],
    ids=lambda value: str(value),
)
def test_what_hinders_an_output_names_it_and_leaves_nothing(
    inputs, run, monkeypatch, what, number, said
):
    paths = inputs(a="one")
    monkeypatch.setattr(*what, refuse(number))
    status, (o,), err = run(*paths, output="new/out.csv")
    assert (status, o["error"], err) == (1, f"new/out.csv: {said}", f"{o['error']}\n")
    left = [path.name for path in Path().rglob("*") if path.is_file()]
    assert [name for name in left if "out" in name or "handclean" in name] == []


def test_an_output_below_a_file_is_refused_in_its_own_name(inputs, run):
    (path,) = inputs(a="one")
    for suffix in (".csv", ".box"):
        output = f"{path}/out{suffix}"
        Path("list.csv").write_text(f"input,output\n{path},{output}\n")
        status, (o,), _ = run(manifest="list.csv")
        assert status == 1
        assert o["error"] == f"{output}: cannot be written: not a directory"


@pytest.mark.parametrize("suffix", [".csv", ".box"])
def test_a_limit_of_a_files_size_names_the_output(inputs, run, suffix):
    (path,) = inputs(a="x" * 100_000)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        status, (o,), _ = run(path, output=f"out{suffix}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert status == 1
    assert o["error"].startswith(f"out{suffix}: ")
    assert "file too large" in o["error"]
    assert sorted(tree(".")) == ["in/a.txt"]


def test_the_list_of_failed_inputs_is_a_manifest_that_puts_them_in_place(inputs, run):
    paths = inputs(S01__a="one", S02__a="wrong", S02__b="one")
    failed = Path("failed.csv")
    run(*paths, output="out", failed=failed, given=Whose(mood="good"))
    assert failed.read_text() == (
        "input,output,who,style,mood,reason\n"
        "in/S02/a.txt,out/S02/a.box,,,,in/S02/a.txt: is wrong; it should be right\n"
    )
    inputs(S02__a="right now")
    given = {"given": Whose(), "manifest": "failed.csv"}
    status, objects, _ = run(failed=failed, **given)
    assert status == 0
    assert [o["output"] for o in objects] == ["out/S02/a.box"]
    assert failed.read_text() == "input,output,who,style,mood,reason\n"
    said = "failed.csv: the manifest lists no takes\n"
    assert run(**given) == (0, [], said)
    assert run(quiet=True, **given) == (0, [], "")


def test_the_list_of_failed_inputs_replaces_one_that_gave_no_reasons(inputs, run):
    listed = Path("f.csv")
    listed.write_text("input,output,who,style,mood\na.txt,a.box,,,\n")
    run(*inputs(a="wrong"), given=Whose(), output="out", failed=listed)
    assert listed.read_text().startswith("input,output,who,style,mood,reason\n")


def test_a_reason_is_one_line(inputs, run):
    run(*inputs(a="wicked", b="one"), output="out", failed=Path("f.csv"))
    (row,) = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert row["reason"].startswith(r"in/a.txt: \x1b]0;title")


def test_what_is_rated_to_be_left_out_is_not_done_and_moves_nothing(inputs, run):
    inputs(S01__a="one", S01__b="two", S02__c="three", S03__d="one")
    Path("l.csv").write_text(
        "input,rating\nin/S01/a.txt,\nin/S02/c.txt,exclude\nin/S01/b.txt,good\n"
    )
    _, objects, _ = run(manifest="l.csv", output="out")
    assert [o["output"] for o in objects] == ["out/S01/a.box", "out/S01/b.box"]
    _, objects, _ = run(manifest="l.csv", output="out", shard="2/2")
    assert [o["output"] for o in objects] == ["out/S01/b.box"]
    Path("l.csv").write_text("input,rating\nin/S01/a.txt,exclude\n")
    assert run(manifest="l.csv", output="out")[:2] == (0, [])
    batch = Batch(inputs=(Path("in/S03/d.txt"),), manifest="l.csv", output="all.box")
    assert many.reduce(Work(command=tally()), batch) == 0
    assert opened(Path("all.box"))["text"] == "one"


def told(objects):
    return "".join(json.dumps(o) + "\n" for o in objects)


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_one_command_told_is_the_manifest_of_another(inputs, run, jobs):
    paths = inputs(a="one", b="wrong", c="one two")
    _, objects, _ = run(*paths, output="first", format=".csv")
    Path("told.jsonl").write_text(told(objects))
    again = {"manifest": "told.jsonl", "failed": Path("f.csv"), "jobs": jobs}
    status, objects, err = run(output="second", **again)
    assert status == 1
    assert [(o["input"], o["output"], o["status"]) for o in objects] == [
        ("first/a.csv", "second/a.box", "done"),
        ("first/b.csv", "second/b.box", "failed"),
        ("first/c.csv", "second/c.box", "done"),
    ]
    assert objects[1]["error"] == (
        "first/b.csv: was not made, as an earlier command failed: "
        "in/b.txt: is wrong; it should be right"
    )
    assert err.splitlines()[0] == objects[1]["error"]
    rows = csv.DictReader(Path("f.csv").read_text().splitlines())
    assert [row["input"] for row in rows] == ["first/b.csv"]


def test_an_input_that_a_pattern_finds_nothing_for_fails_alone(inputs, run):
    paths = inputs(S01__a="one", S02__a="one")
    Path("in/S01/who.raw").write_text("Ada")
    status, objects, _ = run(*paths, output="out", given=Whose(who_for="who.raw"))
    assert (status, [o["status"] for o in objects]) == (1, ["done", "failed"])
    assert objects[1]["error"] == "in/S02/a.txt: there is no in/S02/who.raw"
    status, _, _ = run(paths[1], output="x.box", given=Whose(who_for="who.raw"))
    assert status == 2
    whose = Whose(who=(Path("in/S01/who.raw"),))
    _, (o,), _ = run(paths[0], output="out/S01/a.box", given=whose)
    assert o["status"] == "skipped"  # the record is that of the subject found


@pytest.mark.parametrize("text", ["mine", "input,who\na.raw,S01.box\n", "a.raw\n"])
def test_the_list_of_failed_inputs_replaces_only_an_older_one(inputs, run, text):
    paths = inputs(a="wrong")
    listed = Path("f.csv")
    listed.write_text(text)
    with pytest.raises(UsageError, match=r"f\.csv: is there already and no list of"):
        run(*paths, given=Whose(), output="out", failed=listed)
    assert listed.read_text() == text
    _, _, err = run(*paths, given=Whose(), output="out", failed=listed, overwrite=True)
    assert "--failed: the f.csv that stood there is kept as f.csv~\n" in err
    assert Path("f.csv~").read_text() == text
    assert listed.read_text().startswith("input,output,")
    run(*paths, given=Whose(), output="out", failed=listed)
    listed.write_text("")
    run(*paths, given=Whose(), output="out", failed=listed)
    assert len(list(Path().glob("f.csv*"))) == 2


def test_the_list_of_failed_inputs_never_replaces_a_list_of_inputs(inputs, run):
    inputs(a="wrong")
    for text in ("in/a.txt\n", "input,mood\nin/a.txt,good\n"):
        Path("list.csv").write_text(text)
        for overwrite in (False, True):
            given = {"failed": Path("list.csv"), "overwrite": overwrite}
            given["given"] = Whose()
            with pytest.raises(UsageError, match="also an input"):
                run(manifest="list.csv", output="out", **given)
        assert Path("list.csv").read_text() == text


def test_a_requirement_that_is_not_met_exits_3(inputs, run):
    paths = inputs(a="one", b="one two")
    status, objects, err = run(*paths, output="out", require=("words<=1", "words > 0"))
    assert status == 3
    assert len(objects) == 2
    assert err == "in/b.txt: words is 2, required <= 1\n2 done\n"
    assert run(*paths, output="out", require=("words<=1",))[0] == 3, (
        "skipped counts too"
    )
    assert run(*paths, output="out", require=("words<=2",))[0] == 0
    assert run(*paths, output="out", require=("gap<=2",))[0] == 3, "unknown is not met"


def test_a_failure_outranks_a_requirement(inputs, run):
    paths = inputs(a="one two", b="wrong")
    assert run(*paths, output="out", require=("words<=1",))[0] == 1


def test_a_requirement_on_no_figure_is_refused_before_anything_is_done(inputs, run):
    with pytest.raises(
        UsageError, match="no figure is called 'word'; did you mean words"
    ):
        run(*inputs(a="one"), output="out", require=("word<=1",))
    assert not Path("out").exists()


def test_what_a_step_prints_does_not_meet_the_results(inputs, run):
    paths = inputs(a="prints", b="prints")
    status, objects, err = run(*paths, output="out", jobs=2)
    assert status == 0
    assert len(objects) == 2
    assert err == "noisenoise2 done\n"


def test_a_step_without_outputs_writes_none(inputs, run):
    status, (o,), _ = run(*inputs(a="one"), settings="print", command=tally(()))
    assert (status, o["output"], o["words"]) == (0, None, 1)
    assert sorted(tree(".")) == ["in/a.txt"]


def test_reducing_gives_one_output_for_all(inputs, capfd):
    paths = inputs(a="one", b="two words")
    batch = Batch(inputs=paths, output="all.csv")
    work = Work(command=tally())
    assert many.reduce(work, batch) == 0
    assert capfd.readouterr().out == "in/a.txt, in/b.txt -> all.csv: 3 words\n"
    assert Path("all.csv").read_text() == "ONE TWO WORDS"
    assert many.reduce(work, batch) == 0
    assert "skipped" in capfd.readouterr().out
    inputs(b="two more words")
    assert many.reduce(work, batch) == 0
    assert "skipped" not in capfd.readouterr().out


def test_a_warning_about_several_inputs_is_about_their_output(inputs, capfd):
    batch = Batch(inputs=inputs(a="odd", b="two"), output="all.csv")
    many.reduce(Work(command=tally()), batch)
    assert capfd.readouterr().err == "all.csv: warning: is odd\n"


def test_jobs_default_to_what_slurm_grants(inputs, run, monkeypatch):
    paths = inputs(a="slow 0.5", b="slow 0.5")
    monkeypatch.setenv("SLURM_CPUS_PER_TASK", "many")
    with pytest.raises(UsageError, match="SLURM_CPUS_PER_TASK"):
        run(*paths, output="out")
    monkeypatch.setenv("SLURM_CPUS_PER_TASK", "2")
    assert run(*paths, output="out")[0] == 0


def test_a_shard_without_a_take_says_so(inputs, run):
    assert run(*inputs(a="one"), output="out", shard="2/2")[::2] == (
        0,
        "inputs: none is left for shard 2/2\n",
    )


def test_an_output_of_other_code_is_made_anew(inputs, run, monkeypatch):
    paths = inputs(a="one")
    run(*paths, output="out.csv")
    assert run(*paths, output="out.csv")[1][0]["status"] == "skipped"
    monkeypatch.setattr(provenance, "code", lambda: "another")
    assert run(*paths, output="out.csv")[1][0]["status"] == "done"
    assert run(*paths, output="out.csv")[1][0]["status"] == "skipped"


@pytest.fixture
def full(folder, monkeypatch):
    """A file on a disk that has no room left."""
    write_bytes = Path.write_bytes

    def write(path, data):
        if path.name.startswith(".handclean-"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return write_bytes(path, data)

    monkeypatch.setattr(Path, "write_bytes", write)
    return Path("full.csv")


@pytest.mark.parametrize(("text", "status"), [("one", 1), ("wrong", 1)])
def test_a_list_of_failed_inputs_that_cannot_be_written_is_one_line(
    inputs, run, full, text, status
):
    found, (o,), err = run(*inputs(a=text), output="out", failed=full)
    assert found == status
    assert err.splitlines()[-1] == (
        "--failed full.csv: cannot be written: no space left on device"
    )
    assert o["status"] == ("done" if text == "one" else "failed")
    assert [path for path in Path().iterdir() if path.suffix == ".csv"] == []


def wrong(batch, tasks):
    raise UsageError(f"is none of {len(tasks)} inputs", where=batch.given.who[0])


def test_what_a_commands_check_finds_is_told_before_anything_is_done(inputs, run):
    given = Whose(who=(Path("who.box"),))
    with pytest.raises(UsageError, match=r"^who\.box: is none of 2 inputs$"):
        run(
            *inputs(a="one", b="one"),
            output="out",
            given=given,
            command=tally(check=wrong),
        )
    assert not Path("out").exists()


def test_a_place_for_another_kind_is_found_before_the_work_is_done(inputs, run):
    write_box(Path("S01.box"), "subject", "Ada", [])
    (path,) = inputs(a="bug")
    command = tally(makes={".box": "tally"})
    _, (o,), _ = run(path, output="S01.box", overwrite=True, command=command)
    assert o["error"].startswith("S01.box: is a subject, which a tally never replaces")


def test_what_is_wrong_with_a_row_of_a_manifest_names_its_take_and_its_line(
    inputs, run
):
    inputs(a="one", b="one", c="unsaid")
    Path("l.csv").write_text("input,who\nin/a.txt,\nin/b.txt,none.box\nin/c.txt,\n")
    status, objects, _ = run(manifest="l.csv", output="out", given=Whose())
    assert status == 1
    assert [o["error"] for o in objects] == [
        None,
        "in/b.txt: none.box: no such file (l.csv, line 3)",
        "in/c.txt: --who: is missing (l.csv, line 4)",
    ]


@pytest.mark.parametrize("word", ["one", "wrong"])
def test_what_is_noted_of_damaged_files_is_told_whether_the_step_fails_or_not(
    inputs, run, word
):
    _, (o,), _ = run(*inputs(damaged=word), output="out")
    assert o["warnings"] == ["damaged.txt is damaged"]


@pytest.mark.parametrize("suffixes", [(".csv", ".box"), ()], ids=["writes", "tells"])
def test_a_folder_and_a_pattern_are_told_what_they_are(folder, run, suffixes):
    Path("raw").mkdir()
    for name in ("a.cut", "b.cut", "c.raw", "d.txt"):
        Path("raw", name).touch()
    Path("none").mkdir()
    given = [Path("raw"), Path("none"), Path("raw/*.csv"), Path("ra?/*.cut")]
    settings = None if suffixes else "print"
    command = tally(suffixes)
    status, objects, _ = run(*given, output="out", command=command, settings=settings)
    assert status == 1
    assert [o["error"] for o in objects] == [
        "raw: is a folder; give its files, such as raw/*.cut",
        "none: is a folder; give its files, such as none/*.raw",
        "raw/*.csv: no such file; as a pattern it matches none either",
        "ra?/*.cut: no such file; without quotes it is the 2 files that match it",
    ]


def test_the_list_of_failed_inputs_never_overwrites_an_input(inputs, run):
    paths = inputs(a="one")
    with pytest.raises(UsageError, match="also an input"):
        run(*paths, output="out", failed=paths[0])
    with pytest.raises(UsageError, match="--failed should name a file"):
        run(*paths, output="out", failed=Path("none/failed.csv"))
