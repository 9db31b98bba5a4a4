"""Subjects: hands that differ from the template and from each other in every number.

Length and breadth follow Greiner (1991), see ``handclean.hand.template``, men and
women in equal shares. On top, each segment has a length of its own, each knuckle a
place, each hinge axis points a few degrees elsewhere, and markers were glued on by
eye, so that no scaling of the template reaches the subject.

Skin. Bending a joint draws the skin over its back towards it from both sides: a marker
at a distance d from the joint slides by a exp(-d / 15 mm) per quarter turn, with a of
1 to 3 mm, a little askew. Markers over the ring and little knuckles sink as well, when
those fingers bend and the palm hollows (the hand's bones being one rigid body here).
"""

from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model, bone_rotations, marker_positions
from handclean.hand.skinning import OnSkin, lifted
from handclean.hand.surface import Surface, rest_joints
from handclean.hand.template import FINGERS, bone_frame, distal_length, template
from handclean.hand.template_surface import template_surface
from handclean.numerics.rotations import rotated
from handclean.numerics.triangles import closest
from handclean.simulation.flesh import Flesh, clothe
from handclean.tree import JointTree

_LENGTH_M = {"men": (0.1938, 0.0100), "women": (0.1805, 0.0091)}
"""[m] mean and standard deviation of hand length (Greiner 1991)."""

_BREADTH_M = {"men": (0.0904, 0.0042), "women": (0.0794, 0.0038)}
"""[m] the same of hand breadth (Greiner 1991)."""

_SIZE_CORRELATION = 0.55
"""[-] correlation of hand length and breadth within a sex (chosen)."""

_SLIDING_REACH_M = 0.015
"""[m] how far from a joint its skin slides (chosen)."""

_SINKING_M = {"ring": 0.8e-3, "little": 1.6e-3}
"""[m] by which markers over these knuckles sink per quarter turn of the knuckle
(chosen)."""

_LIFT_M, _LIFT_SD_M = 0.0040, 0.0004
"""[m] a marker's radius and what it is glued on with (chosen)."""

_HOLDER_HEIGHT_M = 0.007
"""[m] a set's marker this high over the skin sits on a glove or a holder (chosen)."""

_FOREARM_CLEARANCE_M = 0.0026
"""[m] least distance of a forearm marker's centre from the skin (chosen)."""


@dataclass(frozen=True, kw_only=True)
class Person:
    """A subject's left hand (the right is its mirror image) with a forearm.

    Attributes
    ----------
    name : who.
    tree : left hand with forearm; its limits are the template's.
    reach : (D, 2) [rad] how far this person's joints go, within the limits.
    habit : (D,) [rad] how this person's postures deviate from everybody's.
    tempo : durations against the average.
    flesh : the hand's and the forearm's capsules, which touch objects.
    surface : the hand's skin, coarse, which hides markers.
    tips : [m] length of each finger's last segment.
    markers : the markers as glued on, in the zero posture.
    skin : (M, D, 3) [m/rad] how each marker slides, in its bone's frame.
    """

    name: str
    tree: JointTree
    reach: Floats
    habit: Floats
    tempo: float
    flesh: Flesh
    surface: Surface
    tips: dict[str, float]
    markers: Model
    skin: Floats


def make_person(
    name: str, marker_set: MarkerSet, rng: np.random.Generator, slide: float = 1.0
) -> Person:
    """Draw a subject with a marker set.

    Parameters
    ----------
    slide : strength of skin sliding, 1 as on living hands, 0 none.
    """
    tree, ratio = _draw_tree(name, rng)
    tips = {
        finger: distal_length(tree, finger) * rng.lognormal(0.0, 0.05)
        for finger in FINGERS
    }
    plump = rng.lognormal(0.0, 0.05)
    flesh = clothe(tree, tips, tree.scale * plump)
    surface = template_surface(tree, coarse=True, plump=plump, tips=tips)
    markers = _glue(tree, marker_set, ratio, tips, flesh, surface, rng)
    middle = tree.limits.mean(axis=1, keepdims=True)
    reach = middle + (tree.limits - middle) * rng.uniform(0.86, 0.98, tree.limits.shape)
    return Person(
        name=name,
        tree=tree,
        reach=reach,
        habit=np.radians(_habit(tree, rng)),
        tempo=float(rng.lognormal(0.0, 0.1)),
        flesh=flesh,
        surface=surface,
        tips=tips,
        markers=markers,
        skin=slide * _draw_skin(tree, markers, tips, rng),
    )


def _habit(tree: JointTree, rng: np.random.Generator) -> Floats:
    """(D,) [degrees] deviation of a person's postures; abduction varies less."""
    spread = [2.0 if name.endswith("mcp_abduction") else 4.5 for name in tree.hinges]
    return rng.normal(0.0, spread)


def _draw_tree(
    name: str, rng: np.random.Generator
) -> tuple[JointTree, dict[str, float]]:
    """Draw a joint tree and how much longer than scaled each bone turned out."""
    sex = "men" if rng.random() < 0.5 else "women"
    one, two = rng.normal(size=2)
    two = _SIZE_CORRELATION * one + np.sqrt(1.0 - _SIZE_CORRELATION**2) * two
    length = _LENGTH_M[sex][0] + _LENGTH_M[sex][1] * np.clip(one, -2.2, 2.2)
    breadth = _BREADTH_M[sex][0] + _BREADTH_M[sex][1] * np.clip(two, -2.2, 2.2)
    tree = template("left", length, breadth, forearm=True, subject=name)
    offsets, ratio = tree.offsets.copy(), dict.fromkeys(tree.bones, 1.0)
    for b, bone in enumerate(tree.bones):
        if b == 0 or bone == "forearm":
            continue
        factor = rng.lognormal(0.0, 0.035)
        offsets[b] *= factor
        if tree.parents[b] == 0:
            offsets[b] += rng.normal(0.0, 0.0015, 3)
        else:
            ratio[tree.bones[tree.parents[b]]] = factor
    axes = tree.axes + rng.normal(0.0, np.radians(2.5), tree.axes.shape)
    fixed = tree.hinge_bone == tree.bone("hand")
    axes[fixed] = tree.axes[fixed]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return replace(tree, offsets=offsets, axes=axes), ratio


def _glue(
    tree: JointTree,
    marker_set: MarkerSet,
    ratio: dict[str, float],
    tips: dict[str, float],
    flesh: Flesh,
    surface: Surface,
    rng: np.random.Generator,
) -> Model:
    """Stick the markers on, off by some millimetres but always on the skin."""
    model = marker_set.on(tree)
    at = model.at.copy()
    for m, bone in enumerate(marker_set.bones):
        frame = bone_frame(bone)
        place = frame.T @ at[m]
        finger = bone.split("_")[0]
        if bone.endswith("distal"):
            place[1] *= tips[finger] / distal_length(tree, finger)
        else:
            place[1] *= ratio[bone]
        spread = 0.0015 if bone.endswith("distal") else 0.0020
        place[:2] += np.clip(rng.normal(0.0, spread, 2), -2.5 * spread, 2.5 * spread)
        lift = _LIFT_M + np.clip(rng.normal(0.0, _LIFT_SD_M), -2.0 * _LIFT_SD_M, None)
        b = tree.bone(bone)
        if bone == "forearm":
            at[m] = _on_capsules(place, flesh, b)
        else:
            at[m] = _on_skin(frame @ place, tree, b, surface, lift)
    return replace(model, at=at)


def _on_skin(
    place: Floats, tree: JointTree, bone: int, surface: Surface, lift: float
) -> Floats:
    """(3,) [m] where a marker ends up that is pressed on a bone's skin at a place.

    One that a glove or a holder keeps off the skin keeps its distance.
    """
    joint = rest_joints(tree)[bone]
    moved = ((surface.bones == bone) & (surface.weights > 0.0)).any(axis=1)
    own = np.flatnonzero(moved[surface.faces].any(axis=1))
    foot = closest(surface.vertices, surface.faces[own], (joint + place)[None])
    off = np.where(foot.distance > _HOLDER_HEIGHT_M, foot.distance, lift)
    on = OnSkin(face=own[foot.face], share=foot.share, lift=off)
    at: Floats = lifted(surface.vertices, surface.faces, on)[0] - joint
    return at


def _on_capsules(place: Floats, flesh: Flesh, bone: int) -> Floats:
    """(3,) [m] a place on a bone, raised until it is outside the bone's capsules."""
    own = np.flatnonzero(flesh.bone == bone)
    starts, stops = (flesh.ends.at[rows] for rows in (own, len(flesh.bone) + own))
    while _depth(place, starts, stops, flesh.radius[own]) < _FOREARM_CLEARANCE_M:
        place = place + np.array([0.0, 0.0, 0.0002])
    return place


def _depth(point: Floats, starts: Floats, stops: Floats, radius: Floats) -> float:
    """[m] How far a point is outside the nearest of some capsules."""
    if not len(radius):
        return np.inf
    along = stops - starts
    size = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((point - starts) * along).sum(axis=1) / size, 0.0, 1.0)
    foot = starts + share[:, None] * along
    return float((np.linalg.norm(point - foot, axis=1) - radius).min())


def _draw_skin(
    tree: JointTree, markers: Model, tips: dict[str, float], rng: np.random.Generator
) -> Floats:
    """(M, D, 3) [m/rad] sliding of each marker with each hinge."""
    skin = np.zeros((len(markers.labels), len(tree.hinges), 3))
    quarter = np.pi / 2
    for m, b in enumerate(markers.bone):
        amount = rng.uniform(0.001, 0.003) / quarter
        for d, hinge in enumerate(tree.hinges):
            joint = tree.hinge_bone[d]
            near = joint == b or tree.parents[joint] == b
            if not near or not hinge.endswith("flexion") or joint == 0:
                continue
            here = np.zeros(3) if joint == b else tree.offsets[joint]
            frame = bone_frame(tree.bones[joint])
            towards = frame[:, 1] * (-1.0 if joint == b else 1.0)
            askew = towards + rng.normal(0.0, 0.2, 3)
            away = markers.at[m] - here
            # along the skin, the height above the joint does not count
            away = away - frame[:, 2] * (frame[:, 2] @ away)
            fade = np.exp(-float(np.linalg.norm(away)) / _SLIDING_REACH_M)
            skin[m, d] = amount * fade * askew
            finger = hinge.split("_")[0]
            if tree.bones[b] == "hand" and finger in _SINKING_M:
                sink = np.exp(-float(np.linalg.norm(away)) / 0.02)
                skin[m, d, 2] -= _SINKING_M[finger] / quarter * sink
    return skin


def true_markers(person: Person, poses: Floats) -> Floats:
    """(T, M, 3) [m] where the markers are, skin and all, in (T, 7 + D) poses."""
    bones = person.markers.bone
    slid = np.einsum("td,mdi->tmi", poses[:, 7:], person.skin)
    turns = bone_rotations(person.tree, poses)[:, bones]
    places = marker_positions(person.markers, poses)
    out: Floats = places + rotated(turns, slid)
    return out


def without_forearm(tree: JointTree) -> JointTree:
    """Return the tree without its forearm and the wrist's two hinges."""
    last = len(tree.bones) - 1
    kept = tree.hinge_bone != last
    return replace(
        tree,
        bones=tree.bones[:-1],
        joints=tree.joints[:-1],
        parents=tree.parents[:-1],
        offsets=tree.offsets[:-1],
        hinges=tuple(np.array(tree.hinges)[kept].tolist()),
        hinge_bone=tree.hinge_bone[kept],
        axes=tree.axes[kept],
        limits=tree.limits[kept],
    )
