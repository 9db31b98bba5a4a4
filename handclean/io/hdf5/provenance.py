"""What made a file, inside it: one JSON text per step, in the order they were taken."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from handclean.io.hdf5.parts import Part


def provenance_item(entries: Sequence[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Return the item that keeps these entries; none if there are none."""
    if not entries:
        return {}
    return {"provenance": [json.dumps(dict(e), ensure_ascii=False) for e in entries]}


def provenance_from(root: Part) -> tuple[Mapping[str, Any], ...]:
    """Return the entries that a file's root keeps.

    Raises
    ------
    FileError
        If one is no JSON object.
    """
    entries = []
    for text in root.texts("provenance") if root.has("provenance") else ():
        try:
            entry = json.loads(text)
        except (ValueError, RecursionError):
            entry = None
        if not isinstance(entry, dict):
            raise root.fail("provenance holds an entry that is no JSON object")
        entries.append(entry)
    return tuple(entries)
