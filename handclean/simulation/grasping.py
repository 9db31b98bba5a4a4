"""Scenes of maycock2015's protocol: grasp, put into a bowl, return."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.recording import Event
from handclean.simulation.closing import STEPS, Closing, close
from handclean.simulation.grasps import GRASPS, REST
from handclean.simulation.people import Person
from handclean.simulation.scene import (
    Scene,
    assemble,
    chained,
    lowest,
    orientation,
    posed,
)
from handclean.simulation.timing import minimum_jerk, movement, staggered

_TRIES = 40


@dataclass(frozen=True, kw_only=True)
class _Stop:
    """A place and orientation the hand goes through."""

    place: Floats
    turn: Rotation


@dataclass(frozen=True, kw_only=True)
class _Plan:
    """[s] when each phase of a take starts; how long the later ones last."""

    reach: float
    reached: float
    closing: float
    closed: float
    lift: float
    above: float
    release: float
    released: float
    back: float
    home: float


def grasp_scene(
    person: Person,
    times: Floats,
    names: tuple[str, ...],
    rng: np.random.Generator,
) -> Scene:
    """Draw one grasp of one of the named classes.

    Raises
    ------
    RuntimeError
        If no object could be grasped at all, which a living hand does not do.
    """
    name, held = _draw_grasp(person, names, rng)
    grasp = GRASPS[name]
    plan = _plan(person.tempo, times[-1] + times[1], rng)
    rest, home = _at_rest(person, rng), _at_rest(person, rng)
    shares = {
        "reach": movement(times, plan.reach, plan.reached - plan.reach, rng),
        "carry": movement(times, plan.lift, plan.above - plan.lift, rng),
        "back": movement(times, plan.back, plan.home - plan.back, rng),
    }
    angles = _angles(person, times, plan, held, rest, home, rng)
    yaw = rng.normal(0.0, 9.0)
    start = _table(person, rest, np.zeros(2), orientation(yaw, 0.0, 0.0))
    moved = rng.normal(0.0, 0.012, 2)
    end = _table(person, home, moved, orientation(yaw + rng.normal(0, 5), 0.0, 0.0))
    at_object = _at_object(person, held, grasp.roll, grasp.pitch, rng)
    at_bowl = _at_bowl(held, at_object, rng)
    stops = [at_object, at_bowl, end]
    late = [_late(times, share, rng) for share in shares.values()]
    turns = chained(start.turn, [s.turn for s in stops], late)
    places = _places(start, stops, list(shares.values()), rng)
    calm = _in_the_air(times, plan)
    poses = assemble(person, times, places, turns, angles, rng, calm)
    return Scene(
        title=name,
        times=times,
        poses=poses,
        object_kind=held.solid.kind,
        object_size=held.solid.size,
        object_frames=_follow(times, poses, held, at_object, plan),
        events=_events(name, plan, times),
    )


def _draw_grasp(
    person: Person, names: tuple[str, ...], rng: np.random.Generator
) -> tuple[str, Closing]:
    known = names or tuple(GRASPS)
    first = known[rng.integers(len(known))]
    for attempt in range(_TRIES):
        # hold on to the class drawn first, so that the hard ones do not get rare
        name = first if attempt < _TRIES // 2 else known[rng.integers(len(known))]
        held = close(person, GRASPS[name], rng)
        if held is not None:
            return name, held
    raise RuntimeError(f"{person.name} could not grasp anything by {', '.join(known)}")


def _plan(tempo: float, duration: float, rng: np.random.Generator) -> _Plan:
    """Draw when things happen; squeezed to fit into the take if need be."""
    pause, reach, shut, hold, carry, drop, home = (
        rng.uniform(0.2, 0.55),
        rng.normal(0.85, 0.10),
        rng.uniform(0.38, 0.6),
        rng.uniform(0.08, 0.3),
        rng.normal(0.95, 0.12),
        rng.uniform(0.25, 0.42),
        rng.normal(0.95, 0.12),
    )
    pace = tempo * rng.lognormal(0.0, 0.08)
    ahead = rng.uniform(0.15, 0.4)  # share of closing done while still reaching
    total = pause + pace * (reach + shut + hold + carry + drop + home)
    pace *= min(1.0, (duration - pause) / (total - pause + 0.15))
    reached = pause + pace * reach
    closing = reached - ahead * pace * shut
    closed = closing + pace * shut
    lift = closed + pace * hold
    above = lift + pace * carry
    release = above - 0.1 * pace * carry
    released = release + pace * drop
    back = released - 0.25 * pace * drop
    return _Plan(
        reach=pause,
        reached=reached,
        closing=closing,
        closed=closed,
        lift=lift,
        above=above,
        release=release,
        released=released,
        back=back,
        home=back + pace * home,
    )


def _at_rest(person: Person, rng: np.random.Generator) -> Floats:
    """(D,) [rad] the calibration posture as this person takes it this time."""
    angles = np.zeros(len(person.tree.hinges))
    angles[:20] = REST + 0.6 * person.habit[:20] + np.radians(rng.normal(0, 1.8, 20))
    low, high = person.reach.T
    return np.clip(angles, low, high)


def _angles(
    person: Person,
    times: Floats,
    plan: _Plan,
    held: Closing,
    rest: Floats,
    home: Floats,
    rng: np.random.Generator,
) -> Floats:
    """(T, D) [rad] rest, open, closed on the object, open, rest."""
    names, path = person.tree.hinges, held.path
    opening = plan.closing - plan.reach
    open_up = staggered(times, plan.reach, 0.92 * opening, names, rng)
    angles = rest + open_up * (path[0] - rest)
    angles += _along(person, times, plan, path, rng) - path[0]
    wide = path[0] + np.radians(rng.normal(0.0, 6.0, len(names)))
    wide = np.clip(path[-1] + 0.85 * (wide - path[-1]), *person.reach.T)
    let_go = staggered(times, plan.release, plan.released - plan.release, names, rng)
    angles += let_go * (wide - path[-1])
    back = staggered(times, plan.back, 0.95 * (plan.home - plan.back), names, rng)
    out: Floats = angles + back * (home - wide)
    return out


def _along(
    person: Person,
    times: Floats,
    plan: _Plan,
    path: Floats,
    rng: np.random.Generator,
) -> Floats:
    """(T, D) [rad] the closing path, each finger in its own time, done by ``closed``.

    Each finger stops moving where its path does, so its time runs over that part.
    """
    out = np.zeros((len(times), path.shape[1]))
    lasts = plan.closed - plan.closing
    for finger in {name.split("_")[0]: None for name in person.tree.hinges}:
        own = [d for d, n in enumerate(person.tree.hinges) if n.startswith(finger)]
        changes = np.flatnonzero(np.abs(np.diff(path[:, own], axis=0)).max(axis=1) > 0)
        stop = changes[-1] + 1 if len(changes) else 1
        begin = plan.closing + lasts * abs(rng.normal(0.0, 0.06))
        share = movement(times, begin, plan.closed - begin, rng)
        for d in own:
            out[:, d] = np.interp(share * stop, np.arange(STEPS + 1), path[:, d])
    return out


def _late(times: Floats, share: Floats, rng: np.random.Generator) -> Floats:
    """A movement's share, some frames later or earlier: turning lags behind going."""
    delay = rng.normal(0.0, 0.025)
    return np.interp(times - delay, times, share)


def _table(person: Person, angles: Floats, place: Floats, turn: Rotation) -> _Stop:
    """The hand lying on the table."""
    at = np.array([*place, 0.0])
    at[2] -= lowest(person, posed(at, turn, angles, person))
    return _Stop(place=at, turn=turn)


def _at_object(
    person: Person, held: Closing, roll: float, pitch: float, rng: np.random.Generator
) -> _Stop:
    """Where the hand is when it holds the object that still stands there."""
    centre = np.array([rng.uniform(-0.14, 0.18), rng.uniform(0.22, 0.40), 0.0])
    yaw = -np.degrees(np.arctan2(centre[0] + 0.05, centre[1] + 0.5))
    turn = orientation(
        yaw + rng.normal(0.0, 12.0), pitch + rng.normal(0, 9), roll + rng.normal(0, 10)
    )
    place = centre - turn.apply(held.solid.frame[:, 3])
    low = lowest(person, posed(place, turn, held.path[-1], person))
    place[2] += rng.uniform(0.006, 0.03) - low
    return _Stop(place=place, turn=turn)


def _at_bowl(held: Closing, before: _Stop, rng: np.random.Generator) -> _Stop:
    """Where the hand is when it lets the object go above the bowl."""
    side = 1.0 if rng.random() < 0.7 else -1.0
    x, y = side * rng.uniform(0.18, 0.32), rng.uniform(0.12, 0.34)
    bowl = np.array([x, y, rng.uniform(0.12, 0.2)])
    tilt = Rotation.from_euler("xyz", rng.normal(0.0, [10, 10, 14]), degrees=True)
    turn = tilt * before.turn
    return _Stop(place=bowl - turn.apply(held.solid.frame[:, 3]), turn=turn)


def _places(
    start: _Stop, stops: list[_Stop], shares: list[Floats], rng: np.random.Generator
) -> Floats:
    """(T, 3) [m] of the wrist: from stop to stop, each time in an arc."""
    places = np.tile(start.place, (len(shares[0]), 1))
    here = start.place
    for n, (stop, share) in enumerate(zip(stops, shares, strict=True)):
        way = stop.place - here
        far = float(np.linalg.norm(way))
        bulge = rng.normal(0.0, 0.06 * far, 3)
        bulge[2] = abs(bulge[2]) + (0.035, 0.06, 0.05)[n] + 0.12 * far
        if n == 0:  # come to the object from behind the palm
            bulge += 0.03 * stop.turn.apply([0.0, -0.6, 0.8])
        places += share[:, None] * way + (4.0 * share * (1.0 - share))[:, None] * bulge
        here = stop.place
    return places


def _in_the_air(times: Floats, plan: _Plan) -> Floats:
    """(T,) 1 while the hand is up, less where table or object steady it."""
    up = minimum_jerk((times - plan.reach) / 0.3)
    down = minimum_jerk((times - plan.home + 0.2) / 0.3)
    return 0.15 + 0.85 * (up - down)


def _follow(
    times: Floats, poses: Floats, held: Closing, at_object: _Stop, plan: _Plan
) -> Floats:
    """(T, 3, 4) the object's frame: standing, in the hand, falling into the bowl."""
    q = np.roll(poses[:, 3:7], -1, axis=1)
    turns = Rotation.from_quat(q).as_matrix()
    frames = np.zeros((len(times), 3, 4))
    frames[:, :, :3] = turns @ held.solid.frame[:, :3]
    frames[:, :, 3] = poses[:, :3] + turns @ held.solid.frame[:, 3]
    taken = int(np.searchsorted(times, plan.lift))
    gone = int(
        np.searchsorted(times, plan.release + 0.35 * (plan.released - plan.release))
    )
    frames[:taken] = frames[min(taken, len(times) - 1)]
    if gone < len(times):
        frames[gone:] = frames[gone]
        fall = 0.5 * 9.81 * (times[gone:] - times[gone]) ** 2
        frames[gone:, 2, 3] -= np.minimum(fall, max(frames[gone, 2, 3] - 0.03, 0.0))
    return frames


def _events(name: str, plan: _Plan, times: Floats) -> tuple[Event, ...]:
    phases = (
        ("rest", 0.0, plan.reach),
        ("reach", plan.reach, plan.closing),
        (f"grasp {name}", plan.closing, plan.lift),
        ("carry", plan.lift, plan.release),
        ("release", plan.release, plan.released),
        ("return", plan.released, plan.home),
    )
    return tuple(
        Event(
            start=int(np.searchsorted(times, start)),
            stop=int(np.searchsorted(times, stop)),
            text=text,
        )
        for text, start, stop in phases
    )
