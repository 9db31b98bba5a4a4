"""``calibrate-hand markers``: from labelled takes of one hand to its subject.

1. Size and side of the hand from a few frames, against the template of either side.
2. A first adjustment over frames spread evenly in time; with it the pose of every
   candidate frame, and so which frames differ, and which samples are mislabelled.
3. Frames are chosen far from each other and the hand adjusted, without the blocks of
   time kept aside; these then measure the error. Axes of joints that moved so little
   that nothing was learnt about them are set back to the template's.
4. The same once more with all frames: that hand is the result. Its held-out error is
   the one of step 3, which knew less.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.errors import UsageError
from handclean.hand.marker_set import MarkerSet
from handclean.hand.model import Model, marker_positions, neutral_pose
from handclean.hand.subject import Subject
from handclean.hand.template import template
from handclean.recording import Recording
from handclean.remarks import Remark
from handclean.subject import judge
from handclean.subject.adjust import Adjusted, Known, Problem, adjust, residuals
from handclean.subject.alike import remarks_on_takes
from handclean.subject.frames import (
    LEAST_FRAMES,
    Frames,
    camera_noise,
    farthest,
    gather,
    kept_aside,
    thinned,
    usable,
)
from handclean.subject.judge import Fit, HeldOut
from handclean.subject.report import (
    CalibrationReport,
    remarks_on_equations,
    remarks_on_joints,
    remarks_on_markers,
    remarks_on_noise,
    remarks_on_side,
)
from handclean.subject.settings import CalibrateConfig
from handclean.subject.shape import SIZE_NUMBERS, Expectation, Shape, tilt_sigmas
from handclean.subject.start import first_poses, guess, loose, scaled
from handclean.tree import POSE_HEAD

GUESS_FRAMES = 12
"""Frames that size and side are guessed from (chosen)."""

MOST_CANDIDATE_FRAMES = 1200
"""Frames that are looked at when frames are chosen, and when errors are measured
(chosen)."""

LEAST_CLEAN_SHARE = 0.3
"""Share of the candidates that must fit well for the others to be left out (chosen)."""

STILL_AXIS_TILT_SD_RAD = 0.005
"""[rad] how far the axis of a joint that hardly moved may tilt (chosen)."""

SCANNED_HAND = Expectation(
    length=0.03,
    joint_m=0.001,
    knuckle_m=0.002,
    tilt_rad=0.08,
    place_m=0.003,
    size=0.02,
)
"""How far a hand may be from what a scan told of it (chosen)."""

START_NOISE_M = 0.005
"""[m] noise the first adjustment starts with: the template is not better than that
(chosen)."""


def calibrate(
    takes: Sequence[Recording],
    marker_set: MarkerSet,
    settings: CalibrateConfig,
    *,
    side: str = "",
    name: str = "",
    known: Model | None = None,
    names: Sequence[str] = (),
) -> tuple[Subject, CalibrationReport]:
    """Find the bone lengths, joint places, axes and marker places of one hand.

    Parameters
    ----------
    takes : labelled takes of the same hand with the same markers.
    marker_set : what the markers are called and about where they are.
    side : "left" or "right"; "" for the marker set's.
    name : whose hand it is.
    known : what is known of this hand and its markers, such as from a scan; it is then
        expected instead of a template, and closely.
    names : what remarks call the takes; "take 1", "take 2" when not given.

    Returns
    -------
    The subject, and figures and remarks on how good it is.

    Raises
    ------
    UnknownNameError
        If a take lacks a marker of the set.
    UsageError
        If the side is neither, or clearly not that of the hand measured, or the set is
        not one for hands.
    HandcleanError
        If too few frames hold enough markers, or what they show is not of a hand's
        size.
    """
    side = side or marker_set.side
    if marker_set.kind != "hand" or side not in ("left", "right"):
        what = marker_set.kind if marker_set.kind != "hand" else f"side '{side}'"
        raise UsageError(
            f"marker set {marker_set.name}: {what}; a hand, left or right, is needed"
        )
    every = gather(takes, marker_set.labels, names)
    frames = usable(every)
    first = guess(marker_set, frames.only(thinned(frames, GUESS_FRAMES)), side)
    tree = template(side, forearm=marker_set.forearm, subject=name)
    expected = scaled(marker_set.on(tree), first.size) if known is None else known
    task = _Task(
        template=expected,
        closely=known is not None,
        camera_m=camera_noise(every),
        settings=settings,
    )
    aside = kept_aside(frames, settings.holdout, settings.block_s)
    start = Shape(model=task.template, sizes=np.ones(SIZE_NUMBERS))
    learned = task.learn(frames.only(~aside), start)
    judged = frames.only(aside)
    heldout = judge.held_out(
        learned.adjusted.known, judged.only(thinned(judged, MOST_CANDIDATE_FRAMES))
    )
    if aside.any():
        learned = task.learn(frames, learned.adjusted.shape)
    remarks = [
        *remarks_on_takes(task.template, every),
        *remarks_on_markers(marker_set.labels, every, learned.candidates, learned.fit),
        *remarks_on_equations(frames, tree),
        *remarks_on_noise(task.camera_m),
        *remarks_on_side(side, first.clear),
    ]
    counts = {"frames": len(every), "frames_usable": len(frames)}
    report = task.report(learned, heldout, counts, remarks)
    return _subject(learned, marker_set, report, name), report


def measure(subject: Subject, takes: Sequence[Recording]) -> HeldOut:
    """Measure the error of a calibrated hand on labelled takes.

    Parameters
    ----------
    subject : as `calibrate` returned it; takes : of the same hand and markers.

    Raises
    ------
    UnknownNameError
        If a take lacks one of the subject's markers.
    HandcleanError
        If too few frames hold enough markers.
    """
    frames = usable(gather(takes, subject.model.labels))
    expected = loose(subject.model).times(1.0 / MOST_CANDIDATE_FRAMES)
    sigma_m = subject.errors["noise_m"]
    known = Known(
        model=subject.model,
        sigma_m=sigma_m,
        soft=(CalibrateConfig.robust * sigma_m) ** -2,
        pose_prior=expected,
    )
    return judge.held_out(known, frames.only(thinned(frames, MOST_CANDIDATE_FRAMES)))


@dataclass(frozen=True, kw_only=True)
class _Learned:
    """A hand and what it was learnt from.

    Attributes
    ----------
    problem, adjusted : the last adjustment.
    candidates, fit : the frames it chose from, and how the hand fits them.
    went : (D, 2) [rad] from where to where hinges went.
    left : (D,) hinges that moved so little that their axes were left alone.
    iterations : steps of all adjustments.
    """

    problem: Problem
    adjusted: Adjusted
    candidates: Frames
    fit: Fit
    went: Floats
    left: Bools
    iterations: int


@dataclass(frozen=True, kw_only=True)
class _Task:
    """What stays the same through a calibration."""

    template: Model
    closely: bool
    camera_m: float
    settings: CalibrateConfig

    def problem(self, frames: Frames) -> Problem:
        """Return the adjustment of the hand over these frames."""
        expect = SCANNED_HAND
        if not self.closely:
            expect = Expectation(
                length=self.settings.length,
                place_m=self.settings.place_m,
                tilt_rad=self.settings.tilt_rad,
            )
        return Problem(
            template=self.template,
            expect=expect,
            tilt_rad=tilt_sigmas(self.template, expect),
            pose_prior=loose(self.template),
            targets=frames.targets,
            seen=frames.seen,
            camera_m=self.camera_m,
            independent=self.settings.independent,
            robust=self.settings.robust,
        )

    def learn(self, frames: Frames, shape: Shape) -> _Learned:
        """Choose frames and adjust the hand over them, starting from ``shape``."""
        candidates = frames.only(thinned(frames, MOST_CANDIDATE_FRAMES))
        some = candidates.only(thinned(candidates, self.settings.frames // 2))
        poses, _ = first_poses(shape.model, some.targets, some.seen)
        rough = adjust(self.problem(some), shape, poses, START_NOISE_M, final=False)
        fits = judge.fit(rough.known, candidates)
        rows = self.chosen(rough.shape.model, fits)
        problem = self.problem(candidates.only(rows))
        sigma_m = 2.0 * rough.known.sigma_m
        final = adjust(problem, rough.shape, fits.poses[rows], sigma_m)
        tried = rough.iterations + final.iterations
        fits = judge.fit(final.known, candidates)
        went = judge.ranges(final.known, fits, candidates)
        left = judge.unmoved(went, self.settings.moved_rad)
        left &= judge.unlearnt(problem, final)
        if left.any():
            held = np.where(left, STILL_AXIS_TILT_SD_RAD, problem.tilt_rad)
            problem = replace(problem, tilt_rad=held)
            sigma_m = final.known.sigma_m
            final = adjust(problem, final.shape, final.poses, sigma_m)
            tried += final.iterations
            fits = judge.fit(final.known, candidates)
            went = judge.ranges(final.known, fits, candidates)
        return _Learned(
            problem=problem,
            adjusted=final,
            candidates=candidates,
            fit=fits,
            went=went,
            left=left,
            iterations=tried,
        )

    def chosen(self, model: Model, fits: Fit) -> Ints:
        """Rows of frames whose postures differ; the root's motion does not count.

        Frames with a doubtful sample are left out, unless most are like that.
        """
        rows = np.flatnonzero(fits.clean)
        if len(rows) < max(LEAST_FRAMES, LEAST_CLEAN_SHARE * len(fits.clean)):
            rows = np.arange(len(fits.clean))
        still = fits.poses[rows]
        still[:, :POSE_HEAD] = neutral_pose(model.tree)[:POSE_HEAD]
        places = marker_positions(model, still).reshape(len(rows), -1)
        places /= np.sqrt(len(model.labels))
        settings = self.settings
        return rows[farthest(places, settings.frames, settings.novel_m)[0]]

    def report(
        self,
        learned: _Learned,
        heldout: HeldOut,
        counts: dict[str, int],
        remarks: list[Remark],
    ) -> CalibrationReport:
        """Put figures and remarks together."""
        adjusted, problem = learned.adjusted, learned.problem
        model = adjusted.shape.model
        went, hinges = learned.went, model.tree.hinges
        still = judge.unmoved(went, self.settings.moved_rad)
        more = remarks_on_joints(hinges, went, still, learned.left)
        found, sigma = judge.lengths(adjusted)
        train = residuals(model, adjusted.poses, problem.targets, problem.seen)
        by_marker = zip(model.labels, heldout.by_marker_m.tolist(), strict=True)
        moved = np.nan_to_num(went[:, 1] - went[:, 0])
        return CalibrationReport(
            side=model.tree.side,
            size=self.template.tree.scale * float(adjusted.shape.sizes[0]),
            frames=counts["frames"],
            frames_usable=counts["frames_usable"],
            frames_used=len(adjusted.poses),
            frames_held_out=heldout.frames,
            train_rms_m=judge.rms(train),
            heldout_rms_m=heldout.rms_m,
            heldout_kept_rms_m=heldout.kept_rms_m,
            heldout_by_marker_m=dict(by_marker),
            doubtful=heldout.doubtful,
            noise_m=adjusted.known.sigma_m,
            camera_noise_m=self.camera_m,
            lengths_m=found,
            lengths_sigma_m=sigma,
            moved_rad=dict(zip(hinges, moved.tolist(), strict=True)),
            poorly_moved=tuple(hinges[d] for d in np.flatnonzero(still)),
            iterations=learned.iterations,
            remarks=(*more, *remarks),
        )


def _subject(
    learned: _Learned, marker_set: MarkerSet, report: CalibrationReport, name: str
) -> Subject:
    """Make the subject that solvers use."""
    model = learned.adjusted.shape.model
    limits = judge.widened(model.tree, learned.went)
    tree = replace(model.tree, limits=limits, scale=report.size, subject=name)
    errors = {
        "frames_used": float(report.frames_used),
        "frames_held_out": float(report.frames_held_out),
        "train_rms_m": report.train_rms_m,
        "heldout_rms_m": report.heldout_rms_m,
        "heldout_kept_rms_m": report.heldout_kept_rms_m,
        "noise_m": report.noise_m,
    }
    for joint, sigma in report.lengths_sigma_m.items():
        errors[f"{joint}_length_sigma_m"] = sigma
    return Subject(
        name=name,
        model=replace(model, tree=tree),
        marker_set=marker_set.name,
        marker_sigma=np.array([judge.rms(column) for column in learned.fit.kept.T]),
        errors=errors,
    )
