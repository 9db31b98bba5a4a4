"""Reading C3D: every form the format knows, against an independent encoder,
``c3d`` (coordinates, residual, mask) and ``ezc3d`` (coordinates)."""

import io
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.commands.convert import contents
from handclean.errors import FileError, HandcleanError, UsageError
from handclean.io import files
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d, write_c3d
from handclean.io.shared.settle import METRES
from handclean.recording import Origin
from tests.io.c3d.c3d_oracles import by_c3d, by_ezc3d, c3d_bytes, take

PROCESSORS = ("intel", "dec", "mips")
SCALE = np.float32(0.1)


@pytest.fixture
def write(tmp_path):
    def write(*args, **more):
        path = tmp_path / "take.c3d"
        path.write_bytes(
            args[0] if isinstance(args[0], bytes) else c3d_bytes(*args, **more)
        )
        return path

    return write


def check(recording, raw, words, is_float, unit=1e-3):
    """Compare a recording with what was encoded."""
    there = words >= 0
    metres = raw * unit if is_float else raw * float(SCALE) * unit
    markers = recording.markers
    np.testing.assert_allclose(markers.positions[there], metres[there], rtol=2e-7)
    assert np.isnan(markers.positions[~there]).all()
    expected = (words & 255) * float(SCALE) * unit
    np.testing.assert_allclose(markers.residual[there], expected[there], rtol=1e-6)
    assert np.isnan(markers.residual[~there]).all()
    np.testing.assert_array_equal(markers.cameras[there], (words >> 8)[there])
    np.testing.assert_array_equal(markers.origin, there.astype(np.uint8))
    columns = np.arange(words.shape[1])
    np.testing.assert_array_equal(markers.source, np.where(there, columns, -1))


@pytest.mark.parametrize("count", [3, 255, 256, 600])
@pytest.mark.parametrize("is_float", [True, False], ids=["float", "integer"])
@pytest.mark.parametrize("processor", PROCESSORS)
def test_every_processor_number_and_length_of_labels_is_read(
    write, rng, processor, is_float, count
):
    """With an analog channel: ``c3d`` takes a DEC rate of 0 for -1.7e38."""
    raw, words = take(rng, 7, count, is_float)
    path = write(
        raw,
        words,
        processor=processor,
        is_float=is_float,
        scale=0.1,
        analog=np.ones((7, 1)),
        per_frame=1,
    )
    recording = read_c3d(path)
    check(recording, raw, words, is_float)
    assert recording.markers.labels == tuple(f"M{i}" for i in range(count))
    assert recording.rate == 100
    assert inspect_c3d(path)["traps"] == []
    if count <= 255:  # c3d knows no more labels, and counts them
        theirs = by_c3d(path)
        np.testing.assert_allclose(
            recording.markers.positions[words >= 0] * 1e3,
            theirs[..., :3][words >= 0],
            rtol=1e-6,
        )
        np.testing.assert_allclose(
            recording.markers.residual[words >= 0] * 1e3,
            theirs[..., 3][words >= 0],
            rtol=1e-5,
        )
        np.testing.assert_array_equal(
            recording.markers.cameras[words >= 0], theirs[..., 4][words >= 0]
        )
    if processor != "mips":  # ezc3d does not know MIPS
        theirs = by_ezc3d(path)
        np.testing.assert_allclose(
            recording.markers.positions[words >= 0] * 1e3,
            theirs[words >= 0],
            rtol=1e-6,
        )


@pytest.mark.parametrize("frames", [65534, 65535, 65536, 70000])
@pytest.mark.parametrize("count", ["trial", "long", "float"])
def test_the_number_of_frames_may_need_more_than_16_bits(write, rng, frames, count):
    raw, words = take(rng, frames, 2)
    path = write(raw, words, count=count, scale=0.1)
    recording = read_c3d(path)
    assert recording.frames == frames
    check(recording, raw, words, True)
    if frames == 65534:  # no news, and c3d is slow
        return
    theirs = by_c3d(path)
    assert len(theirs) == frames
    np.testing.assert_allclose(
        recording.markers.positions[-9:] * 1e3,
        np.where((words < 0)[-9:, :, None], np.nan, theirs[-9:, :, :3]),
        rtol=1e-6,
    )


@pytest.mark.parametrize("count", ["trial", "long", "float"])
def test_long_takes_may_start_anywhere(write, rng, count):
    """``c3d`` reads 69 900 of 70 000 frames when LONG_FRAMES and a first frame meet."""
    raw, words = take(rng, 70000, 1)
    recording = read_c3d(write(raw, words, count=count, first=101, scale=0.1))
    assert recording.frames == 70000
    check(recording, raw, words, True)
    assert recording.first_frame == (101 if count == "trial" else 1)


def test_the_high_word_of_a_trial_field_is_worth_65536(write, rng):
    """c3d.org's page says 65535, which ``c3d`` follows: it reads frame 65 999."""
    raw, words = take(rng, 100, 2)
    recording = read_c3d(write(raw, words, count="trial", first=66000, scale=0.1))
    assert (recording.first_frame, recording.frames) == (66000, 100)


def test_frames_beyond_a_full_count_are_found_by_the_size_of_the_file(write, rng):
    """The form ``ezc3d`` writes: 65535 everywhere, and more frames behind."""
    raw, words = take(rng, 65600, 33, missing=0)
    path = write(raw, words, scale=0.1)
    recording = read_c3d(path)
    assert recording.frames == 65600
    check(recording, raw, words, True)
    assert "65535" in recording.remarks[0].text


@pytest.mark.parametrize("first", [0, 1, 389])
def test_the_first_frame_has_the_number_the_file_gives_it(write, rng, first):
    raw, words = take(rng)
    recording = read_c3d(write(raw, words, first=first, scale=0.1))
    assert (recording.first_frame, recording.frames) == (first, 20)


def test_zeros_before_the_header_are_skipped(write, rng):
    raw, words = take(rng)
    path = write(raw, words, zeros_before=77, scale=0.1)
    check(read_c3d(path), raw, words, True)
    assert any("77 zero bytes" in trap for trap in inspect_c3d(path)["traps"])


@pytest.mark.parametrize(
    ("units", "metres"),
    [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0), ("mm\0\0", 1e-3), ("M", 1.0)],
)
def test_lengths_become_metres(write, rng, units, metres):
    raw, words = take(rng)
    check(read_c3d(write(raw, words, units=units, scale=0.1)), raw, words, True, metres)


@pytest.mark.parametrize("units", [None, "    "])
def test_millimetres_are_the_default_of_the_format_and_an_event_says_so(
    write, rng, units
):
    raw, words = take(rng)
    path = write(raw, words, units=units, scale=0.1)
    recording = read_c3d(path)
    check(recording, raw, words, True)
    assert any("UNITS" in event.text for event in recording.remarks)
    stated = read_c3d(path, unit="cm")
    check(stated, raw, words, True, 1e-2)
    assert not stated.remarks


@pytest.mark.parametrize(
    ("cut", "metres"),
    [("mete", 1.0), ("MILL", 1e-3), ("cent", 1e-2), ("Millimetre", 1e-3), ("met", 1.0)],
)
def test_a_unit_whose_name_was_cut_off_is_what_it_begins(write, rng, cut, metres):
    raw, words = take(rng)
    path = write(raw, words, units=cut, scale=0.1)
    recording = read_c3d(path)
    check(recording, raw, words, True, metres)
    assert METRES[recording.parameters["c3d"]["unit"].lower()] == metres
    write_c3d(path.with_name("b.c3d"), recording)
    assert path.with_name("b.c3d").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("unknown", ["me", "mi", "furl", "metr1"])
def test_a_unit_that_nobody_knows_is_an_error_unless_an_option_says_it(
    write, rng, unknown
):
    raw, words = take(rng)
    path = write(raw, words, units=unknown, scale=0.1)
    with pytest.raises(FileError, match=f"'{unknown}'.*--unit says which"):
        read_c3d(path)
    check(read_c3d(path, unit="cm"), raw, words, True, 1e-2)


def test_options_must_not_contradict_the_file(write, rng):
    raw, words = take(rng)
    path = write(raw, words)
    assert read_c3d(path, unit="mm", rate=100.05).rate == 100
    other = read_c3d(path, unit="cm")
    check(other, raw, words, True, 1e-2)
    assert [e.text for e in other.remarks] == [
        "--unit cm is taken, though the file says mm"
    ]
    with pytest.raises(UsageError, match="contradicts its 100 Hz"):
        read_c3d(path, rate=101)
    with pytest.raises(UsageError, match="no expression"):
        read_c3d(path, unlabelled=["("])


@pytest.mark.parametrize("rate", [0.0, -100.0, np.nan, np.inf])
def test_a_rate_that_is_none_is_an_error_unless_it_is_given(write, rng, rate):
    raw, words = take(rng)
    path = write(raw, words, rate=rate)
    with pytest.raises(FileError, match=r"POINT:RATE is .*above 0"):
        read_c3d(path)
    assert read_c3d(path, rate=120).rate == 120
    assert any("RATE" in trap for trap in inspect_c3d(path)["traps"])


@pytest.mark.parametrize(
    ("said", "axis"), [("+Z", "+z"), ("-Y", "-y"), ("Y ", "+y"), ("up", "")]
)
def test_the_axis_that_the_screen_shows_upwards_is_up(write, rng, said, axis):
    groups = {"POINT": {"X_SCREEN": "+X", "Y_SCREEN": said}}
    assert read_c3d(write(*take(rng), groups=groups)).up_axis == axis


def test_points_at_zero_are_missing_and_an_event_counts_them(write, rng):
    raw, words = take(rng, missing=0)
    raw[3:7, 1] = 0
    path = write(raw, words, scale=0.1)
    recording = read_c3d(path)
    assert np.isnan(recording.markers.positions[3:7, 1]).all()
    assert (recording.markers.origin[3:7, 1] == Origin.MISSING).all()
    assert "4 points at (0, 0, 0)" in recording.remarks[0].text
    kept = read_c3d(path, zeros_are_missing=False)
    assert (kept.markers.positions[3:7, 1] == 0).all()
    assert (kept.markers.origin == Origin.MEASURED).all()


def test_points_with_nan_or_infinity_are_missing(write, rng):
    raw, words = take(rng, missing=0)
    raw[2, 0, 1], raw[5, 2, 0] = np.nan, -np.inf
    recording = read_c3d(write(raw, words))
    expected = np.ones((20, 3), np.uint8)
    expected[2, 0] = expected[5, 2] = 0
    np.testing.assert_array_equal(recording.markers.origin, expected)
    assert np.isnan(recording.markers.positions[2, 0]).all()


def test_a_negative_word_may_be_written_without_its_sign(write, rng):
    """As in c3d.org's sample 26."""
    raw, words = take(rng, missing=0)
    words = words.astype(float)
    words[4, 1] = 65535
    path = write(raw, words)
    assert np.isnan(read_c3d(path).markers.positions[4, 1]).all()
    assert any("unsigned" in trap for trap in inspect_c3d(path)["traps"])


def test_word_zero_means_computed_where_other_points_have_residuals(write, rng):
    raw, words = take(rng, missing=0)
    words[5:9, 2] = 0
    recording = read_c3d(write(raw, words))
    expected = np.ones((20, 3), np.uint8)
    expected[5:9, 2] = Origin.FILLED
    np.testing.assert_array_equal(recording.markers.origin, expected)
    assert not recording.markers.measured[5:9, 2].any()
    assert "residual 0" in recording.remarks[0].text


def test_word_zero_everywhere_means_that_residuals_were_not_recorded(write, rng):
    raw, words = take(rng, missing=0)
    path = write(raw, words * 0)
    assert (read_c3d(path).markers.origin == Origin.MEASURED).all()
    assert any("not recorded" in trap for trap in inspect_c3d(path)["traps"])


def test_unlabelled_columns_become_a_list_of_points(write, rng):
    raw, words = take(rng, 9, 6)
    labels = ["THMB1", "*12", "Bob:THMB1", "", "C_123", "Unlabeled 7"]
    recording = read_c3d(write(raw, words, labels, scale=0.1))
    assert recording.markers.labels == ("THMB1", "Bob:THMB1")
    points = recording.unlabelled
    loose = np.array([1, 3, 4, 5])
    frame, column = np.nonzero(words[:, loose] >= 0)
    np.testing.assert_array_equal(points.frame, frame)
    np.testing.assert_array_equal(points.source, loose[column])
    np.testing.assert_allclose(
        points.positions, raw[frame, loose[column]] * 1e-3, rtol=1e-6
    )
    words = words[frame, loose[column]]
    np.testing.assert_array_equal(points.cameras, words >> 8)
    np.testing.assert_allclose(points.residual, (words & 255) * 1e-4, rtol=1e-5)


def test_what_counts_as_unlabelled_can_be_said(write, rng):
    raw, words = take(rng, 9, 3)
    path = write(raw, words, ["ghost1", "*1", "A"])
    recording = read_c3d(path, unlabelled=["^ghost"])
    assert recording.markers.labels == ("*1", "A")
    assert set(recording.unlabelled.source.tolist()) == {0}


def test_model_outputs_are_not_taken_for_markers(write, rng):
    raw, words = take(rng, 9, 4)
    groups = {"POINT": {"ANGLES": ["Elbow"], "POWERS": ["Knee"]}}
    path = write(raw, words, ["A", "Elbow", "B", "Knee"], groups=groups)
    recording = read_c3d(path)
    assert recording.markers.labels == ("A", "B")
    assert set(np.unique(recording.markers.source).tolist()) <= {-1, 0, 2}
    assert recording.unlabelled is None
    assert inspect_c3d(path)["model_outputs"] == ["Elbow", "Knee"]


@pytest.mark.parametrize("is_float", [True, False], ids=["float", "integer"])
@pytest.mark.parametrize("processor", PROCESSORS)
@pytest.mark.parametrize("unsigned", [False, True], ids=["signed", "unsigned"])
def test_analog_channels_are_scaled(write, rng, processor, is_float, unsigned):
    raw, words = take(rng, 6, 2, is_float)
    stored = rng.integers(0, 65536, (6, 8)) - (0 if unsigned else 32768)
    groups = {
        "ANALOG": {
            "LABELS": ["Fx", "Fy"],
            "UNITS": ["N", "Nmm"],
            "SCALE": np.array([0.5, -2.0]),
            "OFFSET": np.array([2048, 40000 if unsigned else -7]),
            "GEN_SCALE": 0.25,
            "FORMAT": "UNSIGNED" if unsigned else "SIGNED",
        }
    }
    recording = read_c3d(
        write(
            raw,
            words,
            processor=processor,
            is_float=is_float,
            analog=stored,
            per_frame=4,
            groups=groups,
        )
    )
    offset = np.array([2048, 40000 if unsigned else -7])
    expected = (stored.reshape(24, 2) - offset) * [0.5, -2.0] * 0.25
    np.testing.assert_allclose(recording.analog.values, expected)
    assert recording.analog.labels == ("Fx", "Fy")
    assert recording.analog.units == ("N", "Nmm")
    assert recording.analog.rate == 400


def test_an_analog_value_may_be_a_signalling_nan(write, rng):
    raw, words = take(rng, 3, 1)
    path = write(raw, words, analog=np.full((3, 1), 2.5), per_frame=1, is_float=True)
    content = path.read_bytes()
    at = content.rindex(np.float32(2.5).tobytes())
    path.write_bytes(content[:at] + b"\x01\x00\xa0\x7f" + content[at + 4 :])
    values = read_c3d(path).analog.values
    assert np.isnan(values).sum() == 1


def test_more_than_255_analog_channels_have_continued_parameters(write, rng):
    raw, words = take(rng, 3, 1)
    stored = rng.integers(-99, 99, (3, 300))
    scale = np.arange(1.0, 301.0)
    labels = [f"ch{i}" for i in range(300)]
    groups = {
        "ANALOG": {
            "LABELS": labels[:255],
            "LABELS2": labels[255:],
            "SCALE": scale[:255],
            "SCALE2": scale[255:],
        }
    }
    recording = read_c3d(write(raw, words, analog=stored, per_frame=1, groups=groups))
    np.testing.assert_allclose(recording.analog.values, stored * scale)
    assert recording.analog.labels == tuple(labels)


def test_events_of_the_header_and_the_event_group_are_read_once(write, rng):
    groups = {
        "EVENT": {
            "USED": 2,
            "LABELS": ["Touch", "Release"],
            "CONTEXTS": ["Right", "Left"],
            "TIMES": np.array([[0.0, 1.5], [1.0, 1.25]]),
        }
    }
    events = [(0.5, "Touc"), (0.75, "GO")]  # header: from the first stored frame
    recording = read_c3d(
        write(*take(rng), first=101, groups=groups, header_events=events)
    )
    found = [(e.time, e.label, e.context) for e in recording.source_events]
    assert found == [
        (0.5, "Touch", "Right"),  # EVENT:TIMES from frame 1, which is 1 s earlier
        (0.75, "GO", ""),
        (60.25, "Release", "Left"),
    ]


def test_inspect_tells_events_at_the_times_the_file_has(write, rng):
    groups = {"EVENT": {"LABELS": ["go"], "TIMES": np.array([[0.0, 10.5]])}}
    path = write(*take(rng), first=995, groups=groups, header_events=[(0.05, "GO")])
    found = [(e["label"], e["time"]) for e in inspect_c3d(path)["events"]]
    assert found == [("GO", pytest.approx(0.05)), ("go", 10.5)]
    inside = [(e.label, e.time) for e in read_c3d(path).source_events]
    assert inside == [("GO", pytest.approx(0.05)), ("go", pytest.approx(0.56))]


@pytest.mark.parametrize("is_float", [True, False], ids=["float", "integer"])
@pytest.mark.parametrize("groups", [{}, {"POINT": {"RATE": 0.0, "SCALE": 0.0}}])
def test_analog_channels_alone_are_told_of_but_are_no_take(
    write, rng, is_float, groups
):
    analog = rng.integers(0, 99, (20, 12))
    nothing = np.zeros((20, 0, 3)), np.zeros((20, 0), int)
    path = write(*nothing, analog=analog, per_frame=3, is_float=is_float, groups=groups)
    report = inspect_c3d(path)
    assert "it has no points, only analog channels" in report["traps"]
    assert report["analog"] == ["A0", "A1", "A2", "A3"]
    assert (report["frames"], report["points"], report["markers"]) == (20, 0, [])
    with pytest.raises(FileError, match="no points, only analog"):
        read_c3d(path)


@pytest.mark.parametrize("is_float", [True, False], ids=["float", "integer"])
@pytest.mark.parametrize("labels", [["A", "B", "*3"], []], ids=["named", "nameless"])
def test_coordinates_are_believed_on_request_where_all_points_are_marked_missing(
    write, rng, is_float, labels
):
    raw, _ = take(rng, 30, 3, is_float, missing=0)
    raw[4, 1] = 0
    path = write(raw, np.full((30, 3), -1), labels, is_float=is_float, scale=0.1)
    plain = read_c3d(path)
    assert any("--believe-coordinates takes these" in e.text for e in plain.remarks)
    assert plain.unlabelled is None or not len(plain.unlabelled.frame)
    believed = read_c3d(path, believe_coordinates=True)
    told = "every point is marked missing; 89 that have coordinates are believed"
    assert any(told in e.text for e in believed.remarks)
    assert any(
        told in trap for trap in inspect_c3d(path, believe_coordinates=True)["traps"]
    )
    metres = raw * 1e-3 * (1.0 if is_float else float(SCALE))
    if labels:
        markers = believed.markers
        assert not np.isfinite(plain.markers.positions).any()
        there = np.ones((30, 2), bool)
        there[4, 1] = False
        np.testing.assert_array_equal(markers.origin == Origin.MEASURED, there)
        np.testing.assert_allclose(
            markers.positions[there], metres[:, :2][there], rtol=2e-7
        )
        assert np.isnan(markers.residual).all()
        assert not markers.cameras.any()
    points = believed.unlabelled
    np.testing.assert_allclose(
        points.positions, metres[points.frame, points.source], rtol=2e-7
    )
    assert len(points.frame) == (30 if labels else 89)
    again = io.BytesIO()
    write_c3d(again, believed)
    path.write_bytes(again.getvalue())
    found = read_c3d(path)
    assert not any("missing;" in e.text for e in found.remarks)
    np.testing.assert_array_equal(found.unlabelled.positions, points.positions)


def test_marks_of_single_points_are_believed_whatever_the_coordinates(write, rng):
    raw, words = take(rng, 30, 3, missing=0)
    words[7, 1] = -1
    recording = read_c3d(write(raw, words), believe_coordinates=True)
    assert np.isnan(recording.markers.positions[7, 1]).all()
    assert not recording.remarks


def test_labels_that_stand_twice_are_told_and_counted_once(write, rng):
    raw, words = take(rng, 10, 4, missing=0)
    words[3, 0] = words[3, 2] = words[5, 0] = -1
    path = write(raw, words, ["A", "B", "A", "*1"])
    assert "labels that stand twice: A" in [e.text for e in read_c3d(path).remarks]
    about = files.inspect(path)
    assert about["markers"] == ["A", "B"]
    assert about["measured"] == {"A": 9, "B": 10}
    assert about["missing"] == {"A": 0.1, "B": 0.0}
    assert contents(read_c3d(path))["markers"] == 2


def test_labels_are_utf8_else_latin1(write, rng):
    raw, words = take(rng, 4, 2)
    content = c3d_bytes(raw, words, ["Öhr", "naïf"])
    assert read_c3d(write(content)).markers.labels == ("Öhr", "naïf")
    # two bytes for each letter: keep the length of everything
    content = content.replace("Öhr".encode(), b"\xd6hr ")
    path = write(content)
    assert read_c3d(path).markers.labels[0] == "Öhr"
    assert any("Latin-1" in trap for trap in inspect_c3d(path)["traps"])


def test_parameters_are_kept_for_people(write, rng):
    groups = {
        "SUBJECT": {"NAME": "Ann", "MASS": 61.5},
        "FORCE_PLATFORM": {"ORIGIN": np.arange(6.0).reshape(2, 3)},
        "A/B": {"x": np.array([1, -2])},
    }
    recording = read_c3d(write(*take(rng), groups=groups, processor="dec"))
    kept = recording.parameters["c3d"]["groups"]
    assert kept["SUBJECT"] == {"NAME": "Ann", "MASS": 61.5}
    np.testing.assert_array_equal(
        kept["FORCE_PLATFORM"]["ORIGIN"], np.arange(6.0).reshape(2, 3)
    )
    assert kept["A_B"]["x"].tolist() == [1, -2]
    assert kept["POINT"]["LABELS"] == ["M0", "M1", "M2"]


def test_a_truncated_file_says_what_can_be_saved(write, rng):
    raw, words = take(rng, 50, 20)
    content = c3d_bytes(raw, words, scale=0.1)
    begin = 512 + 512 * content[514]
    path = write(content[: begin + 30 * 320 + 100])
    with pytest.raises(FileError, match=r"truncated: 30 of 50 frames .*--lenient"):
        read_c3d(path)
    recording = read_c3d(path, lenient=True)
    assert recording.frames == 30
    check(recording, raw[:30], words[:30], True)
    assert "30 of 50" in recording.remarks[0].text
    assert any("30 of 50" in trap for trap in inspect_c3d(path)["traps"])


def test_a_file_cut_before_its_first_frame_cannot_be_saved(write, rng):
    content = c3d_bytes(*take(rng, 50, 20))
    begin = 512 + 512 * content[514]
    with pytest.raises(FileError, match=r"0 of 50 frames can be saved$"):
        read_c3d(write(content[: begin + 100]), lenient=True)


def test_bad_files_get_one_clear_line(tmp_path, write, rng):
    raw, words = take(rng)
    good = c3d_bytes(raw, words)
    cases = {
        "is empty": b"",
        "is not a C3D file": b"PK\3\4" + bytes(2000),
        "truncated inside its header": good[:515],
        "processor code 99": good[:515] + b"c" + good[516:],
        "has no points": c3d_bytes(raw[:, :0], words[:, :0]),
        "has no frames": c3d_bytes(raw[:0], words[:0]),
        "unit of length is 'furlong'": c3d_bytes(raw, words, units="furlong"),
        "POINT:SCALE is 0": c3d_bytes(raw * 0 + 1, words, is_float=False, scale=0.0),
    }
    for words_of_error, content in cases.items():
        with pytest.raises(FileError, match=words_of_error) as caught:
            read_c3d(write(content))
        assert "\n" not in str(caught.value)
        assert str(caught.value).startswith(str(tmp_path))
    with pytest.raises(FileError, match="is a directory"):
        read_c3d(tmp_path)
    with pytest.raises(FileError, match="no such file"):
        read_c3d(tmp_path / "none.c3d")
    with pytest.raises(HandcleanError):
        read_c3d(tmp_path / "nul\0.c3d")


def test_the_combination_of_claims_that_fills_the_file_is_believed(write, rng):
    """As in c3d.org's samples 13 (frames) and 27 (points)."""
    raw, words = take(rng, 40, 12)
    for lie in ({"FRAMES": 41}, {"USED": 13}, {"SCALE": 0.1}, {"USED": None}):
        path = write(c3d_bytes(raw, words, scale=0.1, groups={"POINT": lie}))
        check(read_c3d(path), raw, words, True)
        assert inspect_c3d(path)["traps"] or lie == {"USED": None}
    good = c3d_bytes(raw, words, scale=0.1)
    for word, value in ((1, 13), (4, 41), (8, 2), (2, 7)):
        content = bytearray(good)
        content[2 * word : 2 * word + 2] = value.to_bytes(2, "little")
        path = write(bytes(content))
        check(read_c3d(path), raw, words, True)
        assert any(str(value) in trap for trap in inspect_c3d(path)["traps"])


@given(seed=st.integers(0, 2**32 - 1), data=st.data())
def test_any_small_file_is_read_as_it_was_encoded(tmp_path_factory, seed, data):
    rng = np.random.default_rng(seed)
    is_float = data.draw(st.booleans())
    frames, points = data.draw(st.integers(1, 40)), data.draw(st.integers(1, 9))
    raw, words = take(rng, frames, points, is_float)
    content = c3d_bytes(
        raw,
        words,
        processor=data.draw(st.sampled_from(PROCESSORS)),
        is_float=is_float,
        scale=0.1,
        first=data.draw(st.integers(0, 70000)),
        count=data.draw(st.sampled_from(["frames", "trial", "long", "float"])),
        pad=data.draw(st.booleans()),
    )
    path = tmp_path_factory.getbasetemp() / "any.c3d"
    path.write_bytes(content)
    there = (words >= 0) & raw.any(axis=2)
    check(read_c3d(path), raw, np.where(there, words, -1), is_float)


def test_traps_name_what_is_odd(write, rng):
    raw, words = take(rng, 10, 3, is_float=False, missing=0)
    raw[0, 0] = 32767
    words[3, 1], raw[3, 1] = -1, 5
    words[5, 1] = 255
    groups = {"ANALOG": {"RATE": 150.001}, "POINT": {"RATE": 50.0}}
    path = write(
        raw,
        words,
        ["A", "A"],
        is_float=False,
        scale=1.0,
        first=7,
        analog=np.ones((10, 3)),
        per_frame=3,
        groups=groups,
    )
    traps = "\n".join(inspect_c3d(path)["traps"])
    for words_of_trap in (
        "rate: the parameters say 50, the header 100",
        "first frame is number 7",
        "POINT:SCALE is 1",
        "2 labels for 3 points",
        "stand twice: A",
        "150.001 is not a whole multiple",
        "3 coordinates are at the end of 16 bits",
        "1 points marked missing have coordinates",
        "at 255 steps of POINT:SCALE",
    ):
        assert words_of_trap in traps


def test_an_inspection_is_plain_json(write, rng):
    raw, words = take(rng, 30, 3)
    report = inspect_c3d(write(raw, words, ["A", "B", "*3"], scale=0.1))
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["measured"] == {
        "A": int((words[:, 0] >= 0).sum()),
        "B": int((words[:, 1] >= 0).sum()),
    }
    assert report["unlabelled_points"] == int((words[:, 2] >= 0).sum())
    assert (report["frames"], report["points"], report["unit"]) == (30, 3, "mm")
