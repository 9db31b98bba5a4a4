"""Marker sets as TOML, millimetres; `handclean.hand.marker_set` reads them."""

from collections.abc import Sequence
from pathlib import Path

from handclean.hand.marker_set import MarkerSet
from handclean.io.shared.writing import write_lines
from handclean.tomltext import quoted


def write_marker_set(
    path: Path, markers: MarkerSet, *, remarks: Sequence[str] = ()
) -> None:
    """Write a marker set.

    Parameters
    ----------
    remarks : one comment for each marker.
    """
    write_lines(path, to_toml(markers, remarks))


def to_toml(markers: MarkerSet, remarks: Sequence[str] = ()) -> list[str]:
    """Lines of a marker set's file; parameters as `write_marker_set`."""
    lines = [f"name = {quoted(markers.name)}"] if markers.name else []
    if markers.kind != "hand":
        lines.append(f"kind = {quoted(markers.kind)}")
    if markers.side:
        lines.append(f"side = {quoted(markers.side)}")
    lines.append(f"source = {quoted(markers.source)}")
    for n, label in enumerate(markers.labels):
        place = ", ".join(f"{1e3 * x + 0.0:.3f}" for x in markers.at[n])
        remark = f"  # {remarks[n]}" if remarks else ""
        lines += [
            "",
            "[[marker]]",
            f"label = {quoted(label)}",
            f"bone = {quoted(markers.bones[n])}",
            f"at = [{place}]{remark}",
        ]
    return lines
