"""How movements unfold in time: minimum jerk, submovements, tremor.

A point-to-point movement follows 10 u^3 - 15 u^4 + 6 u^5 (Flash and Hogan 1985). People
correct it on the way: most of it is done by a first submovement and the rest by a
second one that starts before the first has ended, which puts the peak of speed before
the middle (Meyer et al. 1988). Successive movements are added up, as in Flash and
Henis (1991), so that one may begin before another has ended.

Hands shake: a slow sway below 1 Hz, and a physiological tremor between 8 and 12 Hz.
"""

import numpy as np

from handclean.arrays import Floats


def minimum_jerk(u: Floats) -> Floats:
    """Share of the way done at share ``u`` of the time; 0 before, 1 after."""
    v = np.clip(u, 0.0, 1.0)
    return v * v * v * (10.0 + v * (6.0 * v - 15.0))


def movement(
    times: Floats, start: float, duration: float, rng: np.random.Generator
) -> Floats:
    """(T,) share of a movement done, by a large and a small submovement.

    Parameters
    ----------
    times : (T,) [s]
    start, duration : [s]
    """
    first = rng.uniform(0.82, 0.97)
    stop = rng.uniform(0.72, 0.92)
    begin = rng.uniform(0.45, 0.65)
    u = (times - start) / duration
    large = minimum_jerk(u / stop)
    small = minimum_jerk((u - begin) / (1.0 - begin))
    return first * large + (1.0 - first) * small


def staggered(
    times: Floats,
    start: float,
    duration: float,
    names: tuple[str, ...],
    rng: np.random.Generator,
) -> Floats:
    """(T, D) shares of one movement of all joints: fingers and joints not in step.

    Parameters
    ----------
    names : names of the D hinges; those of one finger share most of their timing.
    """
    late = {name.split("_")[0]: rng.normal(0.0, 0.05) for name in names}
    slow = {name.split("_")[0]: rng.lognormal(0.0, 0.10) for name in names}
    out = np.zeros((len(times), len(names)))
    for d, name in enumerate(names):
        finger = name.split("_")[0]
        begin = start + duration * (late[finger] + rng.normal(0.0, 0.025))
        lasts = duration * slow[finger] * rng.lognormal(0.0, 0.07)
        out[:, d] = movement(times, begin, lasts, rng)
    return out


def shaking(
    times: Floats,
    low_hz: float,
    high_hz: float,
    size: float,
    columns: int,
    rng: np.random.Generator,
) -> Floats:
    """(T, columns) noise of a band of frequencies, standard deviation ``size``.

    Parameters
    ----------
    times : (T,) [s], evenly spaced.
    """
    count = len(times)
    step = times[1] - times[0] if count > 1 else 1.0
    padded = 2 * count  # so that start and end are not the same
    hertz = np.fft.rfftfreq(padded, step)
    middle, width = 0.5 * (low_hz + high_hz), 0.5 * (high_hz - low_hz)
    gain = np.exp(-0.5 * ((hertz - middle) / max(width, 1e-9)) ** 2)
    phase = rng.normal(size=(columns, len(hertz))) + 1j * rng.normal(
        size=(columns, len(hertz))
    )
    noise = np.fft.irfft(gain * phase, padded, axis=1)[:, :count].T
    power = np.sqrt(2.0 * (gain**2).sum() * 2.0) / padded
    return size * noise / power if power > 0.0 else np.zeros((count, columns))


def fidget(times: Floats, names: tuple[str, ...], rng: np.random.Generator) -> Floats:
    """(T, D) small movements nobody intends: each finger as a whole, and each joint.

    Standard deviation 1; abduction a third of it.
    """
    fingers = list(dict.fromkeys(name.split("_")[0] for name in names))
    common = shaking(times, 0.1, 1.3, 0.75, len(fingers), rng)
    own = shaking(times, 0.1, 1.6, 0.66, len(names), rng)
    whole = np.column_stack([common[:, fingers.index(n.split("_")[0])] for n in names])
    size = np.array([1.0 / 3.0 if n.endswith("abduction") else 1.0 for n in names])
    out: Floats = size * (whole + own)
    return out


def sway(
    times: Floats, size: float, tremor: float, columns: int, rng: np.random.Generator
) -> Floats:
    """(T, columns) slow sway and tremor together.

    Parameters
    ----------
    size, tremor : standard deviations of the two; the tremor's varies in time.
    """
    slow = shaking(times, 0.0, 0.7, size, columns, rng)
    fast = shaking(times, 8.0, 12.0, tremor, columns, rng)
    loud = np.exp(shaking(times, 0.0, 0.5, 0.4, columns, rng))
    return slow + loud * fast
