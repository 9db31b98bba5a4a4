"""From frame to frame: predict, assign, bend, refuse, freeze (Maycock 2015 III-B, C).

For every frame

1. the pose moves on with its last velocity, as far as that has foretold anything;
   joints beyond which no marker was seen are frozen. A marker is expected where that
   pose puts it, plus the place where it was last seen beside the model (its bias: skin
   slides and calibrations err, slowly);
2. points are assigned to markers by the Hungarian method. The cost of a pair is minus
   twice the logarithm of how much likelier the point is as that marker than as a ghost,

       d^2 / s^2 + 3 ln(s^2 / s0^2),         price of "no match" 2 ln(odds / ghosts)

   with s the marker's prediction error per axis, learnt from its own surprises. A
   marker out of sight has an s that grows, and lower odds. That is the padding and the
   gate;
3. inverse kinematics on the markers that were seen before; those further from the
   model than their threshold are refused, the worst first (`ghosts`);
4. where that leaves a fit that is not what this hand usually has, other starts are
   tried (`corrections`); where they fail too, the model is lost, and the caller looks
   for it anew;
5. markers that reappear are tried together: the model is bent toward them, and those
   that stay below their threshold, and push no other above its own, are accepted.
"""

import math

import numpy as np

from handclean.arrays import Floats, Floats32, Ints
from handclean.kernels import jit
from handclean.kernels.gauss_newton import Observations, misfit
from handclean.labels.track.alternatives import rebend, recover
from handclean.labels.track.fit import distance, resettle, worth
from handclean.labels.track.residual_gate import STEADY, learn, threshold
from handclean.labels.track.tracker import (
    ABSENT,
    FOLLOWED,
    REFUSED,
    RETURNED,
    UNIT,
    Book,
    Kit,
    Rules,
    State,
    Trace,
    Way,
    put,
)
from handclean.numerics.assignment import NONE, assign_rows

LOUDEST, SOUND = 12.0, 0.99
"""What a link may weigh at most; how often it must be right to overrule a gate."""

FORGET = 0.2
"""Share of the last frame in a marker's bias."""


@jit
def freeze(s: State, kit: Kit) -> None:
    """Write which hinges have no weighted marker further out."""
    s.frozen[:] = True
    for m in range(s.weight.shape[0]):
        if s.weight[m] > 0.0:
            link = kit.tree.link[m]
            while link > 0 and s.frozen[link - 1]:
                s.frozen[link - 1] = False
                link = kit.tree.parent[link]


@jit
def predict(s: State, book: Book, kit: Kit) -> None:
    """Move the pose on, in place, and write where the markers are expected."""
    pose, norm = s.pose, 0.0
    for n in range(pose.shape[0]):
        if n < 7 or not s.frozen[n - 7]:
            pose[n] += s.gain[2] * s.velocity[n]
        if 3 <= n < 7:
            norm += pose[n] * pose[n]
    for n in range(3, 7):
        pose[n] /= math.sqrt(norm)
    limits = kit.tree.limits
    for d in range(s.frozen.shape[0]):
        pose[7 + d] = min(max(pose[7 + d], limits[d, 0]), limits[d, 1])
    put(pose, kit, s.places)
    shift(s, book, kit)
    s.expected[:] = s.places


@jit
def shift(s: State, book: Book, kit: Kit) -> None:
    """Add each marker's bias, given in its link's frame, to its place."""
    for m in range(s.places.shape[0]):
        turn = kit.k.turn[kit.tree.link[m]]
        for n in range(3):
            for j in range(3):
                s.places[m, n] += turn[n, j] * book.bias[m, j]


@jit
def expect(s: State, book: Book, kit: Kit, wide: float) -> None:
    """Write the variance per axis of where each marker is expected."""
    rules, tree = kit.rules, kit.tree
    for m in range(s.s2.shape[0]):
        s2 = max(book.surprise[m], rules.floor * rules.floor) * wide * wide
        if book.gone[m] > 0:
            own, link = False, tree.link[m]
            while link > 0:
                own = own or s.frozen[link - 1]
                link = tree.parent[link]
            away = rules.drift * book.gone[m]
            if not own:  # markers further out tell where it is
                away = min(0.3 * away, 3.0 * math.sqrt(s2))
            away = min(away, 0.5 * rules.reach)
            s2 += away * away
        s.s2[m] = s2


@jit
def price_points(
    points: Floats, s: State, book: Book, rules: Rules, cost: Floats
) -> None:
    """Write the costs (M, P) of all pairs, inf beyond the gate, and the prices."""
    for m in range(s.places.shape[0]):
        gone = book.gone[m] > 0
        s.price[m] = rules.gone_price if gone else rules.seen_price
        size = 3.0 * math.log(s.s2[m] / (UNIT * UNIT))
        gate2 = (s.price[m] - size) * s.s2[m]
        if gone:
            gate2 = min(gate2, rules.reach * rules.reach)
        x, y, z = s.places[m, 0], s.places[m, 1], s.places[m, 2]
        for p in range(points.shape[0]):
            a, b, c = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
            d2 = a * a + b * b + c * c
            cost[m, p] = d2 / s.s2[m] + size if d2 < gate2 else math.inf


@jit
def heed_links(t: int, way: Way, s: State, book: Book, cost: Floats) -> None:
    """Let the paths of the points speak, as loud as they have been right, in place.

    A marker is likelier to be the next point of its own path than the pose foretells,
    and unlikely to be the next point of another's.
    """
    loud = min(2.0 * math.log(s.trust[0] / (1.0 - s.trust[0])) - 4.0, LOUDEST)
    if loud <= 0.0:
        return
    begin = way.start[t]
    for q in range(cost.shape[1]):
        row = way.back[begin + q]
        if row < 0:
            continue
        owner = -1
        for m in range(s.held.shape[0]):
            if s.held[m] == row:
                owner = m
        for m in range(s.held.shape[0]):
            if m == owner:
                if s.trust[0] > SOUND:
                    cost[m, q] = min(cost[m, q], s.price[m] - 0.5 * LOUDEST)
                cost[m, q] -= loud
            elif owner >= 0 or book.gone[m] == 0:
                cost[m, q] += loud


@jit
def learn_links(t: int, way: Way, s: State) -> None:
    """Count which links of the markers that were followed were right."""
    begin = way.start[t]
    for q in range(way.start[t + 1] - begin):
        row = way.back[begin + q]
        if row < 0:
            continue
        for m in range(s.held.shape[0]):
            if s.held[m] == row:
                right = 1.0 if s.weight[m] > 0.0 and s.chosen[m] == q else 0.0
                s.trust[0] += 0.01 * (right - s.trust[0])
    s.trust[0] = min(max(s.trust[0], 1e-3), 1.0 - 1e-3)
    for m in range(s.held.shape[0]):
        s.held[m] = begin + s.chosen[m] if s.weight[m] > 0.0 else -1


@jit
def look_again(points: Floats, s: State, book: Book, kit: Kit, cost: Floats) -> None:
    """Assign the points that are left to the markers that are left; as newcomers.

    They are expected where the pose of this frame, rather than the last, puts them.
    """
    markers = s.weight.shape[0]
    missing = 0
    for m in range(markers):
        if s.weight[m] <= 0.0:
            missing += 1
            s.chosen[m] = NONE
    if missing == 0 or markers - missing >= points.shape[0]:
        return
    put(s.pose, kit, s.places)
    shift(s, book, kit)
    held, again = s.chosen.copy(), s.chosen.copy()
    expect(s, book, kit, 1.5)
    price_points(points, s, book, kit.rules, cost)
    for m in range(markers):
        if held[m] >= 0:
            cost[m, :] = math.inf
            cost[:, held[m]] = math.inf
    assign_rows(cost, s.price, again)
    for m in range(markers):
        if held[m] < 0 and again[m] >= 0:
            s.chosen[m] = again[m]
            s.target[m] = points[again[m]]
            s.trial[m] = 1
            others = 0.0
            for q in range(points.shape[0]):
                if q != again[m] and cost[m, q] < math.inf:
                    others += math.exp(-0.5 * max(cost[m, q] - cost[m, again[m]], 0.0))
            others += math.exp(-0.5 * (s.price[m] - cost[m, again[m]]))
            s.sure[m] = 1.0 / (1.0 + others)


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
        sure[m] = 0.0
        if p < 0 or cost[m, p] == math.inf:
            continue
        against = math.exp(-0.5 * max(price[m] - cost[m, p], 0.0))
        for q in range(cost.shape[1]):
            if q == p or cost[m, q] == math.inf:
                continue
            more = cost[m, q] - cost[m, p]
            other = owner[q]
            if other >= 0 and cost[other, q] < math.inf:
                more += min(cost[other, p], price[other]) - cost[other, q]
            against += math.exp(-0.5 * max(more, 0.0))
        sure[m] = 1.0 / (1.0 + against)


@jit
def judge(s: State, book: Book, kit: Kit) -> int:
    """Return the marker to be refused next, or -1 if none is beyond its threshold.

    Newcomers (``trial`` 1) go before markers that were followed, which they may have
    pushed beyond.
    """
    worst, out, newest, new = 1.0, -1, 0.0, -1
    for m in range(s.weight.shape[0]):
        if s.weight[m] <= 0.0:
            continue
        allowed = threshold(book.usual, m, kit.rules.strict, kit.rules.small)
        if s.trial[m] == 0:
            allowed *= STEADY
        ratio = distance(kit, m) / allowed
        if ratio > worst:
            worst, out = ratio, m
        if s.trial[m] == 1 and ratio > newest:
            newest, new = ratio, m
    return new if out >= 0 and new >= 0 else out


@jit
def look(
    t: int, way: Way, points: Floats, s: State, book: Book, kit: Kit, cost: Floats
) -> int:
    """Assign the points to where the markers are expected; widen the gates if few fit.

    Returns
    -------
    How many have a point.
    """
    wide = 1.0
    for _ in range(3):
        expect(s, book, kit, wide)
        price_points(points, s, book, kit.rules, cost)
        heed_links(t, way, s, book, cost)
        assign_rows(cost, s.price, s.chosen)
        expected, found = 0, 0
        for m in range(s.chosen.shape[0]):
            if book.gone[m] == 0:
                expected += 1
                if s.chosen[m] >= 0:
                    found += 1
        if 3 * found >= 2 * expected:
            break
        wide *= 2.5
    count = 0
    for m in range(s.chosen.shape[0]):
        count += 1 if s.chosen[m] >= 0 else 0
    return count


@jit
def hold_on(points: Floats, s: State, book: Book) -> int:
    """Choose the markers that were followed to hold the model.

    Returns
    -------
    How many markers hold the model.
    """
    count, newcomers = 0, 0
    for m in range(s.chosen.shape[0]):
        s.trial[m], s.weight[m] = 0, 0.0
        if s.chosen[m] < 0:
            continue
        s.target[m] = points[s.chosen[m]]
        if book.gone[m] > 0:
            newcomers += 1
        else:
            s.weight[m] = 1.0
            count += 1
    if count < 4:  # too few to hold on to: whatever fits may come back at once
        count += newcomers
        for m in range(s.chosen.shape[0]):
            if s.chosen[m] >= 0:
                s.weight[m] = 1.0
                s.trial[m] = 1 if book.gone[m] > 0 else 0
    return count


@jit
def refuse(s: State, book: Book, kit: Kit) -> int:
    """Bend, and leave out markers beyond their threshold, one by one.

    Returns
    -------
    How many markers are left.
    """
    count = 0
    for m in range(s.weight.shape[0]):
        count += 1 if s.weight[m] > 0.0 else 0
    tried = np.zeros(kit.tree.parent.shape[0], dtype=np.bool_)  # of each branch
    resettle(s.pose, kit.none, s, kit)
    while True:
        out = judge(s, book, kit)
        if out < 0 or count <= 4:
            return count
        branch = kit.branch[out]
        if branch > 0 and not tried[branch]:
            tried[branch] = True
            rebend(s.pose, branch, s, kit)
            continue
        s.weight[out] = 0.0
        s.trial[out] = 2
        count -= 1
        resettle(s.pose, kit.none, s, kit)


@jit
def admit(s: State, book: Book, kit: Kit, count: int) -> int:
    """Try the newcomers, all together; leave out those that do not fit.

    Returns
    -------
    How many markers hold the model.
    """
    newcomers = 0
    for m in range(s.weight.shape[0]):
        if s.trial[m] == 1 and s.weight[m] <= 0.0:
            s.weight[m] = 1.0
            newcomers += 1
    while newcomers > 0:
        s.attempt[:] = s.pose
        resettle(s.attempt, kit.none, s, kit)
        out = judge(s, book, kit)
        if out >= 0 and kit.branch[out] > 0 and s.trial[out] == 1:
            rebend(s.attempt, kit.branch[out], s, kit)
            out = judge(s, book, kit)
        if out < 0 or s.trial[out] != 1:
            s.pose[:] = s.attempt
            break
        s.weight[out] = 0.0
        s.trial[out] = 2
        newcomers -= 1
    return count + newcomers


@jit
def strange(s: State, book: Book, kit: Kit) -> bool:
    """Whether the fit is clearly worse than this hand's usual ones."""
    square, mean, count = 0.0, 0.0, 0
    for m in range(s.weight.shape[0]):
        if s.weight[m] > 0.0:
            square += distance(kit, m) ** 2
            mean += book.usual.mean[m] ** 2 + book.usual.variance[m]
            count += 1
    if count == 0:
        return True
    usual = math.sqrt(mean / count)
    return math.sqrt(square / count) > 1.6 * usual + kit.rules.small


@jit
def mislaid(s: State, book: Book) -> int:
    """How many markers that were followed have no point now."""
    count = 0
    for m in range(s.weight.shape[0]):
        if book.gone[m] == 0 and s.weight[m] <= 0.0:
            count += 1
    return count


@jit
def keep(t: int, begin: int, s: State, book: Book, kit: Kit, trace: Trace) -> None:
    """Write what was found in a frame, and learn from it."""
    rules, turns = kit.rules, kit.k.turn
    put(s.pose, kit, s.places)
    square, kept = 0.0, 0
    for m in range(s.weight.shape[0]):
        if s.weight[m] <= 0.0:
            trace.fate[t, m] = REFUSED if s.trial[m] == 2 else ABSENT
            trace.chosen[t, m], trace.sure[t, m] = -1, 0.0
            book.gone[m] += 1
            continue
        returned = book.gone[m] > 0
        trace.fate[t, m] = RETURNED if returned else FOLLOWED
        trace.chosen[t, m], trace.sure[t, m] = begin + s.chosen[m], s.sure[m]
        kept += 1
        turn, e2, i2 = turns[kit.tree.link[m]], 0.0, 0.0
        share = 1.0 if returned else FORGET
        for j in range(3):
            local = 0.0
            for n in range(3):
                local += turn[n, j] * (s.target[m, n] - s.places[m, n])
            e2 += local * local
            away = local - book.bias[m, j]
            i2 += away * away
            book.bias[m, j] += share * away
        square += e2
        most = STEADY * threshold(book.usual, m, rules.strict, rules.small)
        learn(book.usual, m, math.sqrt(e2), most)
        book.gone[m] = 0
    s.tally[2] = kept
    trace.pose[t] = s.pose
    trace.rms[t] = math.sqrt(square / kept) if kept > 0 else math.nan
    trace.known[t] = kept > 0


@jit
def learn_surprise(s: State, book: Book, kit: Kit) -> None:
    """Let the errors of the prediction into their averages, quickly if they grow."""
    for m in range(s.weight.shape[0]):
        if s.weight[m] <= 0.0 or book.gone[m] > 0:
            continue
        surprise = 0.0
        for n in range(3):
            surprise += (s.target[m, n] - s.expected[m, n]) ** 2 / 3.0
        most = 16.0 * book.surprise[m] + kit.rules.floor**2
        share = 0.2 if surprise > book.surprise[m] else 0.03
        book.surprise[m] += share * (min(surprise, most) - book.surprise[m])


@jit
def learn_velocity(s: State, most: float) -> None:
    """Take the step to this pose as velocity, and how much of the last one came true.

    The gain is a running regression of steps on the steps foretold, of the root.
    A hinge that turned further than ``most`` [rad] jumped, and has none.
    """
    along, square = 0.0, 0.0
    sign = 0.0
    for n in range(3, 7):
        sign += s.pose[n] * s.last[n]
    for n in range(s.pose.shape[0]):
        last = -s.last[n] if 3 <= n < 7 and sign < 0.0 else s.last[n]
        step = s.pose[n] - last
        if n < 3:
            along += step * s.velocity[n]
            square += s.velocity[n] * s.velocity[n]
        s.velocity[n] = step if n < 7 or abs(step) < most else 0.0
    s.gain[0] += 0.1 * (along - s.gain[0])
    s.gain[1] += 0.1 * (square - s.gain[1])
    if s.gain[1] > 1e-10:
        s.gain[2] = min(max(s.gain[0] / s.gain[1], 0.0), 1.0)


@jit
def follow(
    way: Way,
    first: int,
    stop: int,
    by: int,
    s: State,
    book: Book,
    kit: Kit,
    trace: Trace,
) -> int:
    """Follow a model through frames ``first``, ``first + by``, ... before ``stop``.

    Parameters
    ----------
    way : the points of all frames and their paths, seen in this direction.
    s : its pose is that of the frame before ``first``, or of ``first`` itself.
    book : state of the markers, overwritten. trace : rows of the frames, overwritten.

    Returns
    -------
    The frame at which it lost the model, or ``stop``.
    """
    markers, rules = book.gone.shape[0], kit.rules
    t = first
    while t != stop:
        points = way.at[way.start[t] : way.start[t + 1]]
        cost = np.zeros((markers, points.shape[0]))
        s.last[:] = s.pose
        predict(s, book, kit)
        found = look(t, way, points, s, book, kit, cost)
        count = 0
        if found >= 4:
            rate_labels(cost, s.price, s.chosen, s.sure)
            count = hold_on(points, s, book)
            if count >= 4:
                count = refuse(s, book, kit)
        again = False
        if points.shape[0] >= 4 and 2 * points.shape[0] >= markers:
            again = count < 4 or strange(s, book, kit) or mislaid(s, book) >= 3
        if again:
            before = worth(s.weight, kit) if count >= 4 else 1e9
            gate = 3.0 * rules.reach
            after = recover(points, s, kit, gate, before)
            if after < before:
                put(s.pose, kit, s.places)
                expect(s, book, kit, 1.0)
                price_points(points, s, book, rules, cost)
                rate_labels(cost, s.price, s.chosen, s.sure)
                s.trial[:] = 0
                count = refuse(s, book, kit)
            elif count >= 4:
                resettle(s.pose, kit.none, s, kit)
            if count < 4 or strange(s, book, kit):
                s.pose[:] = s.last
                return t
        if count < 4:
            s.pose[:] = s.last
            s.velocity[:] = 0.0
            s.held[:] = -1
            s.tally[1] += 1
            trace.pose[t] = s.pose
            for m in range(markers):
                book.gone[m] += 1
            if s.tally[1] > rules.patience:
                return t
            t += by
            continue
        s.tally[1] = 0
        learn_surprise(s, book, kit)
        look_again(points, s, book, kit, cost)
        admit(s, book, kit, count)
        freeze(s, kit)
        misfit(s.pose, Observations(s.target, s.weight), kit.tree, kit.k)
        trace.cost[t] = worth(s.weight, kit)
        keep(t, way.start[t], s, book, kit, trace)
        learn_links(t, way, s)
        learn_velocity(s, rules.turn)
        t += by
    return stop
