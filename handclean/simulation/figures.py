"""What simulated takes are like in numbers, to be held against recordings.

Motion: how joint angles share their variance (the spectrum of their PCA) and how fast
they turn. Occlusion: how long markers stay hidden and how many are at once, as in
figures 13 and 14 of Pavllo et al. 2019, of whose text two numbers are left: 90 % of
occlusions last less than 0.36 s, at 60 frames per second, and most involve few markers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handclean.arrays import Bools, Floats, expect_shape, runs
from handclean.numerics.subspace import principal_components

PAVLLO_S, PAVLLO_SHARE = 0.36, 0.90
"""[s] under which this share of all occlusions lasts (Pavllo et al. 2019, on figure
13)."""

PERCENTILES = (50.0, 90.0, 95.0, 99.0, 99.9)
"""[%] that are told (chosen)."""

_SPEED_SPAN_S = 0.025
"""[s] speeds are means over this time, so that noise is no speed (chosen)."""


@dataclass(frozen=True, kw_only=True)
class MotionFigures:
    """Spectrum and speed of joint angles.

    Attributes
    ----------
    shares : (D,) variance the first 1, 2, ... directions hold, over all takes.
    within : (D,) the same of what varies within takes, their means taken off.
    speeds : (5,) [rad/s] percentiles `PERCENTILES` of the size of all angles' speeds.
    """

    shares: Floats
    within: Floats
    speeds: Floats


def motion_figures(takes: Sequence[Floats], rate_hz: float) -> MotionFigures:
    """Describe the joint angles of some takes.

    Parameters
    ----------
    takes : (T, D) angles each [rad]; frames with an unknown angle are left out.
    rate_hz : frames per second.
    """
    known = [take[np.isfinite(take).all(axis=1)] for take in takes]
    span = max(round(_SPEED_SPAN_S * rate_hz), 1)
    steps = [np.abs(take[span:] - take[:-span]) * (rate_hz / span) for take in takes]
    speeds = np.concatenate([step.ravel() for step in steps])
    centred = [take - take.mean(axis=0) for take in known if len(take)]
    return MotionFigures(
        shares=np.cumsum(principal_components(np.concatenate(known)).share),
        within=np.cumsum(principal_components(np.concatenate(centred)).share),
        speeds=np.percentile(speeds[np.isfinite(speeds)], PERCENTILES),
    )


@dataclass(frozen=True, kw_only=True)
class OcclusionFigures:
    """How markers get lost.

    Attributes
    ----------
    durations : (N,) [s] of all occlusions, in order of size; open ends not counted.
    short : share of them shorter than `PAVLLO_S`.
    at_once : (M + 1,) share of frames in which 0, 1, ... M markers are hidden.
    hidden : (M,) share of frames each marker is hidden.
    """

    durations: Floats
    short: float
    at_once: Floats
    hidden: Floats


def occlusion_figures(
    takes: Sequence[Bools], rate_hz: float, seen_at_hz: float = 0.0
) -> OcclusionFigures:
    """Describe the gaps of some takes of one marker set.

    Parameters
    ----------
    takes : (T, M) each, whether each marker is seen.
    seen_at_hz : look at the takes at this lower rate, as other systems recorded.
    """
    step = max(round(rate_hz / seen_at_hz), 1) if seen_at_hz else 1
    markers = takes[0].shape[1]
    durations: list[float] = []
    for take in takes:
        expect_shape("seen", take, "T", markers)
        looked = take[::step]
        for m in range(markers):
            durations += [
                (stop - start) * step / rate_hz
                for start, stop in runs(~looked[:, m])
                if start > 0 and stop < len(looked)
            ]
    ordered = np.sort(np.array(durations))
    counts = np.concatenate([(~take).sum(axis=1) for take in takes])
    return OcclusionFigures(
        durations=ordered,
        short=float((ordered < PAVLLO_S).mean()) if len(ordered) else 1.0,
        at_once=np.bincount(counts, minlength=markers + 1) / len(counts),
        hidden=(~np.concatenate(takes)).mean(axis=0),
    )


def motion_table(columns: dict[str, MotionFigures]) -> str:
    """Figures of several sources side by side, as a Markdown table."""
    rows = [["", *columns]]
    for name in ("shares", "within"):
        said = "all takes" if name == "shares" else "within takes"
        for k in (1, 2, 3, 4, 6, 8, 10):
            share = [f"{getattr(f, name)[k - 1]:.1%}" for f in columns.values()]
            rows.append([f"variance in {k} of D directions, {said}", *share])
    for n, percent in enumerate(PERCENTILES):
        speed = [f"{np.degrees(f.speeds[n]):.0f}" for f in columns.values()]
        rows.append([f"angle speed, {percent:g} % slower [degrees/s]", *speed])
    return _markdown(rows)


def occlusion_table(columns: dict[str, OcclusionFigures]) -> str:
    """Figures of several sources beside Pavllo's, as a Markdown table."""
    rows = [["", *columns, "Pavllo 2019"]]
    for percent in (50, 90, 95, 99):
        said = [
            f"{np.percentile(f.durations, percent):.3f}" if len(f.durations) else "-"
            for f in columns.values()
        ]
        stated = f"{PAVLLO_S}" if percent == 100 * PAVLLO_SHARE else ""
        rows.append([f"{percent} % of occlusions shorter than [s]", *said, stated])
    short = [f"{f.short:.1%}" for f in columns.values()]
    rows.append([f"shorter than {PAVLLO_S} s", *short, f"{PAVLLO_SHARE:.0%}"])
    for count in range(6):
        share = [f"{f.at_once[count]:.1%}" for f in columns.values()]
        rows.append([f"frames with {count} markers hidden", *share, ""])
    more = [f"{f.at_once[6:].sum():.1%}" for f in columns.values()]
    rows.append(["frames with 6 or more hidden", *more, ""])
    return _markdown(rows)


def _markdown(rows: list[list[str]]) -> str:
    head, *body = ["| " + " | ".join(row) + " |" for row in rows]
    rule = "|" + "---|" * len(rows[0])
    return "\n".join([head, rule, *body]) + "\n"
