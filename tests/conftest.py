"""Fixtures every test may use."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "handclean",
    derandomize=True,
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("handclean")

BESIDE = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture
def rng():
    return np.random.default_rng(20150)


@pytest.fixture(scope="session")
def shared_data():
    """Folder of real recordings that are kept beside the project, never in it."""
    folder = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))
    if not folder.is_dir():
        pytest.skip(f"no recordings at {folder} (set HANDCLEAN_DATA to have them)")
    return folder
