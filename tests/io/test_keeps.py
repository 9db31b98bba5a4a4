"""What formats keep: the table is true, and what is lost is named."""

from dataclasses import replace
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from told import texts

from handclean.errors import FileError
from handclean.hand.template import template
from handclean.io import files
from handclean.io.formats import TAKES_WRITTEN
from handclean.io.keeps import KEEPS, PARTS, kept, lost, table
from handclean.recording import (
    Analog,
    Event,
    Origin,
    Points,
    Recording,
    SourceEvent,
    motion_from_poses,
    trajectories,
)

DOUBT = slice(9, 12)
"""Frames of the take that are not trusted."""


@pytest.fixture
def take(rng):
    """Return a take in which every part is there."""
    frames, tree = 20, template("right")
    poses = np.zeros((frames, 7 + len(tree.hinges)))
    poses[:, 3] = 1.0
    poses[:, :3] = rng.normal(size=3)
    poses[:, 7:] = 0.3 * np.sin(np.linspace(0, 6, frames))[:, None] + 0.3
    trusted = np.ones(frames, bool)
    trusted[DOUBT] = False
    origin = np.full((frames, 3), Origin.MEASURED, np.uint8)
    origin[4:6, 0] = Origin.FILLED
    origin[7, 1] = Origin.SMOOTHED
    raw = np.full((frames, 3, 3), np.nan)
    raw[7, 1] = rng.normal(size=3)
    markers = trajectories(
        rng.normal(size=(frames, 3, 3)),
        ("A", "B", "C"),
        origin=origin,
        raw=raw,
        confidence=rng.random((frames, 3)).astype(np.float32),
        residual=np.full((frames, 3), 0.0005, np.float32),
        cameras=np.full((frames, 3), 3, np.uint8),
    )
    return Recording(
        rate=100.0,
        frames=frames,
        first_frame=7,
        start_time=2.345,
        up_axis="+y",
        markers=markers,
        unlabelled=Points(
            frame=np.array([3, 8], np.int32),
            source=np.array([3, 3], np.int32),
            positions=rng.normal(size=(2, 3)),
        ),
        skeletons={"right": tree},
        motions={"right": motion_from_poses(tree.hinges, poses, trusted=trusted)},
        events=(Event(start=4, stop=6, text="gap filled"),),
        analog=Analog(
            values=rng.normal(size=(frames, 1)), labels=("E",), units=("V",), rate=100.0
        ),
        source_events=(SourceEvent(time=0.05, label="grasp", context="Right"),),
        parameters={"c3d": {"groups": {"SUBJECTS": {"USED": 1}}}},
    )


def parts_of(path):
    """Keys of the parts that are found in a file."""
    if path.suffix == ".mot":
        columns = files.inspect(path)["columns"]
        found = {"angles"} if "index_mcp_flexion" in columns else set()
        found |= {"trust"} if files.inspect(path)["frames"] == 17 else set()
        begins = path.read_text().split("endheader\n")[1].splitlines()[1]
        found |= {"start_time"} if begins.startswith("2.345") else set()
        return found | ({"roots"} if "root_tx" in columns else set())
    if path.suffix == ".glb":
        about = files.inspect(path)
        found = {"angles", "roots"} if about["frames"] == 20 else set()
        found |= {"skeletons"} if about["skeletons"] else set()
        found |= {"trust"} if about["not_trusted"] == {"right": [[16, 18]]} else set()
        return found | ({"up_axis"} if about["up_axis"] == "+y" else set())
    back = files.read(path)
    found = {key for key, part in PARTS.items() if part.has(back)}
    if path.suffix == ".c3d" and len(files.inspect(path)["angles"]) == 15:
        found.add("angles")
        points = ezc3d.c3d(str(path))
        labels = points["parameters"]["POINT"]["LABELS"]["value"]
        angles = [n for n, label in enumerate(labels) if label.startswith("right:")]
        gone = np.isnan(points["data"]["points"][:3, angles]).all(axis=(0, 1))
        found |= {"trust"} if np.flatnonzero(gone).tolist() == [9, 10, 11] else set()
    return found


@pytest.mark.parametrize("suffix", list(KEEPS))
def test_a_format_keeps_what_the_table_says_and_no_more(suffix, take, tmp_path):
    assert all(part.has(take) for part in PARTS.values())
    path = tmp_path / f"a{suffix}"
    files.write(path, take)
    assert parts_of(path) == KEEPS[suffix]


def test_every_format_that_is_written_stands_in_the_table():
    assert set(KEEPS) == set(TAKES_WRITTEN)


@pytest.mark.parametrize("suffix", [s for s in KEEPS if s != ".h5"])
def test_one_line_names_what_a_format_loses(suffix, take, tmp_path):
    line = texts(files.write(tmp_path / f"a{suffix}", take))[0]
    assert line.startswith(f"{suffix[1:].upper()} keeps no ")
    for key, part in PARTS.items():
        named = line.removesuffix("; .h5 keeps everything").split(" keeps no ")[1]
        names = [name.partition(" (")[0] for name in named.split(", ")]
        assert (part.name in names) == (key not in KEEPS[suffix])


def test_a_c3d_keeps_the_events_of_its_source(take, tmp_path):
    bare = replace(take, events=())
    assert "events" not in texts(files.write(tmp_path / "a.c3d", bare))[0]
    (event,) = files.read(tmp_path / "a.c3d").source_events
    assert (event.label, event.context) == ("grasp", "Right")
    assert "events of the source" in texts(files.write(tmp_path / "a.trc", bare))[0]


def test_nothing_is_said_where_nothing_is_lost(take, tmp_path):
    assert files.write(tmp_path / "a.h5", take) == ()
    sure = replace(take.motions["right"], trusted=np.ones(20, bool))
    bare = Recording(rate=100.0, frames=20, motions={"right": sure})
    assert files.write(tmp_path / "a.mot", bare) == ()
    trap = Event(start=0, stop=20, text="2 samples at (0, 0, 0) count as missing")
    assert lost(replace(bare, events=(trap,)), ".csv") == ()


def test_what_is_kept_of_a_take_is_what_is_counted(take):
    assert kept(take, ".trc").motions == {}
    assert kept(take, ".trc").markers is take.markers
    assert kept(take, ".bvh").markers is None
    assert kept(take, ".bvh").unlabelled is None
    assert set(kept(take, ".mot").motions) == {"right"}
    cup = replace(take.motions["right"], names=(), angles=np.zeros((20, 0)))
    with_cup = replace(take, motions={**take.motions, "cup": cup})
    assert set(kept(with_cup, ".c3d").motions) == {"right"}
    assert set(kept(with_cup, ".csv").motions) == {"right", "cup"}


def test_the_readme_shows_the_table():
    readme = Path(__file__).parents[2] / "README.md"
    assert table() in readme.read_text(encoding="utf-8")


def test_bvh_says_how_many_frames_are_not_trusted_and_claims_no_trust(take, tmp_path):
    (line,) = texts(files.write(tmp_path / "a.bvh", take))
    assert "trust (3 of 20 frames are not trusted)" in line
    assert files.read(tmp_path / "a.bvh").motions["right"].trusted is None


def test_a_mot_has_no_row_for_a_frame_that_is_not_trusted(take, tmp_path):
    notes = texts(files.write(tmp_path / "a.mot", take))
    assert "3 of 20 frames are left out: they are not trusted" in notes[1]
    rows = (tmp_path / "a.mot").read_text().split("endheader\n")[1].splitlines()[1:]
    times = [float(row.split("\t")[0]) for row in rows]
    assert np.allclose(times, 2.345 + np.delete(take.times, DOUBT))


def test_a_mot_of_which_nothing_is_trusted_is_refused_and_one_such_hand_left_out(
    take, tmp_path
):
    poor = replace(take.motions["right"], trusted=np.zeros(20, bool))
    with pytest.raises(FileError, match="known and trusted"):
        files.write(tmp_path / "a.mot", replace(take, motions={"right": poor}))
    both = replace(take, motions={"left": poor, **take.motions})
    notes = texts(files.write(tmp_path / "b.mot", both))
    assert "motion 'left' is left out: it is not trusted throughout" in notes
    assert files.inspect(tmp_path / "b.mot")["frames"] == 17


def test_a_csv_says_for_each_motion_which_frames_are_trusted(take, tmp_path):
    alone = replace(take.motions["right"], trusted=None)
    for motions in (take.motions, {**take.motions, "left": alone}):
        files.write(tmp_path / "a.csv", replace(take, motions=motions))
        back = files.read(tmp_path / "a.csv").motions
        assert np.array_equal(back["right"].trusted, take.motions["right"].trusted)
        assert "left" not in back or back["left"].trusted is None


def test_a_csv_whose_trust_is_neither_0_nor_1_is_refused(take, tmp_path):
    files.write(tmp_path / "a.csv", take)
    text = (tmp_path / "a.csv").read_text().splitlines()
    text[5] = text[5][:-1] + "2"
    (tmp_path / "a.csv").write_text("\n".join(text) + "\n")
    with pytest.raises(FileError, match="'trusted' should hold 0 or 1"):
        files.read(tmp_path / "a.csv")


def test_a_glb_counts_and_lists_what_is_not_trusted(take, tmp_path):
    notes = texts(files.write(tmp_path / "a.glb", take))
    assert any("3 of 20 frames of 'right' are not trusted" in note for note in notes)


def test_a_c3d_has_no_angles_in_frames_that_are_not_trusted(take, tmp_path):
    notes = texts(files.write(tmp_path / "a.c3d", take))
    assert "angles of 'right' are missing in 3 of 20 frames" in notes[1]


@pytest.mark.parametrize(
    ("suffix", "count"), [(".h5", 17), (".csv", 17), (".bvh", None)]
)
def test_inspect_counts_trusted_frames_where_a_file_says(suffix, count, take, tmp_path):
    files.write(tmp_path / f"a{suffix}", take)
    about = files.inspect(tmp_path / f"a{suffix}")["motions"]["right"]
    assert about["trusted_frames"] == count
