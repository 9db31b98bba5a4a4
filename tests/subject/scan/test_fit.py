from dataclasses import replace

import numpy as np
import pytest
from scanned import coarse_start, scanned
from told import texts

from handclean.errors import HandcleanError, UsageError
from handclean.hand.model import joint_positions
from handclean.hand.skinning import posed
from handclean.hand.surface import is_closed
from handclean.numerics.triangles import closest
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate_scan
from handclean.subject.scan.cloud import Scan
from handclean.subject.scan.fit import fit_scan
from handclean.subject.scan.settings import ScanConfig

QUICK = ScanConfig(rounds=8, steps=1)


def joints_off(fitted, truth):
    """[m] distance of every joint from where it is, in the scan."""
    found = fitted.rebuilt
    there = joint_positions(found.tree, found.pose[None])[0]
    return np.linalg.norm(
        there - joint_positions(truth.tree, truth.pose[None])[0], axis=1
    )


def skin_off(vertices, truth):
    """[m] distance of vertices from the true skin."""
    return closest(truth.places, truth.surface.faces, vertices).distance


@pytest.fixture(scope="module", params=["right", "left"])
def fit(request):
    start = coarse_start(request.param)
    truth = scanned(5, request.param, size=1.08, count=12_000, start=start)
    said = []
    fitted = fit_scan(
        truth.scan,
        truth.marks,
        QUICK,
        side=request.param,
        name="S",
        start=start,
        progress=said.append,
    )
    return truth, fitted, said


def test_skin_and_joints_come_out_to_a_millimetre(fit):
    truth, fitted, _ = fit
    off = skin_off(fitted.registered.vertices, truth)
    assert off.mean() < 0.0004
    assert np.percentile(off, 95) < 0.0012
    assert joints_off(fitted, truth).mean() < 0.002


def test_each_stage_comes_nearer_to_the_truth(fit):
    truth, fitted, _ = fit
    before = skin_off(fitted.aligned.vertices(), truth)
    after = skin_off(fitted.registered.vertices, truth)
    assert after.mean() < 0.5 * before.mean()


def test_the_subject_is_in_the_zero_posture_and_complete(fit):
    truth, fitted, _ = fit
    subject, found = fitted.subject, fitted.rebuilt
    tree, surface = subject.model.tree, subject.surface
    assert subject.name == tree.subject == "S"
    assert subject.model.labels == ()
    assert tree.side == truth.tree.side
    assert tree.scale == pytest.approx(1.08, rel=0.06)
    assert is_closed(surface.faces)
    again = posed(surface, tree, found.pose[None])[0]
    np.testing.assert_allclose(again, fitted.registered.vertices, atol=1e-9)
    zero = posed(truth.surface, truth.tree, np.eye(1, 27, 3))[0]
    off = closest(zero, truth.surface.faces, surface.vertices).distance
    assert off.mean() < 0.003


def test_the_report_says_what_was_done(fit):
    truth, fitted, said = fit
    report = fitted.report
    assert report.points == len(truth.scan.points)
    assert report.points_used < report.points
    assert report.left_out_color > 0
    assert report.landmarks == len(truth.marks)
    assert set(report.landmarks_away_m) == set(truth.marks)
    assert max(report.landmarks_away_m.values()) < 0.012
    assert 0.0003 < report.fit_mean_m < 0.0007  # the scan's noise
    assert 0.85 < report.covered <= 1.0
    assert texts(report.remarks) == ()
    assert len(said) > 15


def test_the_same_scan_gives_the_same_hand():
    start = coarse_start()
    truth = scanned(6, count=4000, start=start)
    one, two = (fit_scan(truth.scan, truth.marks, QUICK, start=start) for _ in range(2))
    np.testing.assert_array_equal(
        one.subject.surface.vertices, two.subject.surface.vertices
    )
    np.testing.assert_array_equal(
        one.subject.model.tree.offsets, two.subject.model.tree.offsets
    )


def test_points_alone_are_enough_and_what_is_missing_is_said():
    start = coarse_start()
    truth = scanned(7, count=8000, start=start)
    marks = {k: v for k, v in truth.marks.items() if k != "ring_tip"}
    fitted = fit_scan(Scan(points=truth.scan.points), marks, QUICK, start=start)
    assert skin_off(fitted.registered.vertices, truth).mean() < 0.0006
    told = " ".join(texts(fitted.report.remarks))
    for word in ("no colors", "no normals", "ring_tip"):
        assert word in told


def test_the_wrong_side_is_told():
    start = coarse_start()
    truth = scanned(8, "left", count=3000, start=coarse_start("left"))
    with pytest.raises(UsageError, match="--side left"):
        fit_scan(truth.scan, truth.marks, QUICK, start=start)
    with pytest.raises(UsageError, match="left or right"):
        fit_scan(truth.scan, truth.marks, QUICK, side="both")


def test_exchanged_landmarks_are_told():
    start = coarse_start()
    truth = scanned(9, count=3000, start=start)
    marks = dict(truth.marks)
    marks["index_tip"], marks["little_tip"] = marks["little_tip"], marks["index_tip"]
    with pytest.raises(HandcleanError, match=r"(index|little)_tip lies .* named right"):
        fit_scan(truth.scan, marks, QUICK, start=start)


@pytest.mark.slow
@pytest.mark.parametrize("pair", [("index_tip", "middle_tip"), ("index_tip", None)])
def test_landmarks_that_are_let_pass_and_are_wrong_are_warned_of(pair):
    start = coarse_start()
    truth = scanned(9, count=4000, start=start)
    marks = dict(truth.marks)
    one, two = pair
    if two is None:
        marks[one] = marks["index_pip"] + 0.4 * (marks[one] - marks["index_pip"])
    else:
        marks[one], marks[two] = marks[two], marks[one]
    report = fit_scan(truth.scan, marks, QUICK, start=start).report
    (told,) = texts(report.remarks)
    assert one in told
    assert "are they named right?" in told
    assert report.landmarks_away_m[one] > 0.01
    if two is not None:
        assert f"{one} and {two} would fit better exchanged" in told


def test_simulated_scans_come_out_to_a_millimetre():
    """A man's, a woman's; eight cameras, a table, a sleeve."""
    for number in (0, 7):
        made = simulate_scan("scan", SimulateConfig(subjects=20), number)
        scan = Scan(points=made.points, normals=made.normals, colors=made.colors)
        side = made.subject.model.tree.side
        fitted = fit_scan(scan, made.landmarks, ScanConfig(), side=side)
        feet = closest(
            made.skin, made.subject.surface.faces, fitted.registered.vertices
        )
        assert feet.distance.mean() < 0.0005
        found = fitted.rebuilt
        there = joint_positions(found.tree, found.pose[None])[0]
        true = joint_positions(made.subject.model.tree, made.pose[None])[0]
        assert np.linalg.norm(there - true, axis=1).mean() < 0.002


def test_settings_are_checked():
    for wrong in (
        {"rounds": -1},
        {"steps": 0},
        {"least_landmarks": 3},
        {"soft": 1.0},
        {"reach_m": 0.0},
        {"points": 10},
        {"landmark_weight": -1.0},
    ):
        with pytest.raises(ValueError, match="should"):
            replace(ScanConfig(), **wrong)
