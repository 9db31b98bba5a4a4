"""Scenes of maycock2015's protocol: grasp, put into a bowl, return."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.errors import HandcleanError
from handclean.kernels.solids import CYLINDER
from handclean.simulation.closing import CLOSING_STEPS, Closing, close
from handclean.simulation.grasps import GRASPS, REST, Grasp
from handclean.simulation.people import Person
from handclean.simulation.protocol import Plan, draw_plan, in_the_air, phases, ramp
from handclean.simulation.scene import (
    Body,
    Scene,
    assemble,
    chained,
    deepest,
    lowest,
    orientation,
    posed,
    sitter,
)
from handclean.simulation.timing import fidget, movement, staggered

_MOST_TRIES = 40
"""Grasps that are tried for a trial, at most (chosen)."""

_TRIED_WAYS = 8
"""Ways to the object that are tried to find one that does not lead through it
(chosen)."""

_GRAZE_M = -0.0025
"""[m] depth at which a way leads through the object (chosen)."""

_IDLE_SD_RAD = np.radians(4.0)
"""[rad] how much fingers that hold nothing move about; standard deviation (chosen)."""


@dataclass(frozen=True, kw_only=True)
class _Stop:
    """A place [m] and orientation the hand goes through."""

    place: Floats
    turn: Rotation


def grasp_scene(
    person: Person,
    times: Floats,
    names: tuple[str, ...],
    rng: np.random.Generator,
) -> Scene:
    """Draw one grasp of one of the named classes; no name: of any.

    Raises
    ------
    HandcleanError
        If no object could be grasped at all.
    """
    name, held = _draw_grasp(person, names, rng)
    best, clear = None, -np.inf
    for _ in range(_TRIED_WAYS):
        scene, plan = _draw_scene(person, times, name, held, rng)
        reaching = slice(*np.searchsorted(times, [plan.reach, plan.lift]))
        gaps = deepest(person, scene.poses[reaching], _part(scene.bodies[0], reaching))
        least = float(gaps.min()) if len(gaps) else 0.0
        if least > clear:
            best, clear = scene, least
        if clear > _GRAZE_M:
            break
    assert best is not None
    return best


def _part(body: Body, frames: slice) -> Body:
    return Body(
        name=body.name, kind=body.kind, size=body.size, frames=body.frames[frames]
    )


def _draw_grasp(
    person: Person, names: tuple[str, ...], rng: np.random.Generator
) -> tuple[str, Closing]:
    known = names or tuple(GRASPS)
    first = known[rng.integers(len(known))]
    for attempt in range(_MOST_TRIES):
        # hold on to the class drawn first, so that the hard ones do not get rare
        name = first if attempt < _MOST_TRIES // 2 else known[rng.integers(len(known))]
        held = close(person, GRASPS[name], rng)
        if held is not None:
            return name, held
    raise HandcleanError(
        f"{person.name} could not grasp anything by {', '.join(known)}; another class "
        "or seed should do"
    )


def _draw_scene(
    person: Person,
    times: Floats,
    name: str,
    held: Closing,
    rng: np.random.Generator,
) -> tuple[Scene, Plan]:
    plan = draw_plan(person.tempo, float(times[-1]), rng)
    rest, home = _at_rest(person, rng), _at_rest(person, rng)
    stops = _draw_stops(person, held, GRASPS[name], rest, home, rng)
    spans = (
        (plan.reach, plan.reached),
        (plan.lift, plan.above),
        (plan.back, plan.home),
    )
    shares = [movement(times, start, stop - start, rng) for start, stop in spans]
    places = _places(stops, shares, rng)
    late = [_late(times, share, rng) for share in shares]
    turns = chained(stops[0].turn, [stop.turn for stop in stops[1:]], late)
    angles = _angles(person, times, plan, held, rest, home, rng)
    poses = assemble(person, times, places, turns, angles, rng, in_the_air(times, plan))
    scene = Scene(
        title=name,
        times=times,
        poses=poses,
        bodies=(_object(times, poses, held, plan), _bowl(stops[2], held), *sitter(rng)),
        events=phases(name, plan, times),
    )
    return scene, plan


def _at_rest(person: Person, rng: np.random.Generator) -> Floats:
    """(D,) [rad] the calibration posture as this person takes it this time."""
    angles = np.zeros(len(person.tree.hinges))
    angles[:20] = REST + 0.5 * person.habit[:20] + np.radians(rng.normal(0, 2.0, 20))
    return np.clip(angles, *person.reach.T)


def _angles(
    person: Person,
    times: Floats,
    plan: Plan,
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
    wide = path[-1] + rng.uniform(0.6, 1.1) * (wide - path[-1])
    wide = np.clip(wide, *person.reach.T)
    let_go = staggered(times, plan.release, plan.released - plan.release, names, rng)
    angles += let_go * (wide - path[-1])
    back = staggered(times, plan.back, 0.95 * (plan.home - plan.back), names, rng)
    angles += back * (home - wide)
    out: Floats = angles + _idle(times, plan, held, names) * fidget(times, names, rng)
    return out


def _idle(times: Floats, plan: Plan, held: Closing, names: tuple[str, ...]) -> Floats:
    """(T, D) [rad] how freely each joint moves about: not on the table, not holding."""
    up = ramp(times, plan.reach, plan.reach + 0.4)
    down = ramp(times, plan.home - 0.4, plan.home)
    grip = ramp(times, plan.closing, plan.closed) - ramp(
        times, plan.dropped, plan.released
    )
    holding = {bone.split("_")[0] for bone in held.near}
    held_still = np.array([name.split("_")[0] in holding for name in names])
    free: Floats = (up - down)[:, None] * (1.0 - grip[:, None] * held_still)
    return np.asarray(_IDLE_SD_RAD * free)


def _along(
    person: Person,
    times: Floats,
    plan: Plan,
    path: Floats,
    rng: np.random.Generator,
) -> Floats:
    """(T, D) [rad] the closing path, each finger in its own time, done by ``closed``.

    Each finger stops moving where its path does, so its time runs over that part.
    """
    out = np.zeros((len(times), path.shape[1]))
    lasts = plan.closed - plan.closing
    for finger in dict.fromkeys(name.split("_")[0] for name in person.tree.hinges):
        own = [d for d, n in enumerate(person.tree.hinges) if n.startswith(finger)]
        changes = np.flatnonzero(np.abs(np.diff(path[:, own], axis=0)).max(axis=1) > 0)
        stop = changes[-1] + 1 if len(changes) else 1
        begin = plan.closing + lasts * min(abs(rng.normal(0.0, 0.1)), 0.3)
        share = movement(times, begin, plan.closed - begin, rng)
        for d in own:
            out[:, d] = np.interp(
                share * stop, np.arange(CLOSING_STEPS + 1), path[:, d]
            )
    return out


def _late(times: Floats, share: Floats, rng: np.random.Generator) -> Floats:
    """A movement's share, some frames later or earlier: turning lags behind going."""
    delay = rng.normal(0.0, 0.025)
    return np.interp(times - delay, times, share)


def _draw_stops(
    person: Person,
    held: Closing,
    grasp: Grasp,
    rest: Floats,
    home: Floats,
    rng: np.random.Generator,
) -> list[_Stop]:
    """On the table, at the object, over the bowl, on the table again."""
    yaw = rng.normal(0.0, 9.0)
    start = _table(person, rest, np.zeros(2), yaw)
    end = _table(person, home, rng.normal(0.0, 0.012, 2), yaw + rng.normal(0.0, 5.0))
    at_object = _at_object(person, held, grasp.roll, grasp.pitch, rng)
    return [start, at_object, _over_bowl(person, held, at_object, rng), end]


def _table(person: Person, angles: Floats, place: Floats, yaw: float) -> _Stop:
    """The hand lying on the table."""
    turn = orientation(yaw, 0.0, 0.0)
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


def _over_bowl(
    person: Person, held: Closing, before: _Stop, rng: np.random.Generator
) -> _Stop:
    """Where the hand is when it lets the object go above the bowl."""
    side = 1.0 if rng.random() < 0.7 else -1.0
    bowl = np.array([side * rng.uniform(0.18, 0.32), rng.uniform(0.12, 0.34), 0.0])
    tilt = Rotation.from_euler("xyz", rng.normal(0.0, [10, 10, 14]), degrees=True)
    turn = tilt * before.turn
    place = bowl - turn.apply(held.solid.frame[:, 3])
    low = lowest(person, posed(place, turn, held.path[-1], person))
    place[2] += rng.uniform(0.07, 0.12) - low
    return _Stop(place=place, turn=turn)


def _places(
    stops: list[_Stop], shares: list[Floats], rng: np.random.Generator
) -> Floats:
    """(T, 3) [m] of the wrist: from stop to stop, each time in an arc."""
    places = np.tile(stops[0].place, (len(shares[0]), 1))
    for n, share in enumerate(shares):
        way = stops[n + 1].place - stops[n].place
        far = float(np.linalg.norm(way))
        bulge = rng.normal(0.0, 0.06 * far, 3)
        bulge[2] = abs(bulge[2]) + (0.035, 0.06, 0.05)[n] + 0.12 * far
        if n == 0:  # come to the object from behind the palm
            back = stops[1].turn.apply([0.0, -0.6, 0.8])
            bulge += rng.uniform(0.02, 0.10) * back
        places += share[:, None] * way + (4.0 * share * (1.0 - share))[:, None] * bulge
    return places


def _object(times: Floats, poses: Floats, held: Closing, plan: Plan) -> Body:
    """The object: standing, then in the hand, then falling into the bowl."""
    q = np.roll(poses[:, 3:7], -1, axis=1)
    turns = Rotation.from_quat(q).as_matrix()
    frames = np.zeros((len(times), 3, 4))
    frames[:, :, :3] = turns @ held.solid.frame[:, :3]
    frames[:, :, 3] = poses[:, :3] + turns @ held.solid.frame[:, 3]
    last = len(times) - 1
    taken = min(int(np.searchsorted(times, plan.lift)), last)
    gone = min(int(np.searchsorted(times, plan.dropped)), last)
    frames[:taken] = frames[taken]
    frames[gone:] = frames[gone]
    fall = 0.5 * 9.81 * (times[gone:] - times[gone]) ** 2
    frames[gone:, 2, 3] -= np.minimum(fall, max(frames[gone, 2, 3] - 0.03, 0.0))
    return Body(
        name="object", kind=held.solid.kind, size=held.solid.size, frames=frames
    )


def _bowl(over: _Stop, held: Closing) -> Body:
    """The bowl, as a low cylinder: cameras near the table do not see through it."""
    centre = over.place + over.turn.apply(held.solid.frame[:, 3])
    frame = np.column_stack([np.eye(3), [centre[0], centre[1], 0.025]])
    size = np.array([0.085, 0.0, 0.025, 0.002])
    return Body(name="bowl", kind=CYLINDER, size=size, frames=frame[None])
