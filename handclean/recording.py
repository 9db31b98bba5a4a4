"""A take: marker trajectories, points nobody explains, skeletons, motions, history.

The types mirror the session file (HDF5), part for part, in SI units. Every part may be
absent. Missing samples are NaN. Nothing here knows a file format.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from importlib import import_module
from typing import Any

import numpy as np

from handclean.arrays import Bools, Bytes, Floats, Floats32, Ints, Ints32, expect_shape
from handclean.errors import HandcleanError, UnknownNameError
from handclean.remarks import Remark
from handclean.tree import JointTree


class Origin(IntEnum):
    """Where a sample of a trajectory comes from."""

    MISSING = 0
    MEASURED = 1
    FILLED = 2
    REJECTED = 3
    SMOOTHED = 4  # measured, then smoothed


@dataclass(frozen=True, kw_only=True)
class Trajectories:
    """Named marker trajectories.

    Attributes
    ----------
    positions : (T, M, 3) [m], NaN where missing.
    labels : M marker names.
    model : M names of the skeleton each belongs to, or "".
    origin : (T, M) uint8, see `Origin`.
    sigma : (T, M) float32 [m], 68 % half-width of the error per axis of filled samples;
        or None.
    confidence : (T, M) float32, 0..1, how sure the label is, or None.
    source : (T, M) int32, raw column or point of the source, -1 none; or None.
    residual : (T, M) float32 [m], as the source file had it; or None.
    cameras : (T, M) uint8 camera mask, as the source file had it; or None.
    raw : (T, M, 3) [m] as it was measured what is smoothed (origin 4), NaN elsewhere;
        or None.
    q95 : (K, 2) length of gaps [s], rising, and how many sigmas hold 95 % of the errors
        of gaps so long, or None.
    """

    positions: Floats
    labels: tuple[str, ...]
    model: tuple[str, ...]
    origin: Bytes
    sigma: Floats32 | None = None
    confidence: Floats32 | None = None
    source: Ints32 | None = None
    residual: Floats32 | None = None
    cameras: Bytes | None = None
    raw: Floats | None = None
    q95: Floats | None = None

    def __post_init__(self) -> None:
        frames, markers = self.positions.shape[:2]
        expect_shape("positions", self.positions, "T", "M", 3)
        expect_shape("labels", np.array(self.labels, dtype=object), markers)
        expect_shape("model", np.array(self.model, dtype=object), markers)
        expect_shape("origin", self.origin, frames, markers)
        for name in ("sigma", "confidence", "source", "residual", "cameras"):
            array = getattr(self, name)
            if array is not None:
                expect_shape(name, array, frames, markers)
        if self.raw is not None:
            expect_shape("raw", self.raw, frames, markers, 3)
        if self.q95 is not None:
            expect_shape("q95", self.q95, "K", 2)

    @property
    def measured(self) -> Bools:
        """(T, M) samples that come from the cameras (and may have been smoothed)."""
        return np.isin(self.origin, (Origin.MEASURED, Origin.SMOOTHED))

    @property
    def has_raw(self) -> Bools:
        """(T, M) smoothed samples of which is known how they were measured."""
        smoothed = self.origin == Origin.SMOOTHED
        if self.raw is None:
            return np.zeros_like(smoothed)
        return np.asarray(smoothed & np.isfinite(self.raw).all(axis=2))

    @property
    def as_measured(self) -> Floats:
        """(T, M, 3) [m] positions, those of smoothed samples as they were measured."""
        if self.raw is None:
            return self.positions
        return np.where(self.has_raw[:, :, None], self.raw, self.positions)

    def index(self, label: str, where: str = "take") -> int:
        """Column of a marker.

        Raises
        ------
        UnknownNameError
            If no marker has that name.
        """
        if label not in self.labels:
            raise UnknownNameError(where, "marker", label, self.labels)
        return self.labels.index(label)


def trajectories(
    positions: Floats, labels: tuple[str, ...], **parts: Any
) -> Trajectories:
    """Make trajectories whose finite samples count as measured.

    Parameters
    ----------
    positions : (T, M, 3) [m], NaN where missing; labels : M marker names.
    **parts : of `Trajectories`; those given are taken as they are.
    """
    seen = np.isfinite(positions).all(axis=2)
    parts.setdefault("origin", seen.astype(np.uint8))
    parts.setdefault("model", ("",) * len(labels))
    return Trajectories(positions=positions, labels=tuple(labels), **parts)


@dataclass(frozen=True, kw_only=True)
class Points:
    """One row per measured point that no model explains; sorted by frame.

    Attributes
    ----------
    frame : (P,) int32, row of the take's arrays, from 0; see `Numbering`.
    source : (P,) int32, raw column the point came from, -1 none.
    positions : (P, 3) [m].
    residual : (P,) float32 [m] or None.
    cameras : (P,) uint8 camera mask or None.
    """

    frame: Ints32
    source: Ints32
    positions: Floats
    residual: Floats32 | None = None
    cameras: Bytes | None = None

    def __post_init__(self) -> None:
        count = len(self.frame)
        expect_shape("frame", self.frame, count)
        expect_shape("source", self.source, count)
        expect_shape("positions", self.positions, count, 3)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """How a joint tree moved.

    Attributes
    ----------
    names : D names of the hinge angles.
    angles : (T, D) [rad].
    translation : (T, 3) [m] root in the laboratory, or None (a glove alone).
    rotation : (T, 4) unit quaternion w, x, y, z, root to laboratory; or None.
    angles_sigma : (T, D) [rad] standard deviation, where known.
    trusted : (T,) bool.
    residual : (T,) [m] RMS distance over the markers measured in that frame.
    """

    names: tuple[str, ...]
    angles: Floats
    translation: Floats | None = None
    rotation: Floats | None = None
    angles_sigma: Floats | None = None
    trusted: Bools | None = None
    residual: Floats | None = None

    def __post_init__(self) -> None:
        frames = len(self.angles)
        expect_shape("angles", self.angles, frames, len(self.names))
        if self.translation is not None:
            expect_shape("translation", self.translation, frames, 3)
        if self.rotation is not None:
            expect_shape("rotation", self.rotation, frames, 4)

    @property
    def poses(self) -> Floats:
        """(T, 7 + D) pose rows; a motion without a root stands at the origin."""
        frames = len(self.angles)
        rows = np.zeros((frames, 7 + len(self.names)))
        rows[:, 3] = 1.0
        if self.translation is not None:
            rows[:, :3] = self.translation
        if self.rotation is not None:
            rows[:, 3:7] = self.rotation
        rows[:, 7:] = self.angles
        return rows

    def to_dataframe(self) -> Any:
        """Return the motion as a pandas table, one row per frame.

        Returns
        -------
        pandas.DataFrame
            Rows count from 0. Columns: ``translation_x`` ... [m], ``rotation_w`` ...
            (a unit quaternion), each angle by its name [rad] and, behind them, its
            standard deviation, ``NAME_sigma`` [rad]; ``trusted``, ``residual`` [m].
            What the motion does not have is left out.

        Raises
        ------
        HandcleanError
            If pandas is not there; handclean does not need it otherwise.
        """
        try:
            pandas = import_module("pandas")
        except ImportError:
            raise HandcleanError(
                "needs pandas, which is not installed; 'pip install pandas' does it",
                where="to_dataframe",
            ) from None
        columns: dict[str, Any] = {}
        for name, axes in (("translation", "xyz"), ("rotation", "wxyz")):
            values = getattr(self, name)
            if values is not None:
                of_axes = zip(axes, values.T, strict=True)
                columns |= {f"{name}_{axis}": column for axis, column in of_axes}
        columns |= dict(zip(self.names, self.angles.T, strict=True))
        if self.angles_sigma is not None:
            of_angles = zip(self.names, self.angles_sigma.T, strict=True)
            columns |= {f"{name}_sigma": column for name, column in of_angles}
        for name in ("trusted", "residual"):
            if getattr(self, name) is not None:
                columns[name] = getattr(self, name)
        return pandas.DataFrame(columns)


def motion_from_poses(names: tuple[str, ...], poses: Floats, **parts: Any) -> Motion:
    """Split pose rows into a motion.

    Parameters
    ----------
    names : of the D hinges.
    poses : (T, 7 + D) place [m], unit quaternion w, x, y, z, hinge angles [rad].
    **parts : of `Motion`.
    """
    return Motion(
        names=names,
        translation=poses[:, :3].copy(),
        rotation=poses[:, 3:7].copy(),
        angles=poses[:, 7:].copy(),
        **parts,
    )


@dataclass(frozen=True)
class Numbering:
    """How the source numbers the frames of a take: upwards from its first one's number.

    In arrays and calls a frame is a row, counted from 0, and a range leaves its stop
    out. Wherever a person reads or writes a frame (messages, figures, options, events
    in a file) it is the source's number, and a range has both its ends. Nothing but
    this turns the one into the other.
    """

    first: int

    def of(self, row: int) -> int:
        """Return the number of a row."""
        return self.first + int(row)

    def span(self, start: int, stop: int) -> tuple[int, int]:
        """Return the first and the last number of rows ``start`` up to ``stop``."""
        return self.first + int(start), self.first + int(stop) - 1

    def rows(self, first: int, last: int) -> tuple[int, int]:
        """Return ``start`` and ``stop`` of what `span` made the numbers of."""
        return int(first) - self.first, int(last) - self.first + 1

    def words(self, start: int, stop: int) -> str:
        """Say which rows, as in "frame 995" and "frames 995 to 1020"."""
        first, last = self.span(start, stop)
        return f"frame {first}" if first == last else f"frames {first} to {last}"


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened in rows ``start`` up to ``stop``, which is left out.

    Rows count from 0; a session file has the source's numbers, see `Numbering`.

    Attributes
    ----------
    kind : one of `handclean.remarks.KINDS`, "" where the file does not say.
    model, marker : the hand or object, and the marker, it is about; or "".
    """

    start: int
    stop: int
    text: str
    kind: str = ""
    model: str = ""
    marker: str = ""


@dataclass(frozen=True, kw_only=True)
class Analog:
    """Analog channels carried over from the source.

    Attributes
    ----------
    values : (T * samples_per_frame, C) in ``units``.
    labels, units : C names.
    rate : [Hz].
    """

    values: Floats
    labels: tuple[str, ...]
    units: tuple[str, ...]
    rate: float


@dataclass(frozen=True, kw_only=True)
class SourceEvent:
    """An event of the source file: ``time`` in seconds from its first frame."""

    time: float
    label: str
    context: str = ""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """One take, with everything known about it.

    Attributes
    ----------
    rate : [Hz]; frames : T; first_frame : number the source gives its first frame.
    start_time : [s] the time the source gives its first frame.
    up_axis : "+y", "+z" ... or "" when unknown.
    parameters : what else the source carried, as nested plain values and arrays.
    provenance : one entry (plain JSON values) per step that made this take.
    remarks : what reading this take and the steps since then told. A session keeps
        them as events; in the take that is read from it they are events only.
    """

    rate: float
    frames: int
    first_frame: int = 1
    start_time: float = 0.0
    up_axis: str = ""
    markers: Trajectories | None = None
    unlabelled: Points | None = None
    skeletons: Mapping[str, JointTree] = field(default_factory=dict)
    motions: Mapping[str, Motion] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    analog: Analog | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    source_events: tuple[SourceEvent, ...] = ()
    provenance: tuple[Mapping[str, Any], ...] = ()
    remarks: tuple[Remark, ...] = ()

    @property
    def numbering(self) -> Numbering:
        """How the source numbers the frames."""
        return Numbering(self.first_frame)

    @property
    def all_events(self) -> tuple[Event, ...]:
        """Events, and those that the remarks are, each once."""
        return tuple(dict.fromkeys([*self.events, *map(self._event, self.remarks)]))

    def _event(self, remark: Remark) -> Event:
        """Return a remark as an event of its frames, else of all of the take."""
        where = remark.where
        start, stop = self.numbering.rows(
            *(where.frames or self.numbering.span(0, self.frames))
        )
        return Event(
            start=min(max(start, 0), self.frames),
            stop=min(max(stop, 0), self.frames),
            text=remark.text,
            kind=remark.kind,
            model=where.model,
            marker=where.marker,
        )

    @property
    def times(self) -> Floats:
        """(T,) [s] from the first frame."""
        return np.arange(self.frames) / self.rate

    @property
    def clock(self) -> Floats:
        """(T,) [s] as the source counts time."""
        return self.start_time + self.times


def frame_slices(frame: Ints32, frames: int) -> Ints:
    """Find where each frame's rows begin in a list sorted by frame.

    Parameters
    ----------
    frame : (P,) rows of the take, rising; frames : T.

    Returns
    -------
    (T + 1,) rows of frame t are those from entry t up to entry t + 1
    """
    return np.searchsorted(frame, np.arange(frames + 1)).astype(np.int64)
