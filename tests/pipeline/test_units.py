"""Lengths in a wrong unit are told by how large the hand would be."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.ik.take import solve
from handclean.pipeline.steps.solve import doubts
from handclean.recording import Recording, trajectories


@pytest.mark.parametrize("factor", [1.0, 1e3, 1e-3])
def test_solving_in_a_wrong_unit_asks_for_the_unit(factor):
    subject = template_subject(load_marker_set("maycock26"), "right")
    subject = replace(subject, marker_sigma=np.full(26, 5e-4), calibrated=True)
    poses = np.tile(neutral_pose(subject.model.tree), (12, 1))
    places = factor * marker_positions(subject.model, poses)
    take = Recording(
        rate=100.0, frames=12, markers=trajectories(places, subject.model.labels)
    )
    solved = solve(take, subject, name="right")
    found = doubts(solved, {"right": subject})
    if factor == 1.0:
        assert found == ()
    else:
        assert f"{factor:.3g} times as far apart as this subject's" in found[0]
        assert "is the unit right? (--unit)" in found[1]
