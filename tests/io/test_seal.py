"""An HDF5 file knows whether it was edited."""

import hashlib
from contextlib import suppress

import h5py
import numpy as np
import pytest

from handclean.io import seal
from handclean.io.h5 import read_h5, write_h5
from handclean.io.parts import Array, Part


@pytest.fixture
def path(tmp_path):
    """A file with more than one piece of numbers."""
    path = tmp_path / "a.h5"
    values = np.random.default_rng(0).normal(size=(200_000, 3))
    write_h5(path, "thing", Part({"name": "x"}, {"values": Array(values, "m")}))
    return path


def test_a_file_is_intact_as_it_was_written_and_does_not_show_its_seal(path):
    assert seal.intact(path) is True
    assert set(read_h5(path, "thing").items) == {"values"}


def test_the_seal_is_the_digest_of_the_file_with_zeros_in_its_place(path):
    with h5py.File(path) as file:
        kept = file["sha256"][()].tobytes()
    image = path.read_bytes()
    assert image.count(kept) == 1
    empty = image.replace(kept, bytes(32))
    assert hashlib.sha256(empty).digest() == kept


@pytest.mark.parametrize("at", [0.3, 0.7, 0.999])
def test_any_byte_that_is_changed_breaks_the_seal(path, at):
    image = bytearray(path.read_bytes())
    image[int(at * len(image))] ^= 1
    path.write_bytes(image)
    with suppress(OSError):  # HDF5 may notice it before
        assert seal.intact(path) is False


def test_a_file_of_another_program_has_no_seal(tmp_path):
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["values"] = 1
    assert seal.intact(tmp_path / "b.h5") is None
    with h5py.File(tmp_path / "c.h5", "w") as file:
        file["sha256"] = "text of variable length"
    assert seal.intact(tmp_path / "c.h5") is None
    with h5py.File(tmp_path / "d.h5", "w") as file:
        file["sha256"] = h5py.ExternalLink("none.h5", "/sha256")
    assert seal.intact(tmp_path / "d.h5") is None
