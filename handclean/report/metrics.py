"""How far one take is from another: labels, markers, joint angles.

Labels
    Of every marker that both takes name, in every frame: a label is *correct* if the
    measured sample it stands for is the reference's sample of that name. Precision =
    correct / labelled, recall = correct / labelled in the reference, F1 their harmonic
    mean. A *swap* is a stretch of a label's samples that are those of one and the same
    other marker; a *ghost* is a labelled sample that is no marker of the reference.

Markers
    Distances between samples of one name, apart for those the test measured and those
    it filled; only where the reference measured one. How often filled samples lie
    within their sigma is counted axis by axis, as sigma is per axis: 68 and 95 % of
    normal errors lie within one and two.

Joint angles
    As Maycock 2015 figure 6: the absolute differences of all joint angles over all
    frames, normalised by the number of frames and joint angles; their standard
    deviation and 95th percentile beside it. Differences are taken the short way round.
"""

from collections.abc import Mapping

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import HandcleanError
from handclean.recording import Motion, Origin, Recording, Trajectories
from handclean.remarks import Remark, first_of, remark
from handclean.report.comparison import (
    Comparison,
    LabelScore,
    MarkerErrors,
    MotionErrors,
    spread_of,
)
from handclean.report.identity import NOBODY, who_is_who
from handclean.report.settings import CompareConfig

SAME_RATE_SHARE = 1e-3
"""[-] relative difference of rates above which takes are not compared (chosen)."""


def compare(
    reference: Recording, test: Recording, settings: CompareConfig | None = None
) -> Comparison:
    """Compare a take with a reference.

    Takes of different length are compared where their frame numbers overlap.

    Raises
    ------
    HandcleanError
        If the rates differ, no frames overlap, or there is nothing both takes have.
    """
    settings = settings or CompareConfig()
    here, there, remarks = _overlap(reference, test, settings.frames)
    missing, extra = _only_one_has(reference, test)
    labels = markers = None
    if reference.markers is not None and test.markers is not None:
        both = [
            label for label in reference.markers.labels if label in test.markers.labels
        ]
        if both:
            old = _part(reference.markers, there, both)
            new = _part(test.markers, here, both)
            known = _part(reference.markers, there, list(reference.markers.labels))
            labels = _score(known, new, settings.tolerance_m)
            markers = _distances(old, new)
    motions = {
        name: _differences(old, new, there, here)
        for name, old, new in _pairs(reference.motions, test.motions)
        if set(old.names) & set(new.names)
    }
    if labels is None and not motions:
        raise HandcleanError(
            f"comparison: the takes share no marker and no motion; {_has(reference)} "
            f"against {_has(test)}"
        )
    return Comparison(
        frames=here.stop - here.start,
        labels=labels,
        markers=markers,
        motions=motions,
        missing=missing,
        extra=extra,
        remarks=remarks,
    )


def _overlap(
    reference: Recording, test: Recording, most: int
) -> tuple[slice, slice, tuple[Remark, ...]]:
    """Frames of the test and of the reference to compare, and what to say of them."""
    if not abs(test.rate - reference.rate) <= SAME_RATE_SHARE * reference.rate:
        raise HandcleanError(
            f"comparison: the test has {test.rate:.6g} Hz, the reference "
            f"{reference.rate:.6g} Hz; both should have the same rate"
        )
    first = max(reference.first_frame, test.first_frame)
    last = min(reference.first_frame + reference.frames, test.first_frame + test.frames)
    if last <= first:
        raise HandcleanError(
            f"comparison: frames {_frames_of(test)} of the test and "
            f"{_frames_of(reference)} of the reference do not overlap"
        )
    remarks: tuple[Remark, ...] = ()
    if _frames_of(test) != _frames_of(reference):
        text = (
            f"the test has frames {_frames_of(test)}, the reference "
            f"{_frames_of(reference)}: compared where they overlap"
        )
        remarks = (remark("not-compared", text, frames=(first, last - 1)),)
    if most > 0:
        last = min(last, first + most)
    here, there = first - test.first_frame, first - reference.first_frame
    size = last - first
    return slice(here, here + size), slice(there, there + size), remarks


def _frames_of(recording: Recording) -> str:
    first, last = recording.numbering.span(0, recording.frames)
    return f"{first}-{last}"


def _has(recording: Recording) -> str:
    labels = recording.markers.labels if recording.markers is not None else ()
    markers = first_of(labels)
    motions = ", ".join(recording.motions)
    return f"markers {markers or 'none'}, motions {motions or 'none'}"


def _only_one_has(
    reference: Recording, test: Recording
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of what only one take has, of the kinds that both have."""
    old: list[str] = []
    new: list[str] = []
    if reference.markers is not None and test.markers is not None:
        old += reference.markers.labels
        new += test.markers.labels
    pairs = _pairs(reference.motions, test.motions)
    for _, theirs, ours in pairs:
        old += theirs.names
        new += ours.names
    if len(pairs) < max(len(reference.motions), len(test.motions)):
        old += [f"motion {name}" for name in reference.motions]
        new += [f"motion {name}" for name in test.motions]
    return (
        tuple(name for name in dict.fromkeys(old) if name not in new),
        tuple(name for name in dict.fromkeys(new) if name not in old),
    )


def _part(markers: Trajectories, rows: slice, labels: list[str]) -> Trajectories:
    """Return some frames of some markers, in the order of ``labels``."""
    columns = [markers.labels.index(label) for label in labels]

    return Trajectories(
        positions=markers.positions[rows][:, columns],
        labels=tuple(labels),
        model=tuple(markers.model[column] for column in columns),
        origin=markers.origin[rows][:, columns],
        sigma=None if markers.sigma is None else markers.sigma[rows][:, columns],
        source=None if markers.source is None else markers.source[rows][:, columns],
    )


def _score(known: Trajectories, test: Trajectories, tolerance_m: float) -> LabelScore:
    """Score the labels of a test, whose markers are all among the known ones."""
    found, identity = who_is_who(known, test, tolerance_m)
    own = np.array([known.labels.index(label) for label in test.labels])
    correct = found == own
    seen = test.measured
    swapped = seen & (found != NOBODY) & ~correct
    return LabelScore(
        correct=int(np.count_nonzero(correct & seen)),
        labelled=int(np.count_nonzero(seen)),
        expected=int(np.count_nonzero(known.measured[:, own])),
        swapped=int(np.count_nonzero(swapped)),
        ghosts=int(np.count_nonzero(seen & (found == NOBODY))),
        swaps=sum(
            _stretches(found[:, m], swapped[:, m], seen[:, m]) for m in range(len(own))
        ),
        identity=identity,
    )


def _stretches(found: Ints, swapped: Bools, seen: Bools) -> int:
    """Stretches of one label's measured samples that are one other marker's."""
    who = np.where(swapped, found, NOBODY)[seen]
    begins = np.diff(who, prepend=NOBODY) != 0
    return int(np.count_nonzero(begins & (who != NOBODY)))


def _distances(reference: Trajectories, test: Trajectories) -> MarkerErrors:
    """Compare the places of markers of the same names."""
    apart = test.positions - reference.positions
    away = np.linalg.norm(apart, axis=2)
    away[~reference.measured] = np.nan
    measured = np.where(test.measured, away, np.nan)
    filled = np.where(test.origin == Origin.FILLED, away, np.nan)
    within = [float("nan")] * 2
    if test.sigma is not None:
        some = np.isfinite(filled) & (test.sigma > 0.0)
        share = np.abs(apart[some]) / test.sigma[some][:, None]
        if len(share):
            within = [float(np.mean(share <= times)) for times in (1.0, 2.0)]
    return MarkerErrors(
        measured=spread_of(measured),
        filled=spread_of(filled),
        by_marker={
            label: (spread_of(measured[:, m]), spread_of(filled[:, m]))
            for m, label in enumerate(test.labels)
        },
        within_one=within[0],
        within_two=within[1],
    )


def _pairs(
    reference: Mapping[str, Motion], test: Mapping[str, Motion]
) -> list[tuple[str, Motion, Motion]]:
    """Motions to compare: those of one name, or the only ones whatever their names."""
    both = [(name, reference[name], test[name]) for name in reference if name in test]
    if not both and len(reference) == len(test) == 1:
        (name, old), (new,) = next(iter(reference.items())), test.values()
        both = [(name, old, new)]
    return both


def _differences(
    reference: Motion, test: Motion, there: slice, here: slice
) -> MotionErrors:
    """Compare two motions in the hinges both have."""
    both = [name for name in reference.names if name in test.names]
    old = reference.angles[there][:, [reference.names.index(name) for name in both]]
    new = test.angles[here][:, [test.names.index(name) for name in both]]
    away = new - old
    around = np.remainder(away + np.pi, 2.0 * np.pi) - np.pi
    away = np.where(np.abs(away) > np.pi, around, away)
    translation = rotation = None
    if reference.translation is not None and test.translation is not None:
        moved = test.translation[here] - reference.translation[there]
        translation = spread_of(np.linalg.norm(moved, axis=1))
    if reference.rotation is not None and test.rotation is not None:
        rotation = spread_of(_turned(reference.rotation[there], test.rotation[here]))
    return MotionErrors(
        angles=spread_of(away),
        by_hinge={name: spread_of(away[:, d]) for d, name in enumerate(both)},
        translation=translation,
        rotation=rotation,
    )


def _turned(a: Floats, b: Floats) -> Floats:
    """(T,) [rad] angle between orientations, exact for small ones too."""
    same = np.sign(np.sum(a * b, axis=1, keepdims=True))
    b = b * np.where(same == 0.0, 1.0, same)
    half = np.clip(0.5 * np.linalg.norm(a - b, axis=1), 0.0, 1.0)
    return np.asarray(4.0 * np.arcsin(half))
