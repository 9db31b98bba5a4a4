from dataclasses import replace

import numpy as np
import pytest
from people import as_take, exercise
from told import texts

from handclean.errors import HandcleanError, UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.subject import Subject
from handclean.hand.surface import rest_joints
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.subject.calibrate import measure
from handclean.subject.frames import gather
from handclean.subject.scan.locate import locate_markers
from handclean.subject.scan.markers import place, put_on_skin, with_forearm
from handclean.subject.settings import CalibrateConfig

NONE = np.zeros(0, dtype=np.int64)
FEW = CalibrateConfig(frames=60, holdout=0.0)


def scanned_hand(side="right", size=1.07):
    """A hand whose palm and fingers no scaling of the template gives."""
    tree = template(side, 0.1872 * size, 0.0849 * size)
    offsets = tree.offsets.copy()
    offsets[5:] *= np.linspace(0.95, 1.05, len(offsets) - 5)[:, None]
    tree = replace(tree, offsets=offsets)
    return Subject(
        name="S",
        model=Model(tree=tree, labels=(), bone=NONE, at=np.zeros((0, 3))),
        marker_set="",
        marker_sigma=np.zeros(0),
        surface=template_surface(tree, plump=1.08),
        errors={"scan_fit_mean_m": 1e-4},
    )


def glued(subject, name, rng, askew=0.003):
    """The true hand: markers where they should be, but for some millimetres."""
    model, normals = put_on_skin(subject, load_marker_set(name))
    off = rng.normal(scale=askew, size=model.at.shape)
    off -= normals * np.sum(normals * off, axis=1, keepdims=True)
    return replace(model, at=model.at + off + 0.001 * normals)


def still(model, rng, frames=40, noise=0.0002):
    """A take of the hand held flat, each joint some degrees off."""
    pose = neutral_pose(model.tree)
    pose[7:] = np.radians(rng.normal(3.0, 3.0, len(model.tree.hinges)))
    poses = np.tile(pose, (frames, 1))
    poses[:, :3] += rng.normal(scale=0.002, size=(frames, 3))
    seen = marker_positions(model, poses)
    return as_take(seen + rng.normal(scale=noise, size=seen.shape), model.labels), pose


@pytest.mark.parametrize("side", ["right", "left"])
def test_markers_lie_over_the_scanned_skin_as_over_the_templates(side):
    """On a hand that is the template, they are where the set has them."""
    tree = template(side)
    subject = replace(
        scanned_hand(side),
        model=Model(tree=tree, labels=(), bone=NONE, at=np.zeros((0, 3))),
        surface=template_surface(tree),
    )
    marker_set = load_marker_set("maycock26")
    model, normals = put_on_skin(subject, marker_set)
    np.testing.assert_allclose(model.at, marker_set.on(tree).at, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)


def test_on_a_plump_hand_markers_are_farther_out():
    subject = scanned_hand()
    thin = replace(subject, surface=template_surface(subject.model.tree, plump=1.0))
    marker_set = load_marker_set("maycock26")
    (fat, normals), (slim, _) = (put_on_skin(s, marker_set) for s in (subject, thin))
    out = np.sum((fat.at - slim.at) * normals, axis=1)
    assert np.median(out) > 0.0003


def test_a_neutral_take_places_markers_to_a_millimetre_or_two(rng):
    subject = scanned_hand()
    truth = glued(subject, "maycock26", rng)
    take, pose = still(truth, rng)
    found = place(subject, load_marker_set("maycock26"), gather([take], truth.labels))
    start = put_on_skin(subject, load_marker_set("maycock26"))[0]
    before = np.linalg.norm(start.at - truth.at, axis=1)
    after = np.linalg.norm(found.model.at - truth.at, axis=1)
    assert after.mean() < 0.7 * before.mean()
    assert found.rms_m < 0.0005
    assert found.start_rms_m > 0.002
    assert texts(found.remarks) == ()
    angles = np.degrees(found.poses[:, 7:] - pose[7:])
    assert np.abs(angles).mean() < 6.0


def test_takes_that_move_refine_hand_and_places(rng):
    subject = scanned_hand()
    truth = glued(subject, "maycock26", rng)
    neutral, _ = still(truth, rng)
    poses = exercise(rng, truth.tree, 400, 50.0)
    seen = marker_positions(truth, poses)
    noisy = seen + rng.normal(scale=0.0002, size=seen.shape)
    rom = as_take(noisy, truth.labels)
    marker_set = load_marker_set("maycock26")
    alone = locate_markers(subject, [neutral], marker_set, FEW)
    assert alone.report is None
    assert np.isnan(alone.subject.marker_sigma).all()
    assert alone.subject.errors["scan_fit_mean_m"] == 1e-4
    assert alone.subject.errors["neutral_rms_m"] == alone.placed.rms_m
    refined = locate_markers(subject, [neutral, rom], marker_set, FEW, name="T")
    assert refined.report is not None
    assert refined.subject.name == "T"
    assert refined.subject.surface is subject.surface
    assert refined.subject.errors["scan_fit_mean_m"] == 1e-4
    heldout = measure(refined.subject, [rom])
    assert heldout.rms_m < 0.0006
    lengths = [
        np.linalg.norm(m.tree.offsets[2:], axis=1)
        for m in (refined.subject.model, truth)
    ]
    assert np.abs(lengths[0] - lengths[1]).mean() < 0.001


def test_what_is_no_scanned_hand_is_refused(rng):
    subject = scanned_hand()
    truth = glued(subject, "maycock26", rng)
    take, _ = still(truth, rng)
    marker_set = load_marker_set("maycock26")
    with pytest.raises(UsageError, match="has no skin"):
        locate_markers(replace(subject, surface=None), [take], marker_set, FEW)


def test_a_marker_that_the_neutral_take_lacks_is_named(rng):
    subject = scanned_hand()
    truth = glued(subject, "maycock26", rng)
    take, _ = still(truth, rng)
    hidden = take.markers.positions.copy()
    hidden[:, 4] = np.nan
    lacking = as_take(hidden, truth.labels)
    with pytest.raises(HandcleanError, match=truth.labels[4]):
        locate_markers(subject, [lacking], load_marker_set("maycock26"), FEW)
    nothing = as_take(np.full_like(hidden, np.nan), truth.labels)
    with pytest.raises(HandcleanError, match="held still"):
        locate_markers(subject, [nothing], load_marker_set("maycock26"), FEW)


def test_a_forearm_is_hung_on_where_the_set_needs_one():
    tree = with_forearm(template("right"), True)
    expected = template("right", forearm=True)
    assert tree.bones == expected.bones
    assert tree.hinges == expected.hinges
    np.testing.assert_array_equal(rest_joints(tree), rest_joints(expected))
    np.testing.assert_array_equal(tree.limits, expected.limits)
    assert with_forearm(tree, True) is tree
    bare = template("left")
    assert with_forearm(bare, False) is bare


def test_markers_on_the_forearm_have_no_place_on_the_skin(rng):
    subject = scanned_hand("left")
    truth = glued(subject, "xu19", rng)
    take, _ = still(truth, rng)
    marker_set = load_marker_set("xu19")
    found = place(subject, marker_set, gather([take], truth.labels))
    on_arm = np.array([bone == "forearm" for bone in marker_set.bones])
    np.testing.assert_array_equal(found.on.face < 0, on_arm)
    assert on_arm.any()
