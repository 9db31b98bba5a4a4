"""A picture of a simulated scan and of the hand that is fitted to it.

Run as ``python -m handclean.factory.scan_picture FILE.png``.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from handclean.arrays import Floats
from handclean.factory.scan_drawing import scan_picture, write_scan_picture
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate_scan
from handclean.subject.scan.cloud import Scan
from handclean.subject.scan.fit import fit_scan
from handclean.subject.scan.settings import ScanConfig

_MARGIN_M = 0.03
"""[m] what the picture shows beside the hand (chosen)."""


def picture(target: Path, number: int = 2) -> None:
    """Scan a simulated hand, fit the template to it, and draw both."""
    scan = simulate_scan("scan", SimulateConfig(subjects=8), number)
    cloud = Scan(points=scan.points, normals=scan.normals, colors=scan.colors)
    side = scan.subject.model.tree.side
    fitted = fit_scan(cloud, scan.landmarks, ScanConfig(), side=side)
    home, turn = scan.pose[:3], Rotation.from_quat(np.roll(scan.pose[3:7], -1))

    def seen(places: Floats) -> Floats:
        """Places in the frame of the scanned hand."""
        out: Floats = turn.apply(places - home, inverse=True)
        return out

    points = seen(scan.points)
    low, high = (limit(seen(scan.skin), axis=0) for limit in (np.min, np.max))
    near = ((points > low - _MARGIN_M) & (points < high + _MARGIN_M)).all(axis=1)
    drawn = scan_picture(
        points[near],
        turn.apply(scan.normals[near], inverse=True),
        scan.colors[near],
        fitted.aligned.template.surface,
        seen(fitted.aligned.vertices()),
        seen(fitted.registered.vertices),
    )
    write_scan_picture(target, drawn)


if __name__ == "__main__":
    picture(Path(sys.argv[1]))
