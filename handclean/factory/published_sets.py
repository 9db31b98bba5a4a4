"""The marker sets of the papers, written as the TOML files that ship.

The papers show their sets in figures and give no coordinates, so every place here is a
reconstruction: markers of 6 mm sit on the skin, 3 mm above it, along the middle of the
back of their segment, on the template hand. Which segment carries a marker comes from
the paper where its text says so; ``source`` in each file says what it does not.
"""

from dataclasses import dataclass, field
from pathlib import Path

_Place = tuple[str, tuple[float, float, float]]

# Millimetres in the bone's rest frame: towards the thumb, along it, out of its back.
_PLACES: dict[str, _Place] = {
    "THUMB_TIP": ("thumb_distal", (0.0, 22.0, 11.5)),
    "THUMB_PROX": ("thumb_proximal", (0.0, 22.0, 13.0)),
    "THUMB_HEAD": ("thumb_metacarpal", (0.0, 41.0, 14.5)),
    "THUMB_BASE": ("thumb_metacarpal", (1.0, 12.0, 16.5)),
    "INDEX_TIP": ("index_distal", (0.0, 12.5, 10.5)),
    "INDEX_MID": ("index_middle", (0.0, 15.5, 11.2)),
    "INDEX_PROX": ("index_proximal", (0.0, 27.0, 12.2)),
    "INDEX_KNUCKLE": ("hand", (25.5, 78.5, 13.8)),
    "MIDDLE_TIP": ("middle_distal", (0.0, 14.0, 10.5)),
    "MIDDLE_MID": ("middle_middle", (0.0, 19.0, 11.2)),
    "MIDDLE_PROX": ("middle_proximal", (0.0, 29.0, 12.2)),
    "MIDDLE_KNUCKLE": ("hand", (4.2, 79.0, 15.8)),
    "RING_TIP": ("ring_distal", (0.0, 13.5, 10.3)),
    "RING_MID": ("ring_middle", (0.0, 18.0, 11.0)),
    "RING_PROX": ("ring_proximal", (0.0, 26.0, 12.0)),
    "RING_KNUCKLE": ("hand", (-16.1, 73.0, 14.0)),
    "LITTLE_TIP": ("little_distal", (0.0, 11.5, 9.4)),
    "LITTLE_MID": ("little_middle", (0.0, 12.5, 10.0)),
    "LITTLE_PROX": ("little_proximal", (0.0, 21.5, 11.0)),
    "LITTLE_KNUCKLE": ("hand", (-32.5, 66.0, 10.0)),
    "WRIST_IN": ("hand", (17.0, 5.0, 13.5)),
    "WRIST_OUT": ("hand", (-20.0, 3.0, 12.0)),
    "HAND_BASE": ("hand", (-1.0, 19.0, 15.5)),
    "HAND_IN": ("hand", (18.0, 44.0, 15.0)),
    "HAND_MID": ("hand", (1.0, 49.0, 16.3)),
    "HAND_OUT": ("hand", (-19.0, 38.0, 13.5)),
}

_FINGERS = ("THUMB", "INDEX", "MIDDLE", "RING", "LITTLE")


def _each(part: str, fingers: tuple[str, ...] = _FINGERS) -> tuple[str, ...]:
    return tuple(f"{finger}_{part}" for finger in fingers)


@dataclass(frozen=True)
class PublishedSet:
    """A set as a selection of places: its name, where it comes from, its markers."""

    name: str
    source: str
    markers: tuple[str, ...]
    side: str = "right"
    note: str = field(default="")


SETS = (
    PublishedSet(
        "maycock26",
        "reconstructed: 26 markers on the right hand (Maycock et al. 2015, IV), at "
        "least one on each of its 16 segments; places are ours",
        tuple(_PLACES),
    ),
    PublishedSet(
        "schroeder17",
        "reconstructed: 17 markers covering most joints (Schroeder et al. 2017, figure "
        "14, not described in words); three per finger, two on the back are ours",
        (
            *_each("TIP"),
            *_each("MID", _FINGERS[1:]),
            *_each("PROX"),
            "THUMB_HEAD",
            "HAND_IN",
            "HAND_OUT",
        ),
    ),
    PublishedSet(
        "schroeder8",
        "reconstructed: an 8-marker subset of schroeder17 (Schroeder et al. 2017, "
        "figure 14, not described in words); chosen after the generic 8-marker layout "
        "of Schroeder et al. 2016, which resembles 6F-2T of Hoyet et al. 2012",
        (
            "THUMB_TIP",
            "THUMB_PROX",
            "INDEX_TIP",
            "INDEX_PROX",
            "MIDDLE_TIP",
            "LITTLE_TIP",
            "LITTLE_PROX",
            "HAND_OUT",
        ),
    ),
    PublishedSet(
        "schroeder6",
        "reconstructed: a 6-marker subset of schroeder17 (Schroeder et al. 2017, "
        "figure 14, not described in words); none on the middle finger, as in the "
        "generic 6-marker layout of Schroeder et al. 2016",
        (
            "THUMB_TIP",
            "INDEX_TIP",
            "INDEX_PROX",
            "RING_TIP",
            "LITTLE_TIP",
            "HAND_OUT",
        ),
    ),
    PublishedSet(
        "hoyet20",
        "reconstructed: the full set of 20 markers per hand of Hoyet et al. 2012, four "
        "per finger; places are ours",
        (
            *_each("TIP"),
            *_each("PROX"),
            *_each("MID", _FINGERS[1:]),
            *_each("KNUCKLE", _FINGERS[1:]),
            "THUMB_HEAD",
            "THUMB_BASE",
        ),
    ),
    PublishedSet(
        "hoyet8",
        "reconstructed: 6F-2T of Hoyet et al. 2012 (figure 8b), six markers on the "
        "fingers and two on the thumb; which segments is ours",
        (
            "THUMB_TIP",
            "THUMB_PROX",
            "INDEX_TIP",
            "INDEX_PROX",
            "MIDDLE_TIP",
            "RING_TIP",
            "LITTLE_TIP",
            "LITTLE_PROX",
        ),
        note="articulation only: its authors took the hand's place from the forearm",
    ),
    PublishedSet(
        "hoyet6",
        "reconstructed: a manual layout after Hoyet et al. 2012, one marker on the end "
        "of each finger and two on the thumb; which segments is ours",
        (*_each("TIP"), "THUMB_PROX"),
        note="articulation only: its authors took the hand's place from the forearm",
    ),
    PublishedSet(
        "pavllo9",
        "reconstructed: the glove of Pavllo et al. 2019, section 2.1; wrist, base of "
        "the index and base of the little finger are stated, one marker per finger "
        "follows from its text, the ninth on the thumb is ours",
        (*_each("TIP"), "THUMB_PROX", "HAND_BASE", "INDEX_KNUCKLE", "LITTLE_KNUCKLE"),
        side="left",
    ),
)


def as_toml(chosen: PublishedSet) -> str:
    """Text of a set's file."""
    letter = "L" if chosen.side == "left" else "R"
    lines = [
        "# written by handclean.factory.published_sets; change it there",
        f'name = "{chosen.name}"',
        f'side = "{chosen.side}"',
        f'source = "{chosen.source}"',
    ]
    if chosen.note:
        lines.append(f'note = "{chosen.note}"')
    for marker in chosen.markers:
        bone, at = _PLACES[marker]
        lines += [
            "",
            "[[marker]]",
            f'label = "{letter}_{marker}"',
            f'bone = "{bone}"',
            f"at = [{at[0]}, {at[1]}, {at[2]}]",
        ]
    return "\n".join(lines) + "\n"


def write_sets(folder: Path) -> list[Path]:
    """Write every set's file into a folder and return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for chosen in SETS:
        path = folder / f"{chosen.name}.toml"
        path.write_text(as_toml(chosen), encoding="utf-8")
        paths.append(path)
    return paths
