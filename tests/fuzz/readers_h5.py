"""Every kind of HDF5 file: our own as written now and before, and other people's.

HDF5 of today keeps checksums over its structure, so that most flipped bytes are noticed
at once. Hence half of the seeds are stored as its first versions did, without any, and
one mutator changes what a file holds through the library itself.
"""

import io
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

from handclean.api import glove_files
from handclean.commands.inspect import inspect
from handclean.commands.shared.formats import RECORDS
from handclean.errors import HandcleanError
from handclean.glove.calibrate import calibrate
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.hand.template_surface import template_surface
from handclean.io import files
from handclean.io.glove.readings import open_readings
from handclean.io.glove.write_readings import write_readings
from handclean.io.hdf5 import seal
from handclean.io.hdf5.prior import read_prior, write_prior
from handclean.io.hdf5.session import write_session
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.runner.batch import Source
from tests.fuzz.inputs import BYTES, Reader
from tests.io.hdf5.test_session import a_take
from tests.linear_glove import GLOVE, QUICK, linear_samples

_MADE = ({"command": "fuzz", "version": "1", "inputs": []},)


def _rng():
    return np.random.default_rng(10)


def sessions(folder):
    take = replace(a_take(_rng(), 12), provenance=_MADE)
    write_session(folder / "whole.h5", take)
    write_session(folder / "bare.h5", replace(take, parameters={}, markers=None))
    _also_old(folder)


def subjects(folder):
    subject = template_subject(load_marker_set("schroeder8"), "right")
    write_subject(folder / "plain.h5", subject, _MADE)
    _also_old(folder)
    skin = template_surface(subject.model.tree)
    write_subject(folder / "skinned.h5", replace(subject, surface=skin))


def priors(folder):
    write_prior(folder / "shipped.h5", read_prior(), _MADE)
    _also_old(folder)


def samples(folder):
    write = glove_files.write_samples
    write(folder / "some.h5", linear_samples(_rng(), 30), GLOVE, _MADE)
    _also_old(folder)


def calibrations(folder):
    found = calibrate(GLOVE, linear_samples(_rng(), 60), QUICK)
    found = found[0] if isinstance(found, tuple) else found
    glove_files.write_calibration(folder / "fit.h5", found, _MADE)
    _also_old(folder)


def readings(folder):
    rng = _rng()
    times, values = np.arange(40) / 60.0, rng.normal(size=(40, 3))
    facts = {"glove": "generic14", "subject": "S01", "rate_hz": 60.0}
    write_readings(folder / "ours.h5", times, values, ["a", "b", "c"], facts)
    _also_old(folder)
    for name, library in (("new", "latest"), ("first", "earliest")):
        with h5py.File(folder / f"theirs_{name}.h5", "w", libver=library) as file:
            store = {"chunks": (16, 2), "compression": "gzip", "fletcher32": True}
            file.create_dataset("readings", data=values, **store, shuffle=True)
            file["time"] = times
            file["sensors"] = ["a", "b", "c"]
            file.attrs.update(rate=60.0, glove="mine", when=[1, 2, 3], tags=["x", "y"])


def _also_old(folder):
    """Store every file once more as the first HDF5 did: texts of variable length."""
    for path in sorted(folder.glob("*.h5")):
        old = path.with_name(f"old_{path.name}")
        with h5py.File(path) as new, h5py.File(old, "w", libver="earliest") as file:
            _copy_old(new, file)


def _copy_old(new, old):
    for name, value in new.attrs.items():
        old.attrs[name] = value.decode() if isinstance(value, bytes) else value
    for name, item in new.items():
        if isinstance(item, h5py.Group):
            _copy_old(item, old.create_group(name))
        elif name != seal.NAME:
            text = h5py.check_string_dtype(item.dtype)
            kind = {"dtype": h5py.string_dtype()} if text else {}
            data = item.asstr()[()] if text else item[()]
            made = old.create_dataset(name, data=data, **kind)
            for key, value in item.attrs.items():
                made.attrs[key] = value.decode() if isinstance(value, bytes) else value


def content(rng, content, other):
    """Change what a file holds, and keep it valid HDF5 (that of another seed).

    It may be made to refer to another file, but nothing is ever written through that.
    """
    image = io.BytesIO(other)
    with suppress(*_REFUSED), h5py.File(image, "r+") as file:
        if seal.NAME in file and rng.random() < 0.9:
            del file[seal.NAME]
        for _ in range(int(rng.choice([1, 1, 2, 3]))):
            with suppress(*_REFUSED):
                _change(rng, file)
    return image.getvalue()


_REFUSED = (ValueError, TypeError, OSError, KeyError, RuntimeError, OverflowError)


def _change(rng, file):
    """Change one thing in an open file."""
    names: list[str] = []
    file.visit(names.append)
    at = names[int(rng.integers(len(names)))]
    item = file[at] if rng.random() < 0.85 else file
    if rng.random() < 0.3 and len(item.attrs):
        key = list(item.attrs)[int(rng.integers(len(item.attrs)))]
        if rng.random() < 0.2:
            del item.attrs[key]
        else:
            item.attrs[key] = _any_value(rng)
    elif isinstance(item, h5py.Dataset) and rng.random() < 0.5:
        _spoil(rng, item)
    elif item is not file:
        _put_another(rng, file, at, dict(item.attrs))
    else:
        file.create_dataset(f"more{rng.integers(9)}", data=_any_value(rng))


def _spoil(rng, dataset):
    """Change some values of a dataset, never those that lie in another file."""
    if dataset.external or dataset.is_virtual or dataset.size > 10**6:
        return
    values = np.array(dataset[()])
    if values.dtype.kind not in "biuf" or not values.size:
        dataset[...] = "x" * int(rng.choice([0, 1, 10, 1000]))
        return
    flat = values.reshape(-1)
    some = rng.integers(len(flat), size=int(rng.choice([1, 3, len(flat)])))
    numbers = [0, 1, -1, 2**31, 2**62, -(2**62), np.nan, np.inf, 1e308, 1e-320, 255]
    with np.errstate(all="ignore"):
        flat[some] = np.array(numbers[int(rng.integers(len(numbers)))]).astype(
            values.dtype
        )
    dataset[...] = values


def _put_another(rng, file, at, attrs):
    """Put something else in the place of a part."""
    old = file[at]
    small = isinstance(old, h5py.Dataset) and not old.external and old.size <= 10**6
    values = old[()] if small else None
    del file[at]
    match int(rng.integers(9)):
        case 0:
            return
        case 1:
            file[at] = h5py.SoftLink("/markers")
        case 2:
            file[at] = h5py.ExternalLink("none.h5", "/")
        case 3:
            file.create_dataset(at, (64,), "u1", external=[("none", 0, 64)])
        case 4:
            shape = tuple(rng.choice([0, 1, 3, 1000, 10**6], size=rng.integers(1, 4)))
            file.create_dataset(at, shape, "f8", chunks=True)
        case 5 if isinstance(values, np.ndarray) and values.ndim and len(values):
            cut = values[: int(rng.integers(len(values)))]
            file[at] = cut if rng.random() < 0.5 else np.concatenate([values] * 3)
        case 6:
            file[at] = np.full((300, 1000), rng.random())
        case 7:
            file.create_group(at).attrs["kind"] = "dict"
        case _:
            file[at] = _any_value(rng)
    if isinstance(file.get(at, getlink=True), h5py.HardLink):
        file[at].attrs.update(attrs)


def _any_value(rng):
    some = [
        0, -1, 2**63 - 1, 2**64 - 1, 1.5, np.nan, np.inf, 1e308, True, "", "x",
        "ü" * 70_000, "/a/path", "nan", "dict", "json", "[" * 3000, "\x1b[31m",
        np.float16(1.0), np.longdouble(1.5), 1j, np.zeros(0), np.zeros((2, 0)),
        np.arange(24).reshape(2, 3, 4), np.array([b"a", b"\xff"]), np.zeros(3, "i4,f8"),
        np.array(3.0, ">f8"), h5py.Empty("f8"), ["a", "b"], [["a"], ["b"]],
        np.array([[1, 2], [3, 4]], dtype="u1"), np.datetime64("2020", "s").astype("i8"),
    ]  # fmt: skip
    return some[int(rng.integers(len(some)))]


def _reader(seeds, *ways):
    """Read with and without ``--lenient``, and in one more way, each by itself."""
    more = (*ways[1:], RECORDS.of, RECORDS.intact, _inspected)

    def read(path: Path) -> None:
        chosen = zlib.crc32(path.read_bytes())
        with suppress(HandcleanError):
            more[chosen % len(more)](path)
        with seal.tolerated(chosen % 4 > 0):
            ways[0](path)

    return Reader(read=read, seeds=seeds, mutators=(*BYTES, *([content] * len(BYTES))))


def _inspected(path):
    inspect(Source(path=path), None)


def _converted(path):
    take = files.read(path)
    for suffix in (".h5", ".c3d"):
        with suppress(HandcleanError):
            files.write(path.with_name(f"output{suffix}"), take)


def _all_readings(path):
    open_readings(path, rate_hz=60.0).all()


READERS = {
    "session": _reader(sessions, files.read, _converted),
    "subject": _reader(subjects, read_subject),
    "prior": _reader(priors, read_prior),
    "samples": _reader(samples, glove_files.read_samples),
    "calibration": _reader(calibrations, glove_files.read_calibration),
    "readings": _reader(readings, _all_readings),
}
