"""How well layouts tell a motion: simulated, solved, compared."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.commands.shared import hands, motions
from handclean.commands.shared.choices import JudgingLayouts
from handclean.commands.shared.layout_hand import LayoutHand, hand_of_layout
from handclean.commands.shared.take_options import TakeOptions, options_of
from handclean.errors import UsageError
from handclean.hand.marker_set import MarkerSet, load_marker_set
from handclean.layouts.evaluate import Errors, evaluate
from handclean.remarks import Remark
from handclean.runner import progress
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "takes": "motions the layouts are judged on",
    "frames": "their frames in which all angles are known and trusted",
    "anchor": "whether the wrist's place was known",
    "layouts": "errors of each: standard and subspace inverse kinematics, mean and "
    "largest distance of vertices of all skin and of the fingers' [mm], mean "
    "difference of joint angles [degrees], milliseconds of processor time a frame",
    "best": "the layout with the least mean error",
    "mean_mm": "its mean error with the subspace",
    "max_mm": "its largest error with the subspace",
}

_KINDS = ("standard", "subspace")


def evaluate_layout(sources: tuple[Source, ...], settings: JudgingLayouts) -> Outcome:
    """Judge layouts on motion they were not made for."""
    odd: list[Remark] = []
    given = [path for role, path in sources[0].files.items() if role.startswith("on ")]
    progress.tell("reading motion")
    options = options_of(sources[0])
    said = TakeOptions(rate_hz=options.rate_hz, unit=options.unit)
    taken = [
        motion
        for path in given
        for motion in motions.read(Source(path=path, given=said), odd)
    ]
    sets = _hand_sets(sources)
    forearm = any(markers.forearm for markers in sets.values())
    hand = hand_of_layout(
        sources[0], [motion.side for motion in taken], forearm=forearm
    )
    motions.common(taken, hand.tree)
    poses = [motions.on_tree(motion, hand.tree) for motion in taken]
    poses = [part for part in poses if len(part)]
    motions.expect_enough(poses, 1, "judging a layout")
    try:
        found = _evaluated(sources[0], settings, sets, hand, poses)
    finally:
        progress.done()
    best = min(found, key=lambda name: found[name]["subspace"].mean_m)
    counts = {name: len(markers.labels) for name, markers in sets.items()}
    return Outcome(
        line=_line(found, best),
        details=_in_text(found, counts),
        figures={
            "takes": len(poses),
            "frames": sum(map(len, poses)),
            "anchor": settings.anchor,
            **_figures_of_all(found, best, counts),
        },
        remarks=(*odd, *motions.left_out(taken)),
    )


def _figures_of_all(
    found: Mapping[str, Mapping[str, Errors]], best: str, counts: Mapping[str, int]
) -> dict[str, Any]:
    """Figures of all layouts, and of the best one."""
    return {
        "layouts": {
            name: {
                "markers": counts[name],
                **{kind: _figures(errors) for kind, errors in kinds.items()},
            }
            for name, kinds in found.items()
        },
        "best": best,
        "mean_mm": 1e3 * found[best]["subspace"].mean_m,
        "max_mm": 1e3 * found[best]["subspace"].max_m,
    }


def _hand_sets(sources: Sequence[Source]) -> dict[str, MarkerSet]:
    """Load the layouts, marker sets of a hand, by their names."""
    sets = {source.name: load_marker_set(source.path) for source in sources}
    for name, markers in sets.items():
        if markers.kind != "hand":
            raise UsageError("is for a rigid object, not a hand", where=Path(name))
    return sets


def _evaluated(
    source: Source,
    settings: JudgingLayouts,
    sets: Mapping[str, MarkerSet],
    hand: LayoutHand,
    poses: Sequence[Floats],
) -> dict[str, dict[str, Errors]]:
    """Errors of each layout with each kind of inverse kinematics."""
    prior = hands.prior(source)
    found: dict[str, dict[str, Errors]] = {}
    for name, markers in sets.items():
        model = markers.on(hand.tree)
        found[name] = {}
        for kind in _KINDS:
            progress.tell(f"{name}: {kind} inverse kinematics")
            found[name][kind] = evaluate(
                model,
                hand.surface,
                poses,
                settings.evaluate,
                np.random.default_rng(source.seed),
                prior=prior if kind == "subspace" else None,
                anchor=settings.anchor,
                solve=settings.solve,
            )
    return found


def _line(found: Mapping[str, Mapping[str, Errors]], best: str) -> str:
    of_best = found[best]["subspace"]
    line = (
        f"{1e3 * of_best.mean_m:.2f} mm in the mean, {1e3 * of_best.max_m:.1f} mm at "
        f"most with the subspace"
    )
    return f"{best} is best of {len(found)}: {line}" if len(found) > 1 else line


def _figures(errors: Errors) -> dict[str, float]:
    return {
        "mean_mm": 1e3 * errors.mean_m,
        "max_mm": 1e3 * errors.max_m,
        "fingers_mean_mm": 1e3 * errors.fingers_mean_m,
        "fingers_max_mm": 1e3 * errors.fingers_max_m,
        "angles_deg": float(np.degrees(errors.angles_rad)),
        "frame_ms": 1e3 * errors.frame_s,
    }


def _in_text(
    found: Mapping[str, Mapping[str, Errors]], counts: Mapping[str, int]
) -> str:
    wide = max(len("layout"), *map(len, found))
    lines = [
        f"{'':<{wide}}                    all skin [mm]   fingers [mm]",
        f"{'layout':<{wide}}  markers  solved      mean    max   mean    max  angles",
    ]
    for name, kinds in found.items():
        for kind, errors in kinds.items():
            f = _figures(errors)
            lines.append(
                f"{name:<{wide}}  {counts[name]:7}  {kind:<8} "
                f"{f['mean_mm']:7.2f} {f['max_mm']:6.1f} "
                f"{f['fingers_mean_mm']:6.2f} {f['fingers_max_mm']:6.1f} "
                f"{f['angles_deg']:6.2f}°"
            )
    return "\n".join(lines)
