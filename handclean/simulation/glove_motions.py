"""What a wearer of a glove does: key poses, widgets, touching, moving freely.

All motions are (T, D) hinge angles of the wearer's hand. The middle finger's abduction
is zero throughout, the reference of abductions between fingers; DIPs and the thumb's
pronation follow other joints nearly as people's do, each wearer's a little differently.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Floats
from handclean.hand.model import Model, jacobian, marker_positions
from handclean.hand.pronation import PRONATION, with_pronation
from handclean.hand.template import FINGERS, HAND_LENGTH_M, distal_length, template
from handclean.simulation.timing import minimum_jerk, shaking
from handclean.tree import POSE_HEAD, JointTree

LONG = FINGERS[1:]

_TREMOR_RAD = np.radians(0.25)
"""[rad] how much a joint trembles that is held still (chosen)."""

_FREE_RANGE_DEG = {
    "thumb_cmc_abduction": (0, 55),
    "thumb_cmc_flexion": (-15, 45),
    "thumb_mcp_flexion": (-5, 50),
    "thumb_ip_flexion": (-10, 70),
    "mcp_flexion": (-15, 85),
    "pip_flexion": (0, 100),
    "dip_flexion": (0, 65),
    "index_mcp_abduction": (0, 25),
    "ring_mcp_abduction": (-18, 0),
    "little_mcp_abduction": (-28, 0),
    "wrist_flexion": (-50, 55),
    "wrist_deviation": (-28, 20),
}
"""[degrees] lowest and highest angle of free movement (chosen)."""

_MOVES = tuple(
    name
    for name in _FREE_RANGE_DEG
    if "_" in name[4:] and name.split("_", 1)[0] not in ("mcp", "pip", "dip")
)


@dataclass(frozen=True, kw_only=True)
class Wearer:
    """A person in a glove.

    Attributes
    ----------
    name : who.
    tree : hand with forearm and pronation.
    size : hand length against the mean.
    tips : the hand with a marker at every fingertip.
    dip : finger to the share of its PIP that its DIP bends.
    pronation : shares of the thumb's flexion and abduction.
    sloppy : [rad] how far from a key pose's angles this person's joints are.
    """

    name: str
    tree: JointTree
    size: float
    tips: Model
    dip: Mapping[str, float]
    pronation: tuple[float, float]
    sloppy: float


def make_wearer(name: str, rng: np.random.Generator, side: str = "right") -> Wearer:
    """Draw a person; hands are sized as men's and women's are.

    The left hand is the mirror image: it takes the same angles.
    """
    size = float(np.clip(rng.normal(1.0, 0.06), 0.85, 1.15))
    breadth = 0.0849 * size * rng.lognormal(0.0, 0.03)
    base = template(side, HAND_LENGTH_M * size, breadth, forearm=True, subject=name)
    tree = with_pronation(base)
    factor = rng.lognormal(0.0, 0.03, len(tree.bones))
    tree = JointTree(
        **{
            **{key: getattr(tree, key) for key in tree.__dataclass_fields__},
            "offsets": tree.offsets * factor[:, None],
        }
    )
    return Wearer(
        name=name,
        tree=tree,
        size=size,
        tips=_tips(tree),
        dip={f: 2.0 / 3.0 + rng.normal(0.0, 0.03) for f in LONG},
        pronation=(0.3 + rng.normal(0.0, 0.03), 0.2 + rng.normal(0.0, 0.03)),
        sloppy=float(np.radians(rng.uniform(0.6, 1.2))),
    )


def _tips(tree: JointTree) -> Model:
    bone = [tree.bone(f"{finger}_distal") for finger in FINGERS]
    along = tree.offsets[bone] / np.linalg.norm(tree.offsets[bone], axis=1)[:, None]
    length = np.array([distal_length(tree, finger) for finger in FINGERS])
    return Model(
        tree=tree,
        labels=tuple(f"{finger}_tip" for finger in FINGERS),
        bone=np.array(bone, dtype=np.int64),
        at=length[:, None] * along,
    )


def follow(wearer: Wearer, angles: Floats) -> Floats:
    """Let DIPs and pronation follow, and the middle finger's abduction be zero."""
    out, names = angles.copy(), wearer.tree.hinges
    for finger in LONG:
        pip = out[:, names.index(f"{finger}_pip_flexion")]
        out[:, names.index(f"{finger}_dip_flexion")] = wearer.dip[finger] * pip
    flexion = out[:, names.index("thumb_cmc_flexion")]
    abduction = out[:, names.index("thumb_cmc_abduction")]
    a, b = wearer.pronation
    out[:, names.index(PRONATION)] = a * flexion + b * abduction
    out[:, names.index("middle_mcp_abduction")] = 0.0
    return out


def held(
    wearer: Wearer, pose: Mapping[str, float], times: Floats, rng: np.random.Generator
) -> Floats:
    """(T, D) [rad] a pose held still, as this person takes it.

    Parameters
    ----------
    pose : hinge to angle [rad].
    """
    names = wearer.tree.hinges
    angles = np.array([pose.get(name, 0.0) for name in names])
    angles = angles + rng.normal(0.0, wearer.sloppy, len(names))
    still = shaking(times, 0.0, 8.0, _TREMOR_RAD, len(names), rng)
    return follow(wearer, angles + still)


def free(wearer: Wearer, times: Floats, rng: np.random.Generator) -> Floats:
    """(T, D) [rad] moving all joints freely, fingers curling as a whole and apart."""
    starts = _starts(times, rng)
    keys = np.array([_posture(wearer, rng) for _ in starts])
    return follow(wearer, _through(times, starts, keys))


def moving(
    wearer: Wearer, hinges: tuple[str, ...], times: Floats, rng: np.random.Generator
) -> Floats:
    """(T, D) [rad] moving these joints as far as they go, the others held still."""
    names = wearer.tree.hinges
    starts = _starts(times, rng)
    keys = np.zeros((len(starts), len(names)))
    for k in range(len(starts)):
        for hinge in hinges:
            low, high = np.radians(_range(hinge))
            pick = rng.random()
            share = rng.choice([0.0, 1.0]) if pick < 0.35 else rng.random() ** 1.3
            if k % 3 == 0:  # back to rest now and then
                share = -low / (high - low) if high > 0.0 else 1.0
            keys[k, names.index(hinge)] = low + share * (high - low)
    still = shaking(times, 0.0, 8.0, _TREMOR_RAD, len(names), rng)
    angles = _through(times, starts, keys) + still
    out = follow(wearer, angles)
    for hinge in hinges:  # a DIP alone is bent by the other hand
        out[:, names.index(hinge)] = angles[:, names.index(hinge)]
    return out


def _range(hinge: str) -> tuple[float, float]:
    return _FREE_RANGE_DEG.get(hinge) or _FREE_RANGE_DEG[hinge.split("_", 1)[1]]


def _posture(wearer: Wearer, rng: np.random.Generator) -> Floats:
    names = wearer.tree.hinges
    out = np.zeros(len(names))
    whole = rng.random()
    for finger in LONG:
        curl = whole if rng.random() < 0.5 else rng.random()
        for part, spread in (("mcp", 0.22), ("pip", 0.18)):
            low, high = _range(f"x_{part}_flexion")
            share = np.clip(curl + rng.normal(0.0, spread), 0.0, 1.0)
            hinge = f"{finger}_{part}_flexion"
            out[names.index(hinge)] = np.radians(low + share * (high - low))
    for hinge in _MOVES:
        low, high = _range(hinge)
        out[names.index(hinge)] = np.radians(low + rng.random() * (high - low))
    return out


def _starts(times: Floats, rng: np.random.Generator) -> Floats:
    """(K,) [s] when movements begin; the first at once."""
    count = max(int(times[-1] / 0.65), 2)
    steps = rng.uniform(0.7, 1.3, count)
    ends = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    return np.asarray(ends / steps.sum() * times[-1])


def _through(times: Floats, starts: Floats, keys: Floats) -> Floats:
    """(T, D) from one posture to the next by minimum jerk."""
    out = np.tile(keys[0], (len(times), 1))
    ends = np.append(starts[1:], times[-1] + 1e-9)
    for k in range(1, len(keys)):
        share = minimum_jerk((times - starts[k]) / (ends[k] - starts[k]))
        out += share[:, None] * (keys[k] - keys[k - 1])
    return out


def with_held(
    wearer: Wearer, angles: Floats, hold: Mapping[str, float], sloppy: float = 0.0
) -> Floats:
    """Hold a sum of hinges at an angle by a widget while all else moves.

    Parameters
    ----------
    hold : hinge to its angle [rad].
    sloppy : [rad] how far off the widget holds it.
    """
    out = angles.copy()
    for hinge, angle in hold.items():
        out[:, wearer.tree.hinges.index(hinge)] = angle + sloppy
    return follow(wearer, out)


def touching(
    wearer: Wearer, finger: str, times: Floats, rng: np.random.Generator
) -> Floats:
    """(T, D) [rad] the tips of thumb and finger together while both move."""
    names = wearer.tree.hinges
    count = len(names)
    own = [k for k, name in enumerate(names) if name.split("_")[0] in ("thumb", finger)]
    free_hinges = [
        k for k in own
        if not names[k].endswith(("dip_flexion", "pronation"))
        and names[k] != "middle_mcp_abduction"
    ]  # fmt: skip
    tips = wearer.tips.selected(("thumb_tip", f"{finger}_tip"))
    starts = _starts(times, rng)
    keys = np.array([_near(wearer, finger, rng) for _ in starts])
    wanted = _through(times, starts, keys)
    couple = np.zeros((count, count))
    couple[np.ix_(free_hinges, free_hinges)] = np.eye(len(free_hinges))
    eye = follow(wearer, np.eye(count))
    for k in range(count):
        if names[k].endswith(("dip_flexion", "pronation")):
            couple[k] = eye[:, k]
    low, high = wearer.tree.limits.T
    out = np.zeros((len(times), count))
    now = wanted[0]
    for t in range(len(times)):
        now = wanted[t] if t == 0 else now + wanted[t] - wanted[t - 1]
        for _ in range(60 if t == 0 else 6):
            now = follow(wearer, np.clip(now, low, high)[None])[0]
            now = now + couple @ _step(tips, now, wanted[t], couple, free_hinges)
        out[t] = follow(wearer, now[None])[0]
    return out


def _step(
    tips: Model, angles: Floats, wanted: Floats, couple: Floats, own: list[int]
) -> Floats:
    """(D,) Gauss-Newton step: tips together (0.1 mm), near the wanted pose (25 deg)."""
    pose = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], angles])
    places = marker_positions(tips, pose[None])[0]
    slopes = jacobian(tips, pose)[:, :, 6:] @ couple
    apart, slope = places[0] - places[1], (slopes[0] - slopes[1])[:, own]
    weight, stay = 1e4, 1.0 / np.radians(25.0)
    matrix = weight**2 * slope.T @ slope + stay**2 * np.eye(len(own))
    right = -(weight**2) * slope.T @ apart + stay**2 * (wanted - angles)[own]
    step = np.zeros(len(angles))
    step[own] = np.clip(np.linalg.solve(matrix, right), -0.3, 0.3)
    return step


def _near(wearer: Wearer, finger: str, rng: np.random.Generator) -> Floats:
    """(D,) [rad] a pose in which thumb and finger are about to touch."""
    names = wearer.tree.hinges
    far = LONG.index(finger)
    pose = {
        "thumb_cmc_abduction": 42 + 2 * far,
        "thumb_cmc_flexion": 14 + 9 * far,
        "thumb_mcp_flexion": 20 + 4 * far,
        "thumb_ip_flexion": 25 + 3 * far,
        **{f"{other}_mcp_flexion": 18 for other in LONG},
        **{f"{other}_pip_flexion": 22 for other in LONG},
        "index_mcp_abduction": 4,
        "ring_mcp_abduction": -3,
        "little_mcp_abduction": -7,
        f"{finger}_mcp_flexion": 48,
        f"{finger}_pip_flexion": 50,
    }
    out = np.zeros(len(names))
    for hinge, angle in pose.items():
        spread = 3.0 if hinge.endswith("mcp_abduction") else 9.0
        out[names.index(hinge)] = np.radians(angle + rng.normal(0.0, spread))
    near: Floats = follow(wearer, out[None])[0]
    return near


def tip_distance(wearer: Wearer, finger: str, angles: Floats) -> Floats:
    """(T,) [m] between the tips of thumb and finger."""
    poses = np.zeros((len(angles), POSE_HEAD + angles.shape[1]))
    poses[:, 3] = 1.0
    poses[:, POSE_HEAD:] = angles
    both = wearer.tips.selected(("thumb_tip", f"{finger}_tip"))
    places = marker_positions(both, poses)
    out: Floats = np.linalg.norm(places[:, 0] - places[:, 1], axis=1)
    return out
