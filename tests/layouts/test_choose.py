"""The number of directions found by trying."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import HandcleanError
from handclean.layouts.choose import choose


@pytest.fixture(scope="module")
def quick(few):
    return replace(few, markers=4, iterations=10)


def test_the_layout_with_the_least_error_is_kept(model, surface, takes, tree, quick):
    told = []
    problem, layout, errors = choose(
        model, surface, takes, tree.hinges, quick, 3,
        told=lambda *one: told.append(one),
    )  # fmt: skip
    # Four markers give twelve equations, three of them for the rotation.
    assert list(errors) == [3, 4, 5, 6, 7, 8, 9]
    assert told == list(errors.items())
    best = min(errors, key=errors.__getitem__)
    assert len(problem.columns) == 3 + best
    assert len(layout.chosen) == 4
    assert all(0.0 < error < 0.1 for error in errors.values())


def test_no_more_directions_are_tried_than_markers_tell(
    model, surface, takes, tree, quick
):
    for anchor, most in ((True, 3), (False, 0)):
        asked = replace(quick, markers=2, anchor=anchor)
        if most:
            _, _, errors = choose(model, surface, takes, tree.hinges, asked, 3)
            assert max(errors) == most
        else:
            with pytest.raises(HandcleanError, match="take more"):
                choose(model, surface, takes, tree.hinges, asked, 3)


def test_frames_with_unknown_angles_are_left_out(model, surface, takes, tree, quick):
    holed = [take.copy() for take in takes]
    holed[0] = np.insert(holed[0], [5, 20], np.nan, axis=0)
    known = choose(model, surface, takes, tree.hinges, quick, 3)
    found = choose(model, surface, holed, tree.hinges, quick, 3)
    np.testing.assert_array_equal(found[1].chosen, known[1].chosen)
    assert found[2] == known[2]
