"""What each part of the take's regression is worth: errors with it switched off."""

from contextlib import contextmanager
from dataclasses import replace
from unittest import mock

import numpy as np

from gaps.errors import YARDSTICK, Errors, compared, judged, words
from handclean.gaps.regression import covariance, features, fill, process

_scales_of = process.scales_of
OFF = {
    "full": {},
    "local slope off": {"LOCAL_SLOPE": 0.0},
    "residual off": {"RESIDUAL": 0.0},
    "residual not of posture": {},
    "residual not of time": {"RESIDUAL_REACH": 1e9},
    "bands off": {},
    "weights off": {},
    "size of residuals not fitted": {},
    "all markers tell": {},
}


@contextmanager
def without(name):
    """Switch a part of the regression off for a while."""
    with mock.patch.multiple(covariance, **OFF[name]) if OFF[name] else _nothing():
        if name == "bands off":
            with mock.patch.object(process, "rows_at", _one_band):
                yield
        elif name == "residual not of posture":
            with (
                mock.patch.object(process, "scales_of", _one_posture),
                mock.patch.object(fill, "scales_of", _one_posture),
            ):
                yield
        elif name == "size of residuals not fitted":
            with mock.patch.object(process, "RESIDUALS", (1.0,)):
                yield
        elif name == "all markers tell":
            with mock.patch.object(fill, "MOST_FEATURES", 1000):
                yield
        elif name == "weights off":
            with mock.patch.object(features, "rigidity", _even):
                yield
        else:
            yield


@contextmanager
def _nothing():
    yield


def _one_posture(window, residual=1.0):
    """All postures are alike."""
    scales = _scales_of(window, residual)
    return replace(scales, posture=np.zeros_like(scales.posture))


def _one_band(window, scales, at, clock):
    """All of a feature has the slopes of the slow band."""
    slow = window.features[at] * np.sqrt(window.weight)
    return covariance.Rows(
        posture=scales.posture[at],
        slow=slow,
        quick=np.zeros((len(at), 1)),
        frame=at,
    )


def _even(positions, column, others):
    return np.ones(len(others))


def row(takes, holes_of, yardstick, prepare, name):
    """Ratio to the yardstick with one part off, over all gaps."""
    found, fillers = Errors(), {YARDSTICK: yardstick, "take": prepare}
    with without(name):
        for take in takes:
            found.add(judged(take, holes_of(take), fillers))
    ratio = compared(found, "take")
    return {
        "regression": name,
        "gaps": ratio.gaps,
        "ratio": words(ratio.geometric),
        "of means": words(ratio.of_means),
    }
