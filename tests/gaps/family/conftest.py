"""Bodies whose markers move together, with gaps where they are told."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Tracks

RATE = 100.0


class Bodies:
    """Takes of markers [m] on a body that is carried, turned and slowly bent."""

    rate = RATE

    def whole(self, rng, frames, markers=8, noise=0.0, bend=0.01, pace=15):
        """(T, M, 3) places; three hidden quantities bend the body.

        Movements take about ``pace`` frames.
        """

        def slowly(columns):
            walk = rng.normal(size=(frames + 6 * pace, columns))
            slow = gaussian_filter1d(walk, pace, axis=0)[3 * pace : -3 * pace]
            return slow * np.sqrt(3.54 * pace)  # of standard deviation 1

        rest = rng.normal(scale=0.04, size=(markers, 3))
        ways = rng.normal(scale=bend, size=(3, markers, 3))
        bent = rest + np.einsum("tk,kmc->tmc", slowly(3), ways)
        turns = Rotation.from_rotvec(0.3 * slowly(3)).as_matrix()
        moved = np.einsum("tij,tmj->tmi", turns, bent) + 0.1 * slowly(3)[:, None]
        return moved + rng.normal(scale=noise, size=moved.shape)

    def without(self, whole, *gaps):
        """Tracks with gaps (marker or markers, start, stop)."""
        positions = whole.copy()
        for markers, start, stop in gaps:
            positions[start:stop, markers] = np.nan
        return self.tracks(positions)

    def tracks(self, positions):
        bones = np.zeros(positions.shape[1], dtype=int)
        return Tracks(positions=positions, rate=RATE, bones=bones)

    def gap(self, marker, start, stop):
        return Gap(column=marker, start=start, stop=stop)


@pytest.fixture(scope="session")
def bodies():
    return Bodies()
