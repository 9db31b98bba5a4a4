"""Settings of labelling that no hand could have are refused."""

import pytest

from handclean.labels.settings import LabelConfig


@pytest.mark.parametrize(
    ("name", "most"), [("small_m", 1.0), ("reach_m", 1.0), ("acceleration_m_s2", 1e4)]
)
def test_more_than_any_hand_has_is_refused(name, most):
    assert getattr(LabelConfig(**{name: most}), name) == most
    with pytest.raises(ValueError, match=f"{name} should be {most:g} at most"):
        LabelConfig(**{name: 1.5 * most})
