"""TRC as OpenSim reads it: with a parser as strict as its own, and with itself."""

import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from told import texts

from handclean.errors import FileError
from handclean.io import files
from handclean.io.text.trc_read import read_trc
from handclean.io.text.trc_write import write_trc
from handclean.recording import Points, Recording, trajectories
from tests.io.text import opensim_trc

NAMES = ("A", "B", "C")


@pytest.fixture
def take(rng):
    """Return a take of three markers and some points without a name."""
    points = Points(
        frame=np.array([0, 0, 2], np.int32),
        source=np.array([4, 9, 4], np.int32),
        positions=rng.normal(size=(3, 3)),
    )
    markers = trajectories(rng.normal(size=(6, 3, 3)), NAMES)
    return Recording(rate=120.0, frames=6, markers=markers, unlabelled=points)


def with_gap(take, *columns):
    """Return the take without these markers in frames 2 and 3."""
    positions = take.markers.positions.copy()
    positions[2:4, columns] = np.nan
    return replace(take, markers=trajectories(positions, take.markers.labels))


gaps = pytest.mark.parametrize("columns", [(0,), (1,), (2,), (0, 2), (0, 1, 2), ()])


@gaps
@pytest.mark.parametrize("unnamed", [False, True])
def test_a_gap_in_any_marker_is_nan_in_a_row_of_full_length(
    columns, unnamed, take, tmp_path
):
    gap = with_gap(take, *columns)
    write_trc(tmp_path / "a.trc", gap, unnamed=unnamed)
    labels, times, places, said = opensim_trc.read(tmp_path / "a.trc")
    assert labels == [*NAMES, *(["U_0", "U_1"] if unnamed else [])]
    np.testing.assert_allclose(times, gap.clock, atol=1e-6)
    np.testing.assert_allclose(places[:, :3], 1e3 * gap.markers.positions, atol=1e-6)
    assert (said["Units"], said["DataRate"]) == ("mm", "120")
    if unnamed:
        assert np.isfinite(places[:, 3:]).all(axis=2).sum() == 3


@gaps
@pytest.mark.parametrize("unnamed", [False, True])
def test_opensim_itself_reads_what_is_written(columns, unnamed, take, tmp_path):
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("Off")
    odd = trajectories(take.markers.positions, ("B b", "L/A*", "Bob:ä"))
    gap = with_gap(replace(take, markers=odd, start_time=2.345), *columns)
    path = tmp_path / "a.trc"
    write_trc(path, gap, unnamed=unnamed)
    table = opensim.TimeSeriesTableVec3(str(path))
    labels = list(table.getColumnLabels())
    assert labels[:3] == ["B_b", "L_A_", "Bob:ä"]
    assert len(labels) == (5 if unnamed else 3)
    np.testing.assert_allclose(table.getIndependentColumn(), gap.clock, atol=1e-6)
    for m in range(3):
        column = table.getDependentColumn(labels[m])
        found = np.array([[column[t][axis] for axis in range(3)] for t in range(6)])
        np.testing.assert_allclose(found, 1e3 * gap.markers.positions[:, m], atol=1e-6)
    reference = opensim.MarkersReference(str(path), opensim.SetMarkerWeights())
    assert reference.getNumFrames() == 6
    model = opensim.Model()
    for label in labels:
        marker = opensim.Marker()
        marker.setName(label)
        marker.setParentFrame(model.getGround())
        model.addMarker(marker)
    model.finalizeConnections()


def test_points_without_a_name_are_left_out_counted_and_written_on_request(
    take, tmp_path
):
    lost = texts(files.write(tmp_path / "a.trc", take))
    assert lost[0] == "TRC keeps no points without a name (3); .h5 keeps everything"
    assert any("convert --unnamed" in line for line in lost[1:])
    assert read_trc(tmp_path / "a.trc").recording.unlabelled is None
    assert files.write(tmp_path / "b.trc", take, unnamed=True) == ()
    back = read_trc(tmp_path / "b.trc").recording
    assert back.markers.labels == NAMES
    assert back.unlabelled.frame.tolist() == [0, 0, 2]
    np.testing.assert_allclose(
        back.unlabelled.positions, take.unlabelled.positions, atol=1e-9
    )


@pytest.mark.parametrize("source", [[4, 9, 4], [-1, -1, -1], [4, 4, 4]])
def test_unlabelled_points_alone_are_written_on_request_and_come_back(source, tmp_path):
    points = Points(
        frame=np.array([0, 0, 2], np.int32),
        source=np.array(source, np.int32),
        positions=np.arange(9.0).reshape(3, 3) + 1,
    )
    take = Recording(rate=1.0, frames=3, unlabelled=points)
    with pytest.raises(FileError, match="none of 3 points has a name; convert --unn"):
        write_trc(tmp_path / "a.trc", take)
    write_trc(tmp_path / "a.trc", take, unnamed=True)
    back = read_trc(tmp_path / "a.trc").recording
    assert back.markers is None
    np.testing.assert_array_equal(back.unlabelled.frame, points.frame)
    np.testing.assert_array_equal(back.unlabelled.positions, points.positions)
    assert back.unlabelled.source.tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("labels", "models", "expected"),
    [
        (("B b", "B_b", "B+b"), ("", "", ""), ["B_b", "B_b_2", "B_b_3"]),
        (("T", "T", "T"), ("left", "right", "right"), ["T", "right:T", "right:T_2"]),
        (("a/b\\c", "*0", " d\u00a0e "), ("", "", ""), ["a_b_c", "_0", "d_e"]),
        (("A", "a", "Bob:A"), ("", "", ""), ["A", "a", "Bob:A"]),
    ],
)
def test_names_are_such_as_opensim_takes_each_once_and_changes_are_said(
    labels, models, expected, take, tmp_path
):
    markers = trajectories(take.markers.positions, labels, model=models)
    notes = texts(write_trc(tmp_path / "a.trc", replace(take, markers=markers)))
    assert opensim_trc.read(tmp_path / "a.trc")[0] == expected
    for old, new in zip(labels, expected, strict=True):
        said = any(f"'{old}' as '{new}'" in note for note in notes)
        assert said == (old != new)


@given(rate=st.floats(0.01, 1e8), start=st.sampled_from([0.0, 2.345, -7.5]))
def test_times_rise_at_any_rate(rate, start, tmp_path_factory):
    path = tmp_path_factory.mktemp("trc") / "a.trc"
    markers = trajectories(np.ones((4, 1, 3)), ("A",))
    write_trc(path, Recording(rate=rate, frames=4, markers=markers, start_time=start))
    assert opensim_trc.read(path)[1][0] == pytest.approx(start, abs=1e-9)


def test_a_sample_without_one_of_its_axes_is_missing(take, tmp_path):
    take.markers.positions[1, 1, 2] = np.nan
    write_trc(tmp_path / "a.trc", take)
    assert np.isnan(opensim_trc.read(tmp_path / "a.trc")[2][1, 1]).all()


def test_a_name_of_nothing_is_an_error_and_no_file(take, tmp_path):
    markers = trajectories(take.markers.positions, ("A", "\t", "C"))
    with pytest.raises(FileError, match="cannot hold a marker"):
        write_trc(tmp_path / "a.trc", replace(take, markers=markers))
    with pytest.raises(FileError, match="no markers"):
        write_trc(tmp_path / "a.trc", Recording(rate=1.0, frames=3))
    assert os.listdir(tmp_path) == []
