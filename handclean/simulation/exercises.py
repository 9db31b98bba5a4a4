"""Scenes without an object: a range-of-motion take and free gestures."""

from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.hand.template import FINGERS
from handclean.recording import Event
from handclean.simulation.grasps import GRASPS, RELAXED, REST, posture
from handclean.simulation.people import Person
from handclean.simulation.scene import (
    Scene,
    assemble,
    chained,
    lowest,
    orientation,
    posed,
    sitter,
)
from handclean.simulation.timing import fidget, movement, staggered

_LONG = FINGERS[1:]

# What each beat of the exercise bends, as a share of the joint's range: +1 its upper
# limit, -1 its lower. "*" stands for all four long fingers.
_BEATS: tuple[tuple[str, dict[str, float]], ...] = (
    ("fingers together", {"index_mcp_abduction": -0.4, "ring_mcp_abduction": 0.45,
                          "little_mcp_abduction": 0.75}),
    ("fingers spread", {"index_mcp_abduction": 0.85, "middle_mcp_abduction": 0.15,
                        "ring_mcp_abduction": -0.6, "little_mcp_abduction": -0.85}),
    ("fist", {"*_mcp_flexion": 0.88, "*_pip_flexion": 0.86, "*_dip_flexion": 0.72}),
    ("overextend", {"*_mcp_flexion": -0.75, "*_pip_flexion": -0.2}),
    ("hook", {"*_pip_flexion": 0.88, "*_dip_flexion": 0.8}),
    ("table", {"*_mcp_flexion": 0.85}),
    ("claw", {"*_mcp_flexion": -0.6, "*_pip_flexion": 0.62, "*_dip_flexion": 0.45}),
    ("thumb out", {"thumb_cmc_abduction": 0.1, "thumb_cmc_flexion": -0.85}),
    ("thumb up", {"thumb_cmc_abduction": 0.88, "thumb_cmc_flexion": -0.2}),
    ("thumb across", {"thumb_cmc_abduction": 0.5, "thumb_cmc_flexion": 0.85}),
    ("thumb back", {"thumb_cmc_abduction": -0.75, "thumb_cmc_flexion": -0.4}),
    ("thumb bend", {"thumb_mcp_flexion": 0.8, "thumb_ip_flexion": 0.3}),
    ("thumb tip", {"thumb_ip_flexion": 0.85}),
    ("thumb straight", {"thumb_mcp_flexion": -0.5, "thumb_ip_flexion": -0.8}),
    ("thumb to little", {"thumb_cmc_abduction": 0.75, "thumb_cmc_flexion": 0.75,
                         "thumb_mcp_flexion": 0.5, "thumb_ip_flexion": 0.4,
                         "little_mcp_flexion": 0.55, "little_pip_flexion": 0.4,
                         "ring_mcp_flexion": 0.3}),
    ("thumb to index", {"thumb_cmc_abduction": 0.6, "thumb_cmc_flexion": 0.3,
                        "thumb_mcp_flexion": 0.3, "thumb_ip_flexion": 0.4,
                        "index_mcp_flexion": 0.5, "index_pip_flexion": 0.45,
                        "index_dip_flexion": 0.3}),
    *((f"{finger} bend", {f"{finger}_mcp_flexion": 0.85, f"{finger}_pip_flexion": 0.5,
                          f"{finger}_dip_flexion": 0.35}) for finger in _LONG),
    *((f"{finger} curl", {f"{finger}_pip_flexion": 0.85, f"{finger}_dip_flexion": 0.75})
      for finger in _LONG),
    *((f"{finger} aside", {f"{finger}_mcp_abduction": share})
      for finger, share in (("index", 0.8), ("middle", 0.7), ("ring", -0.7),
                            ("little", -0.9))),
    *((f"{finger} aslant", {f"{finger}_mcp_abduction": -share,
                            f"{finger}_mcp_flexion": 0.35})
      for finger, share in (("index", 0.6), ("middle", 0.6), ("ring", -0.5),
                            ("little", -0.6))),
)  # fmt: skip

_WRIST_EXTREMES_DEG = np.array(
    [[0, 48, 8], [0, -52, 8], [24, -5, 5], [-22, -5, 5]], dtype=float
)
"""[degrees] yaw, pitch, roll that bend and turn the wrist of a forearm kept ahead
(chosen)."""

_DRAWN_ALONG_SHARE = 0.18
"""[-] share of its own motion by which a finger that bends takes its neighbours along
(chosen)."""


def rom_scene(person: Person, times: Floats, rng: np.random.Generator) -> Scene:
    """Move every joint through its range, once in every take, in random order."""
    duration = float(times[-1])
    order = [_BEATS[k] for k in rng.permutation(len(_BEATS))]
    weights = rng.uniform(0.8, 1.2, len(order))
    begin, end = 0.12 * duration**0.5, duration - 0.12 * duration**0.5
    bounds = begin + (end - begin) * np.concatenate([[0.0], np.cumsum(weights)]) / (
        weights.sum()
    )
    rest = _drawn(person, REST, 1.8, rng)
    base = _drawn(person, RELAXED * 0.35, 2.0, rng)
    keys, starts, lasts = [rest], [0.35 * begin], [0.6 * begin]
    events = []
    for (text, bends), (a, b) in zip(order, pairwise(bounds), strict=True):
        keys += [_bent(person, base, bends, rng), _shifted(base, 2.0, rng)]
        starts += [a, a + 0.5 * (b - a)]
        lasts += [0.5 * (b - a), 0.5 * (b - a)]
        events.append(
            Event(
                start=int(np.searchsorted(times, a)),
                stop=int(np.searchsorted(times, b)),
                text=text,
            )
        )
    keys.append(_drawn(person, REST, 1.8, rng))
    starts.append(end)
    lasts.append(0.7 * (duration - end))
    angles = _through(person, times, keys, starts, lasts, rng)
    places, turns, calm = _raised(
        person, times, angles[0], angles[-1], begin, end, True, rng
    )
    poses = assemble(person, times, places, turns, angles, rng, calm)
    return Scene(
        title="rom",
        times=times,
        poses=poses,
        bodies=sitter(rng),
        events=tuple(events),
    )


def _through(
    person: Person,
    times: Floats,
    keys: list[Floats],
    starts: list[float],
    lasts: list[float],
    rng: np.random.Generator,
) -> Floats:
    """(T, D) [rad] from the first posture through the others, each in its time."""
    angles = np.tile(keys[0], (len(times), 1))
    names = person.tree.hinges
    for n in range(1, len(keys)):
        share = staggered(times, starts[n], lasts[n], names, rng)
        angles += share * (keys[n] - keys[n - 1])
    return angles


def _drawn(
    person: Person, angles: Floats, spread: float, rng: np.random.Generator
) -> Floats:
    """(D,) [rad] a posture as this person takes it this time."""
    out = np.zeros(len(person.tree.hinges))
    out[:20] = angles + 0.6 * person.habit[:20]
    out[:20] += np.radians(rng.normal(0.0, spread, 20))
    return np.clip(out, *person.reach.T)


def _shifted(angles: Floats, spread: float, rng: np.random.Generator) -> Floats:
    out: Floats = angles + np.radians(rng.normal(0.0, spread, len(angles)))
    return out


def _bent(
    person: Person, base: Floats, bends: dict[str, float], rng: np.random.Generator
) -> Floats:
    """(D,) [rad] a posture with some joints near their limits."""
    out = base.copy()
    low, high = person.reach.T
    wanted: dict[str, float] = {}
    for name, share in bends.items():
        if name.startswith("*"):
            wanted |= {name.replace("*", finger): share for finger in _LONG}
        else:
            wanted[name] = share
    for name, share in wanted.items():
        d = person.tree.hinges.index(name)
        share = share * rng.uniform(0.85, 1.05)
        out[d] = share * high[d] if share > 0.0 else -share * low[d]
        finger, part = name.split("_", 1)
        if finger in _LONG and part != "mcp_abduction":
            for step in (-1, 1):
                near = _LONG.index(finger) + step
                beside = f"{_LONG[near]}_{part}" if 0 <= near < 4 else ""
                if beside and beside not in wanted:
                    k = person.tree.hinges.index(beside)
                    out[k] += _DRAWN_ALONG_SHARE * (out[d] - base[d])
    return np.clip(out, low, high)


def _raised(
    person: Person,
    times: Floats,
    first: Floats,
    last: Floats,
    begin: float,
    end: float,
    wrist: bool,
    rng: np.random.Generator,
) -> tuple[Floats, Rotation, Floats]:
    """Where a hand is that lifts from the table, turns about in the air and returns."""
    flat = orientation(rng.normal(0.0, 8.0), 0.0, 0.0)
    count = max(int((end - begin) / 2.5), 1)
    middle, spread = np.array([0.0, -12.0, 12.0]), np.array([14.0, 12.0, 16.0])
    aims = middle + spread * rng.normal(size=(count, 3))
    if wrist:  # as many of the wrist's four extremes as there is time for
        for k, extreme in enumerate(rng.permutation(_WRIST_EXTREMES_DEG)[: count - 1]):
            aims[k] = extreme + rng.normal(0.0, 4.0, 3)
        rng.shuffle(aims)
    stops = [orientation(*aim) for aim in aims]
    ups = rng.normal([0.03, 0.12, 0.26], [0.04, 0.04, 0.03], (count, 3))
    at = [np.zeros(3), *ups, rng.normal(0.0, [0.01, 0.01, 0.0])]
    for n, angles, turn in ((0, first, flat), (-1, last, flat)):
        at[n] = at[n] - [0, 0, lowest(person, posed(at[n], turn, angles, person))]
    bounds = np.linspace(begin, end, count + 1)
    starts = [0.35 * begin, *bounds[1:-1], end]
    lasts = [0.65 * begin] + [1.6] * (count - 1) + [0.7 * (times[-1] - end)]
    shares = [movement(times, s, d, rng) for s, d in zip(starts, lasts, strict=True)]
    places = np.tile(at[0], (len(times), 1))
    for n, share in enumerate(shares):
        places += share[:, None] * (at[n + 1] - at[n])
    turns = chained(flat, [*stops, flat], shares)
    calm = 0.15 + 0.85 * (shares[0] - shares[-1])
    return places, turns, calm


def free_scene(person: Person, times: Floats, rng: np.random.Generator) -> Scene:
    """Gesture: postures of all kinds one after the other, the hand wandering about."""
    duration = float(times[-1])
    library = [GRASPS[name].closed for name in GRASPS]
    library += [GRASPS[name].opened for name in GRASPS]
    library += [RELAXED, REST, *_signs()]
    begin, end = 0.1 * duration, 0.88 * duration
    keys, starts, lasts = [_drawn(person, REST, 1.8, rng)], [0.0], [0.0]
    now = 0.4 * begin
    while now < end - 0.3:
        share = rng.uniform(0.5, 1.0)
        target = _drawn(person, _mixed(library, rng), 5.0, rng)
        keys.append(keys[-1] + share * (target - keys[-1]))
        starts.append(now)
        lasts.append(person.tempo * rng.uniform(0.28, 0.8))
        now += lasts[-1] + (rng.uniform(0.0, 0.5) if rng.random() < 0.5 else -0.05)
    keys.append(_drawn(person, REST, 1.8, rng))
    starts.append(max(now, end - 0.3))
    lasts.append(0.8 * (duration - starts[-1]))
    angles = _through(person, times, keys, starts, lasts, rng)
    places, turns, calm = _raised(
        person, times, angles[0], angles[-1], begin, end, False, rng
    )
    idle = np.radians(3.0) * calm[:, None] * fidget(times, person.tree.hinges, rng)
    poses = assemble(person, times, places, turns, angles + idle, rng, calm)
    return Scene(title="free", times=times, poses=poses, bodies=sitter(rng))


def _mixed(library: list[Floats], rng: np.random.Generator) -> Floats:
    """(20,) [rad] a posture, or as often one whose fingers come from different ones."""
    posture = library[rng.integers(len(library))].copy()
    if rng.random() < 0.5:
        for finger in range(5):
            if rng.random() < 0.4:
                own = slice(4 * finger, 4 * finger + 4)
                posture[own] = library[rng.integers(len(library))][own]
    return posture


def _signs() -> list[Floats]:
    """Gestures: pointing, counting, fist, thumb up, ring."""
    out, straight, bent = [], 6.0, (78.0, 96.0)
    over = ("1000", "1100", "1110", "1001")  # the thumb lies over the bent fingers
    for up in ("1000", "1100", "1110", "1111", "0000", "1001", "0100", "0001"):
        mcp = [straight if c == "1" else bent[0] for c in up]
        pip = [straight if c == "1" else bent[1] for c in up]
        thumb = (40, 38, 40, 40) if up in over else (10, -22, 0, 0)
        out.append(posture(thumb, tuple(mcp), tuple(pip)))  # type: ignore[arg-type]
    return out
