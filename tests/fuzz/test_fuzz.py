"""Damaged files of every kind, and that the driver finds what is wrong."""

import pytest

from tests.fuzz import driver

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
