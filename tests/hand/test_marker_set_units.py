"""Marker sets whose places are of another unit's size are refused."""

import re

import numpy as np
import pytest

from handclean.errors import FileError
from handclean.hand.marker_set import SHIPPED, load_marker_set, shipped

PLACE = re.compile(r"at = \[(.*?)\]")


def scaled(tmp_path, name, factor):
    """Write a shipped set with every place multiplied."""

    def times(found):
        numbers = [float(part) * factor for part in found[1].split(",")]
        return f"at = [{', '.join(f'{number:.6f}' for number in numbers)}]"

    text = (SHIPPED / f"{name}.toml").read_text(encoding="utf-8")
    path = tmp_path / f"{name}.toml"
    path.write_text(PLACE.sub(times, text), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", shipped())
@pytest.mark.parametrize(("factor", "unit"), [(1e-3, "m"), (0.1, "cm")])
def test_places_in_metres_or_centimetres_are_refused(tmp_path, name, factor, unit):
    with pytest.raises(FileError, match=rf"at is in millimetres; are these {unit}\?"):
        load_marker_set(scaled(tmp_path, name, factor))


@pytest.mark.parametrize("name", shipped())
def test_places_far_from_the_hand_are_refused(tmp_path, name):
    with pytest.raises(FileError, match="mm from the joint of"):
        load_marker_set(scaled(tmp_path, name, 10.0))


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.15])
@pytest.mark.parametrize("name", shipped())
def test_hands_of_any_size_are_taken(tmp_path, name, factor):
    found = load_marker_set(scaled(tmp_path, name, factor))
    np.testing.assert_allclose(found.at, factor * load_marker_set(name).at, atol=1e-8)


def write(tmp_path, *markers, head='side = "right"'):
    rows = [
        f'[[marker]]\nlabel = "M{n}"\nbone = "{bone}"\nat = {at}\n'
        for n, (bone, at) in enumerate(markers)
    ]
    path = tmp_path / "set.toml"
    path.write_text("\n".join([head, *rows]))
    return path


def test_a_slipped_point_is_named(tmp_path):
    path = write(
        tmp_path,
        ("hand", [0, 40, 25]),
        ("index_distal", [0, 180.0, 8]),
        ("hand", [1, 2, 20]),
    )
    with pytest.raises(FileError, match=r"marker 'M1' lies 180.2 mm from the joint"):
        load_marker_set(path)


def test_joints_may_be_markers(tmp_path):
    joints = [("hand", [0, 0, 0]), ("index_proximal", [0, 0, 0])]
    assert not load_marker_set(write(tmp_path, *joints)).at.any()
    assert load_marker_set(write(tmp_path, *joints, ("index_distal", [0, 18, 0])))


@pytest.mark.parametrize("size", [2.0, 5000.0])
def test_a_rigid_thing_may_be_small_or_large_but_not_in_metres(tmp_path, size):
    at = [("root", [size, 0, 0]), ("root", [0, size, 0]), ("root", [0, 0, 0])]
    path = write(tmp_path, *at, head='kind = "rigid"')
    assert np.abs(load_marker_set(path).at).max() == pytest.approx(size / 1e3)
    at = [(bone, (np.array(place) / 1e4).tolist()) for bone, place in at]
    with pytest.raises(FileError, match="are these m"):
        load_marker_set(write(tmp_path, *at, head='kind = "rigid"'))
