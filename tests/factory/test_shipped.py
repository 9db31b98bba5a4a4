"""What ships and is made by code."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from handclean import __version__
from handclean.factory.sample_takes import SESSIONS
from handclean.factory.samples import make_samples
from handclean.factory.shipped import GRASPS, default_prior
from handclean.hand.template import template
from handclean.io import files
from handclean.io.hdf5.prior import read_prior
from handclean.io.hdf5.subject import read_subject

SAMPLES = Path(__file__).parents[2] / "sample_sessions"


def test_the_shipped_prior_knows_every_hinge_and_is_a_subspace():
    prior = read_prior()
    assert prior.names == template("right").hinges
    product = prior.components.T @ prior.components
    np.testing.assert_allclose(product, np.eye(len(prior.deviations)), atol=1e-9)
    assert 0.95 <= prior.variance_share.sum() < 1.0


@pytest.mark.slow
def test_the_shipped_prior_is_the_one_the_code_makes():
    made, kept = default_prior(), read_prior()
    np.testing.assert_allclose(made.mean, kept.mean, atol=1e-6)
    np.testing.assert_allclose(made.components, kept.components, atol=1e-5)


def test_a_prior_from_few_grasps_points_much_the_same_way():
    few = default_prior(replace(GRASPS, trials=24, subjects=12, seed=7))
    kept = read_prior()
    # cosine of the angle between the two directions in which hands close
    assert abs(few.components[:, 0] @ kept.components[:, 0]) > 0.9


def test_sample_sessions_are_small_and_whole(tmp_path):
    made = make_samples(tmp_path)
    assert sum(path.stat().st_size for path in made) < 5_000_000
    for path in made:
        if path.name.endswith(".subject.h5"):
            assert len(read_subject(path).model.labels) == 26
        elif path.suffix in (".c3d", ".h5"):
            assert files.read(path).frames > 400


def test_samples_say_what_made_them(tmp_path):
    short = (("grasp", replace(SESSIONS[1][1], trials=2, subjects=1, duration_s=4.0)),)
    made = make_samples(tmp_path, short)
    found = [provenance(path) for path in made if path.suffix == ".h5"]
    assert sorted(number(entry) for entry in found) == [1, 1, 2]
    for entry in found:
        assert (entry["command"], entry["version"]) == ("simulate", __version__)
        assert entry["seed"] == short[0][1].seed
        assert entry["settings"]["scenario"] == "grasp"
        assert entry["settings"]["simulate"] == json.loads(
            json.dumps(asdict(short[0][1]))
        )
        assert entry["inputs"][0]["built_in"] == "grasp"


def provenance(path):
    with h5py.File(path) as file:
        [entry] = file["provenance"].asstr()[:]
    return json.loads(entry)


def number(entry):
    return entry["inputs"][0]["number"]


def test_the_shipped_samples_are_of_this_version():
    for path in SAMPLES.glob("*.h5"):
        entry = provenance(path)
        assert entry["version"] == __version__
        assert entry["seed"] == SESSIONS[1][1].seed
        with h5py.File(path) as file:
            assert str(file.attrs["format"]).startswith("handclean ")


def test_samples_are_the_same_bytes_every_time(tmp_path):
    short = (("grasp", replace(SESSIONS[1][1], trials=1, duration_s=4.0)),)
    one = make_samples(tmp_path / "one", short)
    two = make_samples(tmp_path / "two", short)
    assert [path.name for path in one] == [path.name for path in two]
    for a, b in zip(one, two, strict=True):
        assert a.read_bytes() == b.read_bytes()
