"""Maycock 2015 figure 6 on simulated trials: automatic against true labels.

Eighteen subjects grasp objects (maycock26, 200 Hz, 14 cameras). Each subject is
calibrated from a range-of-motion take of its own, as a laboratory would; nothing of the
truth is used but to score. "x 4" is four times what takes have as usual: ghosts that
come and go, and those that live on beside a hidden marker; dropouts. "auto vs labelled"
is the paper's measure: the mean absolute difference of joint angles between the chain
run on automatic labels and the same chain run on the true labels (mean, standard
deviation and 95th percentile over trials, in degrees); "auto vs true" compares with the
angles the hand really had. The baseline labels by a frame-to-frame Hungarian without a
model, starting from the true labels of the first frame. The paper scores the first 500
frames: 0.085 +- 0.12 degrees.
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from multiprocessing import get_context

import numpy as np
from measuring import counted

from handclean.gaps.fill import fill
from handclean.hand.marker_set import load_marker_set
from handclean.io.hdf5.prior import read_prior
from handclean.labels.baseline import follow_points
from handclean.labels.label import label
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import make_subject, make_trial
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig

SUBJECTS = counted("subjects", 18, quick=6)
USUAL = counted("trials as usual", 108, quick=12)
OTHERS = counted("trials of each other condition", 36, quick=6)
LEARNT = counted("frames that a hand is learnt from", 400, quick=400, tiny=40)
PAPER_FRAMES = 500
GHOSTS, DROPOUTS = ("ghosts_per_s", "impostors_per_s"), ("dropouts_per_s",)


def times(factor, names):
    """Settings that are so many times their defaults."""
    return {name: factor * getattr(SimulateConfig(), name) for name in names}


CONDITIONS = {  # trials, and the settings that differ from the defaults
    "as usual": (USUAL, {}),
    "no ghosts, no dropouts": (OTHERS, times(0.0, GHOSTS + DROPOUTS)),
    "ghosts x 4": (OTHERS, times(4.0, GHOSTS)),
    "dropouts x 4": (OTHERS, times(4.0, DROPOUTS)),
    "both x 4": (OTHERS, times(4.0, GHOSTS + DROPOUTS)),
}


@cache
def subject_of(number):
    """Calibrate a subject from its labelled range-of-motion take."""
    markers, settings = load_marker_set("maycock26"), SimulateConfig(seed=2015)
    person = make_subject(number, markers, settings)
    rom = make_trial("rom", 1000 + number, person, markers, settings)
    return calibrate(
        [rom.labelled], markers, CalibrateConfig(frames=LEARNT), side="right"
    )[0]


def scores(found, truth, frames):
    """True positives, found and present samples in the first frames."""
    right = found.positions[:frames] == truth.positions[:frames]
    hits = right.all(axis=2) & found.measured[:frames] & truth.measured[:frames]
    return hits.sum(), found.measured[:frames].sum(), truth.measured[:frames].sum()


def apart(one, two, frames):
    """[degrees] mean absolute difference of all joint angles."""
    return np.degrees(np.abs(one[:frames] - two[:frames]).mean())


def trials_of(subject):
    """Score all trials of one subject, by condition and number."""
    return {
        (title, number): trial(number, changed)
        for title, (count, changed) in CONDITIONS.items()
        for number in range(subject, count, SUBJECTS)
    }


def trial(number, changed):
    """Score one trial of one condition."""
    settings = replace(SimulateConfig(seed=2015, subjects=SUBJECTS), **changed)
    markers = load_marker_set("maycock26")
    subject = subject_of(number % SUBJECTS)
    person = make_subject(number % SUBJECTS, markers, settings)
    take = make_trial("grasp", number, person, markers, settings)
    prior = read_prior()
    name = "right"

    def angles(recording):
        filled = fill(recording, subject, prior=prior, name=name)[0]
        return filled.motions[name].angles

    auto = label(take.unlabelled, subject, prior=prior, name=name)[0]
    known = take.labelled.markers
    followed = follow_points(take.unlabelled, known.labels, known.positions[0])
    plain = replace(take.unlabelled, markers=followed, unlabelled=None)
    true = take.truth.motions[name].angles
    reference = angles(take.labelled)
    out = {}
    for who, found in (("handclean", auto), ("frame to frame", plain)):
        mine = angles(found)
        for window in (PAPER_FRAMES, found.frames):
            out[f"{who} {'first 500' if window == PAPER_FRAMES else 'whole'}"] = (
                *scores(found.markers, take.labelled.markers, window),
                apart(mine, reference, window),
                apart(mine, true, window),
            )
    return out


def rows():
    """Rows: condition x labeller x window."""
    every, table = {}, []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for part in pool.map(trials_of, range(SUBJECTS)):
            every |= part
    for title, (count, _) in CONDITIONS.items():
        found = [every[title, number] for number in range(count)]
        for key in found[0]:
            hits, named, present, auto, true = np.array([f[key] for f in found]).T
            who = key.rsplit(" ", 2 if key.endswith("500") else 1)[0]
            table.append(
                {
                    "condition": title,
                    "trials": count,
                    "labels": who,
                    "frames": "first 500" if "500" in key else "whole",
                    "F1": round(2 * hits.sum() / (named + present).sum(), 5),
                    "trials without a wrong label": int((hits == named).sum()),
                    "auto vs labelled, mean": round(auto.mean(), 4),
                    "sd": round(auto.std(), 4),
                    "95 %": round(float(np.percentile(auto, 95)), 4),
                    "auto vs true, mean": round(true.mean(), 3),
                }
            )
    return table


if __name__ == "__main__":
    for line in rows():
        sys.stdout.write(json.dumps(line) + "\n")
