"""The parts of the C3D code: numbers, parameter section, layout, columns."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.errors import FileError
from handclean.io.c3d.columns import angles_of, plan_columns
from handclean.io.c3d.edit import (
    edited_bytes,
    with_floats,
    with_shorts,
    with_strings,
    with_text,
)
from handclean.io.c3d.numbers import (
    Processor,
    floats_at,
    floats_from_words,
    shorts_at,
    words_from_floats,
    words_from_shorts,
)
from handclean.io.c3d.parameters import Section, parse_section, plain_values, strings_of
from handclean.recording import Points, Recording, trajectories
from tests.io.c3d.c3d_oracles import floats, section_bytes, shorts

NAMES = {
    "intel": Processor.INTEL,
    "dec": Processor.DEC,
    "mips": Processor.MIPS,
}
processors = st.sampled_from(list(NAMES))


@given(
    values=st.lists(st.floats(-(2.0**120), 2.0**120, width=32), max_size=20),
    name=processors,
)
def test_floats_of_every_processor_are_read_and_written_exactly(values, name):
    values = np.array(values, np.float32)
    values = np.where(np.abs(values) < 1e-37, 0, values).astype(np.float32)
    values += 0.0  # VAX has no negative zero
    raw = floats(values, name)
    np.testing.assert_array_equal(floats_at(raw, NAMES[name]), values)
    assert words_from_floats(values, NAMES[name]).tobytes() == raw


@given(values=st.lists(st.integers(-32768, 32767), max_size=20), name=processors)
def test_integers_of_every_processor_are_read_and_written_exactly(values, name):
    raw = shorts(values, name)
    assert shorts_at(raw, NAMES[name]).tolist() == values
    signed = np.array(values, np.int16)
    assert words_from_shorts(signed, NAMES[name]).tobytes() == raw


@given(bits=st.integers(0, 2**32 - 1))
def test_vax_floats_follow_their_definition(bits):
    """Value (-1)^s x 0.1f x 2^(e - 128); e = 0 is zero, with a sign it is reserved."""
    sign, exponent, fraction = bits >> 31, bits >> 23 & 255, bits & 0x7FFFFF
    words = np.array([(bits << 16 | bits >> 16) & 0xFFFFFFFF], "<u4")
    value = float(floats_from_words(words, Processor.DEC)[0])
    if exponent == 0:
        assert np.isnan(value) if sign else value == 0
    elif exponent <= 2:  # below the smallest normal IEEE number
        assert value == 0
    else:
        expected = (0.5 + fraction / 2**24) * 2.0 ** (exponent - 128)
        assert value == (-expected if sign else expected)


GROUPS = {
    "POINT": {"USED": 3, "LABELS": ["a", "bb", "Öhr"], "SCALE": -0.25},
    "SUBJECT": {"NAME": "Ann", "SIZES": np.array([[1.5, 2.0], [3.0, 4.0], [5.0, 6.0]])},
}


@pytest.mark.parametrize("name", NAMES)
def test_a_section_is_read_entry_by_entry(name):
    section = parse_section(section_bytes(GROUPS, name, 0), NAMES[name])
    assert section.remarks == ()
    assert section.strings("POINT", "LABELS") == ["a", "bb", "Öhr"]
    assert section.strings("point", "labels") == ["a", "bb", "Öhr"]
    assert section.numbers("POINT", "USED").tolist() == [3]
    assert section.numbers("POINT", "NONE").size == 0
    assert section.find("POINT", "USED").locked
    assert not section.find("POINT", "LABELS").locked
    values = plain_values(section)
    assert values["POINT"]["SCALE"] == -0.25
    np.testing.assert_array_equal(
        values["SUBJECT"]["SIZES"], GROUPS["SUBJECT"]["SIZES"]
    )


@pytest.mark.parametrize("name", NAMES)
def test_editing_leaves_every_other_entry_as_it_was(name):
    raw = section_bytes(GROUPS, name, 0)
    section = parse_section(raw, NAMES[name])
    edited = with_strings(section, "POINT", "LABELS", ["c"] * 300, width=4)
    edited = with_shorts(edited, "POINT", "USED", 300)
    edited = with_floats(edited, "EVENT", "TIMES", np.ones((2, 2)), (2, 2))
    edited = with_text(edited, "SUBJECT", "NAME", "Bea")
    again = parse_section(edited_bytes(edited, len(raw)), NAMES[name])
    assert again.remarks == ()
    assert again.strings("POINT", "LABELS") == ["c"] * 300
    assert again.find("POINT", "LABELS").dims == (4, 255)
    assert again.numbers("POINT", "USED", unsigned=True).tolist() == [300]
    assert again.find("POINT", "USED").locked
    assert again.numbers("EVENT", "TIMES").tolist() == [1] * 4
    assert again.strings("SUBJECT", "NAME") == ["Bea"]
    touched = {("POINT", "LABELS"), ("POINT", "USED"), ("SUBJECT", "NAME")}
    kept = {
        (section.group_name(e.group), e.name): e.raw
        for e in section.entries
        if (section.group_name(e.group), e.name) not in touched
    }
    now = {(again.group_name(e.group), e.name): e.raw for e in again.entries}
    assert kept.items() <= now.items()
    fewer = with_strings(again, "POINT", "LABELS", ["one"])
    assert fewer.find("POINT", "LABELS2") is None


@pytest.mark.parametrize("name", NAMES)
def test_the_last_entry_may_lead_nowhere(name):
    """Zero, or as in c3d.org's sample 2 (SGI) the distance in the wrong byte order."""
    raw = bytearray(section_bytes(GROUPS, name, 0))
    whole = parse_section(bytes(raw), NAMES[name])
    last = whole.entries[-1]
    at = bytes(raw).index(last.raw) + 2 + len(last.name)
    for distance in (b"\0\0", b"\x3f\x3f"):
        raw[at : at + 2] = distance
        section = parse_section(bytes(raw), NAMES[name])
        np.testing.assert_array_equal(
            plain_values(section)["SUBJECT"]["SIZES"], GROUPS["SUBJECT"]["SIZES"]
        )
        more = with_text(section, "SUBJECT", "PROJECT", "x")
        again = parse_section(edited_bytes(more, 0), NAMES[name])
        assert again.strings("SUBJECT", "PROJECT") == ["x"]
        np.testing.assert_array_equal(
            plain_values(again)["SUBJECT"]["SIZES"], GROUPS["SUBJECT"]["SIZES"]
        )


@given(raw=st.binary(max_size=400), name=processors)
def test_any_bytes_are_some_section_and_lose_nothing(raw, name):
    section = parse_section(raw, NAMES[name])
    entries = b"".join(entry.raw for entry in section.entries)
    assert section.lead + entries + section.rest == raw
    for entry in section.entries:
        strings_of(entry)
        section.values(entry)
    for values in plain_values(section).values():
        assert all(name and "/" not in name for name in values)


def test_a_section_has_255_blocks_at_most():
    empty = Section(processor=Processor.INTEL, lead=b"\1\x50\1\x54", entries=())
    large = with_strings(empty, "POINT", "LABELS", ["x" * 200] * 700)
    with pytest.raises(FileError, match=r"room for 255"):
        edited_bytes(large, 0)


def test_points_of_a_new_file_keep_their_columns_if_these_tell_them_apart():
    def columns_of(frame, source):
        points = Points(
            frame=np.array(frame, np.int32),
            source=np.array(source, np.int32),
            positions=np.ones((len(frame), 3)),
        )
        recording = Recording(
            rate=1,
            frames=9,
            unlabelled=points,
            markers=trajectories(np.ones((9, 1, 3)), ("*0",)),
        )
        plan = plan_columns(recording, angles_of(recording), (), set(), {}, "test")
        labels = [column.label for column in plan.columns]
        assert len(set(labels)) == len(labels)
        return plan.point_column.tolist(), len(labels)

    assert columns_of([0, 0, 3], [7, 2, 7]) == ([2, 1, 2], 3)
    assert columns_of([0, 0, 3], [7, 7, 7]) == ([1, 2, 1], 3)  # two of one source
    assert columns_of([0, 0, 3], [-1, 2, 7]) == ([1, 2, 1], 3)
    many = sorted(list(range(9)) * 5)
    assert columns_of(many, list(range(45)))[1] == 6  # a source for each point
