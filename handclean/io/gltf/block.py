"""Writing binary glTF: numbers into one block of bytes, and the file around it.

The same numbers give the same bytes: nothing of a file depends on when it was made.
"""

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.errors import FileError
from handclean.io.gltf.read import BIN_CHUNK, JSON_CHUNK, KINDS, MAGIC, WIDTHS

VERTICES, INDICES = 34962, 34963
"""What a buffer view is for."""

_LARGEST_BYTES = 2**32 - 1
"""[bytes] of a GLB: its header has 32 bits for the length (glTF 2.0)."""

_KIND = {np.dtype(name): number for number, name in KINDS.items()}
_TYPE = {width: name for name, width in WIDTHS.items()}


@dataclass
class Block:
    """The bytes of a file, and the accessors that say what they are."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def add(
        self,
        numbers: NDArray[Any],
        kind: str,
        *,
        target: int = 0,
        ranged: bool = False,
        shares: bool = False,
    ) -> int:
        """Add numbers, each item beginning at a multiple of four, and name them.

        Parameters
        ----------
        numbers : (N, width) or (N,)
        kind : as numpy calls it, "<f4".
        target : `VERTICES` or `INDICES`, 0 for what no shader reads.
        ranged : whether the file says their smallest and largest.
        shares : whether whole numbers stand for shares of their type's range.

        Returns
        -------
        the accessor's number
        """
        table = np.ascontiguousarray(numbers.reshape(len(numbers), -1), dtype=kind)
        content = table.tobytes()
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": len(content)}
        self.views.append(view | ({"target": target} if target else {}))
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _KIND[table.dtype],
            "count": len(table),
            "type": _TYPE[table.shape[1]],
        }
        if shares:
            accessor["normalized"] = True
        if ranged:
            accessor["min"] = table.min(axis=0).tolist()
            accessor["max"] = table.max(axis=0).tolist()
        self.accessors.append(accessor)
        padded = content + b"\0" * (-len(content) % 4)
        self.parts.append(padded)
        self.size += len(padded)
        return len(self.accessors) - 1


def write_file(path: Path, tree: dict[str, Any], block: Block) -> None:
    """Write a file: what it says, and the bytes it speaks of.

    Raises
    ------
    FileError
        If it cannot be written, or would be larger than glTF allows.
    """
    whole = {
        "asset": {"version": "2.0", "generator": "handclean"},
        **tree,
        "accessors": block.accessors,
        "bufferViews": block.views,
        "buffers": [{"byteLength": block.size}],
    }
    text = json.dumps(whole, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + block.size
    if length > _LARGEST_BYTES:
        wrong = f"cannot be written: {length / 1e9:.1f} GB are too much for .glb"
        raise FileError(path, wrong, "cut the take")
    head = struct.pack("<5I", MAGIC, 2, length, len(text), JSON_CHUNK)
    try:
        with open(path, "wb") as file:
            file.write(head + text + struct.pack("<2I", block.size, BIN_CHUNK))
            file.writelines(block.parts)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror})") from None
