"""The other hand is told from this one, and from another person's."""

from dataclasses import replace

import numpy as np
import pytest
from people import exercise, true_hand

from handclean.errors import HandcleanError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.hand.subject import template_subject
from handclean.ik.solve import solve_markers
from handclean.ik.wrong_side import expect_side, is_odd, mirrored
from handclean.io.hdf5.prior import read_prior
from handclean.tree import MIRROR

NOISE = 3e-4


def seen_of(rng, name, frames=60):
    """A template, and (T, M, 3) of the markers of somebody with its set."""
    markers = load_marker_set(name)
    model = true_hand(rng, markers, markers.side, 1.0)
    poses = exercise(rng, model.tree, frames, 50.0)
    seen = marker_positions(model, poses)
    subject = replace(
        template_subject(markers),
        model=model,
        marker_sigma=np.full(len(model.labels), np.sqrt(2.0) * NOISE),
        calibrated=True,
    )
    return (
        template_subject(markers),
        subject,
        seen + rng.normal(scale=NOISE, size=seen.shape),
    )


def look(subject, seen):
    residual = solve_markers(subject.model, seen, prior=read_prior()).residual
    expect_side(subject, seen, residual, read_prior())


def test_the_mirror_image_of_a_model_has_the_mirror_images_of_its_markers(rng):
    template, _, _ = seen_of(rng, "maycock26")
    poses = exercise(rng, template.model.tree, 5, 50.0)
    poses[:, :3], poses[:, 3:7] = 0.0, [1.0, 0.0, 0.0, 0.0]
    places = marker_positions(mirrored(template.model), poses)
    np.testing.assert_allclose(
        places, marker_positions(template.model, poses) * MIRROR, atol=1e-12
    )
    assert mirrored(template.model).tree.side == "left"


@pytest.mark.parametrize("name", ["maycock26", "dfki13", "xu19_left"])
def test_the_other_hand_is_refused_and_this_one_is_not(rng, name):
    template, subject, seen = seen_of(rng, name)
    for one in (template, subject):
        look(one, seen)
        with pytest.raises(HandcleanError, match="mirror image"):
            look(one, seen * MIRROR)


def test_another_person_s_take_is_odd_but_no_other_hand(rng):
    _, subject, _ = seen_of(rng, "maycock26")
    _, _, others = seen_of(rng, "maycock26")
    residual = solve_markers(subject.model, others, prior=read_prior()).residual
    assert is_odd(subject, np.isfinite(others[:, :, 0]), residual)
    expect_side(subject, others, residual, read_prior())
