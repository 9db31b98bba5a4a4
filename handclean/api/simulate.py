"""Takes, scans and readings of gloves, with known truth."""

from pathlib import Path
from typing import Any, Literal, overload

from handclean.glove.poses import key_poses
from handclean.simulation.glove import GloveSession, simulate_glove
from handclean.simulation.scan import Scan
from handclean.simulation.scenarios import find_scenario, settings_for
from handclean.simulation.simulate import Trial, simulate_scan
from handclean.simulation.simulate import simulate as simulate_takes


@overload
def simulate(
    scenario: Literal["grasp", "rom", "free", "demo"], **settings: Any
) -> tuple[Trial, ...]: ...


@overload
def simulate(scenario: Literal["scan"], **settings: Any) -> tuple[Scan, ...]: ...


@overload
def simulate(
    scenario: Literal["glove"], **settings: Any
) -> tuple[GloveSession, ...]: ...


@overload
def simulate(
    scenario: Path | str, **settings: Any
) -> tuple[Trial | Scan | GloveSession, ...]: ...


def simulate(
    scenario: Path | str, **settings: Any
) -> tuple[Trial | Scan | GloveSession, ...]:
    """Make takes, scans or readings of a simulated hand, as ``handclean simulate``.

    Parameters
    ----------
    scenario : str or path
        ``grasp``, ``rom``, ``free``, ``demo``, ``scan``, ``glove``, or a TOML file with
        a kind and settings.
    **settings
        Fields of `handclean.simulation.settings.SimulateConfig`: ``trials``, ``seed``,
        ``duration_s`` [s], ``rate_hz`` [Hz] ...

    Returns
    -------
    tuple
        One for each trial; the same settings and seed give the same. Of takes a
        ``Trial`` with ``unlabelled``, ``labelled`` and ``truth``, takes of T frames,
        and ``subject``. Of ``scan`` a ``Scan`` with ``points`` (P, 3) [m],
        ``landmarks`` [m] by name and the true ``subject`` and ``pose``. Of ``glove`` a
        ``GloveSession`` whose ``takes`` have ``times`` (T,) [s], ``readings`` (T, S)
        and the true ``angles`` (T, D) [rad].

    Raises
    ------
    UsageError
        If there is no such scenario, or a setting is wrong.
    HandcleanError
        If the marker set, the glove or a grasp class is unknown.

    Examples
    --------
    >>> import handclean as hc
    >>> (trial,) = hc.simulate("free", duration_s=0.5, rate_hz=50.0, seed=3)
    >>> trial.truth.frames, len(trial.subject.model.labels)
    (25, 26)
    """
    found = find_scenario(scenario)
    chosen = settings_for(found, **settings)
    numbers = range(chosen.trials)
    if found.kind == "scan":
        return tuple(simulate_scan(found.kind, chosen, number) for number in numbers)
    if found.kind == "glove":
        poses = key_poses()
        return tuple(simulate_glove(chosen, number, poses) for number in numbers)
    return tuple(simulate_takes(found.kind, chosen))
