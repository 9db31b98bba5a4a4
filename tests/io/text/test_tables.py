"""CSV in and out, Qualisys TSV in, MOT out."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation
from told import texts

from handclean.errors import FileError, HandcleanError, UsageError
from handclean.io import files
from handclean.io.text.csv_read import read_csv
from handclean.io.text.csv_write import write_csv
from handclean.io.text.mot import inspect_mot, write_mot
from handclean.io.text.qualisys import read_tsv
from handclean.recording import Motion, Origin, Points, Recording, trajectories

OTHERS = "A-X,A-Y,A-Z,R-B-1-X,R-B-1-Y,R-B-1-Z\n1,2,3,4,5,6\n1,2,3,nan,nan,nan\n"

QUALISYS = (
    "NO_OF_FRAMES\t3\n"
    "NO_OF_CAMERAS\t7\n"
    "NO_OF_MARKERS\t2\n"
    "FREQUENCY\t100\n"
    "NO_OF_ANALOG\t0\n"
    "ANALOG_FREQUENCY\t0\n"
    "DESCRIPTION\t--\n"
    "TIME_STAMP\t2021-08-26, 15:19:24.317\t1483034.68525310\n"
    "DATA_INCLUDED\t3D\n"
    "EVENT\tgrasp\t2\t0.01\n"
    "MARKER_NAMES\tA\tB\n"
    "TRAJECTORY_TYPES\tMeasured\tMixed\n"
    "Frame\tTime\tA X\tA Y\tA Z\tB X\tB Y\tB Z\t\n"
    "1\t0.00000\t1\t2\t3\t4\t5\t6\n"
    "2\t0.01000\t1\t2\t3\t\t\t\n"
    "3\t0.02000\t0.000\t0.000\t0.000\t4\t5\t6\n"
)


def written(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


# --- other people's CSV -------------------------------------------------------------


def test_options_say_what_the_file_does_not(tmp_path):
    path = written(tmp_path / "a.csv", OTHERS)
    reading = read_csv(path, rate_hz=120.0, unit="cm")
    markers = reading.recording.markers
    assert markers.labels == ("A", "R-B-1")
    np.testing.assert_allclose(
        markers.positions[0], [[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]]
    )
    assert markers.origin.tolist() == [[1, 1], [1, 0]]
    assert (reading.recording.rate, reading.recording.first_frame) == (120.0, 1)


def test_zeros_count_as_missing_in_other_peoples_files(tmp_path):
    path = written(tmp_path / "a.csv", OTHERS.replace("4,5,6", "0,0.0,-0"))
    reading = read_csv(path, rate_hz=120.0, unit="cm")
    assert reading.recording.markers.origin.tolist() == [[1, 0], [1, 0]]
    assert texts(reading.remarks) == ("1 samples at (0, 0, 0) count as missing",)


def test_the_error_says_which_option_to_give(tmp_path):
    path = written(tmp_path / "a.csv", OTHERS)
    with pytest.raises(UsageError, match="give --rate HZ"):
        read_csv(path, unit="mm")
    with pytest.raises(UsageError, match="give --unit"):
        read_csv(path, rate_hz=120.0)


@pytest.mark.parametrize(
    "header",
    [
        "A_X,A_Y,A_Z,R-B-1_X,R-B-1_Y,R-B-1_Z",
        "A X;A Y;A Z;R-B-1 X;R-B-1 Y;R-B-1 Z",
        "A.x\tA.y\tA.z\tR-B-1.x\tR-B-1.y\tR-B-1.z",
        '"A:X","A:Y","A:Z","R-B-1:X","R-B-1:Y","R-B-1:Z"',
        "R-B-1-X,A-X,A-Y,A-Z,R-B-1-Y,R-B-1-Z",
    ],
)
def test_columns_may_be_named_and_parted_in_many_ways(header, tmp_path):
    part = next(mark for mark in ",;\t" if mark in header)
    values = {name: i for i, name in enumerate(["AX", "AY", "AZ", "RX", "RY", "RZ"])}
    order = [h.strip('"')[0] + h.strip('"')[-1].upper() for h in header.split(part)]
    row = part.join(str(values[key]) for key in order)
    path = written(tmp_path / "a.csv", f"{header}\r\n{row}\r\n")
    markers = read_csv(path, rate_hz=1.0, unit="m").recording.markers
    places = {label: markers.positions[0, m] for m, label in enumerate(markers.labels)}
    assert places["A"].tolist() == [0, 1, 2]
    assert places["R-B-1"].tolist() == [3, 4, 5]


def test_commas_in_names_part_no_cells_where_semicolons_do(tmp_path):
    rows = "A,1-X;A,1-Y;A,1-Z\n1;2;3\n4;5;6\n"
    path = written(tmp_path / "a.csv", rows)
    take = read_csv(path, rate_hz=1.0, unit="mm").recording
    assert take.markers.labels == ("A,1",)
    np.testing.assert_allclose(take.markers.positions[1, 0], [0.004, 0.005, 0.006])


def test_frame_numbers_and_times_give_the_rate_and_the_gaps(tmp_path):
    lines = ["Frame,Time (Seconds),A_X,A_Y,A_Z,weight"]
    lines += [f"{n},{(n - 5) / 120:.6f},1,2,3,70" for n in range(5, 60) if n != 9]
    path = written(tmp_path / "a.csv", "\n".join(lines))
    reading = read_csv(path, unit="mm")
    take = reading.recording
    assert (take.rate, take.first_frame, take.frames) == (120.0, 5, 55)
    assert np.flatnonzero(take.markers.origin[:, 0] == 0).tolist() == [4]
    assert any("weight" in trap for trap in texts(reading.remarks))
    assert any("left out" in trap for trap in texts(reading.remarks))
    with pytest.raises(UsageError, match="contradicts"):
        read_csv(path, unit="mm", rate_hz=100.0)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("A-X,A-Y\n1,2\n", "marker 'A' has no Z column"),
        ("a,b,c\n1,2,3\n", "has no markers"),
        ("A-X,A-Y,A-Z\n", "no frames"),
        ("A-X,A-Y,A-Z,A-X\n1,2,3,4\n", "2 columns are called 'A-X'"),
        ("A-X,A-Y,A-Z\n1,2,b\n3,4,5\n", "line 2 column 3: 'b' is not a number"),
        ("A-X,A-Y,A-Z\n1,2\n3,4,5\n", "line 2: has 2 cells"),
        ("A-X;A-Y;A-Z\n1,5;2;3\n", r"decimal comma \('1,5'\); save it"),
        ("A,B-X;A,B-Y;A,B-Z\n0,1;0,2;0,3\n", r"decimal comma \('0,1'\)"),
        ("1,2,3\n4,5,6\n", "line 1: holds numbers where the names"),
        ("1;2,5;3\n4;5,5;6\n", "line 1: holds numbers where the names"),
        ("\n\n", "is empty"),
        (b"A-X,A-Y,A-Z\n1,2,\x00\n", "zero bytes"),
        (b"\xff\xfeA", "UTF-16"),
        ("# handclean csv {\nA-X,A-Y,A-Z\n1,2,3\n", "is broken"),
        (
            '# handclean csv {"rate_hz": 1e-320, "first_frame": 1, "unit": "mm", '
            '"up_axis": "", "motions": {}}\nA_X,A_Y,A_Z\n1,2,3\n',
            "is broken",
        ),
        ('# handclean csv {"rate_hz": 0}\nA-X,A-Y,A-Z\n1,2,3\n', "is broken"),
        ("," * 200_000 + "\n", "more than 100000 columns"),
    ],
)
def test_a_broken_file_is_one_clear_line(text, complaint, tmp_path):
    path = written(tmp_path / "a.csv", text)
    with pytest.raises(FileError, match=complaint) as caught:
        read_csv(path, rate_hz=1.0, unit="mm")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


# --- our CSV ------------------------------------------------------------------------

names = st.lists(
    st.text("abcXY_-:,;\"' ä*", min_size=1, max_size=6)
    .filter(str.strip)
    .map(str.strip),
    min_size=1,
    max_size=3,
    unique=True,
)


@given(
    data=st.data(), labels=names, frames=st.integers(1, 5), rate=st.floats(0.01, 1e6)
)
def test_our_csv_comes_back_without_options(
    data, labels, frames, rate, tmp_path_factory
):
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    places = st.floats(-50, 50) | st.just(np.nan)
    shape = (frames, len(labels), 3)
    positions = data.draw(hnp.arrays(float, shape, elements=places))
    positions[np.isnan(positions).any(axis=2)] = np.nan
    kinds = [Origin.MEASURED, Origin.FILLED, Origin.SMOOTHED]
    origin = data.draw(hnp.arrays(np.uint8, shape[:2], elements=st.sampled_from(kinds)))
    origin[np.isnan(positions[:, :, 0])] = Origin.MISSING
    take = Recording(
        rate=rate,
        frames=frames,
        first_frame=data.draw(st.integers(-5, 10**6)),
        up_axis=data.draw(st.sampled_from(["", "+z"])),
        markers=trajectories(positions, tuple(labels), origin=origin),
    )
    write_csv(path, take)
    reading = read_csv(path)
    back = reading.recording
    assert texts(reading.remarks) == ()
    assert (back.rate, back.first_frame, back.up_axis) == (
        take.rate,
        take.first_frame,
        take.up_axis,
    )
    assert back.markers.labels == take.markers.labels
    np.testing.assert_allclose(back.markers.positions, positions, atol=5.1e-10)
    np.testing.assert_array_equal(back.markers.origin, origin)


def a_motion(rng, frames, hinges, root=True):
    return Motion(
        names=tuple(f"hinge_{d}" for d in range(hinges)),
        angles=rng.uniform(-3, 3, (frames, hinges)),
        translation=rng.normal(size=(frames, 3)) if root else None,
        rotation=Rotation.random(frames, rng=rng).as_quat(scalar_first=True)
        if root
        else None,
    )


@pytest.mark.parametrize("count", [1, 2])
def test_angles_and_root_come_back_from_csv(rng, tmp_path, count):
    moved = {"right": a_motion(rng, 7, 3), "glove X": a_motion(rng, 7, 2, root=False)}
    motions = dict(list(moved.items())[:count])
    motions["right"].angles[3] = np.nan
    take = Recording(rate=60.0, frames=7, motions=motions)
    write_csv(tmp_path / "a.csv", take)
    back = read_csv(tmp_path / "a.csv").recording
    assert back.markers is None
    assert list(back.motions) == list(motions)
    for name, motion in motions.items():
        other = back.motions[name]
        assert other.names == motion.names
        np.testing.assert_allclose(other.angles, motion.angles, atol=1e-11)
        if motion.rotation is None:
            assert other.rotation is None
            assert other.translation is None
        else:
            np.testing.assert_allclose(other.rotation, motion.rotation, atol=1e-11)
            np.testing.assert_allclose(other.translation, motion.translation, atol=1e-9)


def test_a_spreadsheet_sees_degrees_under_the_hinges_names(rng, tmp_path):
    take = Recording(rate=60.0, frames=2, motions={"right": a_motion(rng, 2, 1)})
    write_csv(tmp_path / "a.csv", take)
    table = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True, skip_header=1)
    np.testing.assert_allclose(
        table["hinge_0"], np.degrees(take.motions["right"].angles[:, 0]), atol=1e-8
    )
    np.testing.assert_allclose(table["time_s"], [0, 1 / 60], atol=1e-6)
    first = (tmp_path / "a.csv").read_text().split("\n", 1)[0]
    said = json.loads(first.removeprefix("# handclean csv"))
    assert (said["rate_hz"], said["unit"]) == (60.0, "mm")


def test_columns_that_would_share_a_name_are_refused(tmp_path):
    motion = Motion(names=("A_X",), angles=np.zeros((1, 1)))
    take = Recording(
        rate=1.0,
        frames=1,
        markers=trajectories(np.ones((1, 1, 3)), ("A",)),
        motions={"m": motion},
    )
    with pytest.raises(FileError, match="2 columns are called 'A_X'"):
        write_csv(tmp_path / "a.csv", take)


def test_points_without_a_name_come_back_as_such(tmp_path):
    points = Points(
        frame=np.array([0, 1, 1], np.int32),
        source=np.array([5, 5, 2], np.int32),
        positions=np.arange(9.0).reshape(3, 3),
    )
    write_csv(tmp_path / "a.csv", Recording(rate=1.0, frames=2, unlabelled=points))
    back = read_csv(tmp_path / "a.csv").recording.unlabelled
    assert back.frame.tolist() == [0, 1, 1]
    assert sorted(back.positions[:, 0]) == [0, 3, 6]


def test_nothing_to_write_is_an_error(tmp_path):
    with pytest.raises(FileError, match="nothing to write"):
        write_csv(tmp_path / "a.csv", Recording(rate=1.0, frames=2))
    with pytest.raises(FileError, match="no joint angles"):
        write_mot(tmp_path / "a.mot", Recording(rate=1.0, frames=2))


# --- Qualisys -----------------------------------------------------------------------


def test_qualisys_is_read_with_its_traps(tmp_path):
    reading = read_tsv(written(tmp_path / "a.tsv", QUALISYS))
    take = reading.recording
    assert (take.rate, take.frames, take.first_frame) == (100.0, 3, 1)
    assert take.markers.labels == ("A", "B")
    assert take.markers.origin.tolist() == [[1, 1], [1, 0], [0, 1]]
    assert np.isnan(take.markers.positions[2, 0]).all()
    np.testing.assert_array_equal(take.markers.positions[0, 1], [4e-3, 5e-3, 6e-3])
    assert [(e.start, e.stop, e.text) for e in take.events] == [(1, 2, "grasp")]
    assert any("1 samples at (0, 0, 0)" in trap for trap in texts(reading.remarks))
    assert any("B is Mixed" in trap for trap in texts(reading.remarks))


def test_gap_filled_trajectories_do_not_count_as_measured(tmp_path):
    text = QUALISYS.replace("Mixed", "Gap-filled")
    reading = read_tsv(written(tmp_path / "a.tsv", text))
    assert reading.recording.markers.origin[:, 1].tolist() == [2, 0, 2]
    assert any("Gap-filled" in trap for trap in texts(reading.remarks))


@pytest.mark.parametrize("lead", [True, False])
@pytest.mark.parametrize("named", [True, False])
def test_column_names_frames_and_times_may_be_left_out(lead, named, tmp_path):
    lines = QUALISYS.replace("\t\t\t\n", "\t7\t8\t9\n").rstrip("\n").split("\n")
    head, rows = lines[:12], lines[12:]
    if not lead:
        rows = [row.split("\t", 2)[2] for row in rows]
    text = "\n".join([*head, *(rows if named else rows[1:])])
    take = read_tsv(written(tmp_path / "a.tsv", text)).recording
    np.testing.assert_array_equal(take.markers.positions[1, 1], [7e-3, 8e-3, 9e-3])
    assert take.frames == 3


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("FREQUENCY\t100", "FREQUENCY\tnan", "FREQUENCY is 'nan'"),
        ("\nFREQUENCY", "\nFREQUENCE", "no FREQUENCY"),
        ("MARKER_NAMES", "NAMES", "no MARKER_NAMES"),
        ("MARKER_NAMES\tA\tB", "MARKER_NAMES", "no markers"),
        ("MARKER_NAMES\tA\tB", "MARKER_NAMES\tA\tA", "2 markers"),
        ("4\t5\t6\n2", "4\t5\n2", "line 14: has 7 cells"),
        (QUALISYS[QUALISYS.index("1\t0.00000") :], "", "no frames"),
        (QUALISYS[QUALISYS.index("Frame") :], "", "no frames"),
    ],
)
def test_a_broken_qualisys_file_is_one_clear_line(old, new, complaint, tmp_path):
    path = written(tmp_path / "a.tsv", QUALISYS.replace(old, new, 1))
    with pytest.raises(FileError, match=complaint) as caught:
        read_tsv(path)
    assert "\n" not in str(caught.value)


def test_qualisys_is_in_millimetres(tmp_path):
    path = written(tmp_path / "a.tsv", QUALISYS)
    read_tsv(path, unit="mm", rate_hz=100.0)
    plain, other = read_tsv(path), read_tsv(path, unit="m")
    assert texts(other.remarks)[0] == "--unit m is taken, though the file says mm"
    np.testing.assert_allclose(
        other.recording.markers.positions, 1e3 * plain.recording.markers.positions
    )


# --- MOT ----------------------------------------------------------------------------


def test_mot_has_degrees_metres_and_carried_xyz_angles(rng, tmp_path):
    motion = a_motion(rng, 5, 2)
    take = Recording(rate=50.0, frames=5, motions={"right": motion})
    assert write_mot(tmp_path / "a.mot", take) == ()
    head, _, body = (tmp_path / "a.mot").read_text().partition("endheader\n")
    assert {"version=1", "nRows=5", "nColumns=9", "inDegrees=yes"} <= set(
        head.split("\n")
    )
    table = np.genfromtxt(io.StringIO(body), names=True, delimiter="\t")
    np.testing.assert_allclose(table["time"], np.arange(5) / 50, atol=1e-6)
    np.testing.assert_allclose(
        table["hinge_1"], np.degrees(motion.angles[:, 1]), atol=1e-8
    )
    np.testing.assert_allclose(table["root_ty"], motion.translation[:, 1], atol=1e-8)
    turns = np.stack([table[f"root_r{axis}"] for axis in "xyz"], axis=1)
    found = Rotation.from_euler("XYZ", turns, degrees=True)
    expected = Rotation.from_quat(motion.rotation, scalar_first=True)
    assert (found * expected.inv()).magnitude().max() < 1e-9


def test_mot_leaves_frames_out_in_which_something_is_missing(rng, tmp_path):
    motion = a_motion(rng, 9, 2)
    motion.angles[[0, 3, 4], 1] = np.nan
    motion.translation[5] = np.nan
    gone = replace(a_motion(rng, 9, 1), angles=np.full((9, 1), np.nan))
    take = Recording(rate=50.0, frames=9, motions={"right": motion, "left": gone})
    notes = texts(write_mot(tmp_path / "a.mot", take))
    assert [note.split(":")[0] for note in notes] == [
        "motion 'left' is left out",
        "4 of 9 frames are left out",
    ]
    text = (tmp_path / "a.mot").read_text()
    assert "nan" not in text.lower()
    assert "nRows=5\n" in text
    body = text.partition("endheader\n")[2]
    table = np.genfromtxt(io.StringIO(body), names=True, delimiter="\t")
    whole = [1, 2, 6, 7, 8]
    np.testing.assert_allclose(table["time"], np.array(whole) / 50, atol=1e-9)
    np.testing.assert_allclose(
        table["right_hinge_1"], np.degrees(motion.angles[whole, 1]), atol=1e-8
    )
    about = inspect_mot(tmp_path / "a.mot")
    assert (about["frames"], about["rate"], about["in_degrees"]) == (5, 50.0, True)
    assert about["columns"] == list(table.dtype.names)
    assert about["duration_s"] == pytest.approx(8 / 50)
    assert about["traps"] == ["3 frames are left out: its times are spaced unevenly"]


def test_mot_without_a_whole_frame_is_an_error(rng, tmp_path):
    motion = a_motion(rng, 4, 2)
    motion.angles[:2, 0] = motion.angles[2:, 1] = np.nan
    take = Recording(rate=50.0, frames=4, motions={"right": motion})
    with pytest.raises(FileError, match="in no frame all angles are known"):
        write_mot(tmp_path / "a.mot", take)
    assert not (tmp_path / "a.mot").exists()


@pytest.mark.parametrize(
    "text",
    ["x\n" * 200, "x\n", "a\nendheader\ntime q\nx y\n", "endheader\n\n1 2\n3 4\n"],
)
def test_what_is_no_mot_is_one_clear_line(text, tmp_path):
    (tmp_path / "a.mot").write_text(text)
    with pytest.raises(FileError, match=r"a\.mot") as caught:
        inspect_mot(tmp_path / "a.mot")
    assert "\n" not in str(caught.value)


def test_a_mot_of_wild_times_is_inspected_without_warnings(tmp_path):
    text = "endheader\ntime q\n0 1\n1e-320 1\n2e-320 1\n1e14 1\n"
    (tmp_path / "a.mot").write_text(text)
    assert files.inspect(tmp_path / "a.mot")["frames"] == 4
    (tmp_path / "a.mot").write_text(text.replace("1e14", "1e300"))
    with pytest.raises(FileError, match="no number of seconds"):
        files.inspect(tmp_path / "a.mot")


def test_mot_columns_of_several_motions_begin_with_their_names(rng, tmp_path):
    motions = {"l": a_motion(rng, 2, 1), "r": a_motion(rng, 2, 1, root=False)}
    write_mot(tmp_path / "a.mot", Recording(rate=1.0, frames=2, motions=motions))
    names = (tmp_path / "a.mot").read_text().partition("endheader\n")[2].split("\n")[0]
    assert names.split("\t")[-2:] == ["l_hinge_0", "r_hinge_0"]
    odd = Motion(names=("a b",), angles=np.zeros((2, 1)))
    with pytest.raises(FileError, match="MOT cannot hold"):
        write_mot(tmp_path / "b.mot", Recording(rate=1.0, frames=2, motions={"m": odd}))


# --- fuzz ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["others", "qualisys", "ours"])
@given(data=st.data())
def test_damaged_tables_raise_nothing_but_our_errors(kind, data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzz")
    raw = bytearray({"others": OTHERS, "qualisys": QUALISYS}.get(kind, "").encode())
    if kind == "ours":
        rng = np.random.default_rng(0)
        take = Recording(
            rate=60.0,
            frames=3,
            markers=trajectories(np.ones((3, 2, 3)), ("A", "B")),
            motions={"right": a_motion(rng, 3, 2)},
        )
        write_csv(folder / "a.csv", take)
        raw = bytearray((folder / "a.csv").read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at : at + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=3))
    (folder / "b").write_bytes(raw[: data.draw(st.integers(0, len(raw)))])
    lenient = data.draw(st.booleans())
    try:
        if kind == "qualisys":
            reading = read_tsv(folder / "b", lenient=lenient)
        else:
            options = {} if kind == "ours" else {"rate_hz": 1.0, "unit": "mm"}
            reading = read_csv(folder / "b", lenient=lenient, **options)
    except HandcleanError:
        return
    assert reading.recording.frames > 0


# --- real ---------------------------------------------------------------------------


def test_the_real_recordings_are_read_in_full(shared_data):
    guitar = read_csv(shared_data / "guitar" / "Pick1.csv", rate_hz=120.0, unit="mm")
    take = guitar.recording
    assert (take.frames, len(take.markers.labels)) == (2718, 23)
    assert take.markers.labels[-1] == "R-Wan-wai"
    assert texts(guitar.remarks) == ()
    hidden = np.mean(take.markers.origin == 0, axis=0).max()
    assert 0.99 < hidden < 1

    dfki = read_tsv(shared_data / "hand_embodiment" / "recording.tsv")
    take = dfki.recording
    assert (take.frames, take.rate, len(take.markers.labels)) == (6000, 100.0, 21)
    assert np.count_nonzero(take.markers.origin == 0) == 613
    assert texts(dfki.remarks) == (
        "middle_tip is Mixed: which samples are filled is not said",
    )
