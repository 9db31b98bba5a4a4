"""Lists of inputs, shards, and the failed ones as a new list."""

import io
import json
import os
import signal
import sys
import threading
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import UsageError
from handclean.runner import interrupts, manifest
from handclean.runner.interrupts import Interrupted
from handclean.runner.manifest import Line

COLUMNS = ("subject", "side")


@pytest.fixture
def read(tmp_path):
    def go(content):
        path = tmp_path / "list.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return manifest.read(str(path), COLUMNS)

    return go


def names(lines):
    return [str(line.input) for line in lines]


def test_a_plain_list_has_a_path_per_line(read):
    assert names(read("a.c3d\nb c, d.c3d\r\n\n ü.c3d \n")) == [
        "a.c3d",
        "b c, d.c3d",
        " ü.c3d ",
    ]


def test_a_header_makes_it_a_table(read):
    lines = read('\ufeffside,input\r\nleft,"a, b.c3d"\r\n,c.c3d\r\n\r\n')
    assert lines == (
        Line(input=Path("a, b.c3d"), cells={"side": "left"}),
        Line(input=Path("c.c3d")),
    )


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_may_end_in_any_way(read, end):
    lines = [line.input for line in read(f"input,side{end}a.c3d,left{end}b.c3d,{end}")]
    assert lines == [Path("a.c3d"), Path("b.c3d")]
    lines = [line.input for line in read(f"a.c3d{end}b.c3d{end}")]
    assert lines == [Path("a.c3d"), Path("b.c3d")]


@pytest.mark.parametrize("first", ["a\rb,c", "input\r,x", "x" * 200_000 + ",y"])
def test_a_first_line_that_is_no_csv_is_a_mistake(read, first):
    with pytest.raises(UsageError, match="is not CSV"):
        read(f"{first}\nb.c3d\n")


def test_columns_may_be_separated_by_tabs(read):
    assert read('side\tinput\r\nleft\ta, b.c3d\r\n\t"c\td"\n') == (
        Line(input=Path("a, b.c3d"), cells={"side": "left"}),
        Line(input=Path("c\td")),
    )


def test_what_another_command_told_names_inputs_by_its_outputs(read):
    told = [
        {"input": "a.c3d", "output": "a.h5", "status": "done", "side": "left"},
        {"status": "skipped", "output": ["b ü.h5", "b.truth.h5"], "error": None},
        {"status": "failed", "output": "c.h5", "error": "c.c3d: is wrong"},
    ]
    lines = read("\n".join(map(json.dumps, told)) + "\n\n")
    assert lines == (
        Line(input=Path("a.h5")),
        Line(input=Path("b ü.h5")),
        Line(input=Path("c.h5"), failed="c.c3d: is wrong"),
    )
    assert lines[2].at.endswith("list.csv, line 3")


def test_a_path_may_begin_with_a_brace(read):
    assert names(read("{a}.c3d\nb.c3d\n")) == ["{a}.c3d", "b.c3d"]


def test_a_reason_and_a_rating_may_stand_there(read):
    lines = read("input,reason,rating\na,was wrong,\nb,,exclude\nc,,good\n")
    assert [(line.reason, line.excluded, line.cells) for line in lines] == [
        ("was wrong", False, {}),
        ("", True, {}),
        ("", False, {}),
    ]


def test_a_table_without_lines_is_no_mistake(read):
    assert read("input,output\n") == ()


def test_a_path_that_is_no_utf8_is_kept(read):
    (line,) = read(b"input\n\xff\xe4.c3d\n")
    assert os.fsencode(line.input) == b"\xff\xe4.c3d"


def test_a_dash_is_stdin(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"a.c3d\n")))
    assert names(manifest.read("-", COLUMNS)) == ["a.c3d"]


@pytest.mark.parametrize("end", ["\n", "\r"])
def test_a_manifest_may_have_so_many_lines_and_bytes(read, monkeypatch, end):
    monkeypatch.setattr(manifest, "MOST_LINES", 100)
    assert len(read(f"x.c3d{end}" * 100)) == 100
    says = "has more than 100 lines or 100 MB; it should be parted into several"
    with pytest.raises(UsageError, match=says) as caught:
        read(f"x.c3d{end}" * 101)
    assert caught.value.exit_status == 2
    monkeypatch.setattr(manifest, "MOST_BYTES", 2_000_000)
    long = "x" * 39_999 + end
    assert len(read(long * 50)) == 50
    with pytest.raises(UsageError, match="has more than 100 lines or 2 MB"):
        read(long * 50 + "x")


@pytest.mark.parametrize("feed", [b"x.c3d\n", b"input\nx", b"x" * 4000, b"\0"])
@pytest.mark.parametrize("stdin", [True, False], ids=["stdin", "pipe"])
def test_a_manifest_without_an_end_is_refused(feed, stdin, monkeypatch):
    reading, writing = os.pipe()
    feeder = threading.Thread(target=pour, args=(writing, feed * 10_000))
    feeder.start()
    try:
        with open(reading, "rb") as stream:
            if stdin:
                monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=stream))
            with pytest.raises(UsageError, match=r"has more than|is not text"):
                manifest.read("-" if stdin else f"/dev/fd/{reading}", COLUMNS)
    finally:
        feeder.join()


def pour(descriptor, chunk):
    """Write the same again and again until nobody reads it any more."""
    with suppress(BrokenPipeError), open(descriptor, "wb", buffering=0) as stream:
        while True:
            stream.write(chunk)


def test_a_signal_ends_a_list_that_goes_on(monkeypatch):
    """Also where it comes between two reads, so that it breaks off neither."""
    reading, writing = os.pipe()
    begun, ended = threading.Event(), threading.Event()
    in_time = []

    def read1(size):
        begun.set()
        return stream.read1(size)

    def feed():
        begun.wait(20.0)
        os.write(writing, b"a.c3d\n")
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)
        os.write(writing, b"b.c3d\n")
        in_time.append(ended.wait(20.0))
        os.close(writing)

    feeder = threading.Thread(target=feed)
    with open(reading, "rb") as stream:
        listed = SimpleNamespace(read1=read1)
        monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=listed))
        feeder.start()
        with interrupts.raising(), pytest.raises(Interrupted):
            manifest.read("-", COLUMNS)
        ended.set()
        feeder.join()
    assert in_time == [True]


def test_a_signal_that_was_swallowed_ends_a_list(read, monkeypatch):
    with interrupts.raising():
        with suppress(Interrupted):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Interrupted):
            read("a.c3d\n")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is empty"),
        ("\n \n", "is empty"),
        ("input;side\na;left\n", "separated by commas"),
        ("input\tsid\na\tleft\n", "no column is called 'sid'; did you mean side?"),
        ("inptu\tside\na\tleft\n", "no column is called 'inptu'"),
        ("input\tside\na\n", "line 2: has 1 cells; it should have 2"),
        ('{"status": "done", "output": "a"}\n{"sta', "line 2: is no JSON object of a"),
        ('{"a": 1}\n', "line 1: is no JSON object of a command"),
        ('{"status": "done", "output": null}', "line 1: names no output"),
        ('{"status": "done", "output": []}', "line 1: names no output"),
        ("{\n", "line 1: is no JSON object"),
        ("input,sid\na,left\n", "no column is called 'sid'; did you mean side?"),
        ("inptu,output\na,b\n", "no column is called 'inptu'; did you mean input?"),
        ("Input,Output\na,b\n", "no column is called 'Input'; did you mean input?"),
        ("subject,output\na,b\n", "has no column 'input'"),
        ("input,input\na,b\n", "should appear once"),
        ("input,side\na\n", "line 2: has 1 cells; it should have 2"),
        ("input,side\n,left\n", "line 2: should name an input"),
        ('input\n"a\n' + "x" * 200_000, "is not CSV"),
        (b"a\0b", "is not text"),
    ],
)
def test_a_mistake_is_one_line_that_names_the_manifest(read, content, message):
    with pytest.raises(UsageError) as caught:
        read(content)
    assert message in str(caught.value)
    assert "list.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_manifest_that_cannot_be_read_is_a_usage_error(tmp_path):
    for path in (tmp_path, tmp_path / "none"):
        with pytest.raises(UsageError, match=str(path)):
            manifest.read(str(path), COLUMNS)


@given(count=st.integers(0, 30), parts=st.integers(1, 12))
def test_shards_are_all_of_it_and_never_overlap(count, parts):
    shards = [manifest.shard(range(count), f"{i}/{parts}") for i in range(1, parts + 1)]
    assert sorted(item for part in shards for item in part) == list(range(count))
    assert [list(part)[:1] for part in shards] == [
        [i] if i < count else [] for i in range(parts)
    ]


@pytest.mark.parametrize(
    "which", ["0/3", "4/3", "1", "a/b", "1/0", "-1/3", "1/3/5", "²/3"]
)
def test_a_shard_that_is_none_is_refused(which):
    with pytest.raises(UsageError, match="--shard should be I/N"):
        manifest.shard([1, 2, 3], which)


text = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1)
paths = text.map(Path)


@given(
    lines=st.lists(
        st.builds(
            Line,
            input=paths.filter(lambda path: str(path) != "input"),
            output=text,
            cells=st.dictionaries(st.sampled_from(COLUMNS), text),
            reason=text,
        )
    )
)
def test_lines_written_read_back_the_same(tmp_path_factory, lines):
    path = tmp_path_factory.getbasetemp() / "lines.csv"
    path.write_bytes(os.fsencode(manifest.to_csv(lines, COLUMNS)))
    assert list(manifest.read(str(path), COLUMNS)) == lines
