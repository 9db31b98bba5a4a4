"""Key poses: hands whose angles are known because everybody can take them."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from handclean.errors import FileError, Place, UnknownNameError, Where
from handclean.tomlfile import read_table

SHIPPED = Path(__file__).parents[1] / "data" / "gloves" / "key_poses.toml"


@cache
def key_poses(path: Path = SHIPPED) -> Mapping[str, Mapping[str, float]]:
    """Read the key poses of a file.

    Parameters
    ----------
    path : of a TOML file with a table of hinges and degrees for each pose.

    Returns
    -------
    by a pose's name, its hinges' angles [rad]

    Raises
    ------
    FileError
        If it is not there or no such file.
    """
    right = "write [name] tables of hinge = degrees"
    content = read_table(path, "not a file of key poses")
    out = {}
    for name in content:
        angles = content.table(name, right).numbers()
        out[name] = {hinge: float(np.radians(a)) for hinge, a in angles.items()}
    if not out:
        raise FileError(path, "has no pose", right)
    return out


def key_pose(name: str) -> Mapping[str, float]:
    """Return a key pose by its shipped name or as ``FILE.toml:NAME``.

    `handclean.glove.claims.expect_pose` tells whether a hand can take it.

    Returns
    -------
    its hinges' angles [rad]

    Raises
    ------
    FileError, UnknownNameError
        If there is none.
    """
    file, colon, inside = name.rpartition(":")
    poses = key_poses(Path(file)) if colon else key_poses()
    if inside not in poses:
        raise UnknownNameError("--pose", "key pose", inside, poses)
    return poses[inside]


def place_of(name: str) -> Where:
    """Return where a key pose is written, for errors about it.

    Parameters
    ----------
    name : as `key_pose` takes it.
    """
    file, _, inside = name.rpartition(":")
    return Place(Path(file), f" [{inside}]") if file else f"--pose {inside}"
