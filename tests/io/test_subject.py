"""A subject's own skin comes back with it; one that is broken is refused."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import FileError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.hand.surface import Surface
from handclean.io.h5 import read_h5, write_h5
from handclean.io.parts import Array, Part
from handclean.io.subject import FORMAT, read_subject, write_subject


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
