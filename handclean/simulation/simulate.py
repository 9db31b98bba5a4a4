"""Takes with known truth: the entry of the simulation.

A take is made in two steps: a scene (subject, motion, object) and its capture (skin,
cameras, noise, losses, ghosts, columns). Trial k of a seed is the same however many
trials are made, and a right hand's take is the mirror image of the left hand's.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.errors import UnknownNameError, UsageError
from handclean.hand.marker_set import MarkerSet, load_marker_set
from handclean.hand.subject import Subject
from handclean.recording import (
    Motion,
    Points,
    Recording,
    Trajectories,
    motion_from_poses,
    trajectories,
)
from handclean.simulation import cameras
from handclean.simulation.capture import Capture, capture, ghost_points
from handclean.simulation.exercises import free_scene, rom_scene
from handclean.simulation.grasping import grasp_scene
from handclean.simulation.grasps import GRASPS
from handclean.simulation.people import (
    Person,
    make_person,
    without_forearm,
)
from handclean.simulation.scan import Scan, make_scan
from handclean.simulation.scene import Scene, quaternions
from handclean.simulation.settings import SCENARIOS, SimulateConfig
from handclean.tree import MIRROR, JointTree, rigid_tree

_DURATION_S = {"grasp": 5.0, "rom": 24.0, "free": 10.0, "demo": 4.0}
"""[s] of a scenario's takes, where the settings do not say (chosen)."""

_SUBJECT, _TRIAL, _RIG = 1, 2, 3  # what a seed's streams of numbers are for
_SHAPE, _SCAN = 4, 5


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One take, raw, labelled and true.

    Attributes
    ----------
    name : such as "S02_007_tripod".
    unlabelled : what the system recorded, nothing named: points in columns.
    labelled : the same points under their true names, gaps as NaN; ghosts unlabelled.
    truth : every marker at its true place in every frame, the motion, the object.
    subject : the hand with its true bone lengths, axes and marker places.
    """

    name: str
    unlabelled: Recording
    labelled: Recording
    truth: Recording
    subject: Subject


def simulate(kind: str, settings: SimulateConfig) -> Iterator[Trial]:
    """Make the takes of a scenario, one after the other.

    Parameters
    ----------
    kind : of scenario; those with settings of their own, and those in files, have both
        from `handclean.simulation.scenarios`.

    Raises
    ------
    HandcleanError
        If the scenario, marker set or a grasp class is unknown.
    """
    for number in range(settings.trials):
        yield simulate_one(kind, settings, number)


def simulate_one(kind: str, settings: SimulateConfig, number: int) -> Trial:
    """Make the take of a number, from 0, whatever ``trials`` says.

    Raises
    ------
    HandcleanError
        If the scenario, marker set or a grasp class is unknown.
    """
    _expect_kind(kind)
    if kind in ("scan", "glove"):
        raise UsageError(f"scenario {kind}: makes no takes of markers")
    marker_set = load_marker_set(settings.marker_set)
    if marker_set.kind != "hand":
        raise UsageError(f"marker set {marker_set.name} is no hand's; name one that is")
    for name in settings.grasps:
        if name not in GRASPS:
            raise UnknownNameError("simulate", "grasp class", name, tuple(GRASPS))
    person = make_subject(number % settings.subjects, marker_set, settings)
    return make_trial(kind, number, person, marker_set, settings)


def _expect_kind(kind: str) -> None:
    if kind not in SCENARIOS:
        raise UnknownNameError("simulate", "scenario", kind, tuple(SCENARIOS))


def simulate_scan(kind: str, settings: SimulateConfig, number: int) -> Scan:
    """Scan the hand of the subject whose turn it is, from 0.

    Raises
    ------
    HandcleanError
        If the scenario or marker set is unknown.
    """
    _expect_kind(kind)
    marker_set = load_marker_set(settings.marker_set)
    subject = number % settings.subjects
    return make_scan(
        make_subject(subject, marker_set, settings),
        settings.side or marker_set.side or "right",
        settings,
        np.random.default_rng([settings.seed, _SHAPE, subject]),
        np.random.default_rng([settings.seed, _SCAN, number]),
    )


def make_subject(
    number: int, marker_set: MarkerSet, settings: SimulateConfig
) -> Person:
    """Subject of a number, the same for every scenario of a seed."""
    rng = np.random.default_rng([settings.seed, _SUBJECT, number])
    return make_person(f"S{number + 1:02d}", marker_set, rng, settings.slide)


def make_trial(
    kind: str,
    number: int,
    person: Person,
    marker_set: MarkerSet,
    settings: SimulateConfig,
) -> Trial:
    """Make the take of a number."""
    streams = np.random.SeedSequence([settings.seed, _TRIAL, number]).spawn(2)
    scene = _scene(kind, person, settings, np.random.default_rng(streams[0]))
    rig = cameras.make_rig(
        settings.cameras, np.random.default_rng([settings.seed, _RIG])
    )
    rng = np.random.default_rng(streams[1])
    side = settings.side or marker_set.side
    taken = capture(person, scene, rig, settings, rng)
    return _trial(
        f"{person.name}_{number + 1:03d}_{scene.title}",
        person,
        scene,
        taken,
        side,
        marker_set,
        settings,
    )


def _scene(
    kind: str, person: Person, settings: SimulateConfig, rng: np.random.Generator
) -> Scene:
    duration = settings.duration_s or _DURATION_S[kind]
    frames = max(round(duration * settings.rate_hz), 2)
    times = np.arange(frames) / settings.rate_hz
    if kind == "rom":
        return rom_scene(person, times, rng)
    if kind == "free":
        return free_scene(person, times, rng)
    return grasp_scene(person, times, settings.grasps, rng)


def _trial(
    name: str,
    person: Person,
    scene: Scene,
    taken: Capture,
    side: str,
    marker_set: MarkerSet,
    settings: SimulateConfig,
) -> Trial:
    mirror = MIRROR if side == "right" else np.ones(3)
    left = person.tree if marker_set.forearm else without_forearm(person.tree)
    tree = left if side == "left" else left.mirrored()
    hidden = ghost_points(taken)
    hidden = replace(hidden, positions=hidden.positions * mirror)
    named = trajectories(
        taken.points * mirror,
        marker_set.labels,
        model=(side,) * len(marker_set.labels),
        source=taken.columns.marker,
        confidence=np.isfinite(taken.points[:, :, 0]).astype(np.float32),
    )
    whole = trajectories(
        taken.markers * mirror,
        marker_set.labels,
        model=(side,) * len(marker_set.labels),
    )
    take = Recording(
        rate=settings.rate_hz, frames=len(scene.times), first_frame=1, up_axis="+z"
    )
    motions, skeletons = _motions(scene, tree, side)
    subject = Subject(
        name=person.name,
        model=replace(person.markers, tree=tree, at=person.markers.at * mirror),
        marker_set=marker_set.name,
        marker_sigma=np.full(len(marker_set.labels), settings.noise_m),
    )
    return Trial(
        name=name,
        unlabelled=replace(take, unlabelled=_all_points(named, hidden)),
        labelled=replace(take, markers=named, unlabelled=hidden, events=scene.events),
        truth=replace(
            take,
            markers=whole,
            motions=motions,
            skeletons=skeletons,
            events=scene.events,
        ),
        subject=subject,
    )


def _all_points(named: Trajectories, hidden: Points) -> Points:
    """Markers and ghosts together, sorted by frame and column."""
    assert named.source is not None
    frame, marker = np.nonzero(named.measured)
    frames = np.concatenate([frame.astype(np.int32), hidden.frame])
    source = np.concatenate([named.source[frame, marker], hidden.source])
    places = np.concatenate([named.positions[frame, marker], hidden.positions])
    order = np.lexsort((source, frames))
    return Points(frame=frames[order], source=source[order], positions=places[order])


def _motions(
    scene: Scene, tree: JointTree, side: str
) -> tuple[dict[str, Motion], dict[str, JointTree]]:
    """The hand's motion and the object's, mirrored for a right hand."""
    poses = scene.poses[:, : 7 + len(tree.hinges)].copy()
    if side == "right":
        poses[:, 0] *= -1.0
        poses[:, 5:7] *= -1.0
    motions = {side: motion_from_poses(tree.hinges, poses)}
    skeletons = {side: tree}
    for body in scene.bodies:
        if body.name == "object":
            frames = body.frames
            if side == "right":
                frames = MIRROR[:, None] * frames * np.array([-1.0, 1.0, 1.0, 1.0])
            motions["object"] = _object_motion(frames)
            skeletons["object"] = rigid_tree(scene.title)
    return motions, skeletons


def _object_motion(frames: Floats) -> Motion:
    """Motion of a rigid thing from (T, 3, 4) frames."""
    turns = Rotation.from_matrix(frames[:, :, :3])
    return Motion(
        names=(),
        angles=np.zeros((len(frames), 0)),
        translation=frames[:, :, 3].copy(),
        rotation=quaternions(turns),
    )
