"""Takes in which nothing is missing, to cut gaps into, and takes with their own gaps.

The recordings are those of the folder that HANDCLEAN_DATA names, by default those kept
beside the project. A recording that is not there is left out, and noted.
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from measuring import absent

from handclean.arrays import runs
from handclean.errors import HandcleanError
from handclean.gaps.evaluate import limbs_of
from handclean.gaps.tracks import Tracks
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.io.files import read
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

BESIDE = Path(__file__).parents[4] / "shared" / "data"
DATA = Path(os.environ.get("HANDCLEAN_DATA", BESIDE))

SIMULATION_NOISE_M = 0.2e-3
"""[m] per axis, added to where simulated markers truly are."""

NOISY = 4
"""sig18 sequences: the longest ones."""


@dataclass(frozen=True)
class Take:
    """A take.

    Attributes
    ----------
    name : of it.
    positions : (T, M, 3) [m].
    rate : [Hz]
    labels : M names.
    fingers : columns of each finger's markers.
    margin : [frames] at both ends in which nothing is cut.
    bones : (M,) rigid body of each marker, None where it is not known.
    """

    name: str
    positions: np.ndarray
    rate: float
    labels: tuple
    fingers: list
    margin: int = 300
    bones: np.ndarray | None = None

    def tracks(self, positions=None):
        """The take as fillers are given it."""
        given = self.positions if positions is None else positions
        bones = np.full(given.shape[1], -1) if self.bones is None else self.bones
        return Tracks(positions=given, rate=self.rate, bones=bones)


def _read(name, path, **options):
    if not (DATA / path).is_file():
        absent(name)
        return None
    return read(DATA / path, **options)


def _on_bones(labels, subject):
    """Fingers' columns and (M,) bones, as a subject has the markers."""
    of_label = dict(zip(subject.model.labels, subject.model.bone, strict=True))
    bones = np.array([of_label.get(label, -1) for label in labels])
    limbs = limbs_of(labels, {"hand": subject})
    return [limb for limb in limbs if len(limb) > 1], bones


def dfki13():
    """The right hand of a Qualisys recording with its gaps, or None."""
    take = _read("dfki13", "hand_embodiment/recording.tsv")
    return take and of_set(take, "dfki13", "dfki13")


def pick1():
    """The right hand of a guitarist with its gaps, or None."""
    take = _read("Pick1", "guitar/Pick1.csv", rate_hz=120.0, unit="mm")
    return take and of_set(take, "Pick1 right", "xu19")


def of_set(take, name, marker_set, **more):
    """The markers of a set."""
    known = load_marker_set(marker_set).labels
    columns = [m for m, label in enumerate(take.markers.labels) if label in known]
    labels = tuple(take.markers.labels[m] for m in columns)
    measured = take.markers.measured[:, columns]
    places = np.where(measured[:, :, None], take.markers.positions[:, columns], np.nan)
    subject = template_subject(load_marker_set(marker_set))
    fingers, bones = _on_bones(labels, subject)
    return Take(name, places, take.rate, labels, fingers, bones=bones, **more)


def always_seen(take):
    """A take with those of its markers only that are never missing."""
    kept = np.flatnonzero(np.isfinite(take.positions).all(axis=(0, 2)))
    labels = tuple(take.labels[m] for m in kept)
    fingers = [np.flatnonzero(np.isin(kept, finger)) for finger in take.fingers]
    fingers = [finger for finger in fingers if len(finger) > 1]
    return replace(
        take,
        positions=take.positions[:, kept],
        labels=labels,
        fingers=fingers,
        bones=None if take.bones is None else take.bones[kept],
    )


def longest_whole(take):
    """The longest stretch of a take in which all of its markers are seen."""
    whole = np.isfinite(take.positions).all(axis=(1, 2))
    start, stop = max(runs(whole), key=lambda part: part[1] - part[0])
    return replace(take, positions=take.positions[start:stop])


def art():
    """Both hands of a whole-body recording: 20 finger points each."""
    path = "c3d/sample_37/ART-Human_hands_real_no6dof.c3d"
    take = _read("ART", path)
    found = []
    for side, letter in (("left", "L"), ("right", "R")) if take else ():
        short = [label.split(":")[-1] for label in take.markers.labels]
        columns = [
            m
            for m, label in enumerate(short)
            if label[0] == letter
            and (label[1:3] in ("IF", "MF", "RF") or label[1] in "TP")
            and len(label) == 4
            and label != letter + "TSP"
        ]
        labels = tuple(short[m] for m in columns)
        fingers = [
            np.flatnonzero([label[1] == finger for label in labels])
            for finger in "TIMRP"
        ]
        places = np.where(
            take.markers.measured[:, columns, None],
            take.markers.positions[:, columns],
            np.nan,
        )
        moving = np.r_[True, np.any(np.diff(places, axis=0) != 0.0, axis=(1, 2))]
        places[~moving] = np.nan  # repeated frames are not measured
        hand = Take(f"ART {side}", places, take.rate, labels, fingers)
        found.append(longest_whole(hand))
    return found


def real():
    """The gap-free takes of the yardstick: dfki13, Pick1 right, both hands of ART."""
    found = [
        longest_whole(take) if take.name == "dfki13" else always_seen(take)
        for take in (dfki13(), pick1())
        if take is not None
    ]
    return [*found, *art()]


def noisy():
    """The longest sig18 sequences: markers with 3 mm of noise."""
    files = sorted((DATA / "sig18").rglob("*.trc"))
    if not files:
        absent("sig18")
        return []
    files = sorted(files, key=lambda path: (-path.stat().st_size, str(path)))
    found = []
    for path in files[: 3 * NOISY]:
        try:
            take = of_set(read(path, unit="mm"), path.stem, "han19", margin=60)
        except HandcleanError:
            continue
        found.append(longest_whole(take))
    found = [take for take in found if len(take.positions) > 400][:NOISY]
    return [replace(take, name=f"sig18 {n}") for n, take in enumerate(found, 1)]


def simulated(count):
    """Gestures and grasps of simulated hands in turns, 20 s at 100 Hz, with noise."""
    found = []
    for number in range(count):
        kind = ("free", "grasp")[number % 2]
        settings = SimulateConfig(
            trials=1, subjects=1, seed=100 + number, rate_hz=100.0, duration_s=20.0
        )
        trial = next(iter(simulate(kind, settings)))
        markers = trial.truth.markers
        rng = np.random.default_rng([101, number])
        noise = rng.normal(scale=SIMULATION_NOISE_M, size=markers.positions.shape)
        fingers, bones = _on_bones(markers.labels, trial.subject)
        found.append(
            Take(
                f"simulated {kind}",
                markers.positions + noise,
                trial.truth.rate,
                markers.labels,
                fingers,
                bones=bones,
            )
        )
    return found
