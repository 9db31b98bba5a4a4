"""What a user writes first: frame to frame by the Hungarian method, without a model.

Every marker stands where it was last seen, or, seen twice in a row, where it would go
on to; the points of the next frame are assigned to these places at the least total
distance within a gate. It knows nothing of hands, so that a marker that comes back
elsewhere is lost and a ghost beside a hidden one is taken. Kept to measure against.
"""

import numpy as np

from handclean.arrays import Floats
from handclean.labels.points import cloud_of
from handclean.numerics.assignment import assign
from handclean.recording import Recording, Trajectories, trajectories


def follow_points(
    recording: Recording, labels: tuple[str, ...], first: Floats, gate_m: float = 0.02
) -> Trajectories:
    """Label a take from the places its markers have in the first frame.

    Parameters
    ----------
    recording : a take; names it has are ignored.
    labels : M names.
    first : (M, 3) [m] where each is in the first frame; NaN where not in view.
    gate_m : [m] farthest a marker may be from where it is expected.
    """
    cloud = cloud_of(recording)
    found = np.full((recording.frames, len(labels), 3), np.nan)
    place, speed = first.copy(), np.zeros_like(first)
    for t in range(recording.frames):
        points = cloud.at[cloud.start[t] : cloud.start[t + 1]]
        expected = place + speed
        far = np.linalg.norm(expected[:, None] - points[None], axis=2)
        far[~(far <= gate_m)] = np.inf
        chosen = assign(far, gate_m)
        has = chosen >= 0
        now = place.copy()
        now[has] = found[t, has] = points[chosen[has]]
        before = found[t - 1] if t > 0 else np.full_like(first, np.nan)
        moved = now - before
        speed = np.where(np.isfinite(moved) & has[:, None], moved, 0.0)
        place = now
    return trajectories(found, labels)
