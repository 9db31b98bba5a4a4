"""What hands can do, and whether a recording shows it."""

import numpy as np
import pytest

from handclean.errors import FileError, UnknownNameError
from handclean.glove import claims
from handclean.glove.definitions import load_glove, shipped
from handclean.glove.poses import key_pose, key_poses, place_of

GLOVE = load_glove("generic14")


@pytest.mark.parametrize("name", shipped())
@pytest.mark.parametrize("pose", key_poses())
def test_hands_can_take_every_shipped_pose(name, pose):
    assert claims.expect_pose(pose, load_glove(name).hand, key_pose(pose)) == ()


@pytest.mark.parametrize(
    ("pose", "kind", "says"),
    [
        ({"index_pip_flexon": 0.5}, UnknownNameError, "did you mean index_pip_flexion"),
        ({"wrist_flexion": 2.5}, FileError, "wrist_flexion is 143.239 degrees"),
        ({"index_mcp_flexion": np.nan}, FileError, "give an angle in degrees"),
        ({"little_mcp_abduction": -1.3}, FileError, "little_mcp_abduction is -74"),
        (
            {"index_mcp_abduction": 0.5, "middle_mcp_abduction": -0.7},
            FileError,
            "index_middle_abduction is 68.7549 degrees; it goes from -5 to 35",
        ),
    ],
)
def test_what_no_hand_can_do_is_named(pose, kind, says):
    with pytest.raises(kind, match=f"mine: .*{says}"):
        claims.expect_pose("mine", GLOVE.hand, pose)


def test_a_rotation_a_little_beyond_its_range_is_told():
    rotations = np.full(len(GLOVE.hand.rotations), np.nan)
    place = GLOVE.hand.index("index_pip_flexion")
    for degrees, count in ((104.0, 0), (109.0, 0), (112.0, 1)):
        rotations[place] = np.radians(degrees)
        assert len(claims.expect_reachable("mine", GLOVE.hand, rotations)) == count
    rotations[place] = np.radians(126.0)
    with pytest.raises(FileError, match="index_pip_flexion is 126 degrees"):
        claims.expect_reachable("mine", GLOVE.hand, rotations)


def test_poses_are_called_by_their_place():
    assert place_of("fist") == "--pose fist"
    assert str(place_of("my/poses.toml:claw")) == "my/poses.toml [claw]"


def test_noise_is_no_movement_and_drift_is(rng):
    times = np.arange(300) / 60.0
    values = 100.0 + rng.normal(0.0, 2.0, (300, 14))
    rows = np.arange(12, 288)
    assert claims.moved(GLOVE, times, values, rows) == ""
    k = GLOVE.sensors.index("R_PIP")
    values[:, k] += np.linspace(0.0, 40.0, 300)
    assert claims.moved(GLOVE, times, values, rows).endswith("moved R_PIP by 36 of 255")
    assert claims.moved(GLOVE, times, values, rows[:30]) == ""
