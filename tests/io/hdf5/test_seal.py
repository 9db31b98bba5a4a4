"""An HDF5 file knows whether it was edited."""

import hashlib
from contextlib import suppress
from dataclasses import replace

import h5py
import numpy as np
import pytest

from handclean.api import glove_files
from handclean.commands.shared.formats import RECORDS
from handclean.errors import FileError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.io import files
from handclean.io.glove.readings import open_readings
from handclean.io.glove.write_readings import write_readings
from handclean.io.hdf5 import seal, walker
from handclean.io.hdf5.file import read_h5, write_h5
from handclean.io.hdf5.parts import Array, Part
from handclean.io.hdf5.prior import read_prior, write_prior
from handclean.io.hdf5.session import write_session
from handclean.io.hdf5.subject import read_subject, write_subject
from handclean.recording import Recording
from tests.edits import edited
from tests.io.hdf5.test_session import a_take
from tests.linear_glove import GLOVE, linear_samples


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
    with suppress(OSError, FileError):  # HDF5 may notice it before
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


def a_session(path):
    write_session(path, a_take(np.random.default_rng(0)))
    return "markers/positions", files.read


def a_subject(path):
    write_subject(path, template_subject(load_marker_set("schroeder8"), "right"))
    return "markers/at", read_subject


def a_prior(path):
    write_prior(path, read_prior())
    return "mean", read_prior


def some_samples(path):
    glove_files.write_samples(
        path, linear_samples(np.random.default_rng(0), 9), GLOVE, ()
    )
    return "targets", glove_files.read_samples


def some_readings(path):
    times, values = np.arange(9) / 60.0, np.ones((9, 3))
    write_readings(path, times, values, ["a", "b", "c"], {})
    return "readings", lambda path: open_readings(path).all()


KINDS = [a_session, a_subject, a_prior, some_samples, some_readings]


def with_a_flipped_bit(path, name):
    """Flip a bit of one number, as a rotten disk does."""
    with h5py.File(path) as file:
        at = file[name].id.get_offset()
    content = bytearray(path.read_bytes())
    content[at + 6] ^= 8
    path.write_bytes(content)


@pytest.mark.parametrize("make", KINDS)
def test_a_flipped_bit_is_an_error_in_every_kind_of_file(tmp_path, make):
    path = tmp_path / "a.h5"
    name, read = make(path)
    read(path)
    with_a_flipped_bit(path, name)
    with pytest.raises(FileError, match=r"do not fit its /sha256.*--lenient") as caught:
        read(path)
    assert caught.value.file == path


@pytest.mark.parametrize("make", KINDS)
def test_a_broken_seal_can_be_tolerated_and_is_noted_once(tmp_path, make):
    path = tmp_path / "a.h5"
    name, read = make(path)
    with_a_flipped_bit(path, name)
    with seal.tolerated(True) as noted:
        read(path)
        read(path)
    assert len(noted) == 1
    assert "a.h5 is damaged or was edited" in noted[0].text
    with seal.tolerated(False), pytest.raises(FileError, match="/sha256"):
        read(path)


@pytest.mark.parametrize("make", KINDS)
def test_a_file_whose_seal_was_taken_off_is_read(tmp_path, make):
    path = tmp_path / "a.h5"
    name, read = make(path)
    with edited(path) as file:
        values = file[name][()]
        values[0, ...] *= 0.5
        file[name][...] = values
    read(path)
    assert seal.intact(path) is None


def test_lenient_reading_keeps_with_the_take_that_it_is_damaged(tmp_path):
    path = tmp_path / "a.h5"
    name, _ = a_session(path)
    with_a_flipped_bit(path, name)
    take = files.read(path, lenient=True)
    assert "is damaged or was edited" in take.remarks[-1].text
    about = files.inspect(path)
    assert "is damaged or was edited" in about["traps"][0]


def test_the_user_block_says_where_provenance_is(tmp_path):
    path = tmp_path / "a.h5"
    told = ({"command": "label"}, {"command": "sölve", "settings": {"a": 1.5}})
    write_session(path, replace(a_take(np.random.default_rng(0)), provenance=told))
    with h5py.File(path) as file:
        kept = [text.encode() for text in file["provenance"].asstr()[()]]
    assert seal.provenance(path) == kept
    assert RECORDS.of(path) == told
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["provenance"] = ["{}"]
    assert seal.provenance(tmp_path / "b.h5") is None
    assert RECORDS.of(tmp_path / "b.h5") == ({},)


def test_provenance_of_very_unlike_lengths_takes_no_room_and_comes_back(tmp_path):
    path = tmp_path / "a.h5"
    told = (*({"n": n} for n in range(500)), {"long": "x" * 100_000})
    write_session(path, Recording(rate=1.0, frames=1, provenance=told))
    assert path.stat().st_size < 300_000
    assert files.read(path).provenance == told
    assert RECORDS.of(path) == told


def test_a_whole_file_is_known_again_without_the_library(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    a_session(path)
    monkeypatch.setattr(walker, "walked", None)
    assert seal.intact(path) is True
