"""What a take claims to know is a finite number, or it is written as unknown."""

from dataclasses import replace
from typing import Any

import numpy as np

from handclean.recording import Motion, Origin, Recording, Trajectories


def only_finite(recording: Recording) -> Recording:
    """Return a take in which nothing that is no finite number counts as known.

    What a place or an angle is that is infinite, or of which a part is missing, nobody
    knows: it is NaN, its sample missing, its frame not trusted. Points without a place
    are none. Nothing but a smoothed sample has a raw place. A take in which all is well
    is returned as it is.
    """
    parts: dict[str, Any] = {}
    if recording.markers is not None:
        parts["markers"] = _known_samples(recording.markers)
    points = recording.unlabelled
    if points is not None and not np.isfinite(points.positions).all():
        kept = np.isfinite(points.positions).all(axis=1)
        parts["unlabelled"] = replace(
            points,
            frame=points.frame[kept],
            source=points.source[kept],
            positions=points.positions[kept],
            residual=None if points.residual is None else points.residual[kept],
            cameras=None if points.cameras is None else points.cameras[kept],
        )
    motions = {name: _known_frames(m) for name, m in recording.motions.items()}
    if any(motions[name] is not motion for name, motion in recording.motions.items()):
        parts["motions"] = motions
    if parts.get("markers") is recording.markers:
        parts.pop("markers", None)
    return replace(recording, **parts) if parts else recording


_CLAIMS = (Origin.MEASURED, Origin.FILLED, Origin.SMOOTHED)


def _known_samples(markers: Trajectories) -> Trajectories:
    unknown = np.asarray(~np.isfinite(markers.positions).all(axis=2))
    claimed = unknown & np.isin(markers.origin, _CLAIMS)
    stray = unknown & ~np.isnan(markers.positions).all(axis=2)
    if claimed.any() or stray.any():
        markers = replace(
            markers,
            positions=np.where(unknown[:, :, None], np.nan, markers.positions),
            origin=np.where(claimed, Origin.MISSING, markers.origin).astype(np.uint8),
        )
    return _with_raw_of_smoothed(markers)


def _with_raw_of_smoothed(markers: Trajectories) -> Trajectories:
    if markers.raw is None:
        return markers
    wrong = ~markers.has_raw & ~np.isnan(markers.raw).all(axis=2)
    if not wrong.any():
        return markers
    return replace(markers, raw=np.where(wrong[:, :, None], np.nan, markers.raw))


def _known_frames(motion: Motion) -> Motion:
    parts: dict[str, Any] = {}
    for name in ("angles", "translation", "rotation"):
        values = getattr(motion, name)
        if values is not None and np.isinf(values).any():
            parts[name] = np.where(np.isinf(values), np.nan, values)
    unknown = ~np.isfinite(motion.poses).all(axis=1)
    if motion.trusted is not None and (motion.trusted & unknown).any():
        parts["trusted"] = motion.trusted & ~unknown
    return replace(motion, **parts) if parts else motion
