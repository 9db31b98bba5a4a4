"""Names that are nearly those of another marker are told, others are not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from told import texts

from handclean.api import names
from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set, shipped
from handclean.hand.subject import template_subject
from handclean.recording import Recording, trajectories

SETS = {name: load_marker_set(name).labels for name in shipped()}


def take(labels):
    places = np.zeros((2, len(labels), 3))
    return Recording(rate=100.0, frames=2, markers=trajectories(places, labels))


def with_markers(*labels):
    subject = template_subject(load_marker_set("pavllo9"))
    model = replace(
        subject.model,
        labels=labels,
        bone=subject.model.bone[: len(labels)],
        at=subject.model.at[: len(labels)],
    )
    return {"right": replace(subject, model=model)}


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("RIDX2", "RIDX_2"),
        ("R_INDEX_TIP", "r index tip"),
        ("R_INDEX_TIP", "R_INDX_TIP"),
        ("R_INDEX_TIP", "R_INEDX_TIP"),
        ("R_INDEX_TIP", "R_INDEX_TOP"),
        ("R_INDEX_TIP", "Anna:R_INDEX_TIP"),
        ("Wan-1", "Wan1"),
    ],
)
def test_a_misspelt_marker_is_named_with_what_the_take_has(name, other):
    said = texts(names.misspelt(take(("A", other)), with_markers(name, "A")))
    assert said == (
        f"marker '{name}' of the subject is not in the take; the take has '{other}'",
    )


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("RIDX2", "RIDX3"),
        ("R_INDEX_TIP", "L_INDEX_TIP"),
        ("R_INDEX_TIP", "LEFT_INDEX_TIP"),
        ("R_INDEX_TIP", "R_LITTLE_BASE"),
        ("Wan-1", "cup"),
        ("R_MIDDLE_TIP", "R_MIDDLE_MID"),
        ("hand_a", "hand_b"),
    ],
)
def test_another_marker_is_no_misspelling(name, other):
    assert names.misspelt(take(("A", other)), with_markers(name, "A")) == ()


def test_a_label_that_is_another_marker_of_the_subject_is_no_misspelling():
    assert (
        names.misspelt(take(("INDEX_TIP",)), with_markers("INDEX_TIP", "INDEXTIP"))
        == ()
    )


@given(name=st.sampled_from(shipped()), gone=st.integers(0, 4))
def test_a_take_whose_labels_are_right_has_no_misspelling(name, gone):
    labels = SETS[name]
    assert names.misspelt(take(labels[gone:]), with_markers(*labels[:9])) == ()


@pytest.mark.parametrize("name", shipped())
def test_the_set_proposed_is_the_one_whose_markers_the_take_has(name):
    other = "han19" if name != "han19" else "maycock26"
    with pytest.raises(HandcleanError) as caught:
        names.expect_set("t.c3d", (*SETS[name], "cup_1"), other)
    said = str(caught.value)
    assert said.startswith(f"t.c3d: {len(SETS[other])} of the {len(SETS[other])} ")
    found = said.rpartition("--marker-set ")[2]
    assert SETS[found] == SETS[name]
    assert "\n" not in said


def test_one_misspelt_marker_of_a_set_is_named_with_what_the_take_has():
    labels = SETS["maycock26"]
    has = tuple(n.replace("INDEX_TIP", "INDX_TIP") for n in labels)
    with pytest.raises(HandcleanError, match="it has 'R_INDX_TIP'"):
        names.expect_set("t.c3d", has, "maycock26")
    names.expect_set("t.c3d", labels, "maycock26")


def test_a_set_that_leaves_markers_of_a_larger_one_unused_is_told():
    (said,) = texts(names.larger_set(SETS["maycock26"], "schroeder6"))
    assert said.startswith("the take has all 26 markers of maycock26, 20 more ")
    assert names.larger_set(SETS["maycock26"], "maycock26") == ()
    assert names.larger_set(SETS["maycock26"][1:], "maycock26") == ()


def test_a_take_that_fits_no_set_is_shown_by_some_of_its_labels():
    with pytest.raises(HandcleanError, match="it has A, B; --marker-set should name"):
        names.expect_set("t.c3d", ("A", "B"), "han19")


def test_a_take_of_another_set_is_told_which():
    subject = {"right": template_subject(load_marker_set("pavllo9"))}
    with pytest.raises(HandcleanError, match=r"none .* --marker-set han19"):
        names.expect_any(take(SETS["han19"]), subject)
    names.expect_any(take(SETS["pavllo9"][:1]), subject)


@pytest.mark.parametrize(
    "other",
    ["Bob:{}", "bob:left hand:{}", "{upper}", "BOB:{upper}", "{lower}"],
)
@pytest.mark.parametrize("name", ["han19", "dfki13", "xu19"])
def test_prefix_and_case_do_not_count_where_names_stay_apart(name, other):
    labels = SETS[name]
    has = [other.format(x, upper=x.upper(), lower=x.lower()) for x in labels]
    found, told = names.matched(take((*has, "*0")), labels)
    assert found.markers.labels == (*labels, "*0")
    changed = sum(a != b for a, b in zip(has, labels, strict=True))
    assert len(told) == bool(changed)
    if changed:
        assert f"{changed} markers are known without prefix and case" in told[0].text


def test_a_take_whose_names_are_the_hand_s_is_left_as_it_is():
    given = take(("A", "B", "Bob:A", "b:b"))
    assert names.matched(given, ("A", "B")) == (given, ())


def test_of_two_people_s_markers_none_is_taken_and_both_are_named():
    labels = SETS["dfki13"]
    has = [f"{who}:{label}" for who in ("Ann", "Bob") for label in labels]
    given = take(has)
    assert names.matched(given, labels) == (given, ())
    subject = template_subject(load_marker_set("dfki13"))
    with pytest.raises(HandcleanError, match=r"Ann:\w+ and Bob:\w+, of which"):
        names.expect_any(given, {"right": subject})
    with pytest.raises(HandcleanError, match=r"Ann:\w+ and Bob:\w+, of which one"):
        names.expect_set("a.c3d", given.markers.labels, "dfki13")


def test_of_two_people_one_is_taken_whose_names_are_bare():
    given = take(("Bob:A", "A", "Bob:B", "Bob:C"))
    found, (told,) = names.matched(given, ("A", "B", "C"))
    assert found.markers.labels == ("Bob:A", "A", "B", "C")
    assert "2 markers are known" in told.text
