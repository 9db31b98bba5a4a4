"""The placement sheet: true to scale, its distances those of calipers."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from scipy import ndimage

from handclean.hand.marker_set import MarkerSet, load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.template import template
from handclean.hand.template_surface import landmarks, template_surface
from handclean.report import placement_sheet as sheets
from handclean.report import placements as placed

DPI, INCH = 200, 25.4


@pytest.fixture(autouse=True)
def coarse_picture(monkeypatch):
    """Draw the hand less finely, for speed."""
    monkeypatch.setattr(sheets, "PIXEL_M", 0.001)


def written(path, name, side="right", length=0.1872, skin=None):
    tree = template(side, length)
    model = (load_marker_set(name) if isinstance(name, str) else name).on(tree)
    surface = skin or template_surface(tree)
    notes = sheets.write_sheet(path, model, surface, 0.003, title="T", source="S")
    return model, surface, notes


@pytest.mark.parametrize("side", ["left", "right"])
def test_dots_are_as_far_apart_as_markers(tmp_path, side):
    places = np.array([[20.0, 70.0, 15.0], [-25.0, 60.0, 12.0], [0.0, 20.0, 15.0]])
    markers = MarkerSet(
        name="three",
        source="",
        kind="hand",
        side="right",
        labels=("A", "B", "C"),
        bones=("hand",) * 3,
        at=1e-3 * places,
    )
    path = tmp_path / "sheet.png"
    model, _, notes = written(path, markers, side)
    assert notes == ()
    page = imread(path)[:, :, :3]
    red = (page[:, :, 0] > 0.6) & (page[:, :, 1] < 0.3) & (page[:, :, 2] < 0.3)
    blobs, count = ndimage.label(ndimage.binary_closing(red, iterations=8))
    assert count == 3
    centres = np.array(ndimage.center_of_mass(blobs > 0, blobs, [1, 2, 3]))
    at = INCH / DPI * centres[:, ::-1] * [1.0, -1.0]
    home = 1e3 * marker_positions(model, neutral_pose(model.tree)[None])[0, :, :2]
    home = home[np.argsort(-home[:, 1])]  # as dots are found, from the top
    np.testing.assert_allclose(at - at[0], home - home[0], atol=0.4)
    size = 2.0 * np.sqrt((blobs == 1).sum() / np.pi) * INCH / DPI
    assert size == pytest.approx(6.0, abs=0.5)


@pytest.mark.parametrize("suffix", ["pdf", "svg", "png"])
def test_the_same_sheet_has_the_same_bytes(tmp_path, suffix):
    paths = [tmp_path / f"{n}.{suffix}" for n in range(2)]
    for path in paths:
        written(path, "schroeder6")
    one, other = (path.read_bytes() for path in paths)
    assert one == other
    assert len(one) > 10_000


def test_a_large_hand_with_many_markers_needs_larger_paper(tmp_path):
    *_, notes = written(tmp_path / "s.pdf", "maycock26", "left", 0.23)
    assert notes == ("the sheet needs A3: hand and table do not fit on A4",)


def test_distances_are_those_from_the_landmarks():
    tree = template("right")
    surface = template_surface(tree)
    model = load_marker_set("schroeder17").on(tree)
    marks = {name: surface.vertices[v] for name, v in landmarks(tree).items()}
    homes = marker_positions(model, neutral_pose(tree)[None])[0]
    for one, home in zip(placed.placements(model, surface), homes, strict=True):
        assert len(one.distances) == placed.LANDMARKS_OF_A_MARKER
        assert [d for _, d in one.distances] == sorted(d for _, d in one.distances)
        own = one.bone.split()[0]
        assert own == "hand" or any(n.startswith(own) for n, _ in one.distances)
        assert not any(name.endswith("_crease") for name, _ in one.distances)
        for name, size in one.distances:
            # The foot on the skin is some millimetres below the marker's middle.
            assert size == pytest.approx(np.linalg.norm(marks[name] - home), abs=6e-3)


def test_a_skin_of_its_own_has_its_landmarks_near_the_templates():
    tree = template("left")
    fine, coarse = (template_surface(tree, coarse=c) for c in (False, True))
    there = placed.landmark_places(tree, fine)
    near = placed.landmark_places(tree, replace(coarse, colors=None))
    assert there.keys() == near.keys()
    for name, place in there.items():
        assert np.linalg.norm(near[name] - place) < 0.004
