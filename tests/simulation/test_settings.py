"""Settings that cannot be are refused, and reading them costs nothing."""

import subprocess
import sys

import pytest

from handclean.simulation.settings import SimulateConfig


@pytest.mark.parametrize(
    "wrong",
    [
        {"trials": 0},
        {"subjects": 0},
        {"cameras": 1},
        {"rate_hz": 1.0},
        {"rate_hz": float("nan")},
        {"noise_m": -1e-4},
        {"noise_m": float("nan")},
        {"duration_s": float("inf")},
        {"duration_s": 0.3},
        {"side": "both"},
        {"seed": -1},
    ],
)
def test_a_setting_that_cannot_be_is_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SimulateConfig(**wrong)


def test_settings_come_without_numpy():
    code = "import handclean.simulation.settings, sys; print('numpy' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert said.stdout.strip() == "False"
