"""The shipped files of the papers' sets are what the code writes."""

import numpy as np
import pytest

from handclean.factory.published_sets import SETS, as_toml
from handclean.hand.marker_set import SHIPPED, load_marker_set
from handclean.hand.template import template


@pytest.mark.parametrize("chosen", SETS, ids=lambda s: s.name)
def test_the_shipped_file_is_the_one_the_code_writes(chosen):
    path = SHIPPED / f"{chosen.name}.toml"
    assert path.read_text(encoding="utf-8") == as_toml(chosen)


@pytest.mark.parametrize("chosen", SETS, ids=lambda s: s.name)
def test_the_number_in_a_set_s_name_is_its_number_of_markers(chosen):
    loaded = load_marker_set(chosen.name)
    digits = "".join(c for c in chosen.name if c.isdigit())
    assert len(loaded.labels) == int(digits)
    assert loaded.source.startswith("reconstructed")
    assert loaded.side == chosen.side


def test_maycock26_has_a_marker_on_every_segment():
    loaded = load_marker_set("maycock26")
    assert set(loaded.bones) == set(template("right").bones)


def test_the_reduced_sets_are_subsets_of_the_full_one():
    full = load_marker_set("schroeder17")
    places = dict(zip(full.labels, full.at, strict=True))
    for name in ("schroeder6", "schroeder8"):
        part = load_marker_set(name)
        for label, at in zip(part.labels, part.at, strict=True):
            np.testing.assert_array_equal(at, places[label])
