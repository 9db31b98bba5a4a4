"""The 24 sample files of c3d.org that are kept beside the project."""

import io
from dataclasses import replace

import numpy as np
import pytest

from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d, write_c3d
from handclean.io.hdf5.session import read_session, write_session
from handclean.recording import Origin
from tests.io.c3d.c3d_oracles import by_c3d, by_ezc3d

pytestmark = pytest.mark.data

# frames, first frame, rate, markers, unlabelled points, measured, computed,
# shape of analog, events, up axis
ONE = (450, 1, 50, 26, 0, 11455, 19, (1800, 16), 3, "+z")
TWO = (89, 1, 50, 36, 0, 2973, 3, (356, 16), 9, "+z")
EXPECTED = {
    "sample_01/Eb015pi.c3d": ONE,
    "sample_01/Eb015pr.c3d": ONE,
    "sample_01/Eb015si.c3d": ONE,
    "sample_01/Eb015sr.c3d": ONE,
    "sample_01/Eb015vi.c3d": ONE,
    "sample_01/Eb015vr.c3d": ONE,
    "sample_02/dec_int.c3d": (*TWO[:8], 8, "+z"),  # its header counts one event less
    "sample_02/dec_real.c3d": TWO,
    "sample_02/pc_int.c3d": TWO,
    "sample_02/pc_real.c3d": TWO,
    "sample_02/sgi_int.c3d": TWO,
    "sample_02/sgi_real.c3d": TWO,
    "sample_03/gait-raw.c3d": (142, 1, 50, 27, 0, 1739, 6, (2272, 30), 0, "+z"),
    "sample_06/MACsample.c3d": (180, 1, 60, 33, 0, 2375, 0, (3060, 16), 0, "+z"),
    "sample_10/TYPE-2.C3D": (199, 1, 60, 13, 0, 1918, 16, (3980, 6), 0, "+z"),
    "sample_13/Dance.c3d": (499, 1, 65.0533, 40, 0, 19960, 0, (499, 8), 0, "+z"),
    "sample_13/golfswing.c3d": (514, 1, 107.527, 29, 0, 14906, 0, (514, 8), 0, "+z"),
    "sample_16/basketball.c3d": (34, 1, 25, 22, 0, 0, 0, None, 0, ""),
    "sample_18/bad_parameter_section.c3d": (
        *(332, 1, 120, 45, 0, 8896, 0, (3320, 32), 7, "+z"),
    ),
    "sample_20/phasespace_sample.c3d": (701, 1, 30, 0, 26759, 0, 0, None, 0, ""),
    "sample_26/Capture0004.c3d": (453, 389, 240, 18, 0, 8037, 57, (453, 16), 0, ""),
    "sample_27/kyowadengyo.c3d": (152, 33, 60, 11, 0, 1640, 6, (152, 24), 0, ""),
    "sample_33/bigparlove.c3d": (323, 1, 200, 141, 0, 44897, 0, (1615, 30), 0, "+z"),
    "sample_37/ART-Human_hands_real_no6dof.c3d": (
        *(969, 1, 60, 61, 0, 59109, 0, None, 0, "+y"),
    ),
}
TRAPS = {
    "sample_02/sgi_int.c3d": "POINT:LABELS says that the next entry is outside",
    "sample_06/MACsample.c3d": "scale: the parameters say 0.0215412, the header 0.0551",
    "sample_13/Dance.c3d": "the header says 499, which was taken, but POINT:FRAMES",
    "sample_13/golfswing.c3d": "data start (block): the parameters say 0, the header 7",
    "sample_16/basketball.c3d": "every point is marked missing, though 748 have",
    "sample_18/bad_parameter_section.c3d": "parameter section cannot be read from",
    "sample_20/phasespace_sample.c3d": "the parameter section is empty",
    "sample_26/Capture0004.c3d": "60 points are marked missing by an unsigned word",
    "sample_27/kyowadengyo.c3d": "points: the parameters say 12, the header 11",
    "sample_33/bigparlove.c3d": "64 points are model outputs",
    "sample_37/ART-Human_hands_real_no6dof.c3d": "all residuals are 0",
}
REFUSED_BY_C3D = {
    "sample_06/MACsample.c3d": AssertionError,  # header and POINT:SCALE differ
    "sample_18/bad_parameter_section.c3d": ValueError,  # data over its parameters
    "sample_27/kyowadengyo.c3d": AssertionError,  # header and POINT:USED differ
    "sample_33/bigparlove.c3d": KeyError,  # two groups of one name
    "sample_37/ART-Human_hands_real_no6dof.c3d": TypeError,  # TRIAL field is 1 x 2
}
# ezc3d knows no MIPS, no float OFFSET (13), no empty (20) or damaged (18) section and
# believes POINT:USED (27)
NOT_FOR_EZC3D = ("si.", "sr.", "sgi", "MAC", "_13", "_18", "_20", "_27")


@pytest.fixture(params=EXPECTED)
def name(request):
    return request.param


@pytest.fixture
def path(name, shared_data):
    return shared_data / "c3d" / name


def test_every_sample_is_read(name, path):
    recording = read_c3d(path)
    markers, points, analog = recording.markers, recording.unlabelled, recording.analog
    origin = np.zeros(0) if markers is None else markers.origin
    found = (
        recording.frames,
        recording.first_frame,
        pytest.approx(recording.rate, rel=1e-5),
        0 if markers is None else len(markers.labels),
        0 if points is None else len(points.frame),
        int((origin == Origin.MEASURED).sum()),
        int((origin == Origin.FILLED).sum()),
        None if analog is None else analog.values.shape,
        len(recording.source_events),
        recording.up_axis,
    )
    assert found == EXPECTED[name]


def test_its_traps_are_named(name, path):
    traps = "\n".join(inspect_c3d(path)["traps"])
    assert TRAPS.get(name, "") in traps


def test_an_identity_rewrite_of_every_sample_is_byte_identical(path, tmp_path):
    """Also after a stay in a session file."""
    recording = read_c3d(path)
    write_session(tmp_path / "take.h5", recording)
    for take in (recording, read_session(tmp_path / "take.h5")):
        file = io.BytesIO()
        write_c3d(file, take)
        assert file.getvalue() == path.read_bytes()


def test_places_residuals_and_masks_are_those_of_c3d(name, path):
    if name in REFUSED_BY_C3D:
        with pytest.raises(REFUSED_BY_C3D[name]):
            by_c3d(path)
        return
    theirs = by_c3d(path)
    recording = read_c3d(path)
    found = recording.unlabelled  # sample 20 has no labels
    there = np.zeros(theirs.shape[:2], bool)
    if found is not None:
        there[found.frame, found.source] = True
        positions, residual, cameras = found.positions, found.residual, found.cameras
    else:
        found = recording.markers
        there = found.origin > 0
        positions, residual, cameras = (
            values[there] for values in (found.positions, found.residual, found.cameras)
        )
    # c3d takes the unsigned words 65535 of sample 26 for points at (0, 0, 0)
    seen = (theirs[..., 3] >= 0) & theirs[..., :3].any(axis=2)
    np.testing.assert_array_equal(there, seen)
    theirs = theirs[there]
    np.testing.assert_allclose(positions * 1e3, theirs[:, :3], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(residual * 1e3, theirs[:, 3], rtol=1e-5)
    np.testing.assert_array_equal(cameras, theirs[:, 4])


def test_places_are_those_of_ezc3d(name, path):
    if any(part in name for part in NOT_FOR_EZC3D):
        pytest.skip("ezc3d cannot read it")
    recording = read_c3d(path)
    markers = recording.markers
    there = markers.origin > 0
    columns = np.broadcast_to(markers.source.max(axis=0), there.shape)
    frames = np.broadcast_to(np.arange(recording.frames)[:, None], there.shape)
    theirs = by_ezc3d(path)[frames[there], columns[there]]
    np.testing.assert_allclose(markers.positions[there] * 1e3, theirs, rtol=1e-6)


@pytest.mark.parametrize("sample", ["sample_01", "sample_02"])
def test_the_encodings_of_one_take_agree(shared_data, sample):
    names = [name for name in EXPECTED if name.startswith(sample)]
    assert len(names) == 6
    names.sort(key=lambda name: "dec_int" in name)
    takes = [read_c3d(shared_data / "c3d" / name) for name in names]
    first = takes[0]
    if sample == "sample_02":  # its DEC integers have other masks in 96 samples
        assert (takes[-1].markers.cameras != first.markers.cameras).sum() == 96
        masks = first.markers.cameras
        takes[-1] = replace(
            takes[-1], markers=replace(takes[-1].markers, cameras=masks)
        )
    scale = first.parameters["c3d"]["groups"]["POINT"]["SCALE"]
    for other in takes[1:]:
        assert other.markers.labels == first.markers.labels
        # floats were computed before integers were rounded, up to one step apart
        np.testing.assert_allclose(
            other.markers.positions, first.markers.positions, atol=1.01e-3 * abs(scale)
        )
        np.testing.assert_allclose(
            other.markers.residual, first.markers.residual, rtol=1e-5
        )
        np.testing.assert_array_equal(other.markers.cameras, first.markers.cameras)
        np.testing.assert_array_equal(other.markers.origin, first.markers.origin)
        np.testing.assert_allclose(
            other.analog.values, first.analog.values, rtol=1e-6, atol=1e-9
        )


def test_the_residuals_of_sample_1_are_what_its_words_say(shared_data):
    """Word 0x3E10: mask 62 (five cameras), residual 16 x 0.0833 = 1.33 mm."""
    markers = read_c3d(shared_data / "c3d" / "sample_01" / "Eb015pi.c3d").markers
    raw = np.fromfile(shared_data / "c3d" / "sample_01" / "Eb015pi.c3d", "<i2")
    words = raw[10 * 256 :][: 450 * 168].reshape(450, 168)[:, 3:104:4]
    frame, marker = np.argwhere(words == 0x3E10)[0]
    assert markers.cameras[frame, marker] == 62
    assert markers.residual[frame, marker] == pytest.approx(16 * 0.0833333e-3, rel=1e-5)


def test_the_hands_of_sample_37_have_20_points_each(shared_data):
    recording = read_c3d(
        shared_data / "c3d" / "sample_37" / "ART-Human_hands_real_no6dof.c3d"
    )
    fingers = [x for x in recording.markers.labels if x.startswith("Human4:L")]
    assert recording.markers.labels[0] == "Human4:PELV"
    assert len(fingers) >= 20
    assert np.nanmax(np.abs(recording.markers.positions)) < 10  # metres
