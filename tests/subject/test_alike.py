"""Takes of two people are told from those of one hand."""

import re
from pathlib import Path

import numpy as np
import pytest
from people import as_take, person

from handclean.commands.calibrate_hand_markers import with_files
from handclean.runner.batch import Source
from handclean.subject.alike import words_on_takes
from handclean.subject.calibrate import calibrate
from handclean.subject.frames import gather
from handclean.subject.settings import CalibrateConfig


def halves(one):
    positions, labels = one.take.markers.positions, one.take.markers.labels
    return [as_take(positions[part::2], labels) for part in (0, 1)]


@pytest.mark.parametrize("noise", [0.0, 0.0005])
def test_takes_of_one_hand_raise_no_doubt(noise):
    one = person(21, noise=noise)
    frames = gather(halves(one), one.set.labels)
    assert words_on_takes(one.model, frames) == []


def test_takes_of_two_people_are_told_with_a_pair_of_markers_that_differs():
    one, two = person(21, frames=60), person(22, frames=60)
    labels = one.set.labels
    found = words_on_takes(one.model, gather([one.take, one.take, two.take], labels))
    (words,) = found
    assert words.startswith("take 3 is hardly of the hand of take 1")
    pattern = r"; (\S+) and (\S+) are (\S+) mm apart in take 1, (\S+) mm in take 3"
    a, b, before, after = re.search(pattern, words).groups()
    for which, told in ((one, before), (two, after)):
        at = [which.model.labels.index(label) for label in (a, b)]
        true = np.linalg.norm(np.subtract(*which.model.at[at]))
        assert float(told) == pytest.approx(1e3 * true, abs=0.3)


def test_markers_too_seldom_seen_together_tell_nothing():
    one, two = person(21, frames=9), person(22, frames=9)
    assert words_on_takes(one.model, gather([one.take, two.take], one.set.labels)) == []


def test_a_calibration_of_two_people_warns():
    one, two = person(21, frames=200), person(22, frames=200)
    settings = CalibrateConfig(frames=30)
    _, report = calibrate([one.take, two.take], one.set, settings)
    assert "take 2 is hardly" in "".join(report.warnings)


def test_words_on_takes_name_their_files():
    sources = [Source(path=Path("a.c3d")), Source(path=Path("b.c3d"))]
    words = "frame 3 of take 2 is not of take 1; take 3, takes"
    named = "frame 3 of b.c3d is not of a.c3d; take 3, takes"
    assert with_files(words, sources) == named
    assert with_files(words, sources[:1]) == words
    twins = [Source(path=Path("x/a.c3d")), Source(path=Path("y/a.c3d"))]
    assert with_files("take 2", twins) == "y/a.c3d"
