"""Of two scales in a C3D file the one is taken that makes sense of its points."""

import io

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.template import template
from handclean.io.c3d.inspect import inspect_c3d
from handclean.io.c3d.read import read_c3d, write_c3d
from handclean.io.hdf5.session import read_session, write_session
from handclean.io.shared.adult_size import size_of
from tests.io.c3d.c3d_oracles import c3d_bytes, floats

BODY = {  # [mm] an adult who stands
    "RSHO": (0, 200, 1450),
    "RELB": (0, 230, 1130),
    "RWRI": (60, 230, 880),
    "RKNE": (40, 100, 500),
    "RANK": (0, 110, 100),
    "RHEE": (-60, 100, 40),
    "RTOE": (150, 110, 40),
}
WORDS = ("Shoulder", "Elbow", "Wrist", "Knee", "Ankle", "Heel", "Toe")
TRUE = 0.05
"""[mm] per step of the samples."""


def hand():
    """[mm] an adult's open hand with the markers of a set, above a table."""
    markers = load_marker_set("maycock26")
    model = markers.on(template("right"))
    places = 1e3 * marker_positions(model, neutral_pose(model.tree)[None])[0]
    places = places + np.array([300.0, 0.0, 900.0])
    return dict(zip(model.labels, places, strict=True))


@pytest.fixture
def write(tmp_path, rng):
    """Write integer samples of places [mm], in steps of `TRUE`, with two scales."""

    def write(places, parameters, header, processor="intel"):
        at = np.array(list(places.values())) + rng.normal(size=(9, 1, 3))
        content = bytearray(
            c3d_bytes(
                np.rint(at / TRUE).astype(int),
                np.full(at.shape[:2], 257),
                list(places),
                processor=processor,
                is_float=False,
                scale=parameters,
            )
        )
        content[12:16] = floats([header], processor)
        path = tmp_path / "take.c3d"
        path.write_bytes(content)
        return path

    return write


def told(recording):
    lines = [e.text for e in recording.remarks if e.text.startswith("scale: ")]
    assert len(lines) == 1
    return lines[0]


def taken(path, places):
    """Whose scale was taken, by what is told and by where the points are."""
    recording = read_c3d(path)
    line = told(recording)
    assert line in inspect_c3d(path)["traps"]
    middle = np.median(recording.markers.positions, axis=0) * 1e3
    true = np.array(list(places.values()))
    ratio = np.linalg.norm(middle, axis=1).sum() / np.linalg.norm(true, axis=1).sum()
    who = "header" if "the header's was taken" in line else "parameters"
    assert ("the parameters' was taken" in line) == (who == "parameters")
    return who, ratio


@pytest.mark.parametrize("processor", ["intel", "dec", "mips"])
@pytest.mark.parametrize("places", [BODY, hand()], ids=["body", "hand"])
@pytest.mark.parametrize("factor", [1e-3, 0.39, 0.5, 2.0, 10.0, 1e3])
def test_a_header_is_taken_where_the_parameters_make_no_adult(
    write, places, factor, processor
):
    path = write(places, factor * TRUE, TRUE, processor)
    who, ratio = taken(path, places)
    assert who == "header"
    assert ratio == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("places", [BODY, hand()], ids=["body", "hand"])
@pytest.mark.parametrize("factor", [1e-3, 0.39, 0.7, 1.4, 1e3])
def test_else_the_parameters_are_whatever_the_header_says(write, places, factor):
    who, ratio = taken(write(places, TRUE, factor * TRUE), places)
    assert who == "parameters"
    assert ratio == pytest.approx(1.0, rel=0.01)


def test_the_parameters_are_where_neither_makes_an_adult(write):
    who, ratio = taken(write(BODY, 0.1 * TRUE, 0.2 * TRUE), BODY)
    assert (who, ratio) == ("parameters", pytest.approx(0.1, rel=0.01))


@pytest.mark.parametrize(("factor", "who"), [(25.0, "header"), (3.0, "parameters")])
def test_points_nobody_named_are_held_against_a_room(write, factor, who):
    nameless = {f"*{n}": place for n, place in enumerate(BODY.values())}
    path = write(nameless, factor * TRUE, TRUE)
    line = told(read_c3d(path))
    assert f"the {who}" in line.split("; ")[1]
    assert ("outside any room" in line) == (who == "header")


def test_floats_are_in_the_files_unit_whatever_its_scales(tmp_path, rng):
    content = bytearray(c3d_bytes(rng.normal(size=(5, 2, 3)), np.full((5, 2), 4)))
    plain = tmp_path / "plain.c3d"
    plain.write_bytes(content)
    content[12:16] = floats([-7.0], "intel")
    other = tmp_path / "other.c3d"
    other.write_bytes(content)
    one, two = read_c3d(plain), read_c3d(other)
    assert "the parameters' was taken, for residuals" in told(two)
    np.testing.assert_array_equal(one.markers.positions, two.markers.positions)
    np.testing.assert_array_equal(one.markers.residual, two.markers.residual)


@pytest.mark.parametrize("through", ["memory", "session"])
def test_a_file_with_two_scales_is_written_as_it_is_or_with_one(
    write, tmp_path, through
):
    path = write(BODY, 0.4 * TRUE, TRUE)
    take = read_c3d(path)
    if through == "session":
        write_session(tmp_path / "take.h5", take)
        take = read_session(tmp_path / "take.h5")
    file = io.BytesIO()
    write_c3d(file, take)
    assert file.getvalue() == path.read_bytes()
    take.markers.positions[3, 2] += 0.001
    again = tmp_path / "again.c3d"
    write_c3d(again, take)
    found = read_c3d(again).markers.positions
    np.testing.assert_allclose(found, take.markers.positions, atol=0.6e-3 * TRUE)
    object.__setattr__(take.markers, "labels", tuple("ABCDEFG"))
    write_c3d(again, take)
    renamed = read_c3d(again)
    assert not [e for e in renamed.remarks if e.text.startswith("scale")]
    found = renamed.markers.positions
    np.testing.assert_allclose(found, take.markers.positions, atol=0.6e-3 * TRUE)


def test_the_sample_of_c3d_org_has_an_adults_shoulder(shared_data):
    recording = read_c3d(shared_data / "c3d/sample_06/MACsample.c3d")
    at = recording.markers.positions[:, recording.markers.labels.index("RSHO"), 2]
    assert np.nanmedian(at) == pytest.approx(1.46, abs=0.005)
    assert "the header's was taken, since with the parameters'" in told(recording)


@pytest.mark.parametrize(
    "labels",
    [
        ("RSHO", "RELB", "RWRA", "RKNE", "RANK", "RHEE", "RTOE"),
        tuple(f"Bob:R.{x}" for x in WORDS),
        tuple(f"{x.lower()}_right" for x in WORDS),
    ],
)
def test_names_of_a_body_tell_its_size(labels):
    at = 1e-3 * np.array([list(BODY.values())])
    assert size_of(labels, at).ratio == pytest.approx(1.0, abs=0.1)
    assert size_of(labels, 0.5 * at).ratio == pytest.approx(0.5, abs=0.05)


def test_names_of_fingers_tell_a_hands_size_and_others_nothing():
    places = hand()
    at = 1e-3 * np.array([list(places.values())])
    fingers = [label.replace("R_", "my hand ").lower() + "#" for label in places]
    assert size_of(fingers, at).ratio == pytest.approx(1.0, abs=0.15)
    assert size_of(fingers, 0.4 * at).ratio == pytest.approx(0.4, abs=0.06)
    assert np.isnan(size_of([f"M{n}" for n in range(len(places))], at).ratio)
    assert np.isnan(size_of(fingers, np.full_like(at, np.nan)).ratio)
    assert np.isnan(size_of(fingers, np.zeros_like(at)).ratio)  # all in one place
