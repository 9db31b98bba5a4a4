"""The session file: what goes in comes out, the same bytes, and nothing but errors."""

import contextlib
import dataclasses
import subprocess
import sys
import time
import tracemalloc
from dataclasses import fields, is_dataclass

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from handclean.errors import FileError, HandcleanError
from handclean.hand.template import template
from handclean.io.hdf5.file import format_of, read_h5, write_h5
from handclean.io.hdf5.parts import Array, Part, tree_from, tree_part
from handclean.io.hdf5.session import FORMAT, read_session, write_session
from handclean.io.hdf5.take import read_h5_take
from handclean.io.shared.writing import unwritable
from handclean.recording import (
    Analog,
    Event,
    Motion,
    Origin,
    Points,
    Recording,
    SourceEvent,
    Trajectories,
)
from handclean.remarks import remark
from tests.edits import edited


def assert_same(a, b, where=""):
    """Fail unless two nested values are equal, types and NaN included."""
    assert type(a) is type(b), f"{where}: {type(a)} {type(b)}"
    if is_dataclass(a):
        for field in fields(a):
            name = f"{where}.{field.name}"
            assert_same(getattr(a, field.name), getattr(b, field.name), name)
    elif isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key, value in a.items():
            assert_same(value, b[key], f"{where}[{key}]")
    elif isinstance(a, (list, tuple)):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{where}[{i}]")
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.shape) == (b.dtype, b.shape), where
        np.testing.assert_array_equal(a, b, err_msg=where)
    else:
        assert a == b or a != a, where


def a_take(rng, frames=40):
    """Return a take in which every part is there."""
    shape = (frames, 3)
    positions = rng.normal(size=(*shape, 3))
    positions[5:9, 1] = np.nan
    names = tuple(f"hinge {d}" for d in range(4))
    turns = rng.normal(size=(frames, 4))
    origin = rng.integers(0, 5, shape).astype(np.uint8)
    origin[5:9, 1] = Origin.MISSING
    raw = np.where((origin == Origin.SMOOTHED)[..., None], positions + 0.001, np.nan)
    return Recording(
        rate=120.0,
        frames=frames,
        first_frame=-3,
        start_time=2.345,
        up_axis="+y",
        markers=Trajectories(
            positions=positions,
            labels=("Zeigefinger ä", "b", ""),
            model=("right", "right", ""),
            origin=origin,
            sigma=rng.random(shape).astype(np.float32),
            confidence=rng.random(shape).astype(np.float32),
            source=rng.integers(-1, 9, shape).astype(np.int32),
            residual=rng.random(shape).astype(np.float32),
            cameras=rng.integers(0, 255, shape).astype(np.uint8),
            raw=raw,
        ),
        unlabelled=Points(
            frame=np.array([0, 0, 7], np.int32),
            source=np.array([3, -1, 0], np.int32),
            positions=rng.normal(size=(3, 3)),
            residual=np.zeros(3, np.float32),
            cameras=np.ones(3, np.uint8),
        ),
        skeletons={"right": template("right", 0.2), "left": template("left")},
        motions={
            "right": Motion(
                names=names,
                angles=rng.normal(size=(frames, 4)),
                translation=rng.normal(size=(frames, 3)),
                rotation=turns / np.linalg.norm(turns, axis=1, keepdims=True),
                angles_sigma=rng.random((frames, 4)),
                trusted=rng.random(frames) < 0.5,
                residual=rng.random(frames),
            ),
            "glove": Motion(names=names[:1], angles=np.zeros((frames, 1))),
        },
        events=(Event(start=0, stop=4, text="swap"), Event(start=2, stop=2, text="")),
        analog=Analog(
            values=rng.normal(size=(frames * 10, 2)),
            labels=("EMG", "Kraft"),
            units=("V", "N"),
            rate=1200.0,
        ),
        parameters={
            "c3d": {
                "head": rng.integers(0, 256, 5000).astype(np.uint8),
                "frames": rng.integers(0, 65536, (frames, 300)).astype(np.uint16),
                "points": 3,
                "scale": -0.01,
                "lenient": False,
                "note": "a\0b ",
                "empty": np.zeros((0, 3)),
                "one": np.float32(1.5),
                "big": np.arange(4, dtype=">i2"),
                "mixed": [1, 2.5, None, {"x": [True]}],
                "groups": {"POINT": {"LABELS": ["a", "", "ä"], "a/b": "%", "..": ""}},
                "nothing": {},
            }
        },
        source_events=(SourceEvent(time=0.25, label="RON", context="Right"),),
        provenance=({"command": "label", "settings": {"gate_m": 0.01}},),
    )


def test_every_part_comes_back_exactly(rng, tmp_path):
    take = a_take(rng)
    write_session(tmp_path / "take.h5", take)
    assert_same(read_session(tmp_path / "take.h5"), take)


def test_parts_that_are_absent_stay_absent(tmp_path):
    take = Recording(rate=30.0, frames=2)
    write_session(tmp_path / "take.h5", take)
    assert_same(read_session(tmp_path / "take.h5"), take)


texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
numbers = st.integers(-(2**63), 2**63 - 1) | st.floats() | st.booleans()
number_arrays = hnp.arrays(
    hnp.scalar_dtypes().filter(lambda d: d.kind in "biuf" and d.itemsize <= 8),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
plain = st.recursive(
    texts | numbers | number_arrays | st.lists(texts),
    lambda inner: st.dictionaries(texts.filter(bool), inner, max_size=4),
    max_leaves=8,
)


@given(values=st.dictionaries(texts.filter(lambda t: t.strip("\0")), plain))
def test_parameters_come_back_exactly(values, tmp_path_factory):
    path = tmp_path_factory.mktemp("s") / "take.h5"
    take = Recording(rate=1.0, frames=1, parameters=values)
    write_session(path, take)
    assert_same(dict(read_session(path).parameters), values)


def test_the_same_content_gives_the_same_bytes(rng, tmp_path):
    take = a_take(rng)
    write_session(tmp_path / "a.h5", take)
    time.sleep(1.1)  # a time stamp would differ
    write_session(tmp_path / "b.h5", take)
    write_session(tmp_path / "c.h5", read_session(tmp_path / "b.h5"))
    first = (tmp_path / "a.h5").read_bytes()
    assert first == (tmp_path / "b.h5").read_bytes()
    assert first == (tmp_path / "c.h5").read_bytes()


def test_every_dataset_carries_units_and_follows_the_interface(rng, tmp_path):
    write_session(tmp_path / "take.h5", a_take(rng))
    found = {}
    with h5py.File(tmp_path / "take.h5") as file:
        assert file.attrs["format"] == b"handclean session"
        assert file.attrs["version"] == 2
        assert file.attrs["rate"] == 120.0
        file.visititems(
            lambda name, item: (
                found.update({name: item.attrs["units"]})
                if isinstance(item, h5py.Dataset)
                else None
            )
        )
        assert file["markers/labels"].asstr()[0] == "Zeigefinger ä"
        assert file["skeleton/right"].attrs["kind"] == b"hand"
        assert file["skeleton/right"].attrs["scale"] > 1
        assert file["markers/origin"].dtype == np.uint8
        assert file["markers/source"].dtype == np.int32
        assert file["motion/right/trusted"].dtype == bool
    found = {name: units.decode() for name, units in found.items()}
    assert found["markers/positions"] == "m"
    assert found["markers/raw"] == "m"
    assert found["motion/right/angles"] == "rad"
    assert found["skeleton/right/offsets"] == "m"
    assert found["skeleton/right/limits"] == "rad"
    assert found["source_events/time"] == "s"


def test_raw_places_stand_where_samples_are_smoothed(rng, tmp_path):
    take = a_take(rng)
    write_session(tmp_path / "take.h5", take)
    with h5py.File(tmp_path / "take.h5") as file:
        raw, origin = file["markers/raw"][()], file["markers/origin"][()]
        assert file.attrs["version"] == 2
    assert raw.shape == (40, 3, 3)
    smoothed = origin == 4
    assert smoothed.sum() > 10
    np.testing.assert_array_equal(
        raw[smoothed], take.markers.positions[smoothed] + 0.001
    )
    assert np.isnan(raw[~smoothed]).all()
    back = read_session(tmp_path / "take.h5").markers
    np.testing.assert_array_equal(back.has_raw, smoothed)
    np.testing.assert_array_equal(back.as_measured[smoothed], raw[smoothed])


def test_raw_places_are_in_the_unit_of_the_positions(rng, tmp_path):
    take = a_take(rng)
    write_session(tmp_path / "take.h5", take)
    back = read_h5_take(tmp_path / "take.h5", unit="mm").recording.markers
    np.testing.assert_array_equal(back.raw, take.markers.raw * 1e-3)


def test_events_have_the_numbers_of_the_source_both_ends_included(rng, tmp_path):
    spans = ((0, 40), (5, 6), (7, 7))
    take = dataclasses.replace(
        a_take(rng),
        first_frame=995,
        events=tuple(Event(start=a, stop=b, text="gap") for a, b in spans),
    )
    write_session(tmp_path / "take.h5", take)
    with h5py.File(tmp_path / "take.h5") as file:
        assert file["events/start"][:].tolist() == [995, 1000, 1002]
        assert file["events/stop"][:].tolist() == [1034, 1000, 1001]  # the last: none
        assert file["unlabelled/frame"][:].tolist() == [0, 0, 7]  # rows of arrays
    assert read_session(tmp_path / "take.h5").events == take.events


def test_a_session_of_version_1_is_read_for_what_it_meant(rng, tmp_path):
    take = dataclasses.replace(a_take(rng), first_frame=995)
    write_session(tmp_path / "old.h5", take)
    distance = (np.sqrt(3.0) * take.markers.sigma).astype(np.float32)
    with h5py.File(tmp_path / "old.h5", "r+") as file:
        file.attrs["version"] = 1
        file["events/start"][:] = [0, 2]  # rows, the stop left out
        file["events/stop"][:] = [4, 2]
        file["markers/sigma"][:] = distance
        del file["sha256"]
    back = read_session(tmp_path / "old.h5")
    assert back.events == take.events
    assert back.markers.sigma.dtype == np.float32
    np.testing.assert_allclose(back.markers.sigma, take.markers.sigma, rtol=1e-6)
    write_session(tmp_path / "new.h5", back)
    with h5py.File(tmp_path / "new.h5") as file:
        assert file.attrs["version"] == 2
        assert file["events/start"][:].tolist() == [995, 997]
    np.testing.assert_array_equal(
        read_session(tmp_path / "new.h5").markers.sigma, back.markers.sigma
    )


def texts_of(file):
    """Names of all objects with their texts: attributes, and datasets of strings."""
    found = [("", name) for name in file.attrs]
    file.visititems(lambda at, item: found.extend((at, name) for name in item.attrs))
    attrs = [(at, name) for at, name in found if attr_type(file, at, name)]
    datasets = []
    file.visititems(
        lambda at, item: (
            datasets.append(at)
            if isinstance(item, h5py.Dataset) and h5py.check_string_dtype(item.dtype)
            else None
        )
    )
    return attrs, datasets


def attr_type(file, at, name):
    where = file[at] if at else file
    return h5py.check_string_dtype(where.attrs.get_id(name).dtype)


def test_every_text_is_utf8_of_fixed_length(rng, tmp_path):
    write_session(tmp_path / "take.h5", a_take(rng))
    with h5py.File(tmp_path / "take.h5") as file:
        attrs, datasets = texts_of(file)
        assert len(attrs) > 20
        assert len(datasets) > 10
        kinds = [attr_type(file, at, name) for at, name in attrs]
        kinds += [h5py.check_string_dtype(file[at].dtype) for at in datasets]
        for encoding, length in kinds:
            assert encoding == "utf-8"
            assert length is not None, "HDF5's heap has no checksums"
        for at in datasets:
            file[at].asstr()[()]


def test_files_whose_texts_are_of_variable_length_are_still_read(rng, tmp_path):
    take = a_take(rng)
    path = tmp_path / "take.h5"
    write_session(path, take)
    with edited(path) as file:
        attrs, datasets = texts_of(file)
        for at in datasets:
            kept = dict(file[at].attrs)
            values = file[at].asstr()[()]
            del file[at]
            file.create_dataset(at, data=values, dtype=h5py.string_dtype())
            file[at].attrs.update(kept)
        for at, name in attrs:
            target = file[at] if at else file
            target.attrs[name] = target.attrs[name].decode()
        assert file.attrs["format"] == "handclean session"
        assert h5py.check_string_dtype(file["markers/labels"].dtype).length is None
    assert_same(read_session(path), take)


def test_texts_that_are_no_utf8_are_read_as_latin1(tmp_path):
    write_session(tmp_path / "take.h5", Recording(rate=1.0, frames=1))
    with edited(tmp_path / "take.h5") as file:
        group = file.create_group("markers")
        group["labels"] = np.array(["Fl\xfcgel".encode("latin-1")])
        group["positions"] = np.zeros((1, 1, 3))
        group["positions"].attrs["units"] = "m"
    take = read_session(tmp_path / "take.h5")
    assert take.markers.labels == ("Fl\xfcgel",)


def test_characters_that_utf8_has_not_become_question_marks(tmp_path):
    odd = "a\udcffb\ud800"
    said = {"name": odd, "names": [odd], "more": [1, odd]}
    take = Recording(rate=1.0, frames=1, parameters=said)
    write_session(tmp_path / "take.h5", take)
    back = read_session(tmp_path / "take.h5").parameters
    assert back == {"name": "a?b?", "names": ["a?b?"], "more": [1, "a?b?"]}


def test_one_long_text_that_stands_for_many_takes_no_memory(tmp_path):
    path, count = tmp_path / "take.h5", 20_000
    write_session(path, Recording(rate=1.0, frames=1))
    with edited(path) as file:
        labels = file.create_dataset("markers/labels", count, h5py.string_dtype())
        labels[0] = "x" * 100_000
        at = labels.id.get_offset()
    content = bytearray(path.read_bytes())
    content[at : at + 16 * count] = content[at : at + 16] * count
    path.write_bytes(content)
    with h5py.File(path) as file:
        assert len(file["markers/labels"][count - 1]) == 100_000
    tracemalloc.start()
    with pytest.raises(FileError, match="far more than it holds"):
        read_session(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 64 * len(content) + 2**25


def test_other_programs_texts_are_read_too(tmp_path):
    take = Recording(rate=1.0, frames=1)
    write_session(tmp_path / "take.h5", take)
    with edited(tmp_path / "take.h5") as file:
        group = file.create_group("markers")
        group["labels"] = ["ä", "b"]  # variable length
        group["positions"] = np.zeros((1, 2, 3))
        group["positions"].attrs["units"] = "m"
    markers = read_session(tmp_path / "take.h5").markers
    assert markers.labels == ("ä", "b")
    assert markers.origin.tolist() == [[1, 1]]


def test_a_joint_tree_is_a_part_of_other_files(tmp_path):
    tree = template("left", forearm=True)
    values = np.linspace(0, 1, 5)
    part = Part(
        {"side": "left"}, {"tree": tree_part(tree), "mean": Array(values, "rad")}
    )
    write_h5(tmp_path / "prior.h5", "handclean prior", part)
    back = read_h5(tmp_path / "prior.h5", "handclean prior")
    assert_same(tree_from(back.part("tree")), tree)
    np.testing.assert_array_equal(back.array("mean", "rad", float, 5), values)
    assert back.text("side") == "left"
    assert format_of(tmp_path / "prior.h5") == "handclean prior"


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (
            lambda f: f.attrs.update(format="handclean subject"),
            "is a handclean subject",
        ),
        (lambda f: f.attrs.pop("format"), "does not say what it is"),
        (lambda f: f.attrs.update(version=3), "version 3"),
        (lambda f: f.attrs.update(version=0), "without a version"),
        (lambda f: f.attrs.update(rate=float("nan")), "rate is nan"),
        (lambda f: f.attrs.update(rate=0.0), "rate is 0"),
        (lambda f: f.attrs.update(frames=0), "no frames"),
        (lambda f: f.attrs.update(frames=41), "shape"),
        (lambda f: f.attrs.update(up_axis="up"), "up axis"),
        (lambda f: f["events/start"].write_direct(np.array([-4, 1])), "outside"),
        (lambda f: f["events/stop"].write_direct(np.array([37, 1])), "frames -3 to 36"),
        (
            lambda f: f["events/stop"].write_direct(np.array([2**63 - 1, 0])),
            "outside",
        ),
        (lambda f: f["events/start"].write_direct(np.array([0, 9])), "outside"),
        (lambda f: f["markers/positions"].attrs.update(units="mm"), "'mm'"),
        (lambda f: f.__delitem__("markers/positions"), "no array 'positions'"),
        (lambda f: f.__delitem__("markers/labels"), "no texts 'labels'"),
        (
            lambda f: f["markers/origin"].write_direct(np.full((40, 3), 9, "u1")),
            "0 to 4",
        ),
        (
            lambda f: f["unlabelled/frame"].write_direct(np.array([2, 1, 0], "i4")),
            "rise",
        ),
        (
            lambda f: f["unlabelled/frame"].write_direct(np.array([0, 1, 40], "i4")),
            "rise",
        ),
        (lambda f: replace(f, "motion/right/angles", np.zeros((40, 3))), "shape"),
        (lambda f: replace(f, "motion/right/names", np.zeros(4)), "no texts 'names'"),
        (
            lambda f: replace(f, "markers/positions", np.zeros((40, 3, 3), "c16")),
            "numbers",
        ),
        (lambda f: replace(f, "markers/source", np.zeros((40, 3))), "float64"),
        (lambda f: replace(f, "markers/raw", np.zeros((40, 3))), "raw has shape"),
        (lambda f: replace(f, "markers/raw", np.zeros((39, 3, 3))), "raw has shape"),
        (lambda f: replace(f, "markers/raw", np.zeros((40, 3, 3), "c16")), "numbers"),
        (lambda f: f["markers/raw"].attrs.update(units="mm"), "raw is in 'mm'"),
        (lambda f: replace(f, "motion/right/trusted", np.zeros(40)), "float64"),
        (lambda f: replace(f, "markers", np.zeros(3)), "should be a group"),
        (lambda f: replace(f, "skeleton/right/parents", np.arange(16)), "joint tree"),
        (lambda f: replace(f, "skeleton/right/axes", np.full((20, 3), 1e300)), "axes"),
        (lambda f: replace(f, "provenance", ["no json"]), "JSON"),
        (lambda f: replace(f, "provenance", ["[1]"]), "JSON"),
        (lambda f: replace(f, "markers/sigma", h5py.SoftLink("/markers/x")), "links"),
        (lambda f: replace(f, "analog", h5py.ExternalLink("a.h5", "/")), "links"),
        (lambda f: replace(f, "analog/values", np.zeros((41, 2))), "41 samples"),
    ],
)
def test_a_session_that_does_not_fit_together_is_refused(
    spoil, complaint, rng, tmp_path
):
    path = tmp_path / "take.h5"
    write_session(path, a_take(rng))
    with edited(path) as file:
        spoil(file)
    with pytest.raises(FileError, match=complaint) as caught:
        read_session(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def replace(file, name, value):
    units = file[name].attrs.get("units", "") if name in file else ""
    del file[name]
    file[name] = value
    if isinstance(value, (np.ndarray, list)):
        file[name].attrs["units"] = units


def test_a_claim_of_a_million_million_values_takes_no_memory(rng, tmp_path):
    path = tmp_path / "take.h5"
    write_session(path, a_take(rng))
    with edited(path) as file:
        del file["markers/positions"]
        file["markers"].create_dataset(
            "positions", shape=(10**9, 1000), dtype="f8", chunks=(10, 10)
        )
    with pytest.raises(FileError, match="more than it holds"):
        read_session(path)
    with edited(path) as file:
        del file["markers/positions"]
        for i in range(200):  # each modest, together not
            file["markers"].create_dataset(
                f"x{i}", shape=(10**6,), dtype="f8", chunks=(10,)
            )
    with pytest.raises(FileError, match="more than it holds"):
        read_session(path)


def test_data_kept_elsewhere_is_not_fetched(rng, tmp_path):
    path = tmp_path / "take.h5"
    write_session(path, a_take(rng))
    (tmp_path / "raw").write_bytes(bytes(8000))
    with edited(path) as file:
        del file["markers/sigma"]
        layout = h5py.VirtualLayout(shape=(40, 3), dtype="f4")
        layout[:] = h5py.VirtualSource(tmp_path / "b.h5", "x", shape=(40, 3))
        file["markers"].create_virtual_dataset("sigma", layout)
    with pytest.raises(FileError, match="elsewhere"):
        read_session(path)
    with edited(path) as file:
        del file["markers/sigma"]
        file["markers"].create_dataset(
            "sigma", (40, 3), "f4", external=[(str(tmp_path / "raw"), 0, 480)]
        )
    with pytest.raises(FileError, match="elsewhere"):
        read_session(path)


def test_filters_that_would_need_a_plugin_are_refused(rng, tmp_path):
    path = tmp_path / "take.h5"
    write_session(path, a_take(rng))
    with edited(path) as file:
        del file["markers/sigma"]
        file["markers"].create_dataset(
            "sigma", data=np.zeros((40, 3), "f4"), compression="lzf"
        )
    with pytest.raises(FileError, match="filter"):
        read_session(path)


def test_python_objects_and_loops_are_refused(rng, tmp_path):
    path = tmp_path / "take.h5"
    write_session(path, a_take(rng))
    with edited(path) as file:
        file["markers/reference"] = file["markers/sigma"].ref
    with pytest.raises(FileError, match="not numbers or texts"):
        read_session(path)
    with edited(path) as file:
        del file["markers/reference"]
        file["parameters/again"] = file["parameters"]
    with pytest.raises(FileError, match="too deeply"):
        read_session(path)


@pytest.mark.parametrize(
    "value", [1j, {"a": {1, 2}}, object(), np.array(["a"], object)]
)
def test_what_no_file_can_hold_is_refused(value, tmp_path):
    take = Recording(rate=1.0, frames=1, parameters={"x": value})
    with pytest.raises(FileError, match="cannot be kept"):
        write_session(tmp_path / "take.h5", take)


@pytest.fixture(scope="module")
def session_bytes(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "take.h5"
    write_session(path, a_take(np.random.default_rng(1)))
    return path.read_bytes()


@given(data=st.data())
def test_damaged_files_raise_nothing_but_our_errors(
    data, session_bytes, tmp_path_factory
):
    path = tmp_path_factory.mktemp("fuzz") / "take.h5"
    raw = bytearray(session_bytes)
    for _ in range(data.draw(st.integers(1, 8))):
        at = data.draw(st.integers(0, len(raw) - 1))
        raw[at] = data.draw(st.integers(0, 255))
    if data.draw(st.booleans()):
        del raw[data.draw(st.integers(0, len(raw))) :]
    path.write_bytes(raw)
    with contextlib.suppress(HandcleanError):
        read_session(path)


@pytest.mark.parametrize("name", ["none.h5", "folder.h5", "empty.h5", "text.h5"])
def test_what_is_no_session_is_one_clear_line(name, tmp_path):
    (tmp_path / "folder.h5").mkdir()
    (tmp_path / "empty.h5").touch()
    (tmp_path / "text.h5").write_text("Frame\t1")
    with pytest.raises(FileError, match=name):
        read_session(tmp_path / name)


FULL = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from handclean.errors import FileError
from handclean.io.hdf5.file import write_h5
from handclean.io.hdf5.parts import Array, Part

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
part = Part({}, {"a": Array(np.random.default_rng(0).random(10_000))})
try:
    write_h5(Path(sys.argv[1]), "handclean test", part)
except FileError as error:
    print(error)
"""


def test_a_full_disk_is_one_clear_line_and_no_crash(tmp_path):
    line = [sys.executable, "-c", FULL, tmp_path / "a.h5"]
    done = subprocess.run(line, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{tmp_path / 'a.h5'}: cannot be written: file too large\n"


def test_a_folder_that_lets_nobody_write_is_named():
    said = "[Errno 13] Unable to open file (unable to open, time = Mon\n, errno = 13)"
    error = unwritable("there/a.h5", PermissionError(13, said))
    assert str(error) == "there/a.h5: cannot be written: there is no folder there"
    error = unwritable("/a.h5", PermissionError(13, said))
    assert str(error) == (
        "/a.h5: cannot be written: permission denied; "
        "is the folder / one that may be written to?"
    )


def test_a_session_cannot_be_written_into_nothing(tmp_path):
    with pytest.raises(FileError, match="cannot be written") as caught:
        write_session(tmp_path / "no" / "take.h5", Recording(rate=1.0, frames=1))
    assert str(caught.value).endswith(f"there is no folder {tmp_path / 'no'}")
    assert FORMAT == "handclean session"


def test_a_remark_is_kept_as_an_event_of_the_frames_it_names(rng, tmp_path):
    told = (
        remark("fit", "odd", frames=(1000, 1002), model="right", marker="A"),
        remark("missing", "all of it"),
    )
    take = dataclasses.replace(a_take(rng), first_frame=995, remarks=told)
    write_session(tmp_path / "take.h5", take)
    with h5py.File(tmp_path / "take.h5") as file:
        assert file["events/start"][-2:].tolist() == [1000, 995]
        assert file["events/stop"][-2:].tolist() == [1002, 994 + take.frames]
    fit, missing = read_session(tmp_path / "take.h5").events[-2:]
    assert (fit.start, fit.stop) == (5, 8)
    assert (fit.kind, fit.model, fit.marker) == ("fit", "right", "A")
    assert (missing.start, missing.stop) == (0, take.frames)
    again = dataclasses.replace(read_session(tmp_path / "take.h5"), remarks=told)
    assert again.all_events == again.events  # each once


def test_events_of_a_session_without_kinds_are_known_by_what_it_wrote(rng, tmp_path):
    texts = ("gap in R:A: filled by coupled", "gap of B", "swap")
    events = tuple(Event(start=0, stop=1, text=text) for text in texts)
    write_session(tmp_path / "a.h5", dataclasses.replace(a_take(rng), events=events))
    with h5py.File(tmp_path / "a.h5") as file:
        assert set(file["events"]) == {"start", "stop", "text"}
    back = read_session(tmp_path / "a.h5").events
    assert [(e.kind, e.marker) for e in back] == [
        ("gap", "R:A"),
        ("lost", "B"),
        ("", ""),
    ]
