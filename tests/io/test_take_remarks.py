"""What ``inspect`` says of samples: frozen, far away, all missing."""

import numpy as np
import pytest
from told import texts

from handclean.io import files
from handclean.io.take_remarks import remarks_on_samples
from handclean.recording import Points, Recording, trajectories

FRAMES, RATE = 200, 100.0
LABELS = ("A", "B", "C", "D")


@pytest.fixture
def moving(rng):
    """(T, 4, 3) [m] four markers that wander, 2 mm of noise a frame."""
    return 0.5 + np.cumsum(0.002 * rng.normal(size=(FRAMES, 4, 3)), axis=0)


def labelled(positions, **more):
    markers = trajectories(positions, LABELS)
    return Recording(rate=RATE, frames=FRAMES, markers=markers, **more)


def loose(positions, rng):
    """Return the same as points without a name, in other columns in every frame."""
    order = np.array([rng.permutation(4) for _ in range(FRAMES)])
    mixed = np.take_along_axis(positions, order[:, :, None], axis=1).reshape(-1, 3)
    seen = np.isfinite(mixed).all(axis=1)
    frame = np.repeat(np.arange(FRAMES, dtype=np.int32), 4)
    column = np.tile(np.arange(4, dtype=np.int32), FRAMES)
    points = Points(frame=frame[seen], source=column[seen], positions=mixed[seen])
    return Recording(rate=RATE, frames=FRAMES, unlabelled=points)


def test_a_take_that_moves_is_not_odd(moving, rng):
    assert remarks_on_samples(labelled(moving)) == []
    assert remarks_on_samples(loose(moving, rng)) == []


def test_a_frozen_marker_is_named(moving, rng):
    moving[50:90, 1] = moving[50, 1]
    (trap,) = texts(remarks_on_samples(labelled(moving)))
    assert trap.startswith("B: the same to the last digit for 40 frames")
    (trap,) = texts(remarks_on_samples(loose(moving, rng)))
    assert "a point without a name stays the same to the last digit, for 40" in trap


def test_a_short_hold_is_not_odd(moving, rng):
    moving[50:74, 1] = moving[50, 1]  # 0.24 s
    assert remarks_on_samples(labelled(moving)) == []
    assert remarks_on_samples(loose(moving, rng)) == []


def test_a_take_in_which_all_stands_still_is_not_odd(moving, rng):
    moving[50:] = moving[50]
    assert remarks_on_samples(labelled(moving)) == []
    assert remarks_on_samples(loose(moving, rng)) == []


def test_missing_samples_are_not_frozen(moving):
    moving[50:150, 2] = np.nan
    assert remarks_on_samples(labelled(moving)) == []


def test_a_marker_that_is_never_there_is_named(moving):
    moving[:, 3] = np.nan
    assert texts(remarks_on_samples(labelled(moving))) == ("never there: D",)


def test_a_take_without_any_point_says_so(moving, rng):
    missing = np.full_like(moving, np.nan)
    (trap,) = texts(remarks_on_samples(labelled(missing)))
    assert "not a single point is there" in trap
    (trap,) = texts(remarks_on_samples(loose(missing, rng)))
    assert "not a single point is there" in trap


def test_a_stretch_without_any_point_is_told(moving, rng):
    moving[120:160] = np.nan
    wanted = "not a point is there in 40 frames, from frame 121 on"
    assert texts(remarks_on_samples(labelled(moving))) == (wanted,)
    assert texts(remarks_on_samples(loose(moving, rng))) == (wanted,)
    moving[120] = 0.5
    moving[141:160] = 0.5 + 0.01 * rng.normal(size=(19, 4, 3))
    assert remarks_on_samples(labelled(moving)) == []


def test_what_has_no_points_to_miss_is_not_odd():
    assert remarks_on_samples(Recording(rate=RATE, frames=5)) == []


@pytest.mark.parametrize("far", [1e27, 1e200, 150.0])
def test_a_point_beyond_any_laboratory_is_named(moving, rng, far):
    moving[7, 2] = far
    (trap,) = texts(remarks_on_samples(labelled(moving)))
    assert trap.startswith("1 samples lie more than 100 m")
    assert "(C)" in trap
    (trap,) = texts(remarks_on_samples(loose(moving, rng)))
    assert "(points without a name)" in trap


def test_a_large_laboratory_far_from_its_origin_is_not_odd(moving):
    assert remarks_on_samples(labelled(moving + 5000.0)) == []


@pytest.mark.parametrize("suffix", [".c3d", ".h5", ".csv", ".trc"])
def test_every_format_is_looked_into(moving, tmp_path, suffix):
    moving[50:90, 1] = moving[50, 1]
    files.write(tmp_path / f"a{suffix}", labelled(moving))
    traps = files.inspect(tmp_path / f"a{suffix}")["traps"]
    assert any("B: the same to the last digit" in trap for trap in traps)
