"""The nodes of a glTF file: their names, their tree, and where each stands."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.io.gltf.read import Glb

_MOST_NODES = 20_000
"""Nodes of a file, at most (chosen)."""


@dataclass(frozen=True)
class Nodes:
    """The N nodes of a file.

    Attributes
    ----------
    names : "" for one without a name.
    parents : (N,) -1 for a root.
    world : (N, 4, 4) from each node to the scene, as the file stands.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    world: Floats


def nodes_of(glb: Glb) -> Nodes:
    """Return the nodes of a file.

    Raises
    ------
    FileError
        If a node has two parents or is its own ancestor, or its place is no number.
    """
    if "nodes" not in glb.made:
        glb.made["nodes"] = _nodes_of(glb)
    found: Nodes = glb.made["nodes"]
    return found


def _nodes_of(glb: Glb) -> Nodes:
    rows = glb.rows("nodes")
    if len(rows) > _MOST_NODES:
        raise glb.fail(f"has {len(rows)} nodes", f"at most {_MOST_NODES} are read")
    parents = [-1] * len(rows)
    for n, row in enumerate(rows):
        children = row.get("children", [])
        for child in children if isinstance(children, list) else [children]:
            glb.row("nodes", child)
            if parents[child] >= 0:
                raise glb.fail(f"node {child} has two parents")
            parents[child] = n
    world = np.zeros((len(rows), 4, 4))
    done: set[int] = set()
    for n in range(len(rows)):
        line = [n]
        while parents[line[-1]] >= 0 and parents[line[-1]] not in done:
            line.append(parents[line[-1]])
            if len(line) > len(rows):
                raise glb.fail(f"node {n} is its own ancestor")
        for m in reversed(line):
            if m not in done:
                own = _local(glb, rows[m])
                up = parents[m]
                world[m] = world[up] @ own if up >= 0 else own
                done.add(m)
    if not np.isfinite(world).all():
        raise glb.fail("a node's place is not a finite number")
    names = tuple(_text(row.get("name")) for row in rows)
    return Nodes(names=names, parents=tuple(parents), world=world)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _local(glb: Glb, row: dict[str, Any]) -> Floats:
    """(4, 4) from a node to its parent."""
    if "matrix" in row:
        return _numbers(glb, row["matrix"], 16, "matrix").reshape(4, 4).T.copy()
    shift = _numbers(glb, row.get("translation", [0, 0, 0]), 3, "translation")
    turn = _numbers(glb, row.get("rotation", [0, 0, 0, 1]), 4, "rotation")
    scale = _numbers(glb, row.get("scale", [1, 1, 1]), 3, "scale")
    size = np.linalg.norm(turn)
    if not 0.5 < size < 2.0:
        raise glb.fail("a node's rotation is no unit quaternion")
    x, y, z, w = turn / size
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, :3] *= scale
    out[:3, 3] = shift
    return out


def _numbers(glb: Glb, value: Any, count: int, what: str) -> Floats:
    try:
        found = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        found = np.zeros(0)
    if found.shape != (count,) or not (np.abs(found) < 1e12).all():
        raise glb.fail(f"a node's {what} is not {count} numbers")
    return found
