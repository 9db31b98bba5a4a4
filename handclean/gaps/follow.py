"""Missing markers follow the bridged posture and meet their measured ends."""

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.posture import what_is_open
from handclean.gaps.runs import Gap
from handclean.gaps.scene import Refused, Scene

FADE = 4.0
"""[frames] after which a filled path has left the noise of its end samples behind."""


def follow(scene: Scene, gap: Gap) -> Floats:
    """Let a marker follow the posture through a gap.

    The posture has it where its place on its bone, moved by what is left over at the
    ends of the gap, is in each frame. What the single samples at the ends differ from
    that, which is their noise, fades within `FADE` frames, so that there is no step.

    Raises
    ------
    Refused
        If something that moves the marker stays open.
    """
    bone = int(scene.model.bone[gap.column])
    still_open = what_is_open(scene.posture, scene.model, bone, gap.start, gap.stop)
    if still_open:
        raise Refused(f"nothing bridges {still_open}")
    rows = slice(gap.start - 1, gap.stop + 1)
    path = scene.posture.points[rows, gap.column]
    before = scene.positions[gap.start - 1, gap.column] - path[0]
    after = scene.positions[gap.stop, gap.column] - path[-1]
    into = np.arange(1.0, gap.frames + 1.0)[:, None]
    fade_in = np.maximum(1.0 - into / FADE, 0.0) ** 2
    fade_out = np.maximum(1.0 - into[::-1] / FADE, 0.0) ** 2
    return np.asarray(path[1:-1] + fade_in * before + fade_out * after)
