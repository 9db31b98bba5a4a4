"""A low-dimensional Kalman smoother (Burke and Lasenby 2016).

Frames with all donors and the hidden marker, as rows less their mean m, have singular
directions; the first K, which hold 99.75 % of the sum of the singular values, span what
the body does. Its state s (K,) walks at random and shows itself in the markers that are
seen, C being their rows of the directions ::

    s_(t+1) = s_t + N(0, Q) ,    z_t = m + C_t s_t + N(0, r^2) .

Q is the covariance of the steps from frame to frame, in the subspace. The smoothed
states minimise ::

    sum_t |z_t - m - C_t s_t|^2 / r^2 + sum_t (s_(t+1) - s_t)^T Q^-1 (s_(t+1) - s_t) ,

a band of equations, which a Cholesky factor solves at once; a forward and a backward
pass over frames give the same. In the gap the donors are seen, in a few frames beside
it the hidden marker, too.

What is not the authors': a frame is laid onto the body first (a hand turns further than
a plane can follow), and r^2 is not fixed but what the directions leave of the frames.
Only the frames around the gap are smoothed, since the walk forgets soon.

Burke and Lasenby, Estimating missing marker positions using low dimensional Kalman
smoothing, Journal of Biomechanics (2016), doi 10.1016/j.jbiomech.2016.04.016.
"""

from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.gaps.body import Motion, motion_onto
from handclean.gaps.family.donors import Group, expect_width, spread_evenly
from handclean.gaps.family.ends import frames_of, root_mean_square
from handclean.gaps.family.learnt import prepare_learnt
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Refused, Tracks

KEPT_SHARE = 0.9975
"""Of the sum of singular values, in the directions that are kept (the authors')."""

BESIDE_S = 0.1
"""[s] on each side of a gap that is smoothed with it (chosen)."""

NOISE_SD_M = 3e-4
"""[m] r without what the directions leave (chosen on two recordings of hands, other
gaps than it is judged by; a third or three times of it cost 8 to 9 % more error)."""

LEAST_STEP_M = 1e-5
"""[m] standard deviation of a step, at the least (chosen)."""

MOST_STEPS = 1024
"""Steps from frame to frame that Q is found from (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Walk:
    """The subspace of a body, and how its state walks.

    Attributes
    ----------
    markers : (V + 1,) donors, and the hidden marker last.
    reference : (V, 3) [m] what each frame's donors are laid onto.
    mean : (3 V + 3,) [m]; directions : (3 V + 3, K)
    stiffness : (K, K) [1/m^2] the inverse of Q; noise : [m^2] r^2.
    residual : [m] root mean square error per axis where it was learnt.
    """

    tracks: Tracks
    markers: Ints
    reference: Floats
    mean: Floats
    directions: Floats
    stiffness: Floats
    noise: float
    residual: float

    def path(self, gap: Gap) -> Floats:
        """(N, 3) [m] places in a gap and at the ends it has."""
        within = frames_of(self.tracks, gap)
        frames, whole = self._around(within)
        rows, motion = _body_rows(self.tracks, frames, self.markers, self.reference)
        states = self._smooth(rows - self.mean, whole)
        places = self.mean[-3:] + states @ self.directions[-3:].T
        here = (frames >= within[0]) & (frames <= within[-1])
        return Motion(motion.turn[here], motion.shift[here]).to_laboratory(places[here])

    def _around(self, within: Ints) -> tuple[Ints, Bools]:
        """(N,) frames to smooth, without any break, and whether they show all."""
        beside = max(round(BESIDE_S * self.tracks.rate), 1)
        first = max(int(within[0]) - beside, 0)
        frames = np.arange(
            first, min(int(within[-1]) + beside + 1, len(self.tracks.seen))
        )
        whole: Bools = np.all(self.tracks.seen[frames][:, self.markers], axis=1)
        before = np.flatnonzero(~whole & (frames < within[0]))
        after = np.flatnonzero(~whole & (frames > within[-1]))
        start = before[-1] + 1 if len(before) else 0
        stop = after[0] if len(after) else len(frames)
        return frames[start:stop], whole[start:stop]

    def _smooth(self, rows: Floats, whole: Bools) -> Floats:
        """(N, K) states of frames, the hidden marker seen where ``whole``."""
        seen, hidden = self.directions[:-3], self.directions[-3:]
        tells = np.tile(seen.T @ seen, (len(rows), 1, 1))
        tells[whole] += hidden.T @ hidden
        right = rows[:, :-3] @ seen
        right[whole] += rows[whole, -3:] @ hidden
        links = np.full(len(rows), 2.0)
        links[[0, -1]] -= 1.0
        diagonal = tells / self.noise + links[:, None, None] * self.stiffness
        return solve_chain(diagonal, -self.stiffness, right / self.noise)


def prepare(tracks: Tracks) -> Fill:
    """Fill by smoothing the state of the body."""

    def learn(hidden: int, group: Group) -> Walk:
        return learn_walk(tracks, hidden, group)

    return prepare_learnt(tracks, learn)


def learn_walk(tracks: Tracks, hidden: int, group: Group) -> Walk:
    """Find subspace, steps and noise from the frames of a group.

    Raises
    ------
    Refused
        If no two of the frames follow each other.
    """
    reference = tracks.positions[group.frames[0], group.markers]
    expect_width(reference)
    markers = np.append(group.markers, hidden)
    rows, _ = _body_rows(tracks, spread_evenly(group.frames), markers, reference)
    mean = rows.mean(axis=0)
    rows = rows - mean
    variances, directions = np.linalg.eigh(rows.T @ rows / len(rows))
    variances, directions = np.maximum(variances[::-1], 0.0), directions[:, ::-1]
    sizes = np.sqrt(variances)
    kept = int(np.argmax(np.cumsum(sizes) >= KEPT_SHARE * sizes.sum())) + 1
    directions = directions[:, :kept]
    noise = float(variances[kept:].sum()) / len(mean) + NOISE_SD_M**2
    steps = _steps(tracks, group, markers, reference) @ directions
    spread = steps.T @ steps / len(steps)
    spread[np.diag_indices(kept)] += LEAST_STEP_M**2
    seen = directions[:-3]
    square = seen.T @ seen / noise + np.diag(1.0 / (variances[:kept] + LEAST_STEP_M**2))
    states = np.linalg.solve(square, seen.T @ rows[:, :-3].T / noise)
    return Walk(
        tracks=tracks,
        markers=markers,
        reference=reference,
        mean=mean,
        directions=directions,
        stiffness=np.linalg.inv(spread),
        noise=noise,
        residual=root_mean_square(rows[:, -3:] - (directions[-3:] @ states).T),
    )


def solve_chain(diagonal: Floats, link: Floats, right: Floats) -> Floats:
    """(N, K) solution of equations that tie each of N blocks to the next.

    Parameters
    ----------
    diagonal : (N, K, K) symmetric; link : (K, K) the same below all of them, symmetric.
    right : (N, K)
    """
    from scipy.linalg import solveh_banded  # 0.2 s, which few takes need

    count, size = right.shape
    band = np.zeros((2 * size, count, size))
    i, j = np.tril_indices(size)
    band[i - j, :, j] = diagonal[:, i, j].T
    i, j = (index.ravel() for index in np.indices((size, size)))
    band[size + i - j, :-1, j] = link[i, j, None]
    band = band.reshape(2 * size, -1)
    found = solveh_banded(band, right.ravel(), lower=True, check_finite=False)
    return np.asarray(found).reshape(count, size)


def _body_rows(
    tracks: Tracks, frames: Ints, markers: Ints, reference: Floats
) -> tuple[Floats, Motion]:
    """(N, 3 V + 3) [m] donors and hidden marker seen from the body, and its motion."""
    points = tracks.positions[frames][:, markers]
    motion = motion_onto(points[:, :-1], reference)
    return motion.to_body(points).reshape(len(frames), -1), motion


def _steps(tracks: Tracks, group: Group, markers: Ints, reference: Floats) -> Floats:
    """(N, 3 V + 3) [m] steps from frame to frame, seen from the body."""
    first = group.frames[:-1][np.diff(group.frames) == 1]
    if len(first) == 0:
        raise Refused("no two frames in a row show it and the others")
    first = spread_evenly(first, MOST_STEPS)
    before, _ = _body_rows(tracks, first, markers, reference)
    after, _ = _body_rows(tracks, first + 1, markers, reference)
    return after - before
