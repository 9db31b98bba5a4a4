"""Lists of inputs, shards, and the failed ones as a new list."""

import io
import os
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import UsageError
from handclean.pipeline import manifest
from handclean.pipeline.manifest import Line


@pytest.fixture
def read(tmp_path):
    def go(content):
        path = tmp_path / "list.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return manifest.read(str(path))

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
        Line(input=Path("a, b.c3d"), side="left"),
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


def test_a_table_without_lines_is_no_mistake(read):
    assert read("input,output\n") == ()


def test_a_path_that_is_no_utf8_is_kept(read):
    (line,) = read(b"input\n\xff\xe4.c3d\n")
    assert os.fsencode(line.input) == b"\xff\xe4.c3d"


def test_a_dash_is_stdin(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"a.c3d\n")))
    assert names(manifest.read("-")) == ["a.c3d"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "is empty"),
        ("\n \n", "is empty"),
        ("input;side\na;left\n", "separated by commas"),
        ("input\tside\na\tleft\n", "separated by commas"),
        ("input,sid\na,left\n", "no column is called 'sid'; did you mean side?"),
        ("inptu,output\na,b\n", "no column is called 'inptu'; did you mean input?"),
        ("Input,Output\na,b\n", "no column is called 'Input'; did you mean input?"),
        ("subject,output\na,b\n", "has no column 'input'"),
        ("input,input\na,b\n", "should appear once"),
        ("input,side\na\n", "line 2: has 1 cells; it should have 2"),
        ("input,side\na,links\n", "side should be left, right or both, not 'links'"),
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
            manifest.read(str(path))


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
            subjects=st.lists(
                paths.filter(lambda path: ";" not in str(path)), max_size=2
            ).map(tuple),
            marker_set=text,
            side=st.sampled_from(["", *manifest.SIDES]),
        )
    )
)
def test_lines_written_read_back_the_same(tmp_path_factory, lines):
    path = tmp_path_factory.getbasetemp() / "lines.csv"
    path.write_bytes(os.fsencode(manifest.to_csv(lines)))
    assert list(manifest.read(str(path))) == lines
