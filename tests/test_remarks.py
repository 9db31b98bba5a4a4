"""A remark says what, where and with which numbers, and survives JSON as it is."""

import doctest
import json
import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean import remarks
from handclean.recording import Numbering
from handclean.remarks import KINDS, Location, Remark, from_json, remark

names = st.text(max_size=8)
numbers = st.integers(-(2**31), 2**31)
places = st.builds(
    Location,
    file=st.none() | st.sampled_from([Path("a.c3d"), Path("S01/b.h5")]),
    frames=st.none() | st.tuples(numbers, numbers),
    model=names,
    marker=names,
    joint=names,
)
plain = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | names,
    lambda part: st.lists(part, max_size=3) | st.dictionaries(names, part, max_size=3),
    max_leaves=5,
)
every = st.builds(
    Remark,
    kind=st.sampled_from(sorted(KINDS)),
    where=places,
    text=st.text(max_size=40),
    data=st.dictionaries(names, plain, max_size=3),
)


@given(one=every)
def test_a_remark_comes_out_of_json_and_of_another_process_as_it_was(one):
    told = json.dumps(one.as_json())
    assert from_json(json.loads(told)) == one
    assert pickle.loads(pickle.dumps(one)) == one
    assert list(one.as_json()) == ["kind", "where", "text", "data"]


@given(
    first=st.integers(-(10**6), 10**6),
    start=st.integers(0, 10**6),
    length=st.integers(1, 10**6),
)
def test_a_place_has_the_frames_of_the_file_both_ends_included(first, start, length):
    """Row 0 is frame ``first``; the stop, left out of rows, is left out here."""
    span = Numbering(first).span(start, start + length)
    where = remark("gap", "g", frames=span).as_json()["where"]
    assert where == {"frames": [first + start, first + start + length - 1]}
    assert Numbering(first).rows(*where["frames"]) == (start, start + length)


def test_only_what_is_known_of_a_place_is_told():
    assert remark("note", "t").as_json()["where"] == {}
    one = remark("fit", "t", marker="A", joint="index_pip", rms_mm=2.5)
    assert one.as_json()["where"] == {"marker": "A", "joint": "index_pip"}
    assert one.as_json()["data"] == {"rms_mm": 2.5}


def test_a_remark_names_its_file_unless_that_is_what_is_spoken_of():
    one = remark("note", "is odd").of_file(Path("a.c3d"))
    assert one.said() == "a.c3d: is odd"
    assert one.said(Path("b.c3d")) == "a.c3d: is odd"
    assert one.said(Path("a.c3d")) == remark("note", "is odd").said() == "is odd"
    assert one.of_file(Path("b.c3d")) == one


def test_a_kind_is_one_of_those_there_are():
    with pytest.raises(ValueError, match=r"a remark is one of .*, not 'oddity'"):
        remark("oddity", "t")
    assert from_json({"kind": "of a later handclean", "text": "t"}).kind == "note"


def test_the_examples_are_true():
    assert doctest.testmod(remarks).failed == 0
    assert doctest.testmod(remarks).attempted > 0
