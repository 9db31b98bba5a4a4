"""The table of formats: all it names is there and is called as it says."""

import inspect
import subprocess
import sys

import pytest

from handclean.io import files
from handclean.io.formats import (
    FORMATS,
    HAND,
    HANDS,
    MESH,
    MESHES,
    TAKE,
    TAKES_READ,
    TAKES_WRITTEN,
    by_suffix,
    chosen,
    function,
)
from handclean.io.keeps import PARTS

OPTIONS = {
    "read": {"rate_hz", "unit", "lenient", "believe_coordinates"},
    "inspect": {"rate_hz", "unit", "believe_coordinates"},
    "write": {"surfaces", "unnamed"},
}
FIRST = {"read": 1, "inspect": 1, "write": 2}
ENTRIES = [
    (entry, verb)
    for entry in FORMATS
    for verb in OPTIONS
    if getattr(entry, verb) and not (verb == "read" and entry.holds != TAKE)
]


@pytest.mark.parametrize(
    ("entry", "verb"), ENTRIES, ids=[f"{e.suffix} {v}" for e, v in ENTRIES]
)
def test_a_function_takes_the_options_that_its_entry_lists(entry, verb):
    signature = inspect.signature(function(getattr(entry, verb)))
    given = chosen(entry, dict.fromkeys(OPTIONS[verb]))
    signature.bind(*["x"] * FIRST[verb], **given)
    takes = {
        name
        for name, one in signature.parameters.items()
        if one.kind is one.KEYWORD_ONLY and name in OPTIONS[verb]
    }
    assert takes <= set(entry.options), "an option that nobody can give"


@pytest.mark.parametrize("entry", [e for e in FORMATS if e.holds != TAKE])
def test_readers_of_meshes_and_hands_are_there(entry):
    places = ["path", b""] if entry.holds == MESH else ["path"]
    inspect.signature(function(entry.read)).bind(*places)


def test_every_suffix_stands_in_the_table_once_and_is_found():
    suffixes = [entry.suffix for entry in FORMATS]
    assert len(set(suffixes)) == len(suffixes)
    assert all(by_suffix(f"a.b{s.upper()}").suffix == s for s in suffixes)
    assert by_suffix("a.xyz") is None
    assert set(suffixes) == {*TAKES_READ, *TAKES_WRITTEN, *HANDS, *MESHES}


def test_formats_keep_parts_that_there_are():
    assert by_suffix(".h5") is None
    assert by_suffix("a.h5").keeps == set(PARTS)
    assert all(entry.keeps <= set(PARTS) for entry in FORMATS)
    assert all(bool(e.keeps) == (e.holds in (TAKE, HAND)) for e in FORMATS if e.write)


def test_the_table_is_known_without_any_reader():
    code = "import sys, handclean.io.formats; print('numpy' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert said.stdout == "False\n"


def test_reading_one_format_imports_no_other(tmp_path):
    (tmp_path / "a.trc").write_text("nothing")
    code = (
        "import sys; from pathlib import Path; from handclean.io import files\n"
        "try: files.read(Path(sys.argv[1]))\n"
        "except Exception: pass\n"
        "print(sorted(m for m in sys.modules if m.startswith('handclean.io.') and "
        "m.split('.')[2] in ('c3d', 'bvh', 'gltf', 'mesh', 'glove')))"
    )
    said = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "a.trc")],
        capture_output=True,
        text=True,
        check=True,
    )
    assert said.stdout == "[]\n"


def test_a_new_format_is_one_line(tmp_path, monkeypatch):
    """A line more in the table and its suffix is read."""
    entry = by_suffix("a.trc")
    from handclean.io import formats

    more = {**formats.BY_SUFFIX, ".new": entry}
    monkeypatch.setattr(formats, "BY_SUFFIX", more)
    (tmp_path / "a.new").write_text("nothing")
    with pytest.raises(Exception, match="TRC"):
        files.read(tmp_path / "a.new")
