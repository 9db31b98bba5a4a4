"""``compare`` of files that say less than others, and of subjects."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from takes import take_source
from told import texts

from handclean.commands.compare import FIGURES, compare
from handclean.errors import UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import template_subject
from handclean.io import files
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Recording, trajectories
from handclean.report.settings import CompareConfig
from handclean.runner.conditions import is_known


@pytest.fixture
def pair(tmp_path, rng):
    """A CSV without rate and unit, and the session of the same take."""
    places = rng.normal(scale=0.1, size=(6, 3, 3))
    take = Recording(
        rate=120.0, frames=6, markers=trajectories(places, ("A", "B", "C"))
    )
    files.write(tmp_path / "a.h5", take)
    rows = ["A x,A y,A z,B x,B y,B z,C x,C y,C z"]
    rows += [",".join(f"{1e3 * x:.6f}" for x in row.ravel()) for row in places]
    (tmp_path / "a.csv").write_text("\n".join(rows) + "\n")
    return tmp_path / "a.csv", tmp_path / "a.h5"


def compared(paths, **given):
    return compare(
        tuple(take_source(path=path, **given) for path in paths), CompareConfig()
    )


@pytest.mark.parametrize("turned", [False, True])
def test_unit_and_rate_are_those_of_the_file_that_says_none(pair, turned):
    done = compared(pair[::-1] if turned else pair, unit="mm", rate_hz=120.0)
    assert done.figures["measured_max_mm"] < 1e-5
    assert texts(done.remarks) == ()


def test_a_unit_that_is_missing_is_still_asked_for(pair):
    with pytest.raises(UsageError, match="--unit"):
        compared(pair, rate_hz=120.0)


def test_a_rate_that_no_file_needs_and_all_contradict_is_refused(pair):
    with pytest.raises(UsageError, match=r"contradicts|says|--"):
        compared((pair[1], pair[1]), rate_hz=121.0)
    assert texts(compared((pair[1], pair[1]), unit="m", rate_hz=120.0).remarks) == ()


def test_a_unit_that_no_file_needs_and_all_contradict_is_taken(pair):
    told = compared((pair[1], pair[1]), unit="mm").remarks
    warned = [one.said() for one in told]
    taken = f"{pair[1]}: --unit mm is taken, though the file says m"
    assert warned.count(taken) == 2


def test_subjects_are_compared_and_every_figure_has_a_meaning(tmp_path):
    subject = template_subject(load_marker_set("maycock26"), "right")
    large = template_subject(load_marker_set("maycock26"), "right", 0.2)
    paths = tmp_path / "one.h5", tmp_path / "two.h5"
    for path, one in zip(paths, (subject, large), strict=True):
        write_subject(path, replace(one, calibrated=True))
    done = compared(paths)
    assert all(is_known(name, FIGURES) for name in done.figures)
    assert done.figures["length_max_mm"] > 1.0
    assert "index_pip" in done.details
    assert "bone lengths differ by" in done.line


def test_a_subject_and_a_take_are_no_pair(pair, tmp_path):
    path = Path(tmp_path / "one.h5")
    write_subject(path, template_subject(load_marker_set("maycock26"), "right"))
    with pytest.raises(UsageError, match=r"one.h5: is a subject"):
        compared((pair[1], path))
    assert np.isfinite(compared(pair, unit="mm", rate_hz=120.0).figures["f1"])
