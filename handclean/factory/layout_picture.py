"""Pictures of layouts, as in figures 6, 7, 12 and 13 of Schroeder 2016.

Run as ``python -m handclean.factory.layout_picture FILE.png``. Above: precision
grasps, 4, 6 and 8 markers with the posture subspace, 13 with all angles. In the middle:
precision grasps, 10 markers, by the condition number alone, by the distance alone, by
both. Below: 6 markers for grasps with all fingers, for power grasps of small things,
and for all motion there is, and 8 for that.
"""

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.image import imsave

from handclean.arrays import Bytes, Floats
from handclean.hand.model import Model
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.layouts.feasible import feasible
from handclean.layouts.optimize import optimize
from handclean.layouts.problem import make_problem, on_bones
from handclean.layouts.settings import LayoutConfig
from handclean.report.beads import with_beads
from handclean.report.drawing import drawn, looking, side_by_side
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

PRECISION = ("thumb_index", "thumb_2_finger")
MANY_FINGERS = ("thumb_4_finger", "disk_precision", "sphere_precision")
SMALL_POWER = ("small_diameter", "medium_wrap")

_RADIUS_M, _PIXEL_M = 0.005, 0.00095
"""[m] radius of a marker that is drawn, and width of a pixel (chosen)."""

_VIEW = looking(-12.0, 0.0)  # a little from the thumb, whose nail looks there

_SIX = LayoutConfig(markers=6, share=0.95)
ROWS = (
    (
        (PRECISION, LayoutConfig(markers=4, dimensions=5)),
        (PRECISION, _SIX),
        (PRECISION, replace(_SIX, markers=8)),
        (PRECISION, replace(_SIX, markers=13, full=True)),
    ),
    (
        (PRECISION, replace(_SIX, markers=10, w2=0.0)),
        (PRECISION, replace(_SIX, markers=10, w1=0.0)),
        (PRECISION, replace(_SIX, markers=10)),
    ),
    (
        (MANY_FINGERS, _SIX),
        (SMALL_POWER, _SIX),
        ((), _SIX),
        ((), replace(_SIX, markers=8)),
    ),
)
"""Grasp classes, or all motion there is, and what is asked of the layout."""


@cache
def motion(grasps: tuple[str, ...]) -> tuple[list[Floats], tuple[str, ...]]:
    """Angles of simulated takes and their names."""
    base = SimulateConfig(seed=6, subjects=4, rate_hz=50.0, occlusion=False)
    kinds = [("grasp", replace(base, trials=12, grasps=grasps))]
    if not grasps:
        kinds += [("free", replace(base, trials=4)), ("rom", replace(base, trials=2))]
    takes: list[Floats] = []
    names: tuple[str, ...] = ()
    for kind, settings in kinds:
        for trial in simulate(kind, settings):
            motions = trial.truth.motions
            (one,) = (m for name, m in motions.items() if name != "object")
            takes.append(one.angles)
            names = one.names
    return takes, names


def layout(grasps: tuple[str, ...], settings: LayoutConfig) -> Model:
    """Return the template hand with the layout's markers."""
    tree = template("right")
    skin = template_surface(tree)
    model = on_bones(skin, tree, feasible(skin, tree, settings))
    takes, names = motion(grasps)
    known = [tree.hinges.index(name) for name in names if name in tree.hinges]
    takes = [take[:, : len(known)] for take in takes]
    problem = make_problem(model, takes, names[: len(known)], settings)
    found = optimize(problem, settings, np.random.default_rng(0))
    return model.selected(found.labels)


def drawn_layout(model: Model) -> Bytes:
    """(H, W, 3) the hand's back with its markers."""
    skin = with_beads(template_surface(model.tree), model, _RADIUS_M)
    assert skin.colors is not None
    return drawn(skin.vertices, skin.faces, skin.colors / 255.0, _VIEW, _PIXEL_M)


def picture(target: Path) -> None:
    """Draw all layouts."""
    rows = [side_by_side([drawn_layout(layout(*one)) for one in row]) for row in ROWS]
    wide = max(row.shape[1] for row in rows)
    padded = [
        np.pad(row, ((0, 0), (0, wide - row.shape[1]), (0, 0)), constant_values=255)
        for row in rows
    ]
    imsave(target, np.vstack(padded))


if __name__ == "__main__":
    picture(Path(sys.argv[1]))
