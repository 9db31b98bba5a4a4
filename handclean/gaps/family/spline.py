"""A marker on the cubic spline through the nearest measured samples on both sides."""

import numpy as np

from handclean.gaps.family.cubic import END_FRAMES, smooth_spread
from handclean.gaps.family.ends import expect_both_ends
from handclean.gaps.min_acceleration import nearest
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Fill, Path, Tracks


def prepare(tracks: Tracks) -> Fill:
    """Fill with a cubic spline through up to ten samples on each side."""

    def fill(gap: Gap) -> Path:
        expect_both_ends(tracks, gap)
        known, reach = tracks.seen[:, gap.column], 2 * END_FRAMES
        before = nearest(known, gap.start - 1, -1, reach, reach)
        after = nearest(known, gap.stop, 1, reach, reach)
        frames = np.concatenate([before[::-1], after])
        from scipy.interpolate import CubicSpline  # 0.2 s, which few takes need

        path = CubicSpline(frames, tracks.positions[frames, gap.column])
        places = np.asarray(path(np.arange(gap.start, gap.stop)))
        return Path(places, smooth_spread(tracks, gap))

    return fill
