"""Fill the gaps of a labelled take: the entry of this package.

Every gap of every labelled marker is filled, and stays open where the error to be
expected is too large. What error to expect, the take tells: pseudo-gaps like its own
are filled and compared with what was measured (`pseudo`, `doubt`).

The method "auto" has several sources: the take's own regression (`regression`), the
bridged posture of a subject (`follow_posture`), and the marker's path of least
acceleration. One after another is asked for the gaps that those before it cannot fill
well enough, and the one that expects the least error fills the gap. (Averaging them,
each weighed by its precision on pseudo-gaps, was tried: 3 % more error than the
regression alone, which is the best of them in nearly every gap, and the posture takes
ten times as long.)
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from handclean.errors import TAKE, HandcleanError
from handclean.gaps.fill_tracks import FilledTracks, JudgedGap, fill_tracks
from handclean.gaps.hand import (
    BridgedHand,
    HandOfTake,
    bridge_hand,
    motion_of,
)
from handclean.gaps.runs import Limits
from handclean.gaps.samples import with_samples
from handclean.gaps.settings import FillConfig
from handclean.gaps.tracks import Tracks
from handclean.hand.subject import Subject
from handclean.ik.prior import PosturePrior, knowing
from handclean.ik.settings import SolveConfig
from handclean.ik.solve import expect_markers
from handclean.recording import Event, Recording

POSTURE_GAP_S = 0.5
"""[s] longest stretch over which joints are bridged, where no longest gap is asked for.
Beyond it a path of least acceleration tells next to nothing (table "gaps")."""

UNNAMED = "*"
"""Columns that a file gives no name are called "*1", "*2", ..."""

KIND = "gap"
"""Of every event of this package."""


@dataclass(frozen=True, kw_only=True)
class FillFigures:
    """What was filled.

    Attributes
    ----------
    method : name of the filler.
    gaps : gaps of labelled markers; filled : how many of them were filled.
    missing_samples, filled_samples : samples in all gaps, in the filled ones.
    longest_filled_s : [s]
    sigma_m : [m] median sigma, per axis, of filled samples; 0 if none has one.
    bridged_frames : frames in which some joint or the root was interpolated.
    filled_by : how many gaps each source filled.
    reasons : how many gaps were left open, by reason.
    """

    method: str
    gaps: int
    filled: int
    missing_samples: int
    filled_samples: int
    longest_filled_s: float
    sigma_m: float
    bridged_frames: int
    filled_by: dict[str, int]
    reasons: dict[str, int]

    @property
    def left_open(self) -> int:
        """Gaps that were not filled."""
        return self.gaps - self.filled


def fill(
    recording: Recording,
    subject: Subject,
    *,
    prior: PosturePrior | None = None,
    settings: FillConfig | None = None,
    solve: SolveConfig | None = None,
    name: str = "",
) -> tuple[Recording, FillFigures]:
    """Fill the gaps of a take of one hand, see `fill_take`."""
    name = name or subject.model.tree.side or subject.model.tree.kind
    return fill_take(
        recording, {name: subject}, prior=prior, settings=settings, solve=solve
    )


def fill_take(
    recording: Recording,
    subjects: Mapping[str, Subject],
    *,
    prior: PosturePrior | None = None,
    settings: FillConfig | None = None,
    solve: SolveConfig | None = None,
) -> tuple[Recording, FillFigures]:
    """Fill the gaps of a take's labelled markers.

    A subject's hand is solved anew from its measured samples; samples filled earlier
    count as missing, so that filling twice is filling once. Measured samples come back
    bit for bit. A rejected sample (origin 3) that a fill replaces moves to the
    unlabelled points. Filled samples have a sigma: the 68 % half-width of their error
    per axis. The bridged motion of each subject comes with the take, and
    ``angles_sigma``: what markers, paths and prior leave open and the constant error of
    each joint's zero (see `ik.doubt`); none where nothing tells of a joint.

    Parameters
    ----------
    recording : a labelled take.
    subjects : by the name of skeleton and motion; none where no hand is known.
    prior : posture subspace for joints the markers never decide.
    settings, solve : of the filling, of inverse kinematics.

    Raises
    ------
    HandcleanError
        If the take has no labelled marker, none of a subject's, or no rate; or if the
        method needs a subject and there is none.
    """
    settings, solve = settings or FillConfig(), solve or SolveConfig()
    if not recording.rate > 0.0:
        raise HandcleanError(
            f"its rate is {recording.rate} Hz; speeds and lengths of gaps need it, so "
            "it should be above 0",
            where=TAKE,
        )
    hands = hands_of(recording, subjects, prior, settings, solve)
    tracks = tracks_of(recording, subjects)
    bridged = {name: bridge_hand(hand, tracks) for name, hand in hands.items()}
    done = fill_tracks(tracks, list(bridged.values()), settings)
    places = np.full(tracks.positions.shape, np.nan)
    sigma = np.full(tracks.seen.shape, np.nan)
    for one in done.gaps:
        if one.path is not None and not one.gap.refused:
            rows = slice(one.gap.start, one.gap.stop)
            places[rows, one.gap.column] = one.path.places
            sigma[rows, one.gap.column] = one.path.spread
    labels = names_of(recording)
    whole = recording.markers.labels if recording.markers else ()
    columns = {m: whole.index(label) for m, label in enumerate(labels)}
    motions = {name: motion_of(hand) for name, hand in bridged.items()}
    skeletons = {name: subject.model.tree for name, subject in subjects.items()}
    filled = replace(
        with_samples(recording, columns, places, sigma, done.q95),
        skeletons={**recording.skeletons, **skeletons},
        motions={**recording.motions, **motions},
        events=_events(recording, labels, done.gaps),
    )
    return filled, _figures(done, bridged.values(), settings.method, recording.rate)


def names_of(recording: Recording) -> tuple[str, ...]:
    """Return the names of a take's labelled markers, not of columns without a name.

    Raises
    ------
    HandcleanError
        If there is none.
    """
    labels = () if recording.markers is None else recording.markers.labels
    names = tuple(label for label in labels if not label.startswith(UNNAMED))
    if not names:
        raise HandcleanError(
            "has no labelled markers; 'handclean label' names them", where=TAKE
        )
    return names


def tracks_of(recording: Recording, subjects: Mapping[str, Subject]) -> Tracks:
    """Return the measured samples of a take's labelled markers, see `names_of`."""
    labels, markers = names_of(recording), recording.markers
    assert markers is not None
    columns = [markers.labels.index(label) for label in labels]
    measured = markers.measured[:, columns, None]
    bones, base = np.full(len(labels), -1), 0
    for subject in subjects.values():
        of_label = dict(zip(subject.model.labels, subject.model.bone, strict=True))
        for m, label in enumerate(labels):
            if label in of_label:
                bones[m] = base + of_label[label]
        base += len(subject.model.tree.parents)
    return Tracks(
        positions=np.where(measured, markers.positions[:, columns], np.nan),
        rate=recording.rate,
        bones=bones,
    )


def hands_of(
    recording: Recording,
    subjects: Mapping[str, Subject],
    prior: PosturePrior | None,
    settings: FillConfig,
    solve: SolveConfig,
) -> dict[str, HandOfTake]:
    """Return the hands of a take, with what of their joints may be bridged.

    Raises
    ------
    HandcleanError
        If the take has none of a subject's markers.
    """
    limits = Limits(
        longest=int(round((settings.max_gap_s or POSTURE_GAP_S) * recording.rate, 6)),
        seed=settings.seed_frames,
        rate=recording.rate,
    )
    found = {}
    for name, subject in subjects.items():
        expect_markers(recording, subject.model)
        labels = names_of(recording)
        found[name] = HandOfTake(
            subject=subject,
            columns={
                m: labels.index(label)
                for m, label in enumerate(subject.model.labels)
                if label in labels
            },
            prior=knowing(prior, subject.model.tree.hinges),
            limits=limits,
            coupled=settings.method != "min-acceleration",
            solve=solve,
        )
    return found


def _events(
    recording: Recording, labels: Sequence[str], judged: Sequence[JudgedGap]
) -> tuple[Event, ...]:
    """Events of a take with those of its gaps in place of an earlier run's."""
    kept = [
        event
        for event in recording.events
        if event.kind != KIND or event.marker not in labels
    ]
    for one in judged:
        marker = labels[one.gap.column]
        kept.append(
            Event(
                start=one.gap.start,
                stop=one.gap.stop,
                text=f"gap in {marker}: {_what_became(one)}",
                kind=KIND,
                marker=marker,
            )
        )
    return tuple(sorted(kept, key=lambda event: (event.start, event.stop)))


def _what_became(one: JudgedGap) -> str:
    """Say what filled a gap and how far off to expect it, or why it is open."""
    expected = f"expected error {1e3 * one.expected_m:.2g} mm per axis"
    if one.gap.refused:
        unsure = "" if one.path is None else f"; {expected}"
        return f"left open, {one.gap.refused}{unsure}"
    return f"filled by {one.source}; {expected}"


def _figures(
    done: FilledTracks, bridged: Iterable[BridgedHand], method: str, rate: float
) -> FillFigures:
    filled = [one for one in done.gaps if not one.gap.refused]
    sigma = [one.path.spread for one in filled if one.path is not None]
    by = Counter(one.source for one in filled)
    why = Counter(one.gap.refused for one in done.gaps if one.gap.refused)
    postures = [hand.scene.posture for hand in bridged]
    return FillFigures(
        method=method,
        gaps=len(done.gaps),
        filled=len(filled),
        missing_samples=sum(one.gap.frames for one in done.gaps),
        filled_samples=sum(one.gap.frames for one in filled),
        longest_filled_s=max((one.gap.frames for one in filled), default=0) / rate,
        sigma_m=float(np.median(np.concatenate(sigma))) if sigma else 0.0,
        bridged_frames=sum(
            int((part.bridged.any(axis=1) | part.bridged_root).sum())
            for part in postures
        ),
        filled_by=dict(by.most_common()),
        reasons=dict(why.most_common()),
    )
