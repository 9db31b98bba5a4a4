"""Takes with known truth."""

from pathlib import Path
from typing import Any

from handclean.errors import UsageError
from handclean.simulation.scenarios import find_scenario, settings_for
from handclean.simulation.simulate import Trial
from handclean.simulation.simulate import simulate as simulate_trials


def simulate(scenario: Path | str, **settings: Any) -> tuple[Trial, ...]:
    """Make takes of a simulated hand, as ``handclean simulate``.

    Parameters
    ----------
    scenario : str or path
        ``grasp``, ``rom``, ``free``, ``demo``, or a TOML file with a kind and settings.
    **settings
        Fields of `handclean.simulation.settings.SimulateConfig`: ``trials``, ``seed``,
        ``duration_s`` [s], ``rate_hz`` [Hz] ...

    Returns
    -------
    tuple of Trial
        Each with ``unlabelled``, ``labelled`` and ``truth``, takes of T frames, and
        ``subject``. The same settings and seed give the same takes.

    Raises
    ------
    HandcleanError
        If the scenario, marker set or a grasp class is unknown.
    UsageError
        If a setting is wrong, or the scenario makes no takes of markers.

    Examples
    --------
    >>> import handclean as hc
    >>> (trial,) = hc.simulate("free", duration_s=0.5, rate_hz=50.0, seed=3)
    >>> trial.truth.frames, len(trial.subject.model.labels)
    (25, 26)
    """
    found = find_scenario(scenario)
    if found.kind in ("scan", "glove"):
        right = "'handclean simulate' writes its files"
        raise UsageError(
            f"scenario {found.name}: makes no takes of markers; {right}",
            where="simulate",
        )
    return tuple(simulate_trials(found.kind, settings_for(found, **settings)))
