"""Gloves and the hands they are for."""

from pathlib import Path

import numpy as np
import pytest

from handclean.errors import FileError, HandcleanError, UnknownNameError
from handclean.glove.definitions import (
    SHIPPED,
    glove_from_text,
    load_glove,
    shipped,
    to_toml,
)
from handclean.glove.gloves import Correspondence, Glove
from handclean.glove.hands import fingertips, load_hand
from handclean.glove.poses import key_pose, key_poses
from handclean.glove.samples import of_hinges
from handclean.hand.template import template

GOOD = (SHIPPED / "cyberglove18.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", shipped())
def test_a_glove_written_and_read_is_the_same(name):
    glove = load_glove(name)
    again = glove_from_text(Path("again.toml"), to_toml(glove))
    assert again.rows == glove.rows
    assert (again.name, again.sensors, again.limits) == (
        glove.name,
        glove.sensors,
        glove.limits,
    )


def test_any_names_of_sensors_come_back(tmp_path):
    odd = ("I MCP", 'a"b', "c\\d", "ä")
    rows = tuple(
        Correspondence(rotation=rotation, measured_by=name)
        for rotation, name in zip(load_hand("fingers").rotations, odd, strict=False)
    )
    glove = Glove(
        name="odd",
        source="",
        hand=load_hand("fingers"),
        sensors=odd,
        reading=dict.fromkeys(odd, (1.0, 2.0)),
        rows=rows,
    )
    again = glove_from_text(tmp_path / "again.toml", to_toml(glove))
    assert again.sensors == odd
    assert again.rows == rows
    assert again.reading == glove.reading


def test_four_gloves_ship_with_their_sensors():
    counts = {name: len(load_glove(name).sensors) for name in shipped()}
    assert counts == {
        "cyberglove18": 18,
        "cyberglove22": 22,
        "generic14": 14,
        "generic5": 5,
    }


def test_the_published_glove_has_the_kinds_of_section_3_3():
    glove = load_glove("cyberglove18")
    assert glove.row("index_mcp_flexion").kind == "1S1R"
    assert glove.row("index_middle_abduction").inputs == ("IM_ABD", "I_MCP", "M_MCP")
    assert glove.row("index_dip_flexion").kind == "0S1R"
    assert len(glove.row("thumb_ip_flexion").inputs) == 4
    assert "PALM_ARCH" not in glove.used


@pytest.mark.parametrize("name", ["wang2013", "fingers"])
def test_hinges_and_rotations_tell_each_other(name, rng):
    hand = load_hand(name)
    names = (*hand.hinges, "middle_mcp_abduction")
    rotations = rng.normal(size=(5, len(hand.rotations)))
    angles = rotations @ hand.to_hinges(names).T
    np.testing.assert_allclose(of_hinges(hand, names, angles), rotations, atol=1e-12)
    assert np.all(angles[:, -1] == 0.0)


def test_relative_abductions_add_up_from_the_middle_finger():
    hand = load_hand("wang2013")
    names = hand.hinges
    rotations = np.zeros(len(hand.rotations))
    for rotation, value in (
        ("index_middle_abduction", 0.1),
        ("middle_ring_abduction", 0.2),
        ("ring_little_abduction", 0.3),
    ):
        rotations[hand.index(rotation)] = value
    angles = dict(zip(names, hand.to_hinges(names) @ rotations, strict=True))
    assert angles["index_mcp_abduction"] == pytest.approx(0.1)
    assert angles["ring_mcp_abduction"] == pytest.approx(-0.2)
    assert angles["little_mcp_abduction"] == pytest.approx(-0.5)


def test_a_rotation_whose_hinge_is_missing_is_not_known():
    hand = load_hand("wang2013")
    names = [name for name in hand.hinges if name != "index_mcp_abduction"]
    rotations = of_hinges(hand, names, np.zeros((1, len(names))))
    unknown = np.flatnonzero(np.isnan(rotations[0]))
    assert [hand.rotations[r] for r in unknown] == ["index_middle_abduction"]


def test_what_follows_is_two_thirds_of_what_it_follows():
    glove = load_glove("cyberglove18")
    factor, _ = glove.completion()
    pip = [row.rotation for row in glove.measured].index("ring_pip_flexion")
    assert factor[glove.hand.index("ring_dip_flexion"), pip] == pytest.approx(
        2 / 3, abs=1e-4
    )


def test_every_key_pose_lies_within_the_active_ranges():
    hand = load_hand("wang2013")
    for name, pose in key_poses().items():
        found = of_hinges(hand, list(pose), np.array([list(pose.values())]))[0]
        known = np.isfinite(found)
        low, high = hand.ranges[known].T
        assert known.sum() == len(hand.rotations) - 1, name  # all but the pronation
        assert np.all((found[known] >= low - 1e-9) & (found[known] <= high + 1e-9)), (
            name
        )


def test_fingertips_are_the_template_hands_length_away():
    tips = fingertips(template("right"))
    middle = tips.labels.index("middle_tip")
    whole = tips.tree.offsets[tips.tree.bone("middle_proximal")]
    chain = [
        np.linalg.norm(tips.tree.offsets[b])
        for b in range(len(tips.tree.bones))
        if tips.tree.bones[b] in ("middle_middle", "middle_distal")
    ]
    length = np.linalg.norm(whole) + sum(chain) + np.linalg.norm(tips.at[middle])
    assert length == pytest.approx(0.1872, rel=0.02)


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        ('measured_by = "IM_ABD"', 'measured_by = "IM_ADB"', "IM_ABD"),
        (
            'name = "index_mcp_flexion"',
            'name = "indx_mcp_flexion"',
            "index_mcp_flexion",
        ),
        ('measured_by = "I_MCP"', 'measured_with = "I_MCP"', "measured_by"),
        ('measured_by = "I_MCP"', 'measured_by = "I_MCP"\nrest = 3.0', "rest"),
        ("limits = [0.0, 255.0]", "limits = [0.0]", "2 numbers"),
        ('"T_TMC", "TI_ABD"', '"T_TMC", "T_TMC"', "names of their own"),
        ("follows = { index_pip_flexion", "follows = { index_pib_flexion", "index_pip"),
    ],
)
def test_a_glove_that_is_wrong_is_refused_in_one_line(before, after, says, tmp_path):
    assert before in GOOD
    path = tmp_path / "my.toml"
    path.write_text(GOOD.replace(before, after, 1))
    with pytest.raises((FileError, UnknownNameError), match=says) as caught:
        load_glove(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_names_that_do_not_exist_are_told_what_does():
    with pytest.raises(UnknownNameError, match="cyberglove18"):
        load_glove("cyberglove16")
    with pytest.raises(UnknownNameError, match="did you mean fist"):
        key_pose("fits")


def test_poses_of_ones_own_are_read_from_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("[claw]\nindex_pip_flexion = 90.0\n")
    pose = key_pose(f"{path}:claw")
    assert pose == {"index_pip_flexion": pytest.approx(np.pi / 2)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f'hand = "{"x" * 500}"\n[[rotation]]\n', "no hand of gloves is called 'xxx"),
        (f'hand = "{"x" * 5000}"\n[[rotation]]\n', "hand has 5000 characters; 1000"),
        ('reading = 1\nhand = "wang2013"\nsensors = ["a"]\nname = "g"\n', "no table"),
    ],
)
def test_odd_values_of_a_glove_are_told(tmp_path, text, message):
    path = tmp_path / "g.toml"
    row = '[[rotation]]\nname = "index_pip_flexion"\nmeasured_by = "a"\n'
    path.write_text(text.replace("[[rotation]]\n", "") + row)
    with pytest.raises(HandcleanError, match=message):
        load_glove(path)
