import numpy as np
import pytest
from told import texts

from handclean.errors import HandcleanError, UnknownNameError
from handclean.subject.scan.landmarks import checked, doubtful, expect_alike, expect_on

KNOWN = ("thumb_tip", "index_tip", "middle_tip", "wrist")


@pytest.fixture
def marks(rng):
    return {name: rng.normal(scale=0.05, size=3) for name in KNOWN}


def test_landmarks_come_in_the_templates_order(marks):
    names, places, missing = checked(dict(reversed(marks.items())), KNOWN, 3)
    assert names == KNOWN
    np.testing.assert_array_equal(places, np.array(list(marks.values())))
    assert missing == ()


def test_a_misnamed_landmark_is_told_with_the_nearest_name(marks):
    marks["indx_tip"] = marks.pop("index_tip")
    with pytest.raises(UnknownNameError, match="'indx_tip'; did you mean index_tip"):
        checked(marks, KNOWN, 3)


def test_missing_landmarks_are_listed_and_too_few_refused(marks):
    del marks["wrist"]
    assert checked(marks, KNOWN, 3)[2] == ("wrist",)
    with pytest.raises(HandcleanError, match=r"3 of 4 are given, 4 or more.*wrist"):
        checked(marks, KNOWN, 4)


def test_landmarks_in_another_unit_are_not_on_the_scan(rng):
    points = rng.normal(scale=0.05, size=(500, 3))
    with pytest.raises(HandcleanError, match="coordinates and unit"):
        expect_on(KNOWN, 1000.0 * points[:4], points)
    with pytest.raises(HandcleanError, match="coordinates and unit"):
        expect_on(KNOWN, 0.001 * points[:4] + 1.0, points)
    expect_on(KNOWN, points[:4], points)


def test_one_landmark_far_from_the_scan_is_named(rng):
    points = rng.normal(scale=0.05, size=(500, 3))
    places = points[:4].copy()
    places[2] += 0.3
    with pytest.raises(HandcleanError, match="middle_tip lies"):
        expect_on(KNOWN, places, points)


def test_exchanged_landmarks_are_named():
    template = np.eye(4, 3)
    expect_alike(KNOWN, template, template)
    with pytest.raises(HandcleanError, match=r"thumb_tip.*nearer to index_tip"):
        expect_alike(KNOWN, template[[1, 0, 2, 3]], template)


def test_landmarks_near_the_template_s_are_not_doubtful(rng):
    template = 0.1 * np.eye(4, 3)
    near = template + 0.004 * rng.normal(size=(4, 3))
    assert doubtful(KNOWN, near, template, 1.0) == ()


def test_exchanged_and_far_landmarks_are_told_apart():
    template = 0.1 * np.eye(4, 3)
    places = template[[1, 0, 2, 3]].copy()
    places[3] += [0.0, 0.0, 0.020]
    (told,) = texts(doubtful(KNOWN, places, template, 1.0))
    assert f"{KNOWN[0]} and {KNOWN[1]} would fit better exchanged" in told
    assert f"{KNOWN[3]} lies 20 mm from where it should" in told
    assert KNOWN[2] not in told
    assert f"{KNOWN[3]} lies" not in doubtful(KNOWN, places, template, 1.6)[0].text
