"""TOML is read within bounds: any text is a document or one line, soon."""

import time
import tomllib
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean import config
from handclean.errors import FileError, HandcleanError
from handclean.glove.gloves import load_glove
from handclean.glove.hands import load_hand
from handclean.glove.poses import key_poses
from handclean.hand.marker_set import load_marker_set
from handclean.hand.skeleton import load_skeleton
from handclean.io.gltf.skinned_map import load_skinned_map
from handclean.io.landmarks import read_landmarks
from handclean.io.shared.joint_map import load_joint_map
from handclean.simulation.scenarios import find_scenario
from handclean.toml import DEEPEST, MOST_BYTES, MOST_TABLES, parse_toml, read_toml

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
    assert those == [package / "toml.py"]


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
