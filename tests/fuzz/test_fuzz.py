"""Damaged files of every kind, and that the driver finds what is wrong."""

import io

import h5py
import numpy as np
import pytest

from tests.fuzz import driver, readers_h5

FEW = 400
"""Inputs of each reader; ``python -m tests.fuzz.driver NAME -n COUNT`` takes more."""


@pytest.mark.slow
@pytest.mark.parametrize("name", driver.names())
def test_damaged_files_raise_nothing_else_and_cost_little(name):
    wrong, worst = driver.fuzz(name, FEW)
    assert wrong == []
    assert worst["inputs"] == FEW


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("raises", "KeyError"),
        ("warns", "RuntimeWarning"),
        ("dies", "the process died"),
        ("hangs", "says nothing"),
        ("works", "s of processor time"),
        ("child_works", "s of processor time"),
        ("hoards", "MB for"),
    ],
)
def test_the_driver_reports_faults_and_goes_on(monkeypatch, capsys, name, says):
    monkeypatch.setattr(driver, "LONGEST", 1.0)
    if name == "hangs":
        monkeypatch.setattr(driver, "SILENT", 8.0)
    wrong, worst = driver.fuzz(f"faulty.{name}", 3)
    capsys.readouterr()
    assert worst["inputs"] == 3
    assert len(wrong) == 1, "one of three inputs is the faulty one"
    assert f"faulty.{name} 1 (seed 0): " in wrong[0]
    assert says in wrong[0]


def test_a_sound_reader_is_not_reported():
    wrong, worst = driver.fuzz("faulty.sound", 5)
    assert wrong == []
    assert worst["inputs"] == 5
    assert worst["read"] == 3, "seeds 0, 1, 2, 0, 1; those of 1 are refused"


def test_the_mutator_of_hdf5_writes_into_no_other_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    elsewhere = tmp_path / "none"
    elsewhere.write_bytes(bytes(range(64)))
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        for k in range(3):
            file.create_dataset(f"x{k}", (64,), "u1", external=[("none", 0, 64)])
        file["y"] = np.arange(9.0)
    for seed in range(300):
        rng = np.random.default_rng(seed)
        readers_h5.content(rng, b"", image.getvalue())
    assert elsewhere.read_bytes() == bytes(range(64))
    assert [path.name for path in tmp_path.iterdir()] == ["none"]
