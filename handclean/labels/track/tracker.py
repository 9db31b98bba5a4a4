"""What the compiled labelling functions share: constants, state, what is written."""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Bytes, Floats, Floats32, Ints
from handclean.ik.settings import SolveConfig
from handclean.kernels import jit
from handclean.kernels.chain import place_links, place_points
from handclean.kernels.gauss_newton import Chain, Workspace, make_workspace
from handclean.labels.settings import LabelConfig
from handclean.labels.target import Sought
from handclean.labels.track.residual_gate import Usual, usual

UNIT = 1e-3
"""[m] prediction error at which the logarithm in the cost is zero."""

HAND_VOLUME = 8e-3
"""[m^3] a cube the length of a hand."""

RESTARTS = 4
"""How many of a model's start postures a finger is tried in when it does not fit."""

ABSENT, FOLLOWED, RETURNED, REFUSED = 0, 1, 2, 3
"""What became of a marker in a frame."""


class Rules(NamedTuple):
    """Numbers of the tracker; see `LabelConfig`.

    seen_price, gone_price : price of "no match" of a marker seen, not seen, before.
    floor : [m] least prediction error; drift : [m] growth per frame out of sight;
    reach : [m]; strict, small : of the threshold; lever : [m], see `find_open_hinges`;
    patience : frames without enough markers after which the model is lost; turn :
    [rad] that a hinge turns at most in a frame; swing : [rad] that it usually does.
    """

    seen_price: float
    gone_price: float
    floor: float
    drift: float
    reach: float
    strict: float
    small: float
    lever: float
    patience: float
    turn: float
    swing: float


class Kit(NamedTuple):
    """What does not change while a model is followed, and the kernels' room.

    tree, k, numbers (damping, enough_m, prior_m) : of the kernels; mean, basis : the
    posture prior, none (D, 0) no prior; variance (M,) [m^2] of the distances, RMS
    squared; branch, rank (M,) : which finger, and how many of its markers lie further
    out; hinge_branch (D,) : which finger a hinge is of; starts (S, D) [rad] postures.
    """

    tree: Chain
    k: Workspace
    mean: Floats
    basis: Floats
    none: Floats
    numbers: tuple[float, float, float]
    rules: Rules
    variance: Floats
    branch: Ints
    rank: Ints
    hinge_branch: Ints
    starts: Floats


class Book(NamedTuple):
    """What is known of the markers while they are followed.

    bias (M, 3) [m] beside the model, in the link's frame; surprise (M,) [m^2] variance
    of the prediction error per axis; gone (M,) frames out of sight; usual : distances.
    """

    bias: Floats
    surprise: Floats
    gone: Ints
    usual: Usual


class Way(NamedTuple):
    """The points of a take, in the direction in which it is followed.

    at (P, 3) [m]; start (T + 1,); back (P,) row of the point before on the same path.
    """

    at: Floats
    start: Ints
    back: Ints


class State(NamedTuple):
    """The frame at hand.

    pose, last, velocity, attempt (7 + D,); places, expected, target (M, 3); weight,
    s2, price, there (M,); chosen, trial (M,); frozen, is_open (D,); rest, anchor (D,);
    sure (M,); tally (3,) level of `find_open_hinges`, frames with too little, markers
    kept; gain (3,) of `learn_velocity`; held (M,) row of each marker's point in the
    last frame, -1 none; trust (1,) share of links that were right.
    """

    pose: Floats
    last: Floats
    velocity: Floats
    attempt: Floats
    places: Floats
    expected: Floats
    target: Floats
    weight: Floats
    s2: Floats
    price: Floats
    there: Floats
    chosen: Ints
    trial: Ints
    frozen: Bools
    is_open: Bools
    rest: Floats
    anchor: Floats
    sure: Floats32
    tally: Ints
    gain: Floats
    held: Ints
    trust: Floats


class Trace(NamedTuple):
    """What the tracker found, one row per frame of the take.

    pose (T, 7 + D); chosen (T, M) row of the cloud or -1; sure (T, M) probability that
    the label is right; fate (T, M) `ABSENT`...; cost (T,) see `worth`; rms (T,) [m];
    known (T,) whether it was followed.
    """

    pose: Floats
    chosen: Ints
    sure: Floats32
    fate: Bytes
    cost: Floats
    rms: Floats
    known: Bools


def rules_of(settings: LabelConfig, solving: SolveConfig, rate: float) -> Rules:
    """Return the tracker's numbers for a frame rate [Hz]."""
    ghosts = settings.ghosts_per_hand / HAND_VOLUME
    volume = (2.0 * math.pi) ** 1.5 * UNIT**3
    fall = 0.25 * settings.acceleration_m_s2 / rate**2
    return Rules(
        seen_price=2.0 * math.log(99.0 / (ghosts * volume)),
        gone_price=2.0 * math.log(0.03 / (ghosts * volume)),
        floor=math.hypot(2e-4, fall),
        drift=settings.drift_m_s / rate,
        reach=settings.reach_m,
        strict=settings.strict,
        small=settings.small_m,
        lever=solving.lever_m,
        patience=0.25 * rate,
        turn=40.0 / rate,
        swing=8.0 / rate,
    )


def kit_of(thing: Sought, rules: Rules, solving: SolveConfig) -> Kit:
    """Return a model with its numbers and room."""
    markers, hinges = len(thing.sigma), len(thing.mean)
    of_link = _branch_of_links(thing)
    return Kit(
        tree=thing.chain,
        k=make_workspace(hinges, markers, thing.basis.shape[1]),
        mean=thing.mean,
        basis=thing.basis,
        none=np.zeros((hinges, 0)),
        numbers=(solving.damping, solving.enough_m, solving.prior_m),
        rules=rules,
        variance=thing.sigma**2 + (0.5 * rules.small) ** 2,
        branch=of_link[thing.chain.link],
        rank=_ranks(thing, of_link),
        hinge_branch=of_link[1:],
        starts=thing.starts[:RESTARTS],
    )


def _branch_of_links(thing: Sought) -> Ints:
    """(D + 1,) branch of the root each link is on, from 1; 0 for the root itself."""
    parent = thing.chain.parent
    branch = np.zeros(len(parent), dtype=np.int64)
    found = 0
    for link in range(1, len(parent)):
        if parent[link] == 0:
            found += 1
            branch[link] = found
        else:
            branch[link] = branch[parent[link]]
    return branch


def _ranks(thing: Sought, branch: Ints) -> Ints:
    """(M,) how many markers of its branch lie further out than each."""
    chain = thing.chain
    depth = 1e-3 * np.linalg.norm(chain.at, axis=1)
    for m, link in enumerate(chain.link):
        up = int(link)
        while up > 0:
            depth[m] += 1.0
            up = int(chain.parent[up])
    rank = np.zeros(len(depth), dtype=np.int64)
    for one in range(1, int(branch.max()) + 1):
        rows = np.flatnonzero(branch[chain.link] == one)
        rank[rows[np.argsort(-depth[rows], kind="stable")]] = np.arange(len(rows))
    return rank


def new_book(thing: Sought, rules: Rules, gone: Ints) -> Book:
    """Return the state of the markers at the start."""
    return Book(
        bias=np.zeros((len(thing.sigma), 3)),
        surprise=thing.sigma**2 / 3.0 + (2.0 * rules.floor) ** 2 + 1e-6,
        gone=gone.astype(np.int64),
        usual=usual(thing.sigma, rules.small),
    )


def new_state(markers: int, hinges: int) -> State:
    """Room for a frame."""
    return State(
        pose=np.zeros(7 + hinges),
        last=np.zeros(7 + hinges),
        velocity=np.zeros(7 + hinges),
        attempt=np.zeros(7 + hinges),
        places=np.zeros((markers, 3)),
        expected=np.zeros((markers, 3)),
        target=np.zeros((markers, 3)),
        weight=np.zeros(markers),
        s2=np.zeros(markers),
        price=np.zeros(markers),
        there=np.full(markers, -1.0),
        chosen=np.zeros(markers, dtype=np.int64),
        trial=np.zeros(markers, dtype=np.int64),
        frozen=np.zeros(hinges, dtype=np.bool_),
        is_open=np.zeros(hinges, dtype=np.bool_),
        rest=np.zeros(hinges),
        anchor=np.zeros(hinges),
        sure=np.zeros(markers, dtype=np.float32),
        tally=np.array([2, 0, 0]),
        gain=np.array([0.0, 0.0, 1.0]),
        held=np.full(markers, -1),
        trust=np.array([0.9]),
    )


def make_trace(frames: int, markers: int, hinges: int) -> Trace:
    """Room for a take."""
    return Trace(
        pose=np.zeros((frames, 7 + hinges)),
        chosen=np.full((frames, markers), -1),
        sure=np.zeros((frames, markers), dtype=np.float32),
        fate=np.zeros((frames, markers), dtype=np.uint8),
        cost=np.full(frames, np.inf),
        rms=np.full(frames, np.nan),
        known=np.zeros(frames, dtype=bool),
    )


@jit
def put(pose: Floats, kit: Kit, places: Floats) -> None:
    """Write where (M, 3) [m] a pose puts the markers; leaves the links in the room."""
    tree, k = kit.tree, kit.k
    place_links(pose, tree.parent, tree.offset, tree.axis, k.turn, k.origin, k.column)
    place_points(k.turn, k.origin, tree.link, tree.at, places)
    for m in range(places.shape[0]):
        for n in range(3):
            places[m, n] += pose[n]
