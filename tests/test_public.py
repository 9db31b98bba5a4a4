"""The public API: what `import handclean` offers, and what it costs."""

import subprocess
import sys

import pytest

import handclean

HEAVY = {"numpy", "scipy", "numba", "h5py", "click", "matplotlib", "pandas"}
PUBLIC = {
    *{"read", "read_subject", "write", "inspect"},
    *{"label", "fill_gaps", "solve", "clean", "calibrate_hand", "compare", "simulate"},
    *{"Recording", "Subject", "Remark", "HandcleanError"},
}
MOST_MODULES = 20
"""Modules of the standard library that `import handclean` may add; 5 when chosen."""


def modules(code):
    told = "import sys; before = set(sys.modules); " + code + "; "
    told += "print(*sorted(set(sys.modules) - before))"
    done = subprocess.run(
        [sys.executable, "-c", told], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_import_handclean_loads_nothing_heavy():
    loaded = modules("import handclean")
    assert not loaded & HEAVY
    assert len(loaded) < MOST_MODULES
    assert {name for name in loaded if name.startswith("handclean.")} == set()


def test_an_error_and_a_remark_need_no_numbers():
    assert not modules("import handclean as hc; hc.HandcleanError, hc.Remark") & HEAVY


def test_every_public_name_is_listed_and_is_there():
    assert set(dir(handclean)) >= PUBLIC
    listed = {name for name in dir(handclean) if not name.startswith("_")}
    own = {name for name in listed if f"handclean.{name}" in sys.modules}
    assert listed - own == PUBLIC - own
    for name in PUBLIC:
        assert getattr(handclean, name).__doc__


def test_another_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'lable'"):
        handclean.lable  # noqa: B018
