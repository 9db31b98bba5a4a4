"""A subject: one hand of one person, with the markers as they were glued on."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from handclean.arrays import Floats
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model
from handclean.hand.surface import Surface
from handclean.hand.template import HAND_BREADTH_M, HAND_LENGTH_M, template
from handclean.remarks import Remark


@dataclass(frozen=True, kw_only=True)
class Subject:
    """A hand with markers, and how well it is known.

    Attributes
    ----------
    name : whose hand.
    model : joint tree with markers on its bones.
    marker_set : name of the set the markers are named after.
    marker_sigma : (M,) [m] RMS residual of each marker, NaN where unknown.
    errors : figures of the calibration, by name (metres, radians, counts).
    calibrated : False for a template that nobody has measured.
    surface : the hand's own skin, where somebody scanned or drew it.
    file_sha256 : digest of the file the subject was read from, by which records name
        it; "" for any other, also a changed copy of one that was read.
    provenance : one entry (plain JSON values) per step that made this subject.
    remarks : what the calibration told; not in the file.
    """

    name: str
    model: Model
    marker_set: str
    marker_sigma: Floats
    errors: Mapping[str, float] = field(default_factory=dict)
    calibrated: bool = True
    surface: Surface | None = None
    file_sha256: str = field(default="", init=False, repr=False, compare=False)
    provenance: tuple[Mapping[str, Any], ...] = field(
        default=(), repr=False, compare=False
    )
    remarks: tuple[Remark, ...] = field(default=(), repr=False, compare=False)


def template_subject(
    marker_set: MarkerSet,
    side: str = "",
    length_m: float = HAND_LENGTH_M,
    breadth_m: float = HAND_BREADTH_M,
) -> Subject:
    """Return the template hand with a marker set, for when nobody was measured.

    Parameters
    ----------
    side : "left" or "right"; "" for the marker set's own.
    length_m : [m] wrist crease to tip of the middle finger.
    breadth_m : [m] across the metacarpal heads.

    Returns
    -------
    a subject that is not calibrated: ``marker_sigma`` (M,) is NaN

    Raises
    ------
    UsageError
        If the side is none of them or the size is not a hand's.
    """
    tree = template(
        side or marker_set.side, length_m, breadth_m, forearm=marker_set.forearm
    )
    return Subject(
        name="template",
        model=marker_set.on(tree),
        marker_set=marker_set.name,
        marker_sigma=np.full(len(marker_set.labels), np.nan),
        calibrated=False,
    )
