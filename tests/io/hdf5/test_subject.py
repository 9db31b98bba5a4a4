"""A subject's own skin comes back with it; one that is broken is refused."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from handclean.commands.inspect import FIGURES, inspect
from handclean.errors import FileError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.hand.surface import Surface
from handclean.hand.template import HAND_LENGTH_M
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Array, Part
from handclean.io.hdf5.subject import FORMAT, read_subject, write_subject
from handclean.runner.batch import Source
from tests.edits import edited


@pytest.fixture
def scanned(rng):
    """A subject with a tetrahedron for a skin."""
    weights = -np.sort(-rng.dirichlet(np.ones(4), size=4), axis=1)
    surface = Surface(
        vertices=rng.normal(size=(4, 3)),
        faces=np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]),
        bones=rng.integers(0, 16, (4, 4)),
        weights=weights,
        colors=rng.integers(0, 256, (4, 3)).astype(np.uint8),
    )
    return replace(template_subject(load_marker_set("schroeder8")), surface=surface)


@pytest.mark.parametrize("colored", [True, False])
def test_a_skin_comes_back_as_it_was(tmp_path, scanned, colored):
    if not colored:
        plain = replace(scanned.surface, colors=None)
        scanned = replace(scanned, surface=plain)
    write_subject(tmp_path / "s.h5", scanned)
    back = read_subject(tmp_path / "s.h5").surface
    for name in ("vertices", "faces", "bones", "weights", "colors"):
        np.testing.assert_array_equal(
            getattr(back, name), getattr(scanned.surface, name)
        )
    assert (back.colors is not None) == colored


def test_a_subject_without_a_skin_comes_back_without(tmp_path, scanned):
    write_subject(tmp_path / "s.h5", replace(scanned, surface=None))
    assert read_subject(tmp_path / "s.h5").surface is None


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("vertices", Array(np.full((4, 3), np.nan), "m"), "finite"),
        ("vertices", Array(np.zeros((4, 3)), "mm"), "'m' is expected"),
        ("vertices", Array(np.zeros((5, 3)), "m"), "shape"),
        ("faces", Array(np.zeros((0, 3), dtype=np.int64)), "at least one face"),
        ("faces", Array(np.array([[0, 1, 4]])), "vertices 0 to 3"),
        ("faces", Array(np.array([[0.0, 1.0, 2.0]])), "not int64"),
        ("bones", Array(np.full((4, 4), 16)), "0 to 15"),
        ("bones", Array(np.full((4, 4), -1)), "negative"),
        ("weights", Array(np.full((4, 4), 0.3)), "sum to 1"),
        ("colors", Array(np.full((4, 3), 256)), "beyond uint8"),
    ],
)
def test_a_broken_skin_is_refused_with_its_place(
    tmp_path, scanned, name, value, message
):
    path = tmp_path / "s.h5"
    write_subject(path, scanned)
    part = read_h5(path, FORMAT)
    items = {**part.part("surface").items, name: value}
    broken = {**part.items, "surface": Part(items=items)}
    write_h5(path, FORMAT, Part(part.attrs, broken))
    with pytest.raises(FileError, match=message) as raised:
        read_subject(path)
    assert str(raised.value).startswith(f"{path}/surface: ")
    assert "\n" not in str(raised.value)


def test_a_subject_without_a_name_is_called_by_its_file(tmp_path, scanned):
    write_subject(tmp_path / "Ada.subject.h5", replace(scanned, name=""))
    assert read_subject(tmp_path / "Ada.subject.h5").name == "Ada"
    write_subject(tmp_path / "Ada.subject.h5", replace(scanned, name="Ben"))
    assert read_subject(tmp_path / "Ada.subject.h5").name == "Ben"


def test_inspecting_a_subject_tells_whose_hand_it_is_and_how_well_known(
    tmp_path, scanned
):
    path = tmp_path / "S07.h5"
    known = replace(scanned, name="", errors={"heldout_rms_m": 2.5e-4}, calibrated=True)
    write_subject(path, known)
    done = inspect(Source(path=path), None)
    found = done.figures
    assert set(found) <= set(FIGURES)
    tree = scanned.model.tree
    assert (found["name"], found["side"]) == ("S07", tree.side)
    assert found["length_mm"] == pytest.approx(1e3 * HAND_LENGTH_M * tree.scale)
    assert found["residual_mm"] == pytest.approx(0.25)
    assert (found["skin"], found["vertices"], found["faces"]) == (True, 4, 4)
    assert found["marker_count"] == len(scanned.model.labels)
    assert "'S07', a right hand of" in done.line
    assert "8 markers of schroeder8, residual 0.25 mm, with a skin" in done.line
    write_subject(path, replace(scanned, surface=None, calibrated=False))
    line = inspect(Source(path=path), None).line
    assert "not calibrated, no skin of its own" in line
    assert "residual" not in line


def test_a_damaged_subject_is_inspected_as_far_as_it_goes(tmp_path, scanned):
    path = tmp_path / "s.h5"
    write_subject(path, scanned)
    with edited(path) as file:
        del file["markers/labels"]
    found = inspect(Source(path=path), None).figures
    assert "markers" in found["parts"]
    assert found["trap_count"] == 1


def spoilt(path, at, value, units=""):
    with edited(path) as file:
        del file[at]
        file[at] = value
        file[at].attrs["units"] = units


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (
            lambda p: spoilt(p, "skeleton/bones", [f"b{n}" for n in range(20_000)]),
            "not 20000",
        ),
        (
            lambda p: spoilt(p, "skeleton/hinges", [f"h{n}" for n in range(20_000)]),
            "shape",
        ),
        (lambda p: spoilt(p, "markers/labels", ["x" * 10**6] * 8), "1000000 char"),
        (lambda p: spoilt(p, "skeleton/bones", ["x" * 10**6] * 16), "1000000 char"),
        (lambda p: scaled(p, 0.0), "scale should be above 0, 1000 at most, not 0"),
        (lambda p: scaled(p, np.nan), "scale is nan; all its numbers should be finite"),
        (lambda p: scaled(p, 1e300), "scale should be above 0, 1000 at most"),
        (lambda p: scaled(p, -1.0), "scale should be above 0, 1000 at most, not -1"),
        (lambda p: scaled(p, np.inf), "scale is inf; all its numbers should be finite"),
    ],
)
def test_a_subject_of_impossible_size_is_refused_in_little_memory(
    tmp_path, spoil, message
):
    path = tmp_path / "s.h5"
    write_subject(path, template_subject(load_marker_set("schroeder8"), "right"))
    spoil(path)
    tracemalloc.start()
    with pytest.raises(FileError, match=message) as caught:
        read_subject(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5e7 + 20 * path.stat().st_size
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("sigma", [-1e-3, 1.5, 1e308])
def test_a_sigma_that_no_marker_has_is_refused(tmp_path, sigma):
    path = tmp_path / "s.h5"
    subject = template_subject(load_marker_set("schroeder8"), "right")
    write_subject(path, subject)
    spoilt(path, "markers/sigma", np.full(8, sigma), "m")
    with pytest.raises(FileError, match="sigma should be 0 to 1 m, or NaN"):
        read_subject(path)
    spoilt(path, "markers/sigma", np.full(8, np.nan), "m")
    assert np.isnan(read_subject(path).marker_sigma).all()


def scaled(path, scale):
    with edited(path) as file:
        file["skeleton"].attrs["scale"] = scale


def test_a_whole_tree_of_20_000_bones_is_refused_at_once(tmp_path):
    count = 20_000
    tree = {
        "bones": [f"b{n}" for n in range(count)],
        "joints": [f"j{n}" for n in range(count)],
        "parents": Array(np.arange(-1, count - 1)),
        "offsets": Array(np.zeros((count, 3)), "m"),
        "hinges": [],
        "hinge_bone": Array(np.zeros(0, dtype=np.int64)),
        "axes": Array(np.zeros((0, 3))),
        "limits": Array(np.zeros((0, 2)), "rad"),
    }
    part = Part({"kind": "rigid", "side": ""}, tree)
    write_h5(tmp_path / "s.h5", FORMAT, Part({}, {"skeleton": part}))
    with pytest.raises(FileError, match="20000 bones and 0 hinges, but 1000"):
        read_subject(tmp_path / "s.h5")
    bones = '[[bone]]\nname = "b0"\n' + "".join(
        f'[[bone]]\nname = "b{n}"\nparent = "b{n - 1}"\noffset = [0, 1, 0]\n'
        for n in range(1, count)
    )
    (tmp_path / "s.toml").write_text(bones)
    with pytest.raises(FileError, match=r"20000 .*bone.*at most 1000"):
        read_subject(tmp_path / "s.toml")
