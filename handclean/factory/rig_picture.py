"""A picture of a rigged hand of another program beside ours, in the same postures.

Run as ``python -m handclean.factory.rig_picture HAND.glb FILE.png``.
"""

import sys
from pathlib import Path

from handclean.factory.rig_drawing import write_rig_picture
from handclean.io.shapes import read_hand


def picture(source: Path, target: Path) -> None:
    """Import a hand and draw it.

    Raises
    ------
    HandcleanError
        If the file holds no hand of ours.
    """
    subject = read_hand(source).subject
    assert subject.surface is not None, "an imported hand has a skin"
    write_rig_picture(target, subject.model.tree, subject.surface)


if __name__ == "__main__":
    picture(Path(sys.argv[1]), Path(sys.argv[2]))
