"""Whether a take holds the motion that solving it would find, bridged through its gaps.

`fill-gaps` and `clean` solve a take from its measured markers and bridge the posture
where these leave it open. Solving their take frame by frame would throw the bridges
away, so `solve` keeps their motion if it is what they would find: the record of the
take names the same subject, prior and settings, and the motion is as far from the
measured markers as it says.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from handclean.api.hands import Hands
from handclean.hand.model import marker_positions
from handclean.hand.subject import Subject
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import markers_of
from handclean.recording import Motion, Origin, Recording
from handclean.runner import provenance
from handclean.runner.outcome import Entry
from handclean.tree import JointTree

MAKERS = ("fill-gaps", "clean")
"""Commands that bridge postures."""

KEEPERS = ("convert",)
"""Commands that change neither markers nor motions."""

SAME_RESIDUAL_M = 1e-9
"""[m] residuals differ by less where markers and motion are those they were (chosen:
rounding)."""


def refused(
    recording: Recording, name: str, hands: Hands, settings: SolveConfig
) -> str | None:
    """Say why the motion of a hand is to be found anew; "" if it is what is wanted.

    None if no gap of the hand was bridged, so that there is nothing to say.

    Parameters
    ----------
    name : of skeleton and motion, and of one of the hands.
    """
    subject, wearer = hands.subjects[name], hands.identities[name]
    entry = _maker(recording, wearer)
    motion = recording.motions.get(name)
    is_bridged = motion is not None and motion.angles_sigma is not None
    if not _filled(recording, subject) and not (entry and is_bridged):
        return None
    if entry is None:
        return "what filled its gaps is not on record"
    if wearer not in _wearers(entry):
        return "its gaps were filled with another subject"
    if why := _other_settings(entry, hands, settings):
        return why
    if motion is None or not _whole(motion):
        return "the file holds no posture in its gaps (.h5 does)"
    if not _same_tree(recording.skeletons.get(name), subject.model.tree):
        return "its gaps were filled with another subject"
    if not _fits(recording, subject, motion):
        return "its markers were changed since its gaps were filled"
    return ""


def _maker(recording: Recording, wearer: str) -> Entry | None:
    """Return the entry of the step that bridged the postures a take holds, if any."""
    for entry in reversed(recording.provenance):
        command = entry.get("command")
        if command in MAKERS:
            return dict(entry)
        if command == "solve":
            solved_anew = not _mapping(entry.get("figures")).get("kept")
            if solved_anew and wearer in _wearers(entry):
                return None
        elif command not in KEEPERS:
            return None
    return None


def _wearers(entry: Entry) -> set[str]:
    """Name all that a step was given, as `Hands.identities` does."""
    items = list(_items(entry))
    files = {str(item.get("sha256")) for item in items if item["role"] == "subject"}
    if files:
        return files
    sets = {str(item.get("sha256")) for item in items if item["role"] == "marker_set"}
    return sets | {str(item["marker_set"]) for item in items if "marker_set" in item}


def _items(entry: Entry) -> Iterator[Mapping[str, Any]]:
    """Inputs of a record that may be anybody's."""
    inputs = entry.get("inputs")
    for item in inputs if isinstance(inputs, list) else ():
        if isinstance(item, Mapping) and "role" in item:
            yield item


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _other_settings(entry: Entry, hands: Hands, settings: SolveConfig) -> str:
    """Say which settings of inverse kinematics differ from those of a record."""
    if hands.prior is None:
        return "its gaps were filled with a prior"
    given = hands.prior_sha256
    priors = [item.get("sha256") for item in _items(entry) if item["role"] == "prior"]
    if priors != ([] if given is None else [given]):
        return "its gaps were filled with another prior"
    then = _mapping(_mapping(entry.get("settings")).get("solve"))
    now = provenance.plain(asdict(settings))
    others = [key for key in now if then.get(key) != now[key]]
    if others:
        told = ", ".join(f"{key} = {then.get(key)}" for key in others)
        return f"its gaps were filled with {told}"
    return ""


def _filled(recording: Recording, subject: Subject) -> bool:
    """Whether a take has filled samples of a subject's markers."""
    markers = recording.markers
    if markers is None:
        return False
    own = [m for m, label in enumerate(markers.labels) if label in subject.model.labels]
    return bool((markers.origin[:, own] == Origin.FILLED).any())


def _whole(motion: Motion) -> bool:
    """Whether a motion has all that solving gives."""
    parts = ("translation", "rotation", "angles_sigma", "trusted", "residual")
    return all(getattr(motion, part) is not None for part in parts)


def _same_tree(one: JointTree | None, other: JointTree) -> bool:
    if one is None or (one.bones, one.hinges) != (other.bones, other.hinges):
        return False
    return all(
        np.array_equal(getattr(one, part), getattr(other, part))
        for part in ("parents", "offsets", "axes", "limits")
    )


def _fits(recording: Recording, subject: Subject, motion: Motion) -> bool:
    """Whether a motion is as far from the measured markers as it says."""
    away = markers_of(recording, subject.model)
    away -= marker_positions(subject.model, motion.poses)
    square = np.sum(away * away, axis=2)
    seen = np.isfinite(square)
    count = seen.sum(axis=1)
    mean = np.sum(square, axis=1, where=seen) / np.maximum(count, 1)
    found = np.where(count > 0, np.sqrt(mean), np.nan)
    assert motion.residual is not None  # see `_whole`
    return np.allclose(
        found, motion.residual, rtol=0.0, atol=SAME_RESIDUAL_M, equal_nan=True
    )
