"""Numbers read without the HDF5 library are those that it reads."""

import io
import zlib

import h5py
import numpy as np
import pytest

from handclean.errors import FileError
from handclean.io.hdf5.file import open_some, read_some
from handclean.io.hdf5.opening import expect_same, opened

LIBRARIES = ["earliest", "v110", "latest"]

STORED = {
    "straight": {},
    "chunks": {"chunks": (7, 2)},
    "deflate": {"chunks": (16, 3), "compression": "gzip"},
    "shuffle": {"chunks": (16, 3), "compression": "gzip", "shuffle": True},
    "fletcher": {"chunks": (5, 2), "fletcher32": True},
    "all": {"chunks": (7, 3), "compression": 9, "shuffle": True, "fletcher32": True},
    "growing": {"chunks": (8, 3), "maxshape": (None, None), "compression": "gzip"},
    "one_chunk": {"chunks": (50, 3), "compression": "gzip"},
}


def both(path, name="x", keys=("x",)):
    """The numbers as HDF5 reads them, and as they are read here."""
    with h5py.File(path) as file:
        wanted = file[name][()]
    part = read_some(path, list(keys))
    return wanted, part.items[name].values


def expect_equal(path):
    wanted, found = both(path)
    assert found.dtype == wanted.dtype
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("stored", STORED)
@pytest.mark.parametrize("block", [0, 512])
def test_every_way_to_store_numbers_is_read(tmp_path, rng, library, stored, block):
    path = tmp_path / "a.h5"
    values = rng.normal(size=(50, 3))
    with h5py.File(path, "w", libver=library, userblock_size=block) as file:
        file.create_dataset("x", data=values, **STORED[stored])
    expect_equal(path)


@pytest.mark.parametrize(
    "dtype", ["u1", "i2", ">i4", "u8", "f2", "f4", ">f8", "?", "i1"]
)
@pytest.mark.parametrize("stored", ["straight", "shuffle"])
def test_every_kind_of_number_is_read(tmp_path, rng, dtype, stored):
    path = tmp_path / "a.h5"
    values = rng.integers(0, 2, (50, 3)).astype(dtype)
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=values, **STORED[stored])
    expect_equal(path)


def test_numbers_that_numpy_has_none_of_are_converted(tmp_path):
    path = tmp_path / "a.h5"
    kind = h5py.h5t.IEEE_F32LE.copy()
    kind.set_fields(15, 7, 8, 0, 7)  # bfloat16
    kind.set_precision(16)
    kind.set_size(2)
    values = np.array([0.0, 1.0, -2.5, 2.0**60])
    with h5py.File(path, "w") as file:
        space = h5py.h5s.create_simple((4,))
        made = h5py.h5d.create(file.id, b"x", kind, space)
        made.write(h5py.h5s.ALL, h5py.h5s.ALL, values)
        assert made.get_storage_size() == 8
    wanted, found = both(path)
    np.testing.assert_array_equal(wanted, values)
    np.testing.assert_array_equal(found, values)


def test_numbers_in_the_header_and_those_never_written_are_read(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_layout(h5py.h5d.COMPACT)
        space = h5py.h5s.create_simple((3,))
        made = h5py.h5d.create(file.id, b"x", h5py.h5t.IEEE_F64LE, space, plan)
        made.write(h5py.h5s.ALL, h5py.h5s.ALL, np.arange(3.0))
        file.create_dataset("never", (4, 2), "f4", fillvalue=7)
        sparse = file.create_dataset("some", (9, 2), "f4", chunks=(3, 2), fillvalue=7)
        sparse[3:5] = 1
        file.create_dataset("none", (0, 3), "f8")
        file["one"] = 3.5
    keys = ("x", "never", "some", "none", "one")
    for name in keys:
        wanted, found = both(path, name, keys)
        np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("stored", STORED)
@pytest.mark.parametrize("rows", [1, 7, 20, 1000])
def test_bands_one_after_another_are_the_whole(tmp_path, rng, stored, rows):
    path = tmp_path / "a.h5"
    values = rng.normal(size=(50, 3))
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=values, **STORED[stored])
    _, found = open_some(path, ["x"])
    with opened(path) as fd:
        bands = list(found["x"].bands(fd, rows))
    np.testing.assert_array_equal(np.concatenate(bands), values)


def test_a_changed_byte_breaks_a_fletcher_checksum(tmp_path, rng):
    values = rng.normal(size=(64,))
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        file.create_dataset("x", data=values, chunks=(64,), fletcher32=True)
    content = bytearray(image.getvalue())
    at = content.index(values.tobytes())
    path = tmp_path / "a.h5"
    for place in (at, at + 200, at + 511):
        changed = content.copy()
        changed[place] ^= 4
        path.write_bytes(changed)
        with pytest.raises(FileError, match="checksum is wrong"):
            read_some(path, ["x"])


def test_a_chunk_that_would_unpack_to_more_than_its_size_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        made = file.create_dataset("x", (512,), "u1", chunks=(512,), compression="gzip")
        made.id.write_direct_chunk((0,), zlib.compress(bytes(10**7)))
    with pytest.raises(FileError, match="another size"):
        read_some(path, ["x"])


def test_many_chunks_are_read_in_little_time_and_memory(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.arange(20_000.0), chunks=(1,))
    _, found = open_some(path, ["x"])
    with opened(path) as fd:
        bands = list(found["x"].bands(fd, 5000))
    assert [len(band) for band in bands] == [5000] * 4
    np.testing.assert_array_equal(np.concatenate(bands), np.arange(20_000.0))


def test_a_claim_beyond_what_is_stored_is_refused(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", (10**6,), "f8", chunks=(1000,))
    with pytest.raises(FileError, match="far more than it holds"):
        read_some(path, ["x"])


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path, rng):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["x"] = rng.normal(size=(9, 3))
    _, found = open_some(path, ["x"])
    path.write_bytes(path.read_bytes() + b"more")
    with opened(path) as fd, pytest.raises(FileError, match="changed while"):
        expect_same(path, fd, found["x"].state)
