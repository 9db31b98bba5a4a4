"""Spikes of one marker: one to three frames that do not belong to its own motion.

A ghost taken for a marker, or two cameras that disagree for a frame, throw a sample
aside and the next ones are right again. Such a *block* of k = 1, 2 or 3 frames is found
from the two measured frames before it, a and b, and the two behind, c and d. The cubic
through a, b, c, d says where the block would lie (the *bridge*). The block is a spike
if its first and its last sample are

1. further from the bridge than `SPIKE_NOISE_SD` standard deviations of what noise does
   to that distance. A marker's noise is measured: its third differences have 20 times
   its variance (1 + 9 + 9 + 1), and slow motion leaves nothing in them;
2. further than `SPIKE_MOTION` times the longest step of the frames around, a to b, c to
   d, and b to c by the frame: fast motion is allowed what it does already;
3. further than an acceleration of `HONEST_ACCELERATION_M_S2` can come and go in k + 1
   intervals, and further than `LEAST_SPIKE_M`;
4. off alone: none of the `NEIGHBOURS` markers nearest to it is off in the same
   direction by `SHARED_SHARE` of that. What a finger or a whole hand does is motion.

What lies further from the bridge than 1 to 3 is replaced by the bridge. A step that
stays and a kink keep within 2. More than three frames in a row are not called a spike,
nor is what has not two measured frames on both sides (the first and last two of every
run).

Measured on a Qualisys, a NOKOV and an ART recording of hands (100, 120 and 60 Hz):

- *Untouched* they have 25 spikes in 125 387 samples, 0 in 57 264 and 0 in 59 109; with
  every second or third frame alone, hence motion two and three times as fast, none. The
  25 are 2.2 to 6.7 mm off, 19 of them of one marker that changes between two places
  while those around it do not.
- *Spikes put in* at 3 cm are found to 100, 100 and 95 %, at 1 cm to 100, 100 and 7 %:
  at 60 Hz 1 cm out and back in three frames is motion that a hand can do. Nothing else
  is found with them. What replaces them is off by 0.05, 0.03 and 0.25 mm in the median.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, expect_shape
from handclean.gaps.noise import noise_of

LONGEST_SPIKE_FRAMES = 3
"""Frames in a row that may be one spike (chosen; the middle of the bridge over three
has 1.4 times the marker's noise)."""

SPIKE_NOISE_SD = 8.0
"""[-] standard deviations of noise that a spike exceeds (chosen: of a hundred million
quiet samples one; from 5 to 12 nothing above changes)."""

SPIKE_MOTION = 2.0
"""[-] steps of the frames around that a spike exceeds. A marker that turns within one
frame, which nothing with mass does, would lie 2/3 of a step away. Chosen: with 1.5 and
3 the recordings above have 31 and 24 spikes, and 91 and 77 % of those of 3 cm are found
at 60 Hz; with 1 the frames beside a spike are taken for it."""

HONEST_ACCELERATION_M_S2 = 40.0
"""[m/s^2] how hard a finger's marker turns within a block at most. Chosen, as hard as
`labels` takes a hand to accelerate: with 20 and 80 the recordings above have 54 and 2
spikes, and 99 and 50 % of those of 1 cm are found at 100 Hz."""

LEAST_SPIKE_M = 5e-4
"""[m] what is nearer to the bridge is left alone (chosen)."""

NEIGHBOURS = 3
"""Markers near by that are asked whether they move along (chosen)."""

SHARED_SHARE = 0.4
"""[-] share of a spike from which on another marker moves along (chosen: the next one
down a finger goes half as far as its tip)."""

_SUPPORT = 2
"""Measured frames on each side of a block."""


@dataclass(frozen=True, kw_only=True)
class Despiked:
    """Trajectories without their spikes.

    Attributes
    ----------
    positions : (T, M, 3) [m] as they were but where ``spikes``.
    spikes : (T, M) samples that were replaced.
    """

    positions: Floats
    spikes: Bools


def despike(positions: Floats, seen: Bools, rate_hz: float) -> Despiked:
    """Replace the spikes of every marker by the path of the frames around them.

    Parameters
    ----------
    positions : (T, M, 3) [m]
    seen : (T, M) which samples are measured; no other one is looked at.
    rate_hz : above 0.
    """
    expect_shape("positions", positions, "T", "M", 3)
    expect_shape("seen", seen, *positions.shape[:2])
    paths = np.where(seen[:, :, None], positions, np.nan)
    cleaned, spikes = positions.copy(), np.zeros(seen.shape, dtype=bool)
    with np.errstate(over="ignore", invalid="ignore"):  # places beyond all measure
        for m in range(seen.shape[1]):
            for block in _spikes_of(paths, m, rate_hz):
                rows = block.start + np.flatnonzero(block.beyond)
                cleaned[rows, m] = block.bridge[block.beyond]
                spikes[rows, m] = True
    return Despiked(positions=cleaned, spikes=spikes)


@dataclass(frozen=True, kw_only=True)
class _Block:
    """k frames of a marker that may be a spike.

    Attributes
    ----------
    start : its first frame.
    bridge : (k, 3) [m] where it would lie.
    off : (k, 3) [m] how far it is from there.
    beyond : (k,) which samples are further off than the bounds.
    """

    start: int
    bridge: Floats
    off: Floats
    beyond: Bools

    @property
    def stop(self) -> int:
        """The frame behind it."""
        return self.start + len(self.bridge)


def _spikes_of(paths: Floats, m: int, rate_hz: float) -> Iterator[_Block]:
    """Go through the spikes of marker m of (T, M, 3) paths.

    A bridge that would rest on a spike is none.
    """
    taken = np.zeros(len(paths), dtype=bool)
    for block in _blocks_of(paths[:, m], rate_hz):
        around = slice(block.start - _SUPPORT, block.stop + _SUPPORT)
        if not taken[around].any() and not _is_shared(block, m, paths[around]):
            taken[block.start : block.stop] = True
            yield block


def _blocks_of(path: Floats, rate_hz: float) -> list[_Block]:
    """Find what may be a spike in a (T, 3) path, the shorter ones first."""
    noise, found = noise_of(path), []
    if np.isfinite(noise):
        for frames in range(1, LONGEST_SPIKE_FRAMES + 1):
            if len(path) >= frames + 2 * _SUPPORT:
                found += _blocks(path, frames, noise, rate_hz)
    return found


def _is_shared(block: _Block, m: int, paths: Floats) -> bool:
    """Whether a marker near by leaves its own bridge the same way.

    Parameters
    ----------
    m : whose block it is.
    paths : (k + 4, M, 3) [m] all markers in the block and the frames around it.
    """
    frames = len(block.bridge)
    apart = np.linalg.norm(paths[_SUPPORT - 1] - paths[_SUPPORT - 1, m], axis=1)
    apart[m] = np.nan
    near = np.argsort(apart)[: min(NEIGHBOURS, int(np.isfinite(apart).sum()))]
    around = np.delete(paths[:, near], np.s_[_SUPPORT : _SUPPORT + frames], axis=0)
    bridge = np.einsum("kw,wni->kni", _bridge_weights(frames), around)
    off = paths[_SUPPORT : _SUPPORT + frames, near] - bridge
    along = np.einsum("kni,ki->kn", off, block.off)
    least = SHARED_SHARE * (block.off**2).sum(axis=1)[:, None]
    return bool((along >= least).any())


def _blocks(path: Floats, frames: int, noise: float, rate_hz: float) -> list[_Block]:
    """Find the spikes of ``frames`` frames in a (T, 3) path, in order of time."""
    count = len(path) - frames - 2 * _SUPPORT + 1
    a, b, c, d = (path[i : i + count] for i in (0, 1, frames + 2, frames + 3))
    weights = _bridge_weights(frames)  # (k, 4)
    bridge = np.einsum("kw,wti->kti", weights, np.stack([a, b, c, d]))
    inside = np.stack([path[2 + j : 2 + j + count] for j in range(frames)])
    off = inside - bridge
    far = np.linalg.norm(off, axis=2)  # (k, count)
    gain = np.sqrt(1.0 + (weights**2).sum(axis=1))  # (k,) of noise
    steps = (b - a, d - c, (c - b) / (frames + 1))
    moving = np.max([np.linalg.norm(step, axis=1) for step in steps], axis=0)
    bound = np.maximum(SPIKE_NOISE_SD * noise * gain[:, None], SPIKE_MOTION * moving)
    bound = np.maximum(bound, max(LEAST_SPIKE_M, _honest(frames, rate_hz)))
    beyond = far > bound  # NaN, not measured, is not
    is_spike = beyond[0] & beyond[-1]
    return [
        _Block(
            start=int(t) + _SUPPORT,
            bridge=bridge[:, t],
            off=off[:, t],
            beyond=beyond[:, t],
        )
        for t in np.flatnonzero(is_spike)
    ]


def _bridge_weights(frames: int) -> Floats:
    """(k, 4) weights of a, b, c, d in the cubic through them, at the block's frames."""
    nodes = np.array([-2.0, -1.0, frames, frames + 1.0])
    inner = np.arange(frames)
    weights = np.ones((frames, 4))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            weights[:, i] *= (inner - other) / (node - other)
    return weights


def _honest(frames: int, rate_hz: float) -> float:
    """[m] how far one gets and is back within a block, turning at the hardest."""
    half_s = (frames + 1) / (2.0 * rate_hz)
    return HONEST_ACCELERATION_M_S2 * half_s**2 / 2.0
