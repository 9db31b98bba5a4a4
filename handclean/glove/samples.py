"""Samples: readings with the rotations that were known (Wang & Neff 2013, section 5).

A sample knows some rotations and not others (NaN). FK samples (key poses, widgets,
markers of whatever hand) hold for other wearers too; IK samples (touching) depend on
the lengths of this wearer's fingers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Bytes, Floats, Ints, expect_shape
from handclean.errors import HandcleanError, UnknownNameError
from handclean.glove.gloves import Glove
from handclean.glove.hands import GloveHand
from handclean.glove.readings import usable

FK, IK = 0, 1
"""Kinds of samples."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """N samples of a glove with S sensors on a hand with R rotations.

    Attributes
    ----------
    glove : name of the glove.
    subject : who wore it.
    sensors, rotations : S and R names.
    readings : (N, S).
    targets : (N, R) [rad], NaN where not known.
    kind : (N,) `FK` or `IK`.
    group : (N,) index into ``groups``.
    groups : what was recorded: "pose flat", "touch thumb index".
    """

    glove: str
    subject: str
    sensors: tuple[str, ...]
    rotations: tuple[str, ...]
    readings: Floats
    targets: Floats
    kind: Bytes
    group: Ints
    groups: tuple[str, ...]

    def __post_init__(self) -> None:
        count = len(self.readings)
        expect_shape("readings", self.readings, count, len(self.sensors))
        expect_shape("targets", self.targets, count, len(self.rotations))
        expect_shape("kind", self.kind, count)
        expect_shape("group", self.group, count)

    def chosen(self, rows: Bools | Ints) -> "Samples":
        """Return some of the samples."""
        return replace(
            self,
            readings=self.readings[rows],
            targets=self.targets[rows],
            kind=self.kind[rows],
            group=self.group[rows],
        )


def make_samples(
    glove: Glove,
    readings: Floats,
    targets: Floats,
    kind: int,
    about: str,
    subject: str = "",
) -> Samples:
    """Make samples of readings with known rotations, without those that are unusable.

    Parameters
    ----------
    readings : (N, S) in the order of the glove's sensors.
    targets : (N, R) [rad] in the order of ``glove.hand``, NaN where not known.
    kind : `FK` or `IK`.
    about : what was recorded, and in which file, for people.
    subject : whose hand it was; "" if not known.
    """
    count = len(readings)
    every = Samples(
        glove=glove.name,
        subject=subject,
        sensors=glove.sensors,
        rotations=glove.hand.rotations,
        readings=readings,
        targets=targets,
        kind=np.full(count, kind, dtype=np.uint8),
        group=np.zeros(count, dtype=np.int64),
        groups=(about,),
    )
    known = np.isfinite(targets).any(axis=1)
    return every.chosen(usable(glove, readings) & known)


def spread(count: int, most: int) -> Ints:
    """Choose some of ``count`` rows, evenly spread.

    Parameters
    ----------
    most : how many, at most; 0 for all.

    Returns
    -------
    their numbers, rising
    """
    if most <= 0 or count <= most:
        return np.arange(count)
    return np.unique(np.round(np.linspace(0, count - 1, most)).astype(np.int64))


def merged(parts: Sequence[Samples]) -> Samples:
    """Put samples of one glove together.

    Parameters
    ----------
    parts : one or more.

    Raises
    ------
    HandcleanError
        If they are of different gloves, or of hands with different rotations.
    """
    first = parts[0]
    for part in parts[1:]:
        if (part.glove, part.sensors) != (first.glove, first.sensors):
            raise HandcleanError(
                f"samples: are of glove {first.glove} ({len(first.sensors)} sensors) "
                f"and of {part.glove} ({len(part.sensors)}); fit one glove at a time"
            )
        if part.rotations != first.rotations:
            raise HandcleanError("samples: are of hands with different rotations")
    starts = np.cumsum([0, *(len(part.groups) for part in parts)])
    subjects = dict.fromkeys(part.subject for part in parts if part.subject)
    return Samples(
        glove=first.glove,
        subject=", ".join(subjects),
        sensors=first.sensors,
        rotations=first.rotations,
        readings=np.concatenate([part.readings for part in parts]),
        targets=np.concatenate([part.targets for part in parts]),
        kind=np.concatenate([part.kind for part in parts]),
        group=np.concatenate(
            [p.group + s for p, s in zip(parts, starts, strict=False)]
        ),
        groups=tuple(group for part in parts for group in part.groups),
    )


def of_hinges(hand: GloveHand, names: Sequence[str], angles: Floats) -> Floats:
    """Turn hinge angles into a glove's rotations.

    Parameters
    ----------
    names : of the D hinges; angles : (N, D) [rad].

    Returns
    -------
    (N, R) [rad] in the order of ``hand``; NaN where a hinge is missing
    """
    matrix = hand.from_hinges(names)
    known = np.isfinite(matrix).all(axis=1)
    out = np.full((len(angles), len(matrix)), np.nan)
    out[:, known] = angles @ matrix[known].T
    return out


def of_pose(hand: GloveHand, pose: Mapping[str, float], count: int) -> Floats:
    """Turn a key pose into a glove's rotations.

    Parameters
    ----------
    pose : hinges' angles [rad]; those it does not list are unknown.
    count : how many rows to make, N.

    Returns
    -------
    (N, R) [rad] in the order of ``hand``, NaN where not known
    """
    names = list(pose)
    return of_hinges(hand, names, np.tile([pose[name] for name in names], (count, 1)))


def of_hold(glove: Glove, holds: Mapping[str, float], count: int) -> Floats:
    """Turn what widgets hold into a glove's rotations.

    Parameters
    ----------
    holds : angles [rad] by a rotation's name or its sensor's; a sensor that measures
        two rotations names neither.
    count : how many rows to make, N.

    Returns
    -------
    (N, R) [rad] in the order of ``glove.hand``, NaN where not held

    Raises
    ------
    UnknownNameError
        If there is no such rotation.
    """
    sensors = [row.measured_by for row in glove.measured]
    by_sensor = {
        row.measured_by: row.rotation
        for row in glove.measured
        if sensors.count(row.measured_by) == 1
    }
    out = np.full((count, len(glove.hand.rotations)), np.nan)
    for name, angle in holds.items():
        rotation = by_sensor.get(name, name)
        if rotation not in glove.hand.rotations:
            known = (*glove.hand.rotations, *by_sensor)
            raise UnknownNameError("--hold", "rotation", name, known)
        out[:, glove.hand.index(rotation)] = angle
    return out
