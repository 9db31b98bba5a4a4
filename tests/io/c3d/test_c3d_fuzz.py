"""Whatever the bytes are: a recording or one HandcleanError, and bounded memory."""

import io
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handclean.errors import HandcleanError
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d, write_c3d
from tests.io.c3d.c3d_oracles import c3d_bytes, take

ROOM = 12 << 20
"""[bytes] beyond a multiple of the file: the largest parameter section, decoded."""


def base(rng, processor, is_float, analog):
    """A small file in which most bytes matter."""
    raw, words = take(rng, 12, 5, is_float)
    return c3d_bytes(
        raw,
        words,
        ["A", "*1", "B", "Elbow", "C"],
        processor=processor,
        is_float=is_float,
        analog=rng.integers(0, 99, (12, 6)) if analog else None,
        per_frame=3 if analog else 0,
        count="trial",
        groups={
            "POINT": {"ANGLES": ["Elbow"], "Y_SCREEN": "+Z", "LONG_FRAMES": 12.0},
            "EVENT": {"LABELS": ["go"], "TIMES": np.array([[0.0, 0.1]])},
        },
        header_events=[(0.25, "GO")],
    )


mutations = st.lists(
    st.tuples(
        st.one_of(
            st.integers(0, 30),  # header
            st.integers(290, 330),  # its events
            st.integers(512, 1400),  # parameters
            st.integers(0, 4000),
        ),
        st.one_of(st.sampled_from([0, 1, 127, 128, 255]), st.integers(0, 255)),
    ),
    max_size=12,
)


def one_line(error):
    assert "\n" not in str(error)


def all_ways(path):
    """Read, inspect and write; True if it could be read."""
    for way in (
        lambda: inspect_c3d(path),
        lambda: read_c3d(path, lenient=True, unit=None, rate=None),
    ):
        try:
            found = way()
        except HandcleanError as error:
            one_line(error)
            found = None
    if found is None:
        return False
    try:
        write_c3d(io.BytesIO(), found)
    except HandcleanError as error:
        one_line(error)
    return True


@settings(max_examples=150)
@given(
    seed=st.integers(0, 5),
    processor=st.sampled_from(["intel", "dec", "mips"]),
    is_float=st.booleans(),
    analog=st.booleans(),
    changes=mutations,
    length=st.one_of(st.none(), st.integers(0, 5000)),
)
def test_mutated_files_raise_nothing_else(
    tmp_path_factory, seed, processor, is_float, analog, changes, length
):
    content = bytearray(base(np.random.default_rng(seed), processor, is_float, analog))
    for at, value in changes:
        content[at % len(content)] = value
    path = tmp_path_factory.getbasetemp() / "fuzz.c3d"
    path.write_bytes(content[:length])
    tracemalloc.start()
    try:
        all_ways(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 30 * len(content) + ROOM


@given(content=st.binary(max_size=3000))
def test_any_bytes_raise_nothing_else(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.c3d"
    for lead in (b"", b"\2\x50", b"\2\x50" + bytes(510) + b"\1\x50\2\x54"):
        path.write_bytes(lead + content)
        all_ways(path)


@pytest.mark.parametrize("word", [1, 2, 4, 8, 9])
def test_a_header_cannot_ask_for_more_memory_than_the_file_has(tmp_path, rng, word):
    content = bytearray(c3d_bytes(*take(rng, 12, 5), groups={"POINT": {"USED": None}}))
    content[2 * word : 2 * word + 2] = b"\xff\xff"
    path = tmp_path / "large.c3d"
    path.write_bytes(content)
    tracemalloc.start()
    all_ways(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30 * len(content) + ROOM


def test_huge_counts_in_parameters_cost_nothing(tmp_path, rng):
    groups = {
        "POINT": {"USED": 65535, "FRAMES": 1e9, "LONG_FRAMES": 2e9, "SCALE": 1e38},
        "ANALOG": {"USED": 65535, "RATE": 1e30},
        "TRIAL": {
            "ACTUAL_START_FIELD": np.array([0, 0]),
            "ACTUAL_END_FIELD": np.array([65535, 65535]),
        },
    }
    path = tmp_path / "huge.c3d"
    path.write_bytes(c3d_bytes(*take(rng, 12, 5), groups=groups))
    tracemalloc.start()
    all_ways(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < ROOM
