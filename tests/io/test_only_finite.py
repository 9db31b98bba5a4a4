"""Numbers that are none are refused when loaded and never said to be known."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest

from handclean.errors import FileError
from handclean.glove.definitions import load_glove
from handclean.hand.marker_set import load_marker_set
from handclean.hand.skeleton import load_skeleton
from handclean.hand.subject import template_subject
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.io import files
from handclean.io.finite import only_finite
from handclean.io.formats import TAKES_READ, TAKES_WRITTEN
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Array, Part
from handclean.io.hdf5.prior import FORMAT as PRIOR
from handclean.io.hdf5.prior import read_prior, write_prior
from handclean.io.hdf5.subject import FORMAT as SUBJECT
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.recording import Motion, Origin, Points, Recording, Trajectories

BAD = [np.nan, np.inf, -np.inf]


def places(part, path=()):
    """Every array of numbers of a part, as the names that lead to it."""
    for name, item in part.items.items():
        if isinstance(item, Part):
            yield from places(item, (*path, name))
        elif isinstance(item, Array) and item.values.dtype.kind == "f":
            yield (*path, name)


def spoilt(part, names, bad):
    """The part with a number that is none in one of its arrays."""
    name, *below = names
    item = part.items[name]
    if below:
        item = spoilt(item, below, bad)
    else:
        values = item.values.copy()
        values[(0,) * values.ndim] = bad
        item = Array(values, item.units)
    return replace(part, items={**part.items, name: item})


def expect_each_is_refused(path, kind, read, unknown):
    whole = read_h5(path, kind)
    found = list(places(whole))
    for names in found:
        for bad in BAD:
            write_h5(path, kind, spoilt(whole, names, bad))
            if names in unknown and np.isnan(bad):
                read(path)
                continue
            within = "/".join((str(path), *names[:-1]))
            said = f"{within}: {names[-1]} holds {bad:g} in row 1; all its numbers"
            with pytest.raises(FileError, match=f"^{re.escape(said)}"):
                read(path)
    return found


def test_a_subject_with_a_number_that_is_none_is_refused(tmp_path):
    subject = template_subject(load_marker_set("maycock26"))
    skin = template_surface(subject.model.tree, coarse=True)
    subject = replace(subject, surface=skin, errors={"heldout_rms_m": 1e-3})
    path = tmp_path / "S01.h5"
    write_subject(path, subject)
    unknown = {("markers", "sigma"), ("errors", "values")}
    found = expect_each_is_refused(path, SUBJECT, read_subject, unknown)
    assert {("skeleton", "offsets"), ("skeleton", "limits"), ("markers", "at")} < set(
        found
    )
    assert {("surface", "vertices"), ("surface", "weights"), *unknown} < set(found)
    whole = read_h5(path, SUBJECT)
    for bad in BAD:
        tree = whole.part("skeleton")
        tree = replace(tree, attrs={**tree.attrs, "scale": bad})
        write_h5(path, SUBJECT, replace(whole, items={**whole.items, "skeleton": tree}))
        with pytest.raises(FileError, match=r"S01\.h5/skeleton: scale"):
            read_subject(path)


def test_a_prior_with_a_number_that_is_none_is_refused(tmp_path):
    path = tmp_path / "prior.h5"
    write_prior(path, read_prior())
    found = expect_each_is_refused(path, PRIOR, read_prior, set())
    assert len(found) == 4


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf"])
def test_text_with_a_number_that_is_none_is_refused(tmp_path, bad):
    path = tmp_path / "a.toml"
    for text, load in [
        (f"side = 'left'\n[[marker]]\nlabel='A'\nbone='hand'\nat=[1.0, {bad}, 0.0]",
         load_marker_set),
        (f"[[bone]]\nname='a'\n[[bone]]\nname='b'\nparent='a'\noffset=[{bad}, 0, 0]",
         load_skeleton),
        ("name='g'\nhand='fingers'\nsensors=['A']\n[[rotation]]\n"
         f"name='index_pip_flexion'\nfollows = {{ index_mcp_flexion = {bad} }}",
         load_glove),
    ]:  # fmt: skip
        path.write_text(text)
        with pytest.raises(FileError, match=r"a\.toml"):
            load(path)


def take():
    """A take that claims to know what is no number, in every way there is."""
    positions = np.random.default_rng(0).normal(size=(6, 5, 3))
    claims = [Origin.MEASURED, Origin.FILLED, Origin.SMOOTHED, Origin.MEASURED, 1]
    origin = np.tile(np.array(claims, np.uint8), (6, 1))
    positions[1, :, 2] = [*BAD, np.nan, np.inf]
    positions[2, 0] = np.nan
    tree = template("right")
    angles = np.full((6, len(tree.hinges)), 0.1)
    rotation = np.tile([1.0, 0.0, 0.0, 0.0], (6, 1))
    translation = np.zeros((6, 3))
    angles[1, 3], translation[2, 0], rotation[3, 1] = np.nan, np.inf, np.nan
    angles[4, 0] = -np.inf
    return Recording(
        rate=100.0,
        frames=6,
        markers=Trajectories(
            positions=positions,
            labels=tuple("ABCDE"),
            model=("",) * 5,
            origin=origin,
        ),
        unlabelled=Points(
            frame=np.array([0, 1], np.int32),
            source=np.array([0, 0], np.int32),
            positions=np.array([[1.0, 2.0, 3.0], [1.0, np.inf, 3.0]]),
        ),
        skeletons={"right": tree},
        motions={
            "right": Motion(
                names=tree.hinges,
                angles=angles,
                translation=translation,
                rotation=rotation,
                trusted=np.ones(6, dtype=bool),
            )
        },
    )


def expect_honest(found):
    if found.markers is not None:
        known = found.markers.origin != Origin.MISSING
        assert np.isfinite(found.markers.positions[known]).all()
        assert not np.isinf(found.markers.positions).any()
        assert known[[0, 3, 4, 5]].all()
        assert not known[1].any()
    if found.unlabelled is not None:
        assert np.isfinite(found.unlabelled.positions).all()
    for motion in found.motions.values():
        assert not np.isinf(motion.poses).any()
        if motion.trusted is not None:
            assert np.isfinite(motion.poses[motion.trusted]).all()


def test_what_is_no_number_counts_as_unknown():
    given = take()
    found = only_finite(given)
    expect_honest(found)
    assert found.motions["right"].trusted.tolist() == [1, 0, 0, 0, 0, 1]
    assert len(found.unlabelled.frame) == 1
    assert np.isinf(given.markers.positions).any(), "what is given stays as it is"
    assert only_finite(found) is found


def test_nothing_but_a_smoothed_sample_has_a_raw_place(tmp_path):
    given = take()
    raw = np.full((6, 5, 3), 0.5)
    raw[3, 2, 1], raw[4, 2] = np.nan, np.inf
    given = replace(given, markers=replace(given.markers, raw=raw))
    found = only_finite(given)
    expect_honest(found)
    assert (
        found.markers.has_raw == [[0, 0, t in (0, 2, 5), 0, 0] for t in range(6)]
    ).all()
    np.testing.assert_array_equal(
        np.isfinite(found.markers.raw).all(axis=2), found.markers.has_raw
    )
    assert np.isnan(found.markers.raw[~found.markers.has_raw]).all()
    assert only_finite(found) is found
    files.write(tmp_path / "a.h5", given)
    with h5py.File(tmp_path / "a.h5") as file:
        np.testing.assert_array_equal(file["markers/raw"][()], found.markers.raw)


@pytest.mark.parametrize("suffix", sorted(TAKES_WRITTEN))
def test_no_writer_says_that_what_is_no_number_is_known(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    files.write(path, take())
    if suffix in TAKES_READ:
        expect_honest(
            files.read(path, rate_hz=100.0, unit="mm" if suffix == ".csv" else None)
        )
    if suffix == ".mot":
        assert path.read_text().split("endheader\n")[1].count("\n") == 3, "two frames"
    if suffix == ".glb":
        assert b'"not_trusted":{"right":[[2,5]]}' in path.read_bytes()


def test_a_session_keeps_no_claim_that_others_would_believe(tmp_path):
    files.write(tmp_path / "a.h5", take())
    with h5py.File(tmp_path / "a.h5") as file:
        origin = file["markers/origin"][()]
        gone = ~np.isfinite(file["markers/positions"][()]).all(axis=2)
        assert (origin[gone] == 0).all()
        trusted = file["motion/right/trusted"][()]
        assert trusted.tolist() == [True, False, False, False, False, True]
