"""Words for what is in samples and calibrations of gloves."""

from collections.abc import Mapping
from typing import Any


def in_words(figures: Mapping[str, Any]) -> list[str]:
    """Say what is in samples or a calibration, a part at a time.

    Parameters
    ----------
    figures : as `handclean.api.glove_contents.inspect_glove` gives them.
    """
    words = [figures["glove"]]
    if figures["wearer"]:
        words.append(f"on {figures['wearer']}")
    rotations = (
        f"{len(figures['rotations'])} of {figures['rotations_measured']} rotations"
    )
    if "model" in figures:
        samples = "all" if figures["use"] == "all" else figures["use"].upper()
        words.append(f"{figures['model']} from {samples} samples")
        words.append(rotations)
        if figures["worn_again"]:
            doubt = f"{figures['doubt_deg']:.1f} degrees in doubt"
            words.append(f"for another donning, {doubt}")
        return words
    words.append(_counted(figures["kinds"]))
    count = len(figures["recordings"])
    words.append(f"{count} recording{'s' * (count != 1)}")
    return [*words, f"{rotations} known"]


def rows(figures: Mapping[str, Any]) -> str:
    """Rotations, and recordings where the file tells of them, one a line."""
    lines = [
        f"{count:6d} samples of {name}"
        for name, count in figures.get("recordings", {}).items()
    ]
    for name, one in figures["rotations"].items():
        line = f"{name:>24} from {_counted(one)}"
        if "floor_deg" in one:
            line += f", floor {one['floor_deg']:.1f} degrees"
        lines.append(line)
    return "\n".join(lines)


def _counted(kinds: Mapping[str, Any]) -> str:
    parts = [f"{kinds[kind]} {kind.upper()}" for kind in ("fk", "ik") if kinds[kind]]
    return f"{' and '.join(parts) or 'no'} samples"
