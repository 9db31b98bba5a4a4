"""Twenty places a person finds on any hand, and where they are on the template.

Each is a place on the spread hand's skin: straight out of the back or the palm side of
a finger at a share of a segment, a finger's tip, the edge of a web, or the side of the
wrist.
"""

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.factory.sculpt.anatomy import WEB_REACH_SHARE, Anatomy

_TIPS = ("thumb", "index", "middle", "ring", "little")

# Finger, segment, its share, and towards which side: 1 the back, -1 the palm.
_ON_FINGERS = {
    "thumb_ip": ("thumb", 2, 0.0, 1.0),
    "thumb_knuckle": ("thumb", 1, 0.0, 1.0),
    "index_pip": ("index", 1, 0.0, 1.0),
    "middle_pip": ("middle", 1, 0.0, 1.0),
    "little_pip": ("little", 1, 0.0, 1.0),
    "index_knuckle": ("index", 0, 0.0, 1.0),
    "middle_knuckle": ("middle", 0, 0.0, 1.0),
    "little_knuckle": ("little", 0, 0.0, 1.0),
    "index_root_crease": ("index", 0, WEB_REACH_SHARE, -1.0),
    "little_root_crease": ("little", 0, WEB_REACH_SHARE, -1.0),
}

_WEBS = {
    "thumb_web": ("thumb", "index"),
    "index_middle_web": ("index", "middle"),
    "ring_little_web": ("ring", "little"),
}

_WRIST = {"wrist_thumb_side": 1.0, "wrist_little_side": -1.0}

_STEP_M = 2e-4
"""[m] step of the march to the skin (chosen)."""


def landmark_vertices(anatomy: Anatomy, vertices: Floats) -> dict[str, int]:
    """Vertex of each landmark among (V, 3) [m] of the spread hand."""
    places = landmark_places(anatomy)
    return {
        name: int(np.argmin(((vertices - place) ** 2).sum(axis=1)))
        for name, place in places.items()
    }


def landmark_places(anatomy: Anatomy) -> dict[str, Floats]:
    """(3,) [m] of each landmark on the spread hand."""
    fingers = {finger.name: finger for finger in anatomy.fingers}
    out = {}
    for name in _TIPS:
        tube = fingers[name].tube
        tip = tube.origin + fingers[name].joints[-1] * tube.frame[:, 1]
        out[f"{name}_tip"] = tip
    for landmark, (name, segment, share, side) in _ON_FINGERS.items():
        finger = fingers[name]
        start, stop = finger.joints[segment : segment + 2]
        at = finger.tube.origin
        at = at + (start + share * (stop - start)) * finger.tube.frame[:, 1]
        outwards = side * finger.tube.frame[:, 2]
        out[landmark] = _marched(anatomy, at + 0.04 * outwards, -outwards)
    for landmark, pair in _WEBS.items():
        ends = []
        for name in pair:
            tube, joints = fingers[name].tube, fingers[name].joints
            far = joints[2] if name == "thumb" else joints[1]
            ends.append(tube.origin + 0.9 * far * tube.frame[:, 1])
        ahead = fingers[pair[0]].tube.frame[:, 1] + fingers[pair[1]].tube.frame[:, 1]
        back = -ahead / np.linalg.norm(ahead)
        out[landmark] = _marched(anatomy, 0.5 * (ends[0] + ends[1]), back)
    for landmark, side in _WRIST.items():
        start = np.array([0.06 * side, 0.0, -0.003])
        out[landmark] = _marched(anatomy, start, np.array([-side, 0.0, 0.0]))
    return out


def _marched(anatomy: Anatomy, start: Floats, heading: Floats) -> Floats:
    """(3,) [m] where a line from outside meets the skin first."""
    line = start + np.arange(0.0, 0.08, _STEP_M)[:, None] * heading
    inside = anatomy.distance(line) < 0.0
    assert inside.any(), "a landmark's line should meet the skin"
    out: Floats = line[int(np.argmax(inside))]
    return out


def nails(anatomy: Anatomy, vertices: Floats) -> Bools:
    """(V,) which vertices of the spread hand lie on a nail."""
    out = np.zeros(len(vertices), dtype=bool)
    for finger in anatomy.fingers:
        x, y, z = finger.tube.local(vertices).T
        joint, tip = finger.joints[2:]
        share = (y - joint) / (tip - joint)
        narrow = np.abs(x) < 0.65 * finger.tube.half[-2]
        on = (share > 0.42) & (share < 0.88) & narrow & (z > 0.0)
        out |= on & (finger.tube.distance(vertices) < 2e-3)
    return out
