"""Measured samples of a take cleaned on request: despiked, then smoothed.

Filling comes behind both, so that it meets the smoothed ends of every gap. What is
changed is marked (`Origin.SMOOTHED`) and kept as it was measured (``raw``). A take that
was cleaned before is cleaned from what was measured then: doing it twice is doing it
once, and other settings replace the earlier ones.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Bools, Floats
from handclean.errors import TAKE, HandcleanError
from handclean.gaps.despike import despike
from handclean.gaps.runs import seen_in
from handclean.gaps.settings import FillConfig
from handclean.gaps.smooth import padding_frames, smooth
from handclean.recording import Origin, Recording, Trajectories
from handclean.remarks import Remark, first_of, remark

KIND = "smoothed"
"""Of every remark of this module."""


@dataclass(frozen=True, kw_only=True)
class Cleaned:
    """A take with its measured samples cleaned.

    Attributes
    ----------
    take : the take; the one that was given where nothing was asked for.
    figures : samples ``despiked`` and ``smoothed``.
    remarks : what was done, and what could not be.
    """

    take: Recording
    figures: Mapping[str, int]
    remarks: tuple[Remark, ...] = ()


def clean_measured(recording: Recording, settings: FillConfig) -> Cleaned:
    """Despike and smooth the measured samples of all markers, as far as asked for.

    Raises
    ------
    HandcleanError
        If the take has no rate, or the cut-off is not below half of it.
    """
    markers = recording.markers
    if markers is None or not (settings.despike or settings.smooth > 0.0):
        return Cleaned(take=recording, figures={"despiked": 0, "smoothed": 0})
    _expect_rate(recording.rate, settings.smooth)
    seen = markers.measured & seen_in(markers.as_measured)
    places, spikes = markers.as_measured, np.zeros(seen.shape, dtype=bool)
    done, remarks = spikes, []
    if settings.despike:
        despiked = despike(places, seen, recording.rate)
        places, spikes = despiked.positions, despiked.spikes
        remarks += _of_spikes(markers, spikes)
    if settings.smooth > 0.0:
        smoothed = smooth(places, seen, settings.smooth, recording.rate)
        places, done = smoothed.positions, smoothed.done
        remarks += _of_smoothing(seen & ~done, settings.smooth, recording.rate)
    take = replace(
        recording,
        markers=_marked(markers, places, seen, spikes | done),
        events=tuple(event for event in recording.events if event.kind != KIND),
        remarks=tuple(one for one in recording.remarks if one.kind != KIND),
    )
    figures = {"despiked": int(spikes.sum()), "smoothed": int(done.sum())}
    return Cleaned(take=take, figures=figures, remarks=tuple(remarks))


def _expect_rate(rate: float, cutoff_hz: float) -> None:
    if not rate > 0.0:
        raise HandcleanError(
            f"its rate is {rate} Hz; despiking and smoothing need one above 0",
            where=TAKE,
        )
    if not cutoff_hz < 0.5 * rate:
        raise HandcleanError(
            f"at {rate:g} Hz it holds nothing of {cutoff_hz:g} Hz and above to smooth "
            f"away; smooth should be below half its rate, {0.5 * rate:g} Hz",
            where=TAKE,
        )


def _marked(
    markers: Trajectories, places: Floats, seen: Bools, changed: Bools
) -> Trajectories:
    """Return markers with places of their measured samples, marks and raw places.

    A sample that came with a mark but without its raw place keeps the mark.
    """
    measured = markers.as_measured
    origin = markers.origin.copy()
    origin[markers.has_raw] = Origin.MEASURED
    origin[changed] = Origin.SMOOTHED
    raw = np.where(changed[:, :, None], measured, np.nan)
    return replace(
        markers,
        positions=np.where(seen[:, :, None], places, markers.positions),
        origin=origin,
        raw=raw if changed.any() else None,
    )


def _of_spikes(markers: Trajectories, spikes: Bools) -> list[Remark]:
    count = spikes.sum(axis=0)
    by_marker = {
        label: int(n) for label, n in zip(markers.labels, count, strict=True) if n
    }
    if not by_marker:
        return []
    few = first_of(sorted(by_marker, key=lambda label: -by_marker[label]))
    total = sum(by_marker.values())
    what = "1 sample is a spike" if total == 1 else f"{total} samples are spikes"
    text = f"{what} and interpolated ({few}); raw places are kept"
    return [remark(KIND, text, despiked=by_marker)]


def _of_smoothing(left: Bools, cutoff_hz: float, rate: float) -> list[Remark]:
    count = int(left.sum())
    if not count:
        return []
    needed = padding_frames(cutoff_hz, rate) + 1
    what = "1 sample is" if count == 1 else f"{count} samples are"
    text = (
        f"{what} not smoothed: smoothing at {cutoff_hz:g} Hz takes "
        f"{needed} measured frames in a row"
    )
    return [remark(KIND, text, not_smoothed=count, needed_frames=needed)]
