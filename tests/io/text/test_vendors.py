"""CSV of Vicon Nexus and OptiTrack Motive, in the forms they are exported in."""

import numpy as np
import pandas as pd
import pytest
from told import texts

from handclean.errors import FileError, UsageError
from handclean.io import files
from handclean.io.text.csv_read import read_csv
from tests.io.text import vendor_files

SEEDS = range(80)


def written(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def lines(tmp_path, *rows):
    return written(tmp_path, "\n".join([*rows, ""]))


def expect(take, truth):
    """Compare named markers; places of the others by what they are."""
    named = vendor_files.named(truth["names"])
    columns = [truth["names"].index(name) for name in named]
    assert (take.rate, take.first_frame) == (truth["rate"], truth["first"])
    assert (take.markers.labels if take.markers else ()) == tuple(named)
    if named:
        np.testing.assert_allclose(
            take.markers.positions, truth["positions"][:, columns], rtol=1e-15
        )
    loose = [k for k in range(len(truth["names"])) if k not in columns]
    found = np.zeros((0, 3)) if take.unlabelled is None else take.unlabelled.positions
    other = truth["positions"][:, loose].reshape(-1, 3)
    if "loose" in truth:
        other = truth["loose"].reshape(-1, 3)
    np.testing.assert_allclose(found, other[np.isfinite(other[:, 0])], rtol=1e-15)


# --- Vicon Nexus --------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_trajectories_of_nexus_are_read_from_any_form(seed, tmp_path):
    text, truth = vendor_files.nexus(np.random.default_rng(seed))
    reading = read_csv(written(tmp_path, text))
    expect(reading.recording, truth)
    assert reading.told["program"] == "Vicon Nexus"
    assert set(reading.told["sections"]) == {"Trajectories", *truth["sections"]}
    assert reading.told["subjects"] == truth["subjects"]
    left_out = [one for one in reading.remarks if "sections" in one.data]
    assert [set(one.data["sections"]) for one in left_out] == (
        [set(truth["sections"])] if truth["sections"] else []
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_nexus_has_the_cells_that_a_naive_reader_finds(seed, tmp_path):
    text, truth = vendor_files.nexus(np.random.default_rng(1000 + seed))
    head, axes, body = vendor_files.read_naively(text)
    take, over = read_csv(written(tmp_path, text)).recording, head[-1]
    for m, label in enumerate(take.markers.labels if take.markers else ()):
        k = over.index(label)
        assert [axis.upper() for axis in axes[k : k + 3]] == ["X", "Y", "Z"]
        cells = [(row + [""] * len(axes))[k : k + 3] for row in body]
        want = np.array([[float(x) if x else np.nan for x in row] for row in cells])
        found = take.markers.positions[:, m]
        np.testing.assert_allclose(found, want * truth["metres"], rtol=1e-12)


HEAD = [",,Hand:A,,,Hand:B,,", "Frame,Sub Frame,X,Y,Z,X,Y,Z", ",,mm,mm,mm,mm,mm,mm"]
ROWS = [f"{101 + k},0,1,2,{k},4,5,6" for k in range(4)]
NEXUS = ["Trajectories", "100", *HEAD, *ROWS]
DEVICES = ["Devices", "1000", ",,Plate", "Frame,Sub Frame,Fx,Fy,Fz", ",,N,N,N"]


@pytest.mark.parametrize("make", [vendor_files.nexus, vendor_files.motive])
def test_they_may_have_the_suffix_of_a_table_parted_by_tabs(make, tmp_path):
    text, truth = make(np.random.default_rng(5))
    (tmp_path / "a.tsv").write_bytes(text.encode())
    expect(files.read(tmp_path / "a.tsv", unit=truth.get("unit")), truth)


def test_inspect_says_program_subjects_rate_unit_and_first_frame(tmp_path):
    about = files.inspect(lines(tmp_path, *NEXUS))
    assert about["program"] == "Vicon Nexus"
    assert about["subjects"] == ["Hand"]
    assert (about["rate"], about["unit"], about["first_frame"]) == (100.0, "mm", 101)
    assert about["markers"] == ["Hand:A", "Hand:B"]


def test_two_subjects_may_have_markers_of_one_name(tmp_path):
    rows = [line.replace("Hand:B", "Cup:A") for line in NEXUS]
    reading = read_csv(lines(tmp_path, *rows))
    assert reading.recording.markers.labels == ("Hand:A", "Cup:A")
    assert reading.told["subjects"] == ["Hand", "Cup"]


def test_without_a_line_of_units_nexus_is_asked_for_one(tmp_path):
    rows = [*NEXUS[:4], *NEXUS[5:]]
    with pytest.raises(UsageError, match=r"its unit; give --unit mm.cm.m$"):
        read_csv(lines(tmp_path, *rows))
    places = read_csv(lines(tmp_path, *rows), unit="cm").recording.markers.positions
    np.testing.assert_allclose(places[0, 0], [0.01, 0.02, 0.0])


def test_a_blank_line_between_rows_ends_no_section(tmp_path):
    rows = [*NEXUS[:7], "", ",,,", *NEXUS[7:], "", *DEVICES, "1,0,1,2,3"]
    assert read_csv(lines(tmp_path, *rows)).recording.frames == 4


def test_a_last_row_that_was_cut_can_be_left_out(tmp_path):
    path = written(tmp_path, "\n".join(NEXUS)[:-4])
    with pytest.raises(FileError, match="--lenient saves 3 rows"):
        read_csv(path)
    assert read_csv(path, lenient=True).recording.frames == 3


def test_lines_are_counted_from_the_start_of_the_file(tmp_path):
    bad = [row.replace("4,5,6", "4,oops,6") for row in NEXUS]
    path = lines(tmp_path, *DEVICES, *["1,0,1,2,3"] * 5, "", *bad)
    with pytest.raises(FileError, match="line 17 column 7: 'oops' is not a number"):
        read_csv(path)


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ([*DEVICES, "1,0,1,2,3"], "Vicon Nexus with Devices only; export the trial's"),
        ([*NEXUS, "", *NEXUS], "has 2 sections of trajectories; one trial"),
        (["Trajectories", "0", *NEXUS[2:]], "the rate below 'Trajectories' is '0'"),
        (["Trajectories", "-1", *NEXUS[2:]], "the rate below 'Trajectories' is '-1'"),
        ([*NEXUS[:3], *NEXUS[4:]], "line 4: begins with ''; a line Frame,Sub Frame"),
        ([x.replace("mm", "inch") for x in NEXUS], "unit of length is 'inch'"),
        ([x.replace("mm,mm", "mm,m") for x in NEXUS], "its columns are in m and in mm"),
        ([x.replace("mm,mm", "mm,ft") for x in NEXUS], "its columns are in mm, ft"),
        (
            [x.replace("Hand:B", "Hand:A") for x in NEXUS],
            "2 markers are called 'Hand:A'",
        ),
        ([x.replace("Z,X", "Q,X") for x in NEXUS], "marker 'Hand:A' has no Z column"),
        ([x.replace("X,Y,Z", "U,V,W") for x in NEXUS], "has no markers; names belong"),
        (NEXUS[:5], "has no frames"),
        (NEXUS[:3], "ends after line 3"),
        (NEXUS[:2], "ends after line 2"),
        ([*NEXUS, "101,0,1,2,3,4,5,6"], "frame 101 follows frame 104"),
        ([*NEXUS, "105,0,1,2,3,4,5"], "has 7 cells"),
        ([*NEXUS, "105,0,1,2,3,4,5,6,7", "106,0"], "has more than 8 cells"),
        ([*NEXUS[:5], "101;0;1,5;2;3;4;5;6"], "decimal comma"),
    ],
)
def test_a_broken_file_of_nexus_is_one_clear_line(rows, says, tmp_path):
    if "decimal" in says:
        rows = [row.replace(",", ";") if ";" not in row else row for row in rows]
    with pytest.raises((FileError, UsageError), match=says) as caught:
        read_csv(lines(tmp_path, *rows))
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "a.csv"))


def test_the_rate_of_nexus_may_not_be_contradicted(tmp_path):
    with pytest.raises(UsageError, match="--rate 120 contradicts its 100 Hz"):
        read_csv(lines(tmp_path, *NEXUS), rate_hz=120.0)
    assert read_csv(lines(tmp_path, *NEXUS), rate_hz=100.0).recording.rate == 100.0


@pytest.mark.parametrize("word", ["Trajectories", "Devices", "Events"])
def test_a_title_without_a_rate_is_the_name_of_a_column(word, tmp_path):
    path = lines(tmp_path, f"{word},A_X,A_Y,A_Z", "1,1,2,3", "2,1,2,3")
    reading = read_csv(path, rate_hz=1.0, unit="mm")
    assert reading.recording.markers.labels == ("A",)
    assert texts(reading.remarks) == (f"not a marker's place, left out: {word}",)


# --- OptiTrack Motive ---------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_measured_markers_of_motive_are_read_from_any_form(seed, tmp_path):
    text, truth = vendor_files.motive(np.random.default_rng(seed))
    reading = read_csv(written(tmp_path, text), unit=truth["unit"])
    expect(reading.recording, truth)
    assert reading.recording.start_time == pytest.approx(truth["start"], abs=1e-6)
    assert reading.told["program"] == "OptiTrack Motive"
    assert reading.told["subjects"] == truth["subjects"]
    said = [one.data["columns"] for one in reading.remarks if one.kind == "left-out"]
    assert said == ([truth["solved"]] if truth["solved"] else [])


@pytest.mark.parametrize("seed", SEEDS)
def test_motive_has_the_cells_that_pandas_finds(seed, tmp_path):
    text, truth = vendor_files.motive(np.random.default_rng(2000 + seed))
    path = written(tmp_path, text)
    take = read_csv(path, unit=truth["unit"]).recording
    axes = next(k for k, x in enumerate(text.splitlines()) if x.startswith("Frame,"))
    body = pd.read_csv(path, skiprows=axes + 1, header=None).to_numpy(dtype=object)
    names = next(
        row
        for row in vendor_files.read_naively(text)[0]
        if take.markers.labels[0] in row
    )
    for m, label in enumerate(take.markers.labels):
        k = names.index(label)
        cells = body[:, k : k + 3].astype(float)
        found = take.markers.positions[:, m]
        np.testing.assert_allclose(found, cells * truth["metres"], rtol=1e-12)


MOTIVE = [
    "Format Version,1.23,Take Name,T,Capture Frame Rate,120.000000,"
    "Export Frame Rate,120.000000,Total Exported Frames,3,Length Units,Meters",
    "",
    ",Type,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,Marker",
    ",Name,Cup,Cup,Cup,A,A,A",
    ",ID,1,1,1,2,2,2",
    ",,Position,Position,Position,Position,Position,Position",
    "Frame,Time (Seconds),X,Y,Z,X,Y,Z",
    *(f"{k},{k / 120:.6f},1,2,3,4,5,{k}" for k in range(3)),
]


def test_rigid_bodies_are_left_out_and_said(tmp_path):
    reading = read_csv(lines(tmp_path, *MOTIVE))
    take = reading.recording
    assert take.markers.labels == ("A",)
    np.testing.assert_array_equal(take.markers.positions[2, 0], [4.0, 5.0, 2.0])
    (remark,) = reading.remarks
    assert remark.text == "not measured but solved, left out: rigid body Cup"
    assert take.parameters["CSV"]["Take Name"] == "T"


def test_rows_that_differ_from_what_motive_claims_are_said(tmp_path):
    reading = read_csv(lines(tmp_path, *MOTIVE[:-1]))
    assert "its head says 3 frames, there are 2 rows" in texts(reading.remarks)


def test_an_export_at_another_rate_runs_at_that(tmp_path):
    rows = [x.replace("Export Frame Rate,120", "Export Frame Rate,60") for x in MOTIVE]
    rows[7:] = [f"{k},{k / 60:.6f},1,2,3,4,5,{k}" for k in range(3)]
    assert read_csv(lines(tmp_path, *rows)).recording.rate == 60.0


def test_points_of_one_name_that_stands_for_none_are_apart(tmp_path):
    rows = [x.replace("Rigid Body", "Marker") for x in MOTIVE]
    rows[3] = ",Name,Unlabeled 7,Unlabeled 7,Unlabeled 7" + ",Unlabeled 7" * 3
    take = read_csv(lines(tmp_path, *rows)).recording
    assert take.markers is None
    assert len(take.unlabelled.frame) == 6


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("Marker,Marker,Marker", "Bone,Bone,Bone", r"without markers \(bone, rigid bo"),
        ("Frame,Time", "Frames,Time", "without a line Frame,Time"),
        (",Type,Rigid Body", ",Kind,Robot", "no column has a type and a name"),
        ("Rate,120.000000,Total", "Rate,0,Total", "Export Frame Rate is '0'"),
        ("Rate,120.000000,Total", "Rate,fast,Total", "Export Frame Rate is 'fast'"),
        ("Units,Meters", "Units,Feet", "the unit of length is 'Feet'"),
        ("Cup,Cup,Cup", "A,A,A", "2 markers are called 'A'"),
        ("X,Y,Z,X,Y,Z", "X,Y,Z,X,Y,W", "marker 'A' has no Z column"),
        ("1,2,3,4,5,1", "1,2,3,4,five,1", "line 9 column 7: 'five' is not a number"),
        ("1,2,3,4,5,2", "1,2,3,4,5", "has 7 cells"),
        ("2,0.016667", "1,0.016667", "frame 1 follows frame 1"),
    ],
)
def test_a_broken_file_of_motive_is_one_clear_line(old, new, says, tmp_path):
    text = "\n".join([*MOTIVE, ""])
    assert old in text
    if new == "A,A,A":
        text = text.replace("Rigid Body", "Marker")
    with pytest.raises(FileError, match=says) as caught:
        read_csv(written(tmp_path, text.replace(old, new)))
    assert "\n" not in str(caught.value)


def test_what_stands_in_columns_that_are_left_out_does_not_matter(tmp_path):
    rows = [x.replace("1,2,3,4", "none,2 cm,,4") for x in MOTIVE]
    assert read_csv(lines(tmp_path, *rows)).recording.frames == 3


@pytest.mark.parametrize(
    ("first", "says"),
    [
        ("PathFileType,4,(X/Y/Z),x.trc", "is a TRC file; give it the suffix .trc"),
        ("NO_OF_FRAMES\t12", "is a Qualisys TSV file; give it the suffix .tsv"),
    ],
)
def test_tables_of_another_suffix_are_called_what_they_are(first, says, tmp_path):
    with pytest.raises(FileError, match=says):
        read_csv(lines(tmp_path, first, *NEXUS))


# --- numbers alone ------------------------------------------------------------------


def rows_of(lead, part=","):
    rows = []
    for k in range(6):
        cells = {"frame": [str(5 + k)], "time": [f"{k / 120:.5f}"]}
        first = [cell for name in lead for cell in cells[name]]
        rows.append(part.join([*first, "1", "2", f"3{k}", "4", "", "6"]))
    return rows


def test_motive_without_a_head_is_points_without_a_name(tmp_path):
    reading = read_csv(lines(tmp_path, *rows_of(["frame", "time"])), unit="mm")
    take = reading.recording
    assert (take.rate, take.first_frame, take.markers) == (120.0, 5, None)
    assert take.unlabelled.frame.tolist() == [0, 1, 2, 3, 4, 5]
    np.testing.assert_allclose(take.unlabelled.positions[1], [1e-3, 2e-3, 0.031])
    assert texts(reading.remarks) == (
        "its columns have no names: 2 points are without a name",
    )


@pytest.mark.parametrize("lead", [[], ["frame"], ["time"], ["frame", "time"]])
def test_qualisys_without_any_head_is_points_without_a_name(lead, tmp_path):
    path = tmp_path / "a.tsv"
    path.write_text("\n".join([*rows_of(lead, "\t"), ""]))
    take = files.read(path, unit="mm", rate_hz=120.0)
    assert take.first_frame == (5 if "frame" in lead else 1)
    assert len(take.unlabelled.frame) == 6
    if "time" not in lead:
        with pytest.raises(UsageError, match="give --rate"):
            files.read(path, unit="mm")
    with pytest.raises(UsageError, match="give --unit"):
        files.read(path, rate_hz=120.0)


@pytest.mark.parametrize("lead", [[], ["frame"], ["time"]])
def test_other_numbers_alone_are_not_guessed_at(lead, tmp_path):
    with pytest.raises(FileError, match="holds numbers where the names of the columns"):
        read_csv(lines(tmp_path, *rows_of(lead)), unit="mm", rate_hz=1.0)
