"""When things happen in a take of maycock2015's protocol."""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.recording import Event
from handclean.simulation.timing import minimum_jerk


@dataclass(frozen=True, kw_only=True)
class Plan:
    """[s] from the start of the take.

    Attributes
    ----------
    reach, reached : the hand leaves the table and arrives at the object.
    closing, closed : the fingers close; they begin on the way.
    lift, above : the hand carries the object over the bowl.
    release, released : the fingers open.
    back, home : the hand returns to the table.
    """

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

    @property
    def dropped(self) -> float:
        """[s] when the object leaves the hand."""
        return self.release + 0.3 * (self.released - self.release)


def draw_plan(tempo: float, duration: float, rng: np.random.Generator) -> Plan:
    """Draw when things happen; squeezed to fit into the take if need be.

    Parameters
    ----------
    tempo : durations against the average.
    duration : [s] of the take.
    """
    pause = min(rng.uniform(0.2, 0.55), 0.12 * duration)
    reach, carry, home = np.maximum(rng.normal([0.85, 0.95, 0.95], 0.12), 0.5)
    shut, hold, drop = rng.uniform([0.36, 0.08, 0.22], [0.6, 0.3, 0.42])
    pace = tempo * rng.lognormal(0.0, 0.08)
    ahead = rng.uniform(0.15, 0.4)  # share of the closing done while still reaching
    total = reach + shut + hold + carry + drop + home
    pace = min(pace, (duration - pause - 0.15) / total)
    reached = pause + pace * reach
    closing = reached - ahead * pace * shut
    lift = closing + pace * (shut + hold)
    above = lift + pace * carry
    release = above - 0.1 * pace * carry
    released = release + pace * drop
    back = released - 0.25 * pace * drop
    return Plan(
        reach=pause,
        reached=reached,
        closing=closing,
        closed=closing + pace * shut,
        lift=lift,
        above=above,
        release=release,
        released=released,
        back=back,
        home=back + pace * home,
    )


def ramp(times: Floats, start: float, stop: float) -> Floats:
    """(T,) from 0 before ``start`` to 1 after ``stop`` [s]."""
    return minimum_jerk((times - start) / max(stop - start, 1e-6))


def in_the_air(times: Floats, plan: Plan) -> Floats:
    """(T,) 1 while the hand is up, less where table or object steady it."""
    up = ramp(times, plan.reach, plan.reach + 0.3)
    down = ramp(times, plan.home - 0.3, plan.home)
    steady = ramp(times, plan.closing, plan.closed) - ramp(
        times, plan.lift, plan.lift + 0.2
    )
    air: Floats = 0.15 + 0.85 * (up - down) * (1.0 - 0.8 * steady)
    return air


def phases(name: str, plan: Plan, times: Floats) -> tuple[Event, ...]:
    """What happens when, for the take's record."""
    spans = (
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
        for text, start, stop in spans
    )
