"""TOML is read within bounds: any text is a document or one line, soon.

Getters refuse what is missing, of the wrong kind or out of bounds.
"""

import time
import tomllib
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean import config
from handclean.errors import FileError, HandcleanError
from handclean.glove.definitions import load_glove
from handclean.glove.hands import load_hand
from handclean.glove.poses import key_poses
from handclean.hand.marker_set import load_marker_set
from handclean.hand.skeleton import load_skeleton
from handclean.io.gltf.skinned_map import load_skinned_map
from handclean.io.landmarks import read_landmarks
from handclean.io.shared.joint_map import load_joint_map
from handclean.simulation.scenarios import find_scenario
from handclean.tomlfile import MOST_ROWS, Table, read_toml
from handclean.tomltext import (
    DEEPEST,
    MOST_BYTES,
    MOST_TABLES,
    key_of,
    parse_toml,
    quoted,
)

PROJECT = Path(__file__).parents[1]
READERS = {
    "config": lambda path: config.check(path, {}),
    "marker set": load_marker_set,
    "subject": load_skeleton,
    "landmarks": lambda path: read_landmarks(path, "mm"),
    "joint map": load_joint_map,
    "skinned map": lambda path: load_skinned_map(str(path)),
    "glove": load_glove,
    "hand of gloves": load_hand,
    "key poses": key_poses,
    "scenario": find_scenario,
}
BOMBS = {
    "arrays": "a = " + "[" * 500 + "]" * 500,
    "tables": "a = " + "{b = " * 500 + "1" + "}" * 500,
    "a million arrays": "a = " + "[" * 1_000_000,
    "digits": "a = " + "1" * 100_000,
    "digits of another base": "a = 0x" + "f" * 100_000,
    "beyond 64 bits": f"a = {2**63}",
    "a key's parts": "a" + ".a" * 20_000 + " = 1",
    "quoted parts": '"a"' + " . 'a'" * 20_000 + " = 1",
    "a table's parts": "[a" + ".a" * 20_000 + "]",
    "parts inside": "x = [{y = 1, a" + ".a" * 20_000 + " = 1}]",
    "many tables": "\n".join(f"[a{n}]" for n in range(100_000)),
    "many keys with parts": "\n".join(f"a{n}.b.c.d.e.f=1" for n in range(50_000)),
    "too long": "# " + "x" * MOST_BYTES,
    "texts without an end": "a = " + '"""\\' * 300_000,
    "texts that end nowhere": "a = " + "'''x" * 300_001,
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("bomb", BOMBS)
def test_no_reader_spends_much_on_what_no_such_file_holds(tmp_path, kind, bomb):
    path = tmp_path / "a.toml"
    path.write_text(BOMBS[bomb])
    began = time.process_time()
    with pytest.raises(HandcleanError) as caught:
        READERS[kind](path)
    assert time.process_time() - began < 2.0
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value)) < len(str(path)) + 300
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", READERS)
def test_every_reader_says_what_a_file_is_that_is_not_toml(tmp_path, kind):
    path = tmp_path / "a.toml"
    with pytest.raises(HandcleanError, match="no such file"):
        READERS[kind](path)
    path.write_bytes(b"a = '\xff\xfe\x00'")
    with pytest.raises(HandcleanError, match="is not text; it should be TOML"):
        READERS[kind](path)
    path.write_text("a = ")
    with pytest.raises(HandcleanError, match="Invalid value"):
        READERS[kind](path)
    path.unlink()
    path.mkdir()
    with pytest.raises(HandcleanError, match="cannot be read"):
        READERS[kind](path)


OURS = [*PROJECT.glob("handclean/data/**/*.toml"), *PROJECT.glob("configs/*.toml")]


@pytest.mark.parametrize("path", sorted(OURS), ids=lambda path: path.name)
def test_files_of_ours_are_read_as_they_are(path):
    assert read_toml(path, "not TOML") == tomllib.loads(path.read_text("utf-8"))


def test_no_other_module_parses_toml():
    package = PROJECT / "handclean"
    those = [p for p in package.rglob("*.py") if "tomllib" in p.read_text("utf-8")]
    assert those == [package / "tomltext.py"]


LEGAL = [
    "# [[[[[ a.b.c",
    r"""a.b."c.d".'e.f' = [[1, 2.5], [{x.y = "}}]]", z = '[['}], ["a\"b", 'c"d']]""",
    'other = "x#y" # "not closed',
    "[t.u]",
    "when = 1979-05-27T07:32:00.5Z",
    "lines = QQQ\n" + "[" * 99 + "\nQQQ",
    "text = QQQit's ''fine''" + "[" * 99 + "QQQQ",
    'doubled = """' + "[" * 99 + r'\"""[ ""[ """""',
    "rows = [\n  {a.b = [1.5]},\n  {a.c = [-2.5]}, # [\n]",
    "big = 9223372036854775807",
]


def test_marks_in_texts_and_comments_count_for_nothing():
    text = "\n".join(LEGAL).replace("Q", "'")
    document = parse_toml("a", text, "not TOML")
    assert document == tomllib.loads(text)
    assert document["t"]["u"]["text"].endswith("[[['")


@given(
    parts=st.integers(1, 2 * DEEPEST),
    head=st.sampled_from(["[{}]", "[[{}]]", "{} = 1", "x = {{ {} = 1 }}"]),
)
def test_a_key_has_as_many_parts_as_are_allowed(parts, head):
    text = head.format(".".join("a" * parts))
    if parts <= DEEPEST:
        assert parse_toml("a", text, "no") == tomllib.loads(text)
    else:
        with pytest.raises(FileError, match=f"a: no: line 1: .*{DEEPEST} parts"):
            parse_toml("a", text, "no")


@given(text=st.text("ab.[]{}=,'\"\\\n#1 ", max_size=60))
def test_what_is_refused_without_bombs_tomllib_refuses_too(text):
    try:
        expected = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        with pytest.raises(FileError):
            parse_toml("a", text, "no")
    else:
        assert parse_toml("a", text, "no") == expected


def test_the_largest_file_that_is_read_costs_little():
    rows = "".join(f"[[marker]]\nlabel='{n}'\n" for n in range(MOST_TABLES))
    text = (rows + "# \n" * MOST_BYTES)[:MOST_BYTES]
    tracemalloc.start()
    began = time.process_time()
    document = parse_toml("a", text, "no")
    spent, peak = time.process_time() - began, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(document["marker"]) == MOST_TABLES
    assert spent < 20.0  # memory that is traced costs time
    assert peak < 50e6 + 20 * len(text)


GOOD = """
name = "n"
empty = ""
words = ["a", "b"]
kind = "rigid"
yes = true
whole = 3
half = 0.5
place = [1, 2.5, -3]
[table]
a = 1
[[row]]
x = 1
[[row]]
x = 2
"""


@pytest.fixture
def table():
    return Table(Path("a.toml"), parse_toml("a.toml", GOOD, "not TOML"))


def test_getters_return_what_is_there_or_the_default(table):
    assert table.name("name") == "n"
    assert (table.text("empty", "x"), table.text("none", "x")) == ("", "x")
    assert (table.texts("words"), table.texts("none")) == (("a", "b"), ())
    assert table.word("kind", ("hand", "rigid")) == "rigid"
    assert table.word("none", ("hand", "rigid"), "") == ""
    assert table.flag("yes", False) is True
    assert table.flag("none", False) is False
    assert (table.number("whole"), table.number("none", 2.0)) == (3.0, 2.0)
    assert isinstance(table.number("whole"), float)
    assert table.whole_number("whole", 0, 3, "") == 3
    assert table.vector("place", 3) == (1.0, 2.5, -3.0)
    assert table.table("table", "").numbers() == {"a": 1.0}
    assert not table.table("none", "").values
    rows = table.tables("row", {"x"})
    assert [row.number("x") for row in rows] == [1.0, 2.0]
    assert table.tables("none", {"x"}) == ()


@pytest.mark.parametrize(
    ("get", "message"),
    [
        (lambda t: t.name("none"), 'no none; give none = "..."'),
        (lambda t: t.name("empty"), "empty is ''; give empty"),
        (lambda t: t.name("whole"), "whole is 3; give whole"),
        (lambda t: t.text("whole", ""), "whole is 3; give whole"),
        (lambda t: t.texts("name"), "name is 'n'; give name = [\"...\", ...]"),
        (lambda t: t.texts("place"), "place is [1, 2.5, -3]; give"),
        (lambda t: t.word("kind", ("a", "b")), "kind should be a or b"),
        (lambda t: t.word("none", ("a", "b")), "no none; none should be a or b"),
        (lambda t: t.word("words", ("a", "b")), "words is ['a', 'b']"),
        (lambda t: t.flag("whole", True), "whole is 3; give whole = true or false"),
        (lambda t: t.number("yes"), "yes is True; it should be a number"),
        (lambda t: t.number("none"), "no none; it should be a number"),
        (lambda t: t.number("whole", least=4.0), "whole is 3"),
        (lambda t: t.number("whole", most=2.0, right="so"), "whole is 3; so"),
        (lambda t: t.whole_number("half", 0, 3, "so"), "half is 0.5; so"),
        (lambda t: t.whole_number("yes", 0, 3, "so"), "yes is True; so"),
        (lambda t: t.whole_number("whole", 0, 2, "so"), "whole is 3; so"),
        (lambda t: t.vector("place", 2), "place is [1, 2.5, -3]; give 2 numbers"),
        (lambda t: t.vector("place", 3, most=2.0), "place is [1, 2.5, -3]"),
        (lambda t: t.vector("words", 2), "words is ['a', 'b']; give 2 numbers"),
        (lambda t: t.vector("none", 2), "no none; give 2 numbers"),
        (lambda t: t.table("name", "so"), "name is 'n', no table; so"),
        (lambda t: t.table("none", "").numbers(), "[none]: is empty"),
        (lambda t: t.tables("table", ()), "table is {'a': 1}; write [[table]] tables"),
        (lambda t: t.tables("words", ()), "write [[words]] tables"),
        (lambda t: t.tables("row", {"xx"}), "[[row]] 1: no key is called 'x'; did you"),
        (lambda t: t.expect_keys({"names"}), "a.toml: no key is called 'name'; did"),
    ],
)
def test_getters_refuse_in_one_line_that_names_the_place(table, get, message):
    with pytest.raises(HandcleanError) as caught:
        get(table)
    assert str(caught.value).startswith("a.toml")
    assert message in str(caught.value)
    assert caught.value.file == Path("a.toml")


@pytest.mark.parametrize("number", ["nan", "inf", "1e13", "-1e13", "true", "'1'"])
def test_no_getter_takes_for_a_number_what_is_none(number):
    text = f"x = {number}\ny = [{number}]"
    table = Table(Path("a.toml"), parse_toml("a.toml", text, ""))
    for get in (
        table.number,
        lambda key: table.vector("y", 1),
        lambda _: table.numbers(),
    ):
        with pytest.raises(FileError):
            get("x")


def test_more_rows_than_any_such_file_has_are_refused():
    table = Table(Path("a.toml"), {"row": [{}] * (MOST_ROWS + 1)})
    with pytest.raises(FileError, match=r"has 1001 \[\[row\]\]; at most 1000"):
        table.tables("row", ())


KEYS = {
    "config": ("[fill-gap]\n", "fill-gaps"),
    "marker set": ('sid = "left"\n', "side"),
    "subject": ('kin = "rigid"\n', "kind"),
    "joint map": ("unit = 1.0\n", "unit_m"),
    "skinned map": ("flexio = 1.0\n", "flexion"),
    "glove": ("limit = [0, 1]\n", "limits"),
    "hand of gloves": ("referenc = []\n", "reference"),
}


@pytest.mark.parametrize("kind", KEYS)
def test_an_unknown_key_is_an_error_with_a_suggestion(tmp_path, kind):
    path = tmp_path / "a.toml"
    text, meant = KEYS[kind]
    path.write_text(text)
    read = READERS[kind]
    if kind == "config":
        read = lambda path: config.check(path, {"fill-gaps": object})  # noqa: E731
    with pytest.raises(HandcleanError, match=rf"did you mean .*\b{meant}\b"):
        read(path)


@given(text=st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")))
def test_any_text_can_be_written(text):
    assert tomllib.loads(f"a = {quoted(text)}") == {"a": text}
    assert tomllib.loads(f"{key_of(text)} = 1") == {text: 1}
