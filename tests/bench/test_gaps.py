"""The benchmark of gaps: its protocol is the yardstick's, its files come back."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def gaps():
    """Modules of the benchmark, as it imports them."""
    sys.path.insert(0, str(HERE))
    try:
        yield (
            importlib.import_module("gaps.cells"),
            importlib.import_module("gaps.errors"),
            importlib.import_module("gaps.takes"),
        )
    finally:
        sys.path.remove(str(HERE))


@pytest.fixture(scope="module")
def take(gaps):
    rng = np.random.default_rng(1)
    t = np.arange(900) / 100.0
    sway = np.stack([np.sin(w * t) for w in (1.1, 1.7, 2.3)], axis=1)
    mixed = rng.normal(scale=0.01, size=(6, 3, 3))
    places = rng.normal(scale=0.05, size=(6, 3)) + np.einsum("tk,mkj->tmj", sway, mixed)
    fingers = [np.array([0, 1]), np.array([2, 3])]
    return gaps[2].Take("a take", places, 100.0, tuple("abcdef"), fingers)


def test_gaps_lie_in_every_cell_and_are_drawn_alike(gaps, take):
    cells = gaps[0]
    found = cells.holes(take, 101, 3)
    assert found == cells.holes(take, 101, 3)
    assert found != cells.holes(take, 102, 3)
    count = {}
    for hole in found:
        count[hole.cell] = count.get(hole.cell, 0) + 1
        assert 300 <= hole.first < hole.stop <= 600
        expected = 2 if hole.pattern == "finger" else int(hole.pattern)
        assert len(set(hole.hidden)) == expected
    assert set(count.values()) == {3}
    assert len(count) == 15


def test_files_of_others_come_back_as_they_were_filled(gaps, take, tmp_path):
    cells, errors, _ = gaps
    found = cells.holes(take, 101, 1)
    cells.write(tmp_path, [take], found)
    written = np.loadtxt(tmp_path / "a_take.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(written.reshape(take.positions.shape), take.positions)
    lines = ["gap,frame,marker,x,y,z"]
    for number, hole in enumerate(found[:4]):
        for frame in range(hole.first, hole.stop):
            for marker in hole.hidden:
                x, y, z = take.positions[frame, marker] + [0.001, 0.0, 0.0]
                lines.append(f"{number},{frame},{marker},{x:.17g},{y:.17g},{z:.17g}")
    path = tmp_path / "filled.csv"
    path.write_text("\n".join(lines))
    filled = cells.read_filled(path, found)
    assert sorted(filled) == [0, 1, 2, 3]
    one = errors.Errors()
    errors.note(one, "theirs", take, found[2], filled[2])
    np.testing.assert_allclose(one.mean["theirs"], 0.001)
    path.write_text("\n".join(lines[:-1]))  # one sample of the last is missing
    assert sorted(cells.read_filled(path, found)) == [0, 1, 2]
    path.write_text("\n".join([*lines, "0,5,0,1,1,1"]))
    with pytest.raises(ValueError, match="frame 5 of marker 0 is not of gap 0"):
        cells.read_filled(path, found)


def test_a_filler_that_knows_the_truth_makes_no_error(gaps, take):
    errors = gaps[1]
    cells = gaps[0]
    from handclean.gaps.family.table import BASELINES
    from handclean.gaps.tracks import Path as Filled

    def prepare(tracks):
        assert np.isnan(tracks.positions).any()
        return lambda gap: Filled(
            take.positions[gap.start : gap.stop, gap.column], np.ones(gap.frames)
        )

    fillers = {"ridge": BASELINES["ridge"].prepare, "truth": prepare}
    found = errors.judged(take, cells.holes(take, 101, 1), fillers)
    assert max(found.mean["truth"]) == 0.0
    assert errors.compared(found, "truth").geometric.value < 0.01
    rows = errors.overall(found)
    assert [row["filler"] for row in rows] == ["ridge", "truth"]


def test_a_filler_that_is_none_is_said_in_one_line():
    done = subprocess.run(
        [sys.executable, str(HERE / "gaps" / "judge.py"), "no_such_module:prepare"],
        env={**os.environ, "HANDCLEAN_DATA": "."},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "no recordings; HANDCLEAN_DATA should name their folder" in done.stderr
    assert done.stderr.count("\n") == 1
