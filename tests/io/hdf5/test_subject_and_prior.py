"""Subjects and priors come back as they were written; broken ones are refused."""

import numpy as np
import pytest

from handclean.errors import FileError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.ik.prior import PosturePrior
from handclean.io.hdf5.file import write_h5
from handclean.io.hdf5.parts import Array, Part
from handclean.io.hdf5.prior import read_prior, write_prior
from handclean.io.hdf5.subject import read_subject, write_subject


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_subject_comes_back_as_it_was(tmp_path, side):
    subject = template_subject(load_marker_set("schroeder8"), side)
    path = tmp_path / "s.h5"
    write_subject(path, subject, ({"command": "test"},))
    back = read_subject(path)
    assert back.model.labels == subject.model.labels
    assert back.model.tree.side == side
    assert back.calibrated == subject.calibrated
    for one, two in (
        (back.model.at, subject.model.at),
        (back.model.bone, subject.model.bone),
        (back.model.tree.offsets, subject.model.tree.offsets),
        (back.model.tree.axes, subject.model.tree.axes),
        (back.marker_sigma, subject.marker_sigma),
    ):
        np.testing.assert_array_equal(one, two)


def test_writing_a_subject_twice_gives_the_same_bytes(tmp_path):
    subject = template_subject(load_marker_set("schroeder8"))
    for name in ("a.h5", "b.h5"):
        write_subject(tmp_path / name, subject)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_a_prior_comes_back_as_it_was(tmp_path, rng):
    prior = PosturePrior(
        names=("a", "b", "c"),
        mean=rng.normal(size=3),
        components=np.linalg.qr(rng.normal(size=(3, 2)))[0],
        deviations=np.array([0.4, 0.1]),
        variance_share=np.array([0.8, 0.1]),
        source="a test",
    )
    path = tmp_path / "p.h5"
    write_prior(path, prior)
    back = read_prior(path)
    assert (back.names, back.source) == (prior.names, prior.source)
    np.testing.assert_array_equal(back.components, prior.components)
    np.testing.assert_array_equal(back.mean, prior.mean)


def test_files_of_another_kind_are_refused(tmp_path):
    subject = template_subject(load_marker_set("schroeder8"))
    path = tmp_path / "s.h5"
    write_subject(path, subject)
    with pytest.raises(FileError, match="handclean posture prior"):
        read_prior(path)
    write_h5(path, "handclean subject", Part(items={"markers": Array(np.zeros(3))}))
    with pytest.raises(FileError):
        read_subject(path)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a.c3d", "is a take, not a subject; 'handclean calibrate-hand markers' makes"),
        ("a.CSV", "is a take, not a subject"),
        ("a.ply", "is a mesh, not a subject; 'handclean calibrate-hand scan' makes"),
        ("a.glb", "is a rigged hand, not a subject; 'handclean convert' makes"),
    ],
)
def test_what_is_given_for_a_subject_is_told_what_it_is(tmp_path, name, said):
    path = tmp_path / name
    with pytest.raises(FileError, match="no such file"):
        read_subject(path)
    path.write_text("something")
    with pytest.raises(FileError, match=said):
        read_subject(path)
