"""Compile every kernel and cache it, by doing a little of everything once.

numba compiles a kernel for the types it is called with, so this goes the way the
commands go, on a short simulated take. A kernel that no part reaches would compile when
a command first needs it; a test forbids that.

Labelling takes most of the time, and goes one way: find, follow, repair, review. Its
parts are set out by hand, so that processes can do them side by side.
"""

import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handclean.commands.shared.formats import FORMATS
from handclean.commands.shared.warming import FOR
from handclean.errors import HandcleanError
from handclean.gaps.fill import fill
from handclean.hand import model
from handclean.hand.marker_set import load_marker_set
from handclean.hand.skinning import (
    posed,
    project,
    skin_jacobian,
    skin_places,
    unposed,
    vertex_jacobian,
)
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.ik.settings import SolveConfig
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.kernels import cache_directory
from handclean.labels.label import label
from handclean.labels.points import Cloud, cloud_of
from handclean.labels.review.paths import Glance, Paths, paths_of
from handclean.labels.review.review import Scene
from handclean.labels.review.suppose import measured
from handclean.labels.settings import LabelConfig
from handclean.labels.target import TrackTarget, make_target
from handclean.labels.track.frames import track_frames
from handclean.labels.track.links import path_links
from handclean.labels.track.state import (
    FrameSequence,
    TrackResult,
    empty_result,
    new_state,
    start_stats,
)
from handclean.labels.track.tracker import (
    Tracker,
    TrackSetup,
    make_tracker,
    track_setup,
)
from handclean.labels.track_take import find_first_fit
from handclean.layouts.feasible import feasible
from handclean.layouts.optimize import SEARCHES, optimize
from handclean.layouts.problem import make_problem, on_bones
from handclean.layouts.settings import LayoutConfig
from handclean.runner.batch import Source, Task
from handclean.runner.command import Command, Work
from handclean.runner.workers import in_workers
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import Trial, simulate
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig


def compiling() -> str:
    """Say that kernels are compiled."""
    return "compiling kernels, which takes a minute or two ..."


WARM = Command(
    name="warm",
    step="handclean.commands.warm",
    formats=FORMATS,
    compiling=compiling,
)
"""What a process does of ``warm``."""

TAKE = SimulateConfig(duration_s=1.0, rate_hz=100.0, dropouts_per_s=0.5)
EXERCISE = SimulateConfig(duration_s=21.0, rate_hz=25.0)


def trial(scenario: str, settings: SimulateConfig) -> Trial:
    """Simulate a take."""
    return next(iter(simulate(scenario, settings)))


def hand() -> None:
    """Place joints, bones and markers of a hand."""
    subject = trial("demo", TAKE).subject.model
    poses = np.tile(model.neutral_pose(subject.tree), (2, 1))
    model.joint_positions(subject.tree, poses)
    model.bone_rotations(subject.tree, poses)
    model.marker_positions(subject, poses)
    model.jacobian(subject, poses[0])
    model.moved(poses[0], np.zeros(subject.tree.dofs))


def chain() -> None:
    """Label, fill and solve a take, with and without a prior."""
    made = trial("demo", TAKE)
    labelled, _ = label(made.unlabelled, made.subject, prior=read_prior())
    for prior in (read_prior(), None):
        fill(labelled, made.subject, prior=prior)
        solve(labelled, made.subject, prior=prior)


def calibration() -> None:
    """Learn a hand."""
    made = trial("rom", EXERCISE)
    markers = load_marker_set(EXERCISE.marker_set)
    calibrate([made.labelled], markers, replace(CalibrateConfig(), frames=20))


@dataclass(frozen=True, kw_only=True)
class Bench:
    """What labelling a take needs, set out by hand, and what it finds."""

    cloud: Cloud
    target: TrackTarget
    setup: TrackSetup
    sequence: FrameSequence
    tracker: Tracker
    result: TrackResult
    paths: Paths


def bench() -> Bench:
    """Set out a take of which nothing is known yet."""
    made = trial("demo", TAKE)
    cloud = cloud_of(made.unlabelled)
    target = make_target(made.subject, read_prior(), "")
    setup = track_setup(LabelConfig(), SolveConfig(), made.unlabelled.rate)
    result = empty_result(cloud.frames, len(target.sigma), len(target.mean))
    after, before = path_links(cloud, LabelConfig(), made.unlabelled.rate)
    return Bench(
        cloud=cloud,
        target=target,
        setup=setup,
        sequence=FrameSequence(cloud.at, cloud.start, before),
        tracker=make_tracker(target, setup),
        result=result,
        paths=paths_of(cloud, after, before, result),
    )


def following() -> None:
    """Find a hand, and follow it for a few frames."""
    on = bench()
    found = find_first_fit(on.cloud, on.target, on.setup)
    assert found is not None
    state = new_state(len(found.target.sigma), len(found.target.mean))
    state.pose[:] = found.pose
    unseen = (found.chosen < 0).astype(np.int64)
    stats = start_stats(found.target, on.setup.rules, unseen)
    first, stop = found.frame, min(found.frame + 3, on.cloud.frames)
    track_frames(on.sequence, first, stop, 1, state, stats, on.tracker, on.result)


def solving() -> None:
    """Solve and fill a take whose labels are known."""
    made = trial("demo", TAKE)
    solve(made.labelled, made.subject, prior=read_prior())
    fill(made.labelled, made.subject, prior=read_prior())


def layouts() -> None:
    """Place a few markers for a short motion, in every way that searches."""
    motion = trial("demo", TAKE).truth.motions["right"]
    tree = template("left")
    surface = template_surface(tree, coarse=True)
    few = LayoutConfig(keyframes=3, visibility=1.0, particles=20, iterations=5)
    model = on_bones(surface, tree, feasible(surface, tree, few))
    problem = make_problem(model, [motion.angles], motion.names, few, surface=surface)
    for method in SEARCHES:
        settings = replace(few, method=method)
        optimize(problem, settings, np.random.default_rng(0))


def skin() -> None:
    """Bend a hand's skin, and ask what is near it and where markers ride on it."""
    tree = template("left")
    surface = template_surface(tree, coarse=True)
    pose = model.neutral_pose(tree)
    places = posed(surface, tree, pose[None])[0]
    unposed(surface, tree, pose, places)
    on = project(surface, places, 1.02 * places[:4])
    skin_places(surface, tree, on, pose[None])
    skin_jacobian(surface, tree, on, pose)
    vertex_jacobian(surface, tree, pose)


def reviewing() -> None:
    """Judge a path of a take in which nothing has been followed yet."""
    on = bench()
    state = new_state(len(on.target.sigma), len(on.target.mean))
    places, _ = measured(on.sequence, on.tracker, on.result)
    scene = Scene(on.paths, on.sequence, state, on.tracker, on.result, places)
    nowhere = Glance(np.full(1, -1), np.zeros(1, dtype=np.int64))
    scene.judge(nowhere, -1)


PARTS: Mapping[str, Callable[[], None]] = {
    "following": following,
    "solving": solving,
    "calibration": calibration,
    "hand": hand,
    "layouts": layouts,
    "reviewing": reviewing,
    "skin": skin,
    "chain": chain,
}
"""What is warmed, the longest first; the last part is whole commands, for what the
others leave. Of what two processes need, one compiles it and the other waits for it."""


def kernels() -> Iterator[Any]:
    """Yield every kernel of the modules that are loaded."""
    seen = set()
    for name, module in sorted(sys.modules.items()):
        if not name.startswith("handclean."):
            continue
        for thing in vars(module).values():
            if hasattr(thing, "nopython_signatures") and thing not in seen:
                seen.add(thing)
                yield thing


def warm(
    jobs: int = 1,
    tell: Callable[[str], None] = lambda text: None,
    commands: Collection[str] = (),
) -> dict[str, Any]:
    """Do every part; return how many kernels were compiled and how many loaded.

    Parameters
    ----------
    jobs : processes to begin with.
    tell : told of each part that is done, where kernels were compiled for it.
    commands : do only the parts that these of `FOR` need; all, if there are none.

    Raises
    ------
    HandcleanError
        If one of these processes fails.
    """
    needed = {part for command in commands for part in FOR[command]} or set(PARTS)
    parts = [part for part in PARTS if part in needed]
    compiled = 0
    if jobs > 1:
        compiled += _side_by_side(parts, jobs, tell)
        parts = parts[-1:]
    for part in parts:
        PARTS[part]()
    hits, misses = counts()
    return {
        "compiled": compiled + misses,
        "loaded": max(hits - compiled, 0),
        "cache": str(cache_directory()),
    }


def counts() -> tuple[int, int]:
    """Count the kernels that this process loaded, and those it compiled."""
    stats = [kernel.stats for kernel in kernels()]
    return (
        sum(sum(s.cache_hits.values()) for s in stats),
        sum(sum(s.cache_misses.values()) for s in stats),
    )


def _side_by_side(parts: Sequence[str], jobs: int, tell: Callable[[str], None]) -> int:
    """Do parts but the last, in processes; return how many kernels compiled."""
    sources = [Source(path=Path(part), is_file=False) for part in parts[:-1]]
    tasks = [Task(sources=(source,)) for source in sources]
    compiled, done = 0, 0
    with closing(in_workers(Work(command=WARM), tasks, jobs, lambda: True)) as ended:
        for index, report in ended:
            if report.status == "failed":
                raise HandcleanError(report.error)
            done += 1
            if report.figures["compiled"]:
                compiled += report.figures["compiled"]
                tell(f"{done} of {len(parts)}: {parts[index]}, {report.line}")
    return compiled
