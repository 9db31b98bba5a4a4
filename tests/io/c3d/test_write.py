"""Writing C3D: nothing changes that no step has changed, and what changes is right."""

import copy
import io
from dataclasses import replace

import ezc3d
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from told import texts

from handclean.errors import FileError
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d, write_c3d
from handclean.recording import (
    Analog,
    Motion,
    Origin,
    Points,
    Recording,
    SourceEvent,
    trajectories,
)
from tests.io.c3d.c3d_oracles import by_c3d, by_ezc3d, c3d_bytes, take

PROCESSORS = ("intel", "dec", "mips")


@pytest.fixture
def read(tmp_path):
    """Read bytes, or write a recording and read it back."""

    def read(content, **more):
        path = tmp_path / "take.c3d"
        path.write_bytes(content if isinstance(content, bytes) else written(content))
        return read_c3d(path, **more)

    return read


def written(recording):
    file = io.BytesIO()
    write_c3d(file, recording)
    return file.getvalue()


def plain(value):
    """Parameters as they come back from a session file: fresh native arrays."""
    if isinstance(value, dict):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, np.ndarray):
        return value.astype(value.dtype.newbyteorder("=")).copy()
    return copy.copy(value)


def with_markers(recording, **parts):
    return replace(recording, markers=replace(recording.markers, **parts))


def traps_of(recording, folder):
    """Traps of what is written, but for the first frame's number."""
    path = folder / "traps.c3d"
    write_c3d(path, recording)
    return [t for t in inspect_c3d(path)["traps"] if "first frame" not in t]


@given(seed=st.integers(0, 2**32 - 1), data=st.data())
def test_an_identity_rewrite_is_byte_identical(tmp_path_factory, seed, data):
    """Also after a stay in a session file; whatever the fourth words and places are."""
    rng = np.random.default_rng(seed)
    is_float = data.draw(st.booleans(), "float")
    frames, points = data.draw(st.integers(1, 30)), data.draw(st.integers(1, 8))
    raw, words = take(rng, frames, points, is_float, missing=0.3)
    kind = data.draw(
        st.sampled_from(["plain", "places", "zeros", "words", "unrecorded"])
    )
    if kind == "places":  # missing points may have coordinates
        raw = raw + (words < 0)[..., None] * 17
    if kind == "zeros":
        raw[rng.random(words.shape) < 0.3] = 0
    if kind == "words":
        words = rng.integers(-32768, 32768, words.shape)
    if kind == "unrecorded":
        words = np.minimum(words, 0)
    words = words.astype(float)
    if is_float and kind == "words" and data.draw(st.booleans()):
        words[rng.random(words.shape) < 0.2] = 0.37
        words[rng.random(words.shape) < 0.2] = 65535
    processor = data.draw(st.sampled_from(PROCESSORS), "processor")
    if is_float and processor != "dec":
        raw[rng.random(words.shape) < 0.1] = np.nan
    analog = (
        rng.integers(-32768, 32768, (frames, 6)) if data.draw(st.booleans()) else None
    )
    labels = data.draw(
        st.lists(
            st.sampled_from(["A", "B", "*1", "", "Öhr", "out"]), max_size=points + 2
        )
    )
    content = c3d_bytes(
        raw,
        words,
        labels,
        processor=processor,
        is_float=is_float,
        scale=0.1,
        analog=analog,
        per_frame=0 if analog is None else 3,
        first=data.draw(st.integers(0, 5)),
        count=data.draw(st.sampled_from(["frames", "trial", "long", "float"])),
        pad=data.draw(st.booleans()),
        zeros_before=data.draw(st.sampled_from([0, 3])),
        units=data.draw(st.sampled_from(["mm", "cm", "m", None])),
        groups={"POINT": {"ANGLES": ["out"]}, "EVENT": {"TIMES": np.ones((1, 2))}},
        header_events=[(0.5, "GO")],
    )
    path = tmp_path_factory.getbasetemp() / "identity.c3d"
    path.write_bytes(content)
    recording = read_c3d(path, zeros_are_missing=data.draw(st.booleans()))
    assert written(recording) == content
    session = replace(recording, parameters=plain(dict(recording.parameters)))
    assert written(session) == content


@pytest.mark.parametrize("count", ["trial", "long", "float", "frames"])
def test_long_takes_are_rewritten_byte_for_byte(rng, read, count):
    content = c3d_bytes(*take(rng, 66000, 2), count=count, first=3)
    assert written(read(content)) == content


@pytest.mark.parametrize("is_float", [True, False], ids=["float", "integer"])
@pytest.mark.parametrize("processor", PROCESSORS)
def test_each_sample_is_written_as_its_origin_says(rng, read, processor, is_float):
    raw, words = take(rng, 12, 4, is_float, missing=0)
    words[2, 1], raw[2, 1] = -1, 9  # missing in the source, with a place
    content = c3d_bytes(raw, words, processor=processor, is_float=is_float, scale=0.1)
    recording = read(content)
    positions = recording.markers.positions.copy()
    origin = recording.markers.origin.copy()
    positions[0, 0] += 0.001
    origin[0, 0] = Origin.FILLED
    positions[0, 1] += 0.001
    origin[0, 1] = Origin.SMOOTHED
    positions[0, 2] = np.nan
    origin[0, 2] = Origin.MISSING
    origin[0, 3] = Origin.REJECTED
    positions[1, 0] += 0.001  # moved, still measured: its residual and cameras stay
    changed = with_markers(recording, positions=positions, origin=origin)
    rejected, smoothed = texts(write_c3d(io.BytesIO(), changed))
    assert rejected == "1 rejected samples are written as missing"
    assert smoothed.startswith(
        "1 smoothed samples are written as computed, like filled"
    )
    again = read(written(changed))
    raws = again.parameters["c3d"]["frames"][:, : 4 * 4].reshape(12, 4, 4)
    before = recording.parameters["c3d"]["frames"][:, : 4 * 4].reshape(12, 4, 4)
    same = np.ones((12, 4), bool)
    same[0], same[1, 0] = False, False
    np.testing.assert_array_equal(raws[same], before[same])
    step = 2e-6 if is_float else 0.51e-4
    seen = np.isfinite(again.markers.positions).all(axis=2)
    expected = np.isfinite(positions).all(axis=2)
    expected[0, 3] = False
    np.testing.assert_array_equal(seen, expected)
    np.testing.assert_allclose(
        again.markers.positions[seen], positions[seen], atol=step
    )
    assert again.markers.origin[0].tolist() == [Origin.FILLED, Origin.FILLED, 0, 0]
    assert (again.markers.residual[0, :2] == 0).all()
    assert (again.markers.cameras[0, :2] == 0).all()
    assert again.markers.origin[1, 0] == Origin.MEASURED
    assert again.markers.residual[1, 0] == recording.markers.residual[1, 0]
    assert again.markers.cameras[1, 0] == recording.markers.cameras[1, 0]


def test_relabelling_moves_each_point_with_its_own_words(rng, read):
    """A take of unlabelled columns in which two points change columns half way."""
    raw, words = take(rng, 20, 3, missing=0.2)
    recording = read(c3d_bytes(raw, words, ["*0", "*1", "*2"], groups={"X": {"Y": 3}}))
    points = recording.unlabelled
    positions, source = np.full((20, 2, 3), np.nan), np.full((20, 2), -1, np.int32)
    for row in np.flatnonzero(points.source < 2):
        frame = points.frame[row]
        marker = points.source[row] ^ int(frame >= 10)
        positions[frame, marker] = points.positions[row]
        source[frame, marker] = points.source[row]
    markers = trajectories(positions, ("TIP", "DIP"), source=source)
    ghosts = points.source == 2
    left = Points(
        frame=points.frame[ghosts],
        source=points.source[ghosts],
        positions=points.positions[ghosts],
    )
    again = read(written(replace(recording, markers=markers, unlabelled=left)))
    assert again.markers.labels == ("TIP", "DIP")
    assert again.parameters["c3d"]["groups"]["X"]["Y"] == 3
    assert again.parameters["c3d"]["groups"]["POINT"]["LABELS"] == ["TIP", "DIP", "*2"]
    np.testing.assert_array_equal(again.markers.positions, positions)
    there = source >= 0
    theirs = words[np.arange(20)[:, None], source]
    np.testing.assert_array_equal(again.markers.cameras[there], (theirs >> 8)[there])
    np.testing.assert_allclose(
        again.markers.residual[there], (theirs & 255)[there] * 1e-4, rtol=1e-5
    )
    np.testing.assert_array_equal(again.unlabelled.positions, left.positions)
    np.testing.assert_array_equal(again.unlabelled.cameras, points.cameras[ghosts])


@given(seed=st.integers(0, 2**32 - 1), data=st.data())
def test_any_labelling_of_any_take_reads_back(tmp_path_factory, seed, data):
    """Points are dealt anew to markers, old and new, and to nobody."""
    rng = np.random.default_rng(seed)
    is_float, frames = data.draw(st.booleans()), data.draw(st.integers(1, 12))
    columns = data.draw(st.integers(1, 6))
    raw, words = take(rng, frames, columns, is_float, missing=0.2)
    raw[words >= 0] += raw[words >= 0] == 0
    names = st.sampled_from(["A", "B", "C", "*1", "*2", ""])
    labels = data.draw(st.lists(names, min_size=columns, max_size=columns))
    path = tmp_path_factory.getbasetemp() / "dealt.c3d"
    path.write_bytes(
        c3d_bytes(
            raw,
            words,
            labels,
            processor=data.draw(st.sampled_from(PROCESSORS)),
            is_float=is_float,
        )
    )
    before = read_c3d(path)
    every = np.full((frames, columns, 3), np.nan)
    if before.markers is not None:
        for frame, marker in np.argwhere(before.markers.origin > 0):
            column = before.markers.source[frame, marker]
            every[frame, column] = before.markers.positions[frame, marker]
    if before.unlabelled is not None:
        loose = before.unlabelled
        every[loose.frame, loose.source] = loose.positions
    markers = data.draw(st.lists(names.filter(str.isalpha), unique=True))
    markers = tuple(markers) + ("New",) * data.draw(st.booleans())
    positions = np.full((frames, len(markers), 3), np.nan)
    source = np.full((frames, len(markers)), -1, np.int32)
    left = []
    for frame in range(frames):
        for place, column in enumerate(rng.permutation(columns)):
            if words[frame, column] < 0:
                continue
            if place < len(markers) and rng.random() < 0.7:
                positions[frame, place] = every[frame, column]
                source[frame, place] = column
            else:
                left.append((frame, column))
    frame, column = np.array(left, np.int32).reshape(-1, 2).T
    dealt = replace(
        before,
        markers=trajectories(positions, markers, source=source) if markers else None,
        unlabelled=Points(frame=frame, source=column, positions=every[frame, column]),
    )
    if not (markers or left):
        return
    path.write_bytes(written(dealt))
    again = read_c3d(path)
    if markers:
        found = [again.markers.labels.index(label) for label in markers]
        np.testing.assert_array_equal(again.markers.positions[:, found], positions)
        there = source >= 0
        its = words[np.arange(frames)[:, None], source]
        np.testing.assert_array_equal(
            again.markers.cameras[:, found][there], (its >> 8)[there]
        )
    left_over = again.unlabelled
    kept = np.column_stack([frame, every[frame, column], words[frame, column] >> 8])
    now = np.zeros((0, 5))
    if left_over is not None:
        now = np.column_stack([left_over.frame, left_over.positions, left_over.cameras])
    np.testing.assert_array_equal(kept[np.lexsort(kept.T)], now[np.lexsort(now.T)])


def test_points_that_lost_their_label_share_new_columns(rng, read):
    raw, words = take(rng, 8, 3, missing=0)
    recording = read(c3d_bytes(raw, words, ["A", "B", "*7"]))
    markers = recording.markers
    kept = replace(
        markers,
        positions=markers.positions[:, :1],
        labels=("A",),
        model=("",),
        origin=markers.origin[:, :1],
        source=markers.source[:, :1],
        residual=None,
        cameras=None,
    )
    frame = np.repeat(np.arange(8), 2).astype(np.int32)
    source = np.tile([1, 2], 8).astype(np.int32)
    points = Points(
        frame=frame,
        source=source,
        positions=np.stack(
            [markers.positions[:, 1], recording.unlabelled.positions], axis=1
        ).reshape(-1, 3),
    )
    again = read(written(replace(recording, markers=kept, unlabelled=points)))
    assert again.parameters["c3d"]["groups"]["POINT"]["LABELS"] == ["A", "*7", "*0"]
    assert again.parameters["c3d"]["groups"]["POINT"]["DESCRIPTIONS"] == [
        "about A",
        "about *7",
        "",
    ]
    np.testing.assert_array_equal(
        np.sort(again.unlabelled.positions.ravel()), np.sort(points.positions.ravel())
    )


def test_parameters_and_analog_stay_when_markers_are_added(rng, read, tmp_path):
    raw, words = take(rng, 10, 2, is_float=False)
    stored = rng.integers(-32768, 32768, (10, 8))
    groups = {"SUBJECT": {"NAME": "Ann", "MASS": 61.5}, "POINT": {"X_SCREEN": "+X"}}
    for processor in PROCESSORS:
        content = c3d_bytes(
            raw,
            words,
            processor=processor,
            is_float=False,
            scale=0.1,
            analog=stored,
            per_frame=4,
            groups=groups,
            first=5,
        )
        recording = read(content)
        more = 60  # needs more room for labels: the data move
        markers = trajectories(
            np.concatenate(
                [recording.markers.positions, np.ones((10, more, 3))], axis=1
            ),
            recording.markers.labels + tuple(f"a longer name {i}" for i in range(more)),
        )
        again = read(written(replace(recording, markers=markers)))
        np.testing.assert_array_equal(again.analog.values, recording.analog.values)
        assert again.markers.labels == markers.labels
        assert again.first_frame == 5
        kept, now = (r.parameters["c3d"]["groups"] for r in (recording, again))
        assert now["SUBJECT"] == kept["SUBJECT"]
        assert now["POINT"]["X_SCREEN"] == "+X"
        assert now["POINT"]["USED"] == 62
        np.testing.assert_allclose(again.markers.positions[:, 2:], 1.0, atol=0.51e-4)
        assert not traps_of(again, tmp_path)


@pytest.mark.parametrize("processor", PROCESSORS)
def test_a_coordinate_too_large_for_integers_rescales_all_points(rng, read, processor):
    raw, words = take(rng, 10, 3, is_float=False)
    stored = rng.integers(-32768, 32768, (10, 4))
    content = c3d_bytes(
        raw,
        words,
        ["A", "Elbow", "*3"],
        processor=processor,
        is_float=False,
        scale=0.1,
        analog=stored,
        per_frame=4,
        groups={"POINT": {"ANGLES": ["Elbow"]}},
    )
    recording = read(content)
    positions = recording.markers.positions.copy()
    positions[4, 0] = (1.0, -9.0, 2.0)  # 9000 mm, where 3276.7 is the most
    origin = recording.markers.origin.copy()
    origin[4, 0] = Origin.FILLED
    changed = with_markers(recording, positions=positions, origin=origin)
    assert "POINT:SCALE went from 0.1" in texts(write_c3d(io.BytesIO(), changed))[0]
    again = read(written(changed))
    scale = again.parameters["c3d"]["groups"]["POINT"]["SCALE"]
    assert scale == pytest.approx(9000 / 32000)
    np.testing.assert_allclose(again.markers.positions, positions, atol=0.51e-3 * scale)
    np.testing.assert_array_equal(
        again.markers.cameras,
        np.where(origin == Origin.FILLED, 0, recording.markers.cameras),
    )
    measured = origin == Origin.MEASURED
    np.testing.assert_allclose(
        again.markers.residual[measured],
        np.maximum(recording.markers.residual[measured], scale * 1e-3),
        atol=0.51e-3 * scale,
    )
    np.testing.assert_allclose(
        again.unlabelled.positions, recording.unlabelled.positions, atol=0.51e-3 * scale
    )
    np.testing.assert_array_equal(again.analog.values, recording.analog.values)
    elbow = again.parameters["c3d"]["frames"].view(
        np.int16 if processor != "mips" else ">i2"
    )[:, 4:8]
    there = words[:, 1] >= 0
    np.testing.assert_allclose(
        elbow[there, :3] * scale, raw[there, 1] * 0.1, atol=0.51 * scale
    )
    np.testing.assert_array_equal(elbow[:, 3] >> 8, words[:, 1] >> 8)


def test_the_ends_of_16_bits_need_no_rescaling(rng, read):
    raw, words = take(rng, 5, 2, is_float=False, missing=0)
    raw[0, 0], raw[1, 0] = 32767, -32768
    content = c3d_bytes(raw, words, is_float=False, scale=0.013)
    assert written(read(content)) == content


def test_residuals_beyond_a_byte_are_held_not_wrapped(read):
    markers = trajectories(
        np.full((3, 1, 3), 0.5),
        ("A",),
        residual=np.array([[0.0], [1.0], [np.nan]], np.float32),
        cameras=np.full((3, 1), 5, np.uint8),
    )
    again = read(Recording(rate=100, frames=3, markers=markers))
    scale = 500 / 32000
    np.testing.assert_allclose(
        again.markers.residual[:, 0], np.array([1, 255, 1]) * scale * 1e-3, rtol=1e-6
    )
    assert (again.markers.cameras == 5).all()


def new_take(rng, frames=50, count=4, **parts):
    positions = rng.normal(size=(frames, count, 3))
    positions[rng.random((frames, count)) < 0.2] = np.nan
    labels = tuple(f"M{i}" for i in range(count))
    markers = trajectories(positions, labels)
    return Recording(rate=120.0, frames=frames, markers=markers, **parts)


@pytest.mark.parametrize("frames", [1, 50, 65534, 65535, 70000])
@pytest.mark.parametrize("first", [1, 0, 12, 70000])
def test_a_new_file_reads_back_in_handclean_c3d_and_ezc3d(tmp_path, rng, frames, first):
    recording = new_take(rng, frames, 2, first_frame=first, up_axis="+y")
    path = tmp_path / "new.c3d"
    write_c3d(path, recording)
    again = read_c3d(path)
    assert (again.frames, again.rate, again.up_axis) == (frames, 120.0, "+y")
    assert again.first_frame == first
    np.testing.assert_allclose(
        again.markers.positions, recording.markers.positions, rtol=1e-7, atol=1e-9
    )
    assert again.markers.labels == recording.markers.labels
    assert set(inspect_c3d(path)["traps"]) <= {f"the first frame is number {first}"}
    there = np.isfinite(recording.markers.positions).all(axis=2)
    if first == 1:
        theirs = by_c3d(path)
        assert len(theirs) == frames
        np.testing.assert_allclose(
            theirs[there][:, :3], recording.markers.positions[there] * 1e3, rtol=1e-6
        )
        np.testing.assert_array_equal(theirs[..., 3] >= 0, there)
        np.testing.assert_allclose(
            by_ezc3d(path)[:frames][there],
            recording.markers.positions[there] * 1e3,
            rtol=1e-6,
        )


def test_a_new_file_holds_labels_of_any_letters_and_number(tmp_path, rng):
    count = 600
    labels = tuple(f"Zeigefingerspitze→{i}" for i in range(count))
    markers = trajectories(
        rng.normal(size=(3, count, 3)), labels, model=("right",) * count
    )
    path = tmp_path / "new.c3d"
    write_c3d(path, Recording(rate=100, frames=3, markers=markers))
    again = read_c3d(path)
    assert again.markers.labels == labels
    theirs = ezc3d.c3d(str(path))["parameters"]["POINT"]
    found = (
        theirs["LABELS"]["value"]
        + theirs["LABELS2"]["value"]
        + theirs["LABELS3"]["value"]
    )
    assert tuple(found) == labels
    assert again.parameters["c3d"]["groups"]["POINT"]["DESCRIPTIONS3"] == ["right"] * 90


def test_a_new_file_holds_analog_events_and_unlabelled_points(read, rng):
    recording = new_take(
        rng,
        50,
        first_frame=121,
        analog=Analog(
            values=rng.normal(size=(150, 2)),
            labels=("Fx", "Fz"),
            units=("N", "N"),
            rate=360,
        ),
        source_events=(
            SourceEvent(time=0.25, label="Touch", context="Right"),
            SourceEvent(time=75.5, label="Release"),
        ),
        unlabelled=Points(
            frame=np.array([0, 0, 7], np.int32),
            source=np.array([4, 9, 9], np.int32),
            positions=rng.normal(size=(3, 3)),
        ),
    )
    again = read(recording)
    np.testing.assert_allclose(again.analog.values, recording.analog.values, rtol=1e-6)
    assert (again.analog.labels, again.analog.rate) == (("Fx", "Fz"), 360)
    assert [(e.label, e.context) for e in again.source_events] == [
        ("Touch", "Right"),
        ("Release", ""),
    ]
    np.testing.assert_allclose(
        [e.time for e in again.source_events], [0.25, 75.5], atol=1e-5
    )
    np.testing.assert_array_equal(again.unlabelled.frame, [0, 0, 7])
    np.testing.assert_array_equal(again.unlabelled.source, [4, 5, 5])
    np.testing.assert_allclose(
        again.unlabelled.positions, recording.unlabelled.positions, rtol=1e-6
    )


def test_filled_samples_of_a_new_file_stay_apart_from_measured_ones(read, rng):
    recording = new_take(rng)
    origin = recording.markers.origin.copy()
    origin[10:20, 1] = np.where(origin[10:20, 1], Origin.FILLED, 0)
    again = read(with_markers(recording, origin=origin))
    np.testing.assert_array_equal(again.markers.origin, origin)


def test_joint_angles_are_written_as_model_outputs_in_degrees(read, rng, tmp_path):
    names = ("thumb_cmc_abduction", "thumb_cmc_flexion", "index_pip_flexion")
    motion = Motion(names=names, angles=rng.normal(size=(50, 3)))
    recording = new_take(rng, motions={"right": motion})
    again = read(recording)
    assert again.markers.labels == recording.markers.labels
    groups = again.parameters["c3d"]["groups"]["POINT"]
    assert groups["ANGLES"] == ["right:thumb_cmc", "right:index_pip"]
    assert groups["ANGLE_UNITS"] == "deg"
    assert groups["DESCRIPTIONS"][-2:] == ["abduction, flexion", "flexion"]
    path = tmp_path / "take.c3d"
    points = ezc3d.c3d(str(path))["data"]["points"]
    np.testing.assert_allclose(
        points[:2, 4].T, np.degrees(motion.angles[:, :2]), rtol=1e-5
    )
    # solving once more replaces them
    other = replace(motion, angles=motion.angles + 1)
    third = read(replace(again, motions={"right": other}))
    assert third.parameters["c3d"]["groups"]["POINT"]["ANGLES"] == groups["ANGLES"]
    points = ezc3d.c3d(str(path))["data"]["points"]
    np.testing.assert_allclose(points[0, 5], np.degrees(other.angles[:, 2]), rtol=1e-5)


@pytest.mark.parametrize("is_float", [True, False], ids=["float", "integer"])
def test_a_take_of_other_frames_keeps_parameters_and_analog(rng, read, is_float):
    stored = rng.integers(-99, 99, (20, 4))
    raw, words = take(rng, 20, 3, is_float)
    content = c3d_bytes(
        raw,
        words,
        is_float=is_float,
        analog=stored,
        per_frame=2,
        processor="mips",
        groups={"SUBJECT": {"NAME": "Ann"}},
    )
    recording = read(content)
    markers = recording.markers
    half = trajectories(markers.positions[5:15], markers.labels)
    cut = replace(
        recording,
        frames=10,
        first_frame=6,
        markers=half,
        analog=replace(recording.analog, values=recording.analog.values[10:30]),
    )
    again = read(cut)
    assert (again.frames, again.first_frame) == (10, 6)
    np.testing.assert_allclose(again.markers.positions, half.positions, rtol=1e-6)
    np.testing.assert_array_equal(again.analog.values, cut.analog.values)
    assert again.parameters["c3d"]["groups"]["SUBJECT"] == {"NAME": "Ann"}


def test_a_truncated_file_is_mended_when_it_is_written(rng, read):
    content = c3d_bytes(*take(rng, 50, 20), count="trial")
    begin = 512 + 512 * content[514]
    recording = read(content[: begin + 30 * 320 + 100], lenient=True)
    again = read(written(recording))
    assert again.frames == 30
    assert not again.remarks


def test_what_cannot_be_written_is_an_error(tmp_path, rng):
    empty = Recording(rate=100, frames=3)
    with pytest.raises(FileError, match="no points"):
        written(empty)
    with pytest.raises(FileError, match="no frames"):
        written(
            Recording(
                rate=100, frames=0, markers=trajectories(np.ones((0, 1, 3)), ("A",))
            )
        )
    take_ = new_take(rng)
    analog = Analog(values=np.ones((99, 1)), labels=("a",), units=("V",), rate=1)
    with pytest.raises(FileError, match="analog samples do not divide"):
        written(replace(take_, analog=analog))
    with pytest.raises(FileError, match="cannot be written"):
        write_c3d(tmp_path / "no" / "where.c3d", take_)
    with pytest.raises(FileError, match="is no place"):
        written(with_markers(take_, positions=np.full((50, 4, 3), 1e40)))
    long = tuple(f"{'x' * 200}{i}" for i in range(700))
    with pytest.raises(FileError, match="the format has room for 255"):
        written(
            Recording(
                rate=1, frames=1, markers=trajectories(np.ones((1, 700, 3)), long)
            )
        )
    broken = replace(take_, parameters={"c3d": {"head": np.zeros(9, np.uint8)}})
    with pytest.raises(FileError):
        written(broken)


def test_an_analog_value_beyond_32_bits_is_refused_by_channel(tmp_path):
    analog = Analog(
        values=np.array([[1.0, np.inf], [2.0, 1e300]]),
        labels=("Fx", "Fz"),
        units=("N", "N"),
        rate=100.0,
    )
    markers = trajectories(np.ones((2, 1, 3)), ("A",))
    take = Recording(rate=100.0, frames=2, markers=markers, analog=analog)
    with pytest.raises(FileError, match=r"analog channel 'Fz' holds 1e\+300"):
        write_c3d(tmp_path / "a.c3d", take)
    analog.values[1, 1] = 3.0
    write_c3d(tmp_path / "a.c3d", take)
