"""Takes of two people are told from those of one hand."""

import re
from pathlib import Path

import numpy as np
import pytest
from people import as_take, person
from told import texts

from handclean.commands.calibrate_hand_markers import names_of
from handclean.runner.batch import Source
from handclean.subject.alike import remarks_on_takes
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
    assert remarks_on_takes(one.model, frames) == []


def test_takes_of_two_people_are_told_with_a_pair_of_markers_that_differs():
    one, two = person(21, frames=60), person(22, frames=60)
    labels = one.set.labels
    found = remarks_on_takes(one.model, gather([one.take, one.take, two.take], labels))
    (words,) = texts(found)
    assert words.startswith("take 3 is hardly of the hand of take 1")
    pattern = r"; (\S+) and (\S+) are (\S+) mm apart in take 1, (\S+) mm in take 3"
    a, b, before, after = re.search(pattern, words).groups()
    for which, told in ((one, before), (two, after)):
        at = [which.model.labels.index(label) for label in (a, b)]
        true = np.linalg.norm(np.subtract(*which.model.at[at]))
        assert float(told) == pytest.approx(1e3 * true, abs=0.3)


def test_markers_too_seldom_seen_together_tell_nothing():
    one, two = person(21, frames=9), person(22, frames=9)
    assert (
        remarks_on_takes(one.model, gather([one.take, two.take], one.set.labels)) == []
    )


def test_a_calibration_of_two_people_warns():
    one, two = person(21, frames=200), person(22, frames=200)
    settings = CalibrateConfig(frames=30)
    _, report = calibrate([one.take, two.take], one.set, settings)
    assert "take 2 is hardly" in "".join(texts(report.remarks))


def test_remarks_on_takes_name_their_files():
    sources = [Source(path=Path("a.c3d")), Source(path=Path("b.c3d"))]
    one, two = person(21, frames=60), person(22, frames=60)
    labels, takes = one.set.labels, [one.take, two.take]
    frames = gather(takes, labels, names_of(sources))
    (found,) = remarks_on_takes(one.model, frames)
    assert found.text.startswith("b.c3d is hardly of the hand of a.c3d, or its ")
    assert "mm apart in a.c3d, " in found.text
    assert found.data["take"] == "b.c3d"
    twins = [Source(path=Path("x/a.c3d")), Source(path=Path("y/a.c3d"))]
    assert names_of(twins) == ("x/a.c3d", "y/a.c3d")
