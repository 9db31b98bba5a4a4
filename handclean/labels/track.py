"""From frame to frame: predict, assign, bend, refuse, freeze (Maycock 2015 III-B, C).

For every frame

1. the pose moves on with its last velocity; joints beyond which no marker was seen are
   frozen. A marker is expected where that pose puts it, plus the place where it was
   last seen beside the model (its bias: skin slides and calibrations err, slowly);
2. points are assigned to markers by the Hungarian method. The cost of a pair is minus
   twice the logarithm of how much likelier the point is as that marker than as a ghost,

       d^2 / s^2 + 3 ln(s^2 / s0^2),         price of "no match" 2 ln(odds / ghosts)

   with s the marker's prediction error per axis, learnt from its own surprises. A
   marker out of sight has an s that grows, and lower odds. That is the padding and the
   gate;
3. inverse kinematics on the markers that were seen before; those further from the
   model than their threshold are refused, the worst first;
4. markers that reappear are tried together: the model is bent toward them, and those
   that stay below their threshold, and push no other above its own, are accepted.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Bytes, Floats, Floats32, Ints
from handclean.ik.frames import settle
from handclean.kernels import jit
from handclean.kernels.chain import place_links, place_points
from handclean.kernels.gauss_newton import Chain, Work, misfit, undecided
from handclean.labels.ghosts import STEADY, Usual, learn, threshold
from handclean.numerics.assignment import assign_rows

UNIT = 1e-3
"""[m] prediction error at which the logarithm in the cost is zero."""

FORGET = 0.2
"""Share of the last frame in a marker's bias."""

ABSENT, FOLLOWED, RETURNED, REFUSED = 0, 1, 2, 3
"""What became of a marker in a frame."""


class Rules(NamedTuple):
    """Numbers of the tracker; see `LabelConfig`.

    seen_price, gone_price : price of "no match" of a marker seen, not seen, before.
    floor : [m] least prediction error; drift : [m] growth per frame out of sight;
    reach : [m]; strict, small : of the threshold; lever : [m], see `undecided`.
    """

    seen_price: float
    gone_price: float
    floor: float
    drift: float
    reach: float
    strict: float
    small: float
    lever: float


class Book(NamedTuple):
    """What is known of the markers while they are followed.

    bias (M, 3) [m] beside the model, in the link's frame; surprise (M,) [m^2] variance
    of the prediction error per axis; gone (M,) frames out of sight; usual : distances.
    """

    bias: Floats
    surprise: Floats
    gone: Ints
    usual: Usual


class Trace(NamedTuple):
    """What the tracker found, one row per frame of the take.

    pose (T, 7 + D); chosen (T, M) row of the cloud or -1; sure (T, M) probability that
    the label is right; fate (T, M) `ABSENT`...; cost (T,) minus twice the
    log-likelihood against ghosts; rms (T,) [m]; known (T,) whether it was followed.
    """

    pose: Floats
    chosen: Ints
    sure: Floats32
    fate: Bytes
    cost: Floats
    rms: Floats
    known: Bools


def make_trace(frames: int, markers: int, hinges: int) -> Trace:
    """Room for a take."""
    return Trace(
        pose=np.zeros((frames, 7 + hinges)),
        chosen=np.full((frames, markers), -1),
        sure=np.zeros((frames, markers), dtype=np.float32),
        fate=np.zeros((frames, markers), dtype=np.uint8),
        cost=np.zeros(frames),
        rms=np.full(frames, np.nan),
        known=np.zeros(frames, dtype=bool),
    )


@jit
def freeze(tree: Chain, weight: Floats, frozen: Bools) -> None:
    """Write (D,) which hinges have no weighted marker further out."""
    frozen[:] = True
    for m in range(weight.shape[0]):
        if weight[m] > 0.0:
            link = tree.link[m]
            while link > 0 and frozen[link - 1]:
                frozen[link - 1] = False
                link = tree.parent[link]


@jit
def predict(
    pose: Floats, velocity: Floats, frozen: Bools, tree: Chain, k: Work, places: Floats
) -> None:
    """Move the pose on, in place, and write where (M, 3) [m] it puts the markers."""
    norm = 0.0
    for n in range(pose.shape[0]):
        if n < 7 or not frozen[n - 7]:
            pose[n] += velocity[n]
        if 3 <= n < 7:
            norm += pose[n] * pose[n]
    for n in range(3, 7):
        pose[n] /= math.sqrt(norm)
    for d in range(frozen.shape[0]):
        low, high = tree.limits[d, 0], tree.limits[d, 1]
        pose[7 + d] = min(max(pose[7 + d], low), high)
    put(pose, tree, k, places)


@jit
def put(pose: Floats, tree: Chain, k: Work, places: Floats) -> None:
    """Write where (M, 3) [m] a pose puts the markers."""
    place_links(pose, tree.parent, tree.offset, tree.axis, k.turn, k.origin, k.column)
    place_points(k.turn, k.origin, tree.link, tree.at, places)
    for m in range(places.shape[0]):
        for n in range(3):
            places[m, n] += pose[n]


@jit
def shift(tree: Chain, k: Work, bias: Floats, places: Floats) -> None:
    """Add each marker's bias, given in its link's frame, to its place."""
    for m in range(places.shape[0]):
        turn = k.turn[tree.link[m]]
        for n in range(3):
            for j in range(3):
                places[m, n] += turn[n, j] * bias[m, j]


@jit
def expect(
    book: Book, rules: Rules, frozen: Bools, tree: Chain, wide: float, s2: Floats
) -> None:
    """Write (M,) [m^2] the variance per axis of where each marker is expected."""
    for m in range(s2.shape[0]):
        s2[m] = max(book.surprise[m], rules.floor * rules.floor) * wide * wide
        if book.gone[m] > 0:
            own, link = False, tree.link[m]
            while link > 0:
                own = own or frozen[link - 1]
                link = tree.parent[link]
            away = rules.drift * book.gone[m]
            if not own:  # markers further out tell where it is
                away = min(0.3 * away, 3.0 * math.sqrt(s2[m]))
            away = min(away, 0.5 * rules.reach)
            s2[m] += away * away


@jit
def price_points(
    places: Floats,
    points: Floats,
    s2: Floats,
    book: Book,
    rules: Rules,
    cost: Floats,
    price: Floats,
) -> None:
    """Write the costs (M, P) of all pairs, inf beyond the gate, and the prices (M,)."""
    for m in range(places.shape[0]):
        gone = book.gone[m] > 0
        price[m] = rules.gone_price if gone else rules.seen_price
        size = 3.0 * math.log(s2[m] / (UNIT * UNIT))
        gate2 = (price[m] - size) * s2[m]
        if gone:
            gate2 = min(gate2, rules.reach * rules.reach)
        x, y, z = places[m, 0], places[m, 1], places[m, 2]
        for p in range(points.shape[0]):
            a, b, c = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
            d2 = a * a + b * b + c * c
            cost[m, p] = d2 / s2[m] + size if d2 < gate2 else math.inf


@jit
def rate_labels(cost: Floats, price: Floats, chosen: Ints, sure: Floats32) -> None:
    """Write (M,) how likely each label is right.

    Against it stand: the point is a ghost; another free point is the marker; two
    markers have changed places.
    """
    owner = np.full(cost.shape[1], -1)
    for m in range(chosen.shape[0]):
        if chosen[m] >= 0:
            owner[chosen[m]] = m
    for m in range(chosen.shape[0]):
        p = chosen[m]
        if p < 0:
            sure[m] = 0.0
            continue
        against = math.exp(-0.5 * max(price[m] - cost[m, p], 0.0))
        for q in range(cost.shape[1]):
            if q == p or cost[m, q] == math.inf:
                continue
            more = cost[m, q] - cost[m, p]
            other = owner[q]
            if other >= 0:
                more += min(cost[other, p], price[other]) - cost[other, q]
            against += math.exp(-0.5 * max(more, 0.0))
        sure[m] = 1.0 / (1.0 + against)


@jit
def judge(
    trial: Ints,
    book: Book,
    rules: Rules,
    k: Work,
    weight: Floats,
) -> int:
    """Return the marker furthest beyond its threshold, or -1 if none is.

    A newcomer (``trial``) that is beyond its own, or that pushes another beyond,
    goes before those that were followed.
    """
    worst, at = 1.0, -1
    newest, new = 0.0, -1
    for m in range(weight.shape[0]):
        if weight[m] <= 0.0:
            continue
        distance = math.sqrt(
            k.error[m, 0] ** 2 + k.error[m, 1] ** 2 + k.error[m, 2] ** 2
        )
        allowed = threshold(book.usual, m, rules.strict, rules.small)
        if trial[m] == 0:
            allowed *= STEADY
        ratio = distance / allowed
        if ratio > worst:
            worst, at = ratio, m
        if trial[m] == 1 and ratio > newest:
            newest, new = ratio, m
    if at >= 0 and new >= 0:
        return new
    return at


@jit
def follow(
    at: Floats,
    start: Ints,
    first: int,
    stop: int,
    by: int,
    pose0: Floats,
    tree: Chain,
    k: Work,
    mean: Floats,
    basis: Floats,
    numbers: tuple[float, float, float],
    rules: Rules,
    book: Book,
    trace: Trace,
) -> int:
    """Follow a model through frames ``first``, ``first + by``, ... before ``stop``.

    Parameters
    ----------
    at : (P, 3) [m], start : (T + 1,) the points of all frames.
    pose0 : (7 + D,) of the frame before ``first``, or of ``first`` itself.
    mean, basis : posture prior, of which the tracker uses the limits of no more than
        what settles a finger that the markers leave open.
    numbers : damping, enough_m, prior_m.
    book : state of the markers, overwritten. trace : rows of the frames, overwritten.

    Returns
    -------
    The frame at which it lost the model, or ``stop``.
    """
    markers, hinges = book.gone.shape[0], mean.shape[0]
    pose, last, velocity = pose0.copy(), pose0.copy(), np.zeros(pose0.shape[0])
    places, target = np.zeros((markers, 3)), np.zeros((markers, 3))
    weight, s2, price = np.zeros(markers), np.zeros(markers), np.zeros(markers)
    chosen, trial = np.zeros(markers, np.int64), np.zeros(markers, np.int64)
    before = np.ones(markers)
    frozen, is_open = np.zeros(hinges, np.bool_), np.zeros(hinges, np.bool_)
    rest, anchor, attempt = np.zeros(hinges), np.zeros(hinges), np.zeros(pose.shape[0])
    none = np.zeros((hinges, 0))
    sure = np.zeros(markers, np.float32)
    level, lost = 2, 0
    t = first
    while t != stop:
        points = at[start[t] : start[t + 1]]
        cost = np.zeros((markers, points.shape[0]))
        last[:] = pose
        predict(pose, velocity, frozen, tree, k, places)
        shift(tree, k, book.bias, places)
        wide = 1.0
        for _ in range(3):
            expect(book, rules, frozen, tree, wide, s2)
            price_points(places, points, s2, book, rules, cost, price)
            assign_rows(cost, price, chosen)
            expected, found = 0, 0
            for m in range(markers):
                if book.gone[m] == 0:
                    expected += 1
                    if chosen[m] >= 0:
                        found += 1
            if 3 * found >= 2 * expected:
                break
            wide *= 2.5
        rate_labels(cost, price, chosen, sure)

        # what was followed so far
        count = 0
        for m in range(markers):
            trial[m], weight[m] = 0, 0.0
            trace.fate[t, m] = ABSENT
            if chosen[m] >= 0:
                target[m] = points[chosen[m]]
                if book.gone[m] > 0:
                    trial[m] = 1
                else:
                    weight[m] = 1.0
                    count += 1
        if count < 3:  # nothing to hold on to: whatever fits may come back
            for m in range(markers):
                if trial[m] == 1:
                    weight[m] = 1.0
                    count += 1
        if count < 3:
            velocity[:] = 0.0
            pose[:] = last
            for m in range(markers):
                book.gone[m] += 1
            lost += 1
            trace.pose[t] = pose
            if lost > 10:
                return t
            t += by
            continue
        while True:
            same = True
            for m in range(markers):
                same = same and (weight[m] > 0.0) == (before[m] > 0.0)
                before[m] = weight[m]
            if not same or level == 2:
                level = undecided(
                    pose, target, weight, tree, k, numbers[0], rules.lever, is_open
                )
                freeze(tree, weight, frozen)
            settle(
                pose, target, weight, tree, k, mean, none, is_open, level, rest,
                anchor, numbers, 20,
            )  # fmt: skip
            misfit(pose, target, weight, tree, k)
            out = judge(trial, book, rules, k, weight)
            if out < 0 or count <= 4:
                break
            weight[out] = 0.0
            trace.fate[t, out] = REFUSED
            trial[out] = 2
            count -= 1
        # what may be back
        newcomers = 0
        for m in range(markers):
            if trial[m] == 1 and weight[m] <= 0.0:
                weight[m] = 1.0
                newcomers += 1
        while newcomers > 0:
            attempt[:] = pose
            same = True
            for m in range(markers):
                before[m] = weight[m]
            level = undecided(
                attempt, target, weight, tree, k, numbers[0], rules.lever, is_open
            )
            settle(
                attempt, target, weight, tree, k, mean, none, is_open, level, rest,
                anchor, numbers, 20,
            )  # fmt: skip
            misfit(attempt, target, weight, tree, k)
            out = judge(trial, book, rules, k, weight)
            if out < 0:
                pose[:] = attempt
                freeze(tree, weight, frozen)
                break
            if trial[out] != 1:  # a newcomer pushes it: the farthest newcomer goes
                out = -1
                far = -1.0
                for m in range(markers):
                    if trial[m] == 1 and weight[m] > 0.0:
                        e = k.error[m, 0] ** 2 + k.error[m, 1] ** 2 + k.error[m, 2] ** 2
                        if e > far:
                            far, out = e, m
            weight[out] = 0.0
            trace.fate[t, out] = REFUSED
            newcomers -= 1
            before[:] = -1.0
            level = 2

        # keep
        put(pose, tree, k, places)
        total, square, kept = 0.0, 0.0, 0
        for m in range(markers):
            if weight[m] <= 0.0:
                book.gone[m] += 1
                trace.chosen[t, m] = -1
                trace.sure[t, m] = 0.0
                total += price[m]
                continue
            p = chosen[m]
            returned = book.gone[m] > 0
            trace.fate[t, m] = RETURNED if returned else FOLLOWED
            trace.chosen[t, m] = start[t] + p
            trace.sure[t, m] = sure[m]
            total += cost[m, p]
            kept += 1
            turn, e2 = k.turn[tree.link[m]], 0.0
            share = 1.0 if returned else FORGET
            for j in range(3):
                local = 0.0
                for n in range(3):
                    local += turn[n, j] * (target[m, n] - places[m, n])
                e2 += local * local
                book.bias[m, j] += share * (local - book.bias[m, j])
            square += e2
            learn(
                book.usual, m, math.sqrt(e2),
                STEADY * threshold(book.usual, m, rules.strict, rules.small),
            )  # fmt: skip
            if not returned:
                size = 3.0 * math.log(s2[m] / (UNIT * UNIT))
                surprise = (cost[m, p] - size) * s2[m] / 3.0
                up = 0.2 if surprise > book.surprise[m] else 0.03
                most = 16.0 * book.surprise[m] + rules.floor**2
                book.surprise[m] += up * (min(surprise, most) - book.surprise[m])
            book.gone[m] = 0
        for n in range(pose.shape[0]):
            velocity[n] = pose[n] - last[n]
        trace.pose[t] = pose
        trace.cost[t] = total
        trace.rms[t] = math.sqrt(square / kept) if kept > 0 else math.nan
        trace.known[t] = True
        lost = lost + 1 if 3 * kept < markers else 0
        if lost > 50:
            return t
        t += by
    return stop
