"""A reduced marker layout for a motion."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.commands.shared import hands, motions
from handclean.commands.shared.choices import LayingOut
from handclean.commands.shared.layout_hand import LayoutHand, hand_of_layout
from handclean.commands.shared.layout_set import marker_set_of, writers_of
from handclean.commands.shared.take_options import options_of
from handclean.errors import FileError, UnknownSettingError, UsageError
from handclean.hand.marker_set import MarkerSet, load_marker_set, shipped
from handclean.hand.model import Model
from handclean.hand.surface import Surface
from handclean.io.mesh.meshes import read_mesh
from handclean.labels.settings import LEAST_MARKERS
from handclean.layouts.choose import choose
from handclean.layouts.feasible import counts, feasible
from handclean.layouts.optimize import Layout, optimize
from handclean.layouts.problem import Problem, make_problem, on_bones, subspace_of
from handclean.remarks import Remark, remark
from handclean.runner import progress
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome
from handclean.tree import JointTree

FIGURES = {
    "method": "how it was found",
    "takes": "motions it is for",
    "frames": "their frames in which all angles are known and trusted",
    "keyframes": "postures of them that count",
    "unknowns": "of the posture: directions or angles, the hand's rotation, and its "
    "place without an anchor",
    "candidates": "places to choose from on each bone",
    "markers": "markers of the layout",
    "labels": "their names",
    "bones": "the bones they sit on",
    "vertices": "vertices of the skin they sit on; of a set, its markers' names",
    "energy": "what was minimised",
    "condition": "mean condition number over the keyframes",
    "distance": "minus the smallest distance, squared, in hand lengths",
    "hidden": "share of keyframes and directions in which a marker is not seen",
    "weights": "of these three in the energy",
    "kappa": "condition number in each keyframe",
    "smallest_mm": "smallest distance of two markers in any keyframe",
    "weighed": "layouts that were weighed",
    "history": "layouts weighed and least energy so far, after each step",
    "stopped": "why the search ended",
    "tried_mm": "with --by-error: by directions tried, mean error of the skin",
}

_LEAST_RED, _MOST_OTHER = 128, 80
"""[of 255] painted is what has more red and less green and blue (chosen)."""


def optimize_layout(sources: tuple[Source, ...], settings: LayingOut) -> Outcome:
    """Find the markers that tell a motion best."""
    odd: list[Remark] = []
    progress.tell("reading motion")
    taken = [motion for source in sources for motion in motions.read(source, odd)]
    hand = hand_of_layout(sources[0], [motion.side for motion in taken])
    names = motions.common(taken, hand.tree)
    takes = _angles(sources[0], settings, taken, names)
    given = _glued(settings, hand.tree) if settings.from_set else None
    model = _candidates(sources[0], settings, hand, given)
    try:
        problem, found, errors = _found(sources[0], settings, hand, model, takes, names)
    finally:
        progress.done()
    source = (
        f"handclean optimize-layout, {settings.layout.method} on {len(takes)} motions, "
        f"{sources[0].path.name} the first of them"
    )
    markers = marker_set_of(found, problem, hand, given, settings, source)
    return Outcome(
        line=_in_words(found),
        details=_in_rows(found, markers.labels),
        figures={
            "takes": len(takes),
            "frames": motions.known(takes),
            **_figures(found, problem, markers.labels),
            **({"tried_mm": errors} if errors else {}),
        },
        remarks=(
            *odd,
            *motions.left_out(taken),
            *_doubts(found, settings),
        ),
        writers=writers_of(markers, found, hand, settings),
    )


def _angles(
    source: Source,
    settings: LayingOut,
    taken: Sequence[motions.HandMotion],
    names: tuple[str, ...],
) -> list[Floats]:
    """(T, D) [rad] angles of takes that know some, enough for what is learnt."""
    takes = [motions.angles(motion, names) for motion in taken]
    learns = "prior" not in source.files and not settings.layout.full
    what = f"a subspace of {len(names)} angles" if learns else "a layout"
    motions.expect_enough(takes, len(names) + 1 if learns else 1, what)
    return [take for take in takes if motions.known([take])]


def _candidates(
    source: Source, settings: LayingOut, hand: LayoutHand, given: MarkerSet | None
) -> Model:
    """The markers to choose from: those of a set, or on all of the skin."""
    if given is not None:
        return given.on(hand.tree)
    mask = _unpainted(source, hand.surface)
    places = feasible(hand.surface, hand.tree, settings.layout, mask)
    return on_bones(hand.surface, hand.tree, places)


def _doubts(found: Layout, settings: LayingOut) -> tuple[Remark, ...]:
    """Say what nobody could use of a layout."""
    remarks: list[Remark] = []
    count, least = len(found.chosen), LEAST_MARKERS
    if count < least:
        remarks.append(
            remark(
                "layout",
                f"{count} markers can be solved but not labelled: 'label' and 'clean' "
                f"need {least} at least",
                markers=count,
            )
        )
    apart = 1e3 * found.smallest_m
    if apart < settings.marker_mm:
        remarks.append(
            remark(
                "layout",
                f"two markers come to {apart:.1f} mm of each other, centre to centre, "
                f"and are {settings.marker_mm:g} mm wide: they touch; take fewer than "
                f"{count}",
                apart_mm=apart,
            )
        )
    return tuple(remarks)


def _found(
    source: Source,
    settings: LayingOut,
    hand: LayoutHand,
    model: Model,
    takes: Sequence[Floats],
    names: tuple[str, ...],
) -> tuple[Problem, Layout, dict[str, float]]:
    """The layout, and mean errors [mm] by directions where several were tried."""
    prior = None
    if "prior" in source.files:
        prior = hands.prior(source)
    elif not settings.layout.full:  # first, as it names joints that never move
        prior = subspace_of(takes, names, settings.layout)
    if settings.by_error:

        def told(directions: int, error: float) -> None:
            progress.tell(f"{directions} directions: {1e3 * error:.2f} mm")

        given = prior if "prior" in source.files else None
        problem, found, errors = choose(
            model,
            hand.surface,
            takes,
            names,
            settings.layout,
            source.seed,
            prior=given,
            told=told,
        )
        return problem, found, {str(n): 1e3 * e for n, e in errors.items()}

    def watch(weighed: int, energy: float) -> None:
        progress.tell(f"{weighed} layouts, energy {energy:.4g}")

    problem = make_problem(
        model, takes, names, settings.layout, prior=prior, surface=hand.surface
    )
    rng = np.random.default_rng(source.seed)
    return problem, optimize(problem, settings.layout, rng, watch=watch), {}


def _glued(settings: LayingOut, tree: JointTree) -> MarkerSet:
    """The set whose markers are to choose from, without those on the forearm."""
    name = settings.from_set
    if not name.endswith(".toml") and name not in shipped():
        raise UnknownSettingError("--from-set", "marker set", name, shipped())
    found = load_marker_set(name)
    if found.kind != "hand":
        raise UsageError(f"--from-set {name}: is for a rigid object, not a hand")
    kept = [
        n
        for n, bone in enumerate(found.bones)
        if bone != "forearm" and bone not in settings.layout.without_bones
    ]
    return MarkerSet(
        name=found.name,
        source=found.source,
        kind=found.kind,
        side=tree.side,
        labels=tuple(found.labels[n] for n in kept),
        bones=tuple(found.bones[n] for n in kept),
        at=found.at[kept],
    )


def _unpainted(source: Source, surface: Surface) -> Bools | None:
    """(V,) vertices that nobody painted red."""
    path = source.files.get("painted")
    if path is None:
        return None
    mesh = read_mesh(path, unit=options_of(source).unit)
    if mesh.colors is None:
        raise FileError(path, "has no colors", "paint its vertices")
    if len(mesh.vertices) != len(surface.vertices):
        raise FileError(
            path,
            f"has {len(mesh.vertices)} vertices",
            f"the hand's skin has {len(surface.vertices)}; 'handclean convert' writes "
            "that of a subject",
        )
    red, other = mesh.colors[:, 0], mesh.colors[:, 1:].max(axis=1)
    return np.asarray((red <= _LEAST_RED) | (other >= _MOST_OTHER))


def _figures(
    found: Layout, problem: Problem, labels: tuple[str, ...]
) -> dict[str, Any]:
    tree = problem.model.tree
    return {
        "method": found.method,
        "keyframes": len(problem.places),
        "unknowns": len(problem.columns),
        "candidates": counts(tree, problem.model.bone),
        "markers": len(found.chosen),
        "labels": list(labels),
        "bones": list(found.bones),
        "vertices": [int(x) if x.isdecimal() else x for x in found.labels],
        "energy": _known(found.energy),
        "condition": _known(found.condition),
        "distance": _known(found.distance),
        "hidden": found.hidden,
        "weights": list(found.weights),
        "kappa": [_known(x) for x in found.kappa.tolist()],
        "smallest_mm": _known(1e3 * found.smallest_m),
        "weighed": found.weighed,
        "history": [[int(n), _known(e)] for n, e in found.history.tolist()],
        "stopped": found.stopped,
    }


def _known(value: float) -> float | None:
    """A number, or nothing where it is infinite."""
    return float(value) if np.isfinite(value) else None


def _in_words(found: Layout) -> str:
    condition = f"{found.condition:.1f}" if np.isfinite(found.condition) else "infinite"
    words = f"{len(found.chosen)} markers, condition number {condition}"
    if np.isfinite(found.smallest_m):
        words += f", {1e3 * found.smallest_m:.0f} mm apart at least"
    return f"{words}: {', '.join(found.bones)}"


def _in_rows(found: Layout, labels: Sequence[str]) -> str:
    wide = max(map(len, labels))
    return "\n".join(
        f"{n:3}  {label:<{wide}}  {bone}"
        for n, (label, bone) in enumerate(zip(labels, found.bones, strict=True), 1)
    )
