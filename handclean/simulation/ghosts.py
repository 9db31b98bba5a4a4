"""Ghosts: points that are no marker.

Short-lived ones flash up near the hand and stay where they are. *Impostors* are worse:
while a marker is hidden, a point 5 to 20 mm away from it moves along with its bone for
30 frames or more, within what the joints could do; half of them go on under the hidden
marker's number.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, runs
from handclean.numerics.rotations import rotated
from handclean.simulation.losses import first_frames

_MEAN_GHOST_S = 0.025
"""[s] mean life of a short-lived ghost (chosen)."""

_IMPOSTOR_S = (0.15, 0.9)
"""[s] shortest and longest life of an impostor, which is 30 frames at least
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Ghost:
    """One ghost.

    Attributes
    ----------
    start : its first frame.
    points : (n, 3) [m] one per frame of its life.
    beside : marker it stands beside, -1 none.
    continues : whether it goes on under that marker's number.
    """

    start: int
    points: Floats
    beside: int = -1
    continues: bool = False


def flashes(
    markers: Floats,
    rate_hz: float,
    per_s: float,
    noise_m: float,
    rng: np.random.Generator,
) -> list[Ghost]:
    """Short-lived ghosts around (T, M, 3) true markers [m].

    Parameters
    ----------
    per_s : ghosts per second.
    """
    frames, clean = len(markers), first_frames(rate_hz)
    ghosts = []
    for start in rng.integers(clean, frames, rng.poisson(per_s * frames / rate_hz)):
        long = rng.random() < 0.1
        mean = rate_hz * _MEAN_GHOST_S * (10.0 if long else 1.0)
        life = min(int(rng.geometric(1.0 / max(mean, 1.0))), frames - start)
        low, high = markers[start].min(axis=0) - 0.05, markers[start].max(axis=0) + 0.05
        at = rng.uniform(low, high)
        shake = rng.normal(0.0, max(noise_m, 1e-5) * 4.0, (life, 3))
        ghosts.append(Ghost(start=int(start), points=at + shake))
    return ghosts


def impostors(
    markers: Floats,
    turns: Floats,
    seen: Bools,
    rate_hz: float,
    per_s: float,
    noise_m: float,
    rng: np.random.Generator,
) -> tuple[list[Ghost], Bools]:
    """Ghosts beside hidden markers, and what is seen then.

    A marker that is hidden long enough is taken where there is one, else one gets
    hidden for it.

    Parameters
    ----------
    markers : (T, M, 3) [m] true places.
    turns : (T, M, 3, 3) orientation of each marker's bone.
    seen : (T, M)
    per_s : impostors per second.

    Returns
    -------
    ghosts, seen : the ghosts and (T, M) what is seen with them.
    """
    frames, count = seen.shape
    left, ghosts = seen.copy(), []
    least = max(30, int(_IMPOSTOR_S[0] * rate_hz))
    clean = first_frames(rate_hz)
    for _ in range(rng.poisson(per_s * frames / rate_hz)):
        life = max(int(rng.uniform(*_IMPOSTOR_S) * rate_hz), least)
        hidden = [
            (m, a, b)
            for m in range(count)
            for a, b in runs(~left[:, m])
            if b - a >= least and a >= clean
        ]
        if hidden and rng.random() < 0.6:
            m, a, b = hidden[rng.integers(len(hidden))]
            life = min(life, b - a)
        elif frames - clean > life:
            m, a = int(rng.integers(count)), int(rng.integers(clean, frames - life))
            left[a : a + life + int(rng.integers(2, 20)), m] = False
        else:
            continue
        ghosts.append(_beside(m, int(a), int(life), markers, turns, noise_m, rng))
    return ghosts, left


def _beside(
    marker: int,
    start: int,
    life: int,
    markers: Floats,
    turns: Floats,
    noise_m: float,
    rng: np.random.Generator,
) -> Ghost:
    way = rng.normal(size=3)
    away = rng.uniform(0.005, 0.020) * way / np.linalg.norm(way)
    drift = np.cumsum(rng.normal(0.0, 4e-5, (life, 3)), axis=0)
    span = slice(start, start + life)
    local = away + drift
    points = markers[span, marker] + rotated(turns[span, marker], local)
    points = points + rng.normal(0.0, 1.5 * max(noise_m, 1e-5), points.shape)
    return Ghost(
        start=start,
        points=points,
        beside=marker,
        continues=bool(rng.random() < 0.5),
    )
