"""Missing markers follow the bridged posture and meet their measured ends."""

import numpy as np

from handclean.arrays import Floats
from handclean.gaps.posture import what_is_open
from handclean.gaps.runs import Gap
from handclean.gaps.scene import Scene
from handclean.gaps.tracks import Refused

FADE = 4.0
"""[frames] within which a filled path leaves the noise of its end samples behind
(chosen)."""


def follow(scene: Scene, gap: Gap) -> Floats:
    """Let a marker follow the posture through a gap.

    The posture has it where its place on its bone, moved by what is left over at the
    ends of the gap, is in each frame. What is then missing to a smooth passage into the
    measured samples at both ends fades within `FADE` frames if it is no more than their
    noise, and so slowly that it changes by the noise in a frame if it is more.

    Raises
    ------
    Refused
        If something that moves the marker stays open.
    """
    bone = int(scene.model.bone[gap.column])
    still_open = what_is_open(scene.posture, scene.model, bone, gap.start, gap.stop)
    if still_open:
        raise Refused(f"nothing bridges {still_open}")
    measured = scene.positions[:, gap.column]
    path = scene.posture.points[gap.start : gap.stop, gap.column]
    before = measured[max(gap.start - 2, 0) : gap.start][::-1]
    after = measured[gap.stop : gap.stop + 2]
    start = _missing_to_smooth(path, before, after[0])
    end = _missing_to_smooth(path[::-1], after, before[0])
    noise = float(scene.noise[gap.column])
    return np.asarray(
        path + _fade(start, noise, gap.frames) + _fade(end, noise, gap.frames)[::-1]
    )


def _missing_to_smooth(path: Floats, outside: Floats, far_end: Floats) -> Floats:
    """(3,) [m] how far a path is off from passing smoothly into measured samples.

    The step between them should be the mean of the steps on both sides of it, which is
    so for any constant acceleration.

    Parameters
    ----------
    path : (N, 3) [m] outwards in time from that end into the gap.
    outside : (1 or 2, 3) [m] samples from that end away from the gap.
    far_end : (3,) [m] the sample that ends the gap on the other side.
    """
    step = path[0] - outside[0]
    inner = (path[1] if len(path) > 1 else far_end) - path[0]
    outer = outside[0] - outside[1] if len(outside) > 1 else inner
    outer = np.where(np.isfinite(outer), outer, inner)
    return np.asarray(0.5 * (inner + outer) - step)


def _fade(off: Floats, noise: float, frames: int) -> Floats:
    """(frames, 3) [m] a correction that begins with ``off`` and fades to nothing."""
    over = min(max(FADE, float(np.linalg.norm(off)) / noise), frames + 1.0)
    into = np.arange(1.0, frames + 1.0)[:, None]
    return np.asarray(np.maximum(1.0 - into / over, 0.0) ** 2 * off)
