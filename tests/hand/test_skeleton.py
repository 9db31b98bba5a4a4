"""Joint trees from TOML: what is written is what moves; what is wrong is told."""

import numpy as np
import pytest
from oracles import random_tree

from handclean.errors import FileError, UnknownNameError, UsageError
from handclean.hand.marker_set import load_marker_set, shipped
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.skeleton import load_skeleton, rigid_subject
from handclean.hand.template import template

PLIERS = """
name = "pliers"
[[bone]]
name = "handle"
[[bone]]
name = "jaw"
parent = "handle"
offset = [0.0, 62.0, 0.0]
[[bone.hinge]]
name = "opening"
axis = [0.0, 0.0, 2.0]
limits = [0.0, 40.0]
[[marker]]
label = "P1"
bone = "jaw"
at = [0.0, 30.0, 5.0]
"""


def written(tmp_path, text):
    path = tmp_path / "thing.toml"
    path.write_text(text)
    return path


def test_a_hinge_turns_its_bone_about_its_axis(tmp_path):
    subject = load_skeleton(written(tmp_path, PLIERS))
    pose = neutral_pose(subject.model.tree)
    pose[7] = np.radians(30.0)
    place = marker_positions(subject.model, pose[None])[0, 0]
    want = [-0.030 * np.sin(pose[7]), 0.062 + 0.030 * np.cos(pose[7]), 0.005]
    np.testing.assert_allclose(place, want, atol=1e-12)
    np.testing.assert_allclose(np.degrees(subject.model.tree.limits), [[0.0, 40.0]])


def test_a_rigid_object_is_a_tree_of_one_joint(tmp_path):
    path = tmp_path / "cup.toml"
    path.write_text('kind = "rigid"\n[[marker]]\nlabel = "C1"\nat = [1.0, 2.0, 3.0]\n')
    subject = rigid_subject(load_marker_set(path))
    assert len(subject.model.tree.bones) == 1
    assert subject.model.tree.dofs == 6
    np.testing.assert_allclose(subject.model.at, [[0.001, 0.002, 0.003]])


@pytest.mark.parametrize("written", ["", "left", "right"])
def test_places_of_a_rigid_set_hold_on_its_own_side(tmp_path, written):
    path = tmp_path / "cup.toml"
    side = f'side = "{written}"\n' if written else ""
    marker = '[[marker]]\nlabel = "C1"\nat = [1.0, 2.0, 3.0]\n'
    path.write_text(f'kind = "rigid"\n{side}{marker}')
    markers = load_marker_set(path)
    subject = rigid_subject(markers)
    assert subject.model.tree.side == written
    np.testing.assert_allclose(subject.model.at, [[0.001, 0.002, 0.003]])
    for asked in ("left", "right"):
        if not written:
            with pytest.raises(UsageError, match="without sides"):
                rigid_subject(markers, asked)
            continue
        subject = rigid_subject(markers, asked)
        x = 0.001 if asked == written else -0.001
        assert subject.model.tree.side == asked
        np.testing.assert_allclose(subject.model.at, [[x, 0.002, 0.003]])


def test_a_limb_is_named_after_its_innermost_hinge(rng):
    for tree in (template("left", forearm=True), *(random_tree(rng, 9) for _ in "ab")):
        moves = tree.carried_by()
        first = np.argmax(moves, axis=1) if moves.size else 0
        want = np.where(moves.any(axis=1), first, -1)
        np.testing.assert_array_equal(tree.limbs(), want)
    one = random_tree(rng, 1)
    assert tuple(one.limbs()) == (-1,)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("axis = [0.0, 0.0, 2.0]", "axis = [0.0, 0.0, 0.0]", "axis of length 0"),
        ("axis = [0.0, 0.0, 2.0]", "axis = [0.0]", "give 3 numbers"),
        ("limits = [0.0, 40.0]", "limits = [50.0, 40.0]", "lower limits"),
        ("name = \"opening\"", "nam = \"opening\"", "did you mean name"),
        ("offset = [0.0, 62.0, 0.0]", "offset = [nan, 0, 0]", "give 3 numbers"),
        ("parent = \"handle\"", "parent = \"hndle\"", "did you mean handle"),
        ("bone = \"jaw\"", "bone = \"jw\"", "did you mean jaw"),
        ("[[bone]]", "[bone", "not a skeleton"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_in_one_line(tmp_path, old, new, says):
    path = written(tmp_path, PLIERS.replace(old, new, 1))
    with pytest.raises((FileError, UnknownNameError), match=says) as caught:
        load_skeleton(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_marker_set_loads_and_says_where_it_is_from(name):
    found = load_marker_set(name)
    assert "published" in found.source or "reconstructed" in found.source
    assert len(set(found.labels)) == len(found.labels)
    assert np.abs(found.at).max() < 0.13
