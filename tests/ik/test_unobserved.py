"""Fingers that nothing tells of are named."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.unobserved import unobserved, unseen
from handclean.recording import Origin, Recording, trajectories


def words(take, subject, **given):
    """What is said of a take, without the name of the motion; "" if nothing is."""
    return "".join(
        one.text.removeprefix("right: ")
        for one in unobserved(take, subject, "right", **given)
    )


@pytest.fixture(scope="module")
def subject():
    return template_subject(load_marker_set("dfki13"))


def take(subject, frames=100):
    labels = subject.model.labels
    markers = trajectories(np.zeros((frames, len(labels), 3)), labels)
    return Recording(rate=100.0, frames=frames, markers=markers)


def hide(recording, finger, frames, origin=Origin.MISSING):
    there = recording.markers.origin.copy()
    for column, label in enumerate(recording.markers.labels):
        if label.startswith(finger):
            there[:frames, column] = origin
    return replace(recording, markers=replace(recording.markers, origin=there))


def test_shares_count_frames_that_show_the_hand(subject):
    labels = subject.model.labels
    seen = np.ones((10, 13), dtype=bool)
    seen[:4, [label.startswith("thumb") for label in labels]] = False
    seen[6:8, labels.index("ring_tip")] = False
    seen[8:] = False
    shares = unseen(subject.model, seen)
    assert {where: share for where, share in shares.items() if share} == {
        "on the thumb": 0.5,
        "beyond ring_pip_flexion": 0.25,
    }
    assert unseen(subject.model, np.zeros((10, 13), dtype=bool)) == {}


def test_the_finger_and_how_often_it_is_bare_are_said(subject):
    whole = take(subject)
    assert words(whole, subject, filled=False, prior=True) == ""
    bare = hide(whole, "thumb", 100)
    assert words(bare, subject, filled=False, prior=True) == (
        "no marker on the thumb in 100 % of frames: its angles are the prior's"
    )
    more = hide(bare, "little", 30)
    assert words(more, subject, filled=False, prior=False) == (
        "no marker on the thumb in 100 %, on the little in 30 % of frames: "
        "their angles are not measured"
    )
    assert words(hide(whole, "little", 3), subject, filled=False, prior=True) == ""


def test_filled_samples_tell_of_a_finger_where_they_may(subject):
    part = hide(take(subject), "index", 50, Origin.FILLED)
    assert words(part, subject, filled=True, prior=True) == ""
    assert "index in 50 %" in words(part, subject, filled=False, prior=True)
