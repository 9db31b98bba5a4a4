"""Marker sets come back as they were written."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.hand.marker_set import MarkerSet, load_marker_set, shipped
from handclean.io.marker_sets import write_marker_set

words = st.text(
    st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1
)


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_set_comes_back(name, tmp_path):
    known = load_marker_set(name)
    path = tmp_path / "set.toml"
    write_marker_set(path, known, remarks=[f"number {n}" for n in range(26)])
    found = load_marker_set(path)
    for field in ("name", "source", "kind", "side", "labels", "bones"):
        assert getattr(found, field) == getattr(known, field)
    np.testing.assert_allclose(found.at, known.at, atol=1e-12)


@given(name=words, source=words, labels=st.lists(words, min_size=1, unique=True))
def test_any_text_comes_back(tmp_path_factory, name, source, labels):
    path = tmp_path_factory.mktemp("set") / "set.toml"
    known = MarkerSet(
        name=name,
        source=source,
        kind="hand",
        side="left",
        labels=tuple(labels),
        bones=("hand",) * len(labels),
        at=np.zeros((len(labels), 3)),
    )
    write_marker_set(path, known)
    found = load_marker_set(path)
    assert (found.name, found.source, found.labels) == (name, source, known.labels)


def test_a_set_without_a_name_is_called_as_its_file(tmp_path):
    known = load_marker_set("hoyet6")
    nameless = MarkerSet(**{**vars(known), "name": ""})
    write_marker_set(tmp_path / "mine.toml", nameless)
    assert load_marker_set(tmp_path / "mine.toml").name == "mine"
