"""A take whose first frame is number 995: whatever is said of a frame is its number."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from takes import take_source
from told import texts

from handclean.commands import simulate
from handclean.commands.shared.choices import Cleaning, Filling, Simulating, Solving
from handclean.commands.table import COMMANDS
from handclean.gaps.settings import FillConfig
from handclean.ik.settings import SolveConfig
from handclean.io import files
from handclean.labels.settings import LabelConfig
from handclean.recording import Origin
from handclean.runner import plan
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute
from handclean.simulation.settings import SimulateConfig

FIRST = 995
CLEANING = Cleaning(label=LabelConfig(), fill=FillConfig(), solve=SolveConfig())


def run(command, settings, *paths, output=None, subjects=()):
    sources = tuple(take_source(path=path, subjects=subjects) for path in paths)
    outputs = (output,) if output else ()
    task = Task(sources=sources, outputs=outputs, token=plan.token())
    report = execute(Work(command=COMMANDS[command], settings=settings), task)
    assert report.status == "done", report.error + report.trace
    return report


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One short take as ``from_1.c3d`` and ``from_995.c3d``, its first part empty."""
    folder = tmp_path_factory.mktemp("frames")
    config = SimulateConfig(duration_s=3.0, rate_hz=100.0, dropouts_per_s=2.0)
    chosen = Simulating(scenario="demo", kind="demo", simulate=config)
    (task,) = simulate.tasks(chosen, folder)
    assert (
        execute(Work(command=COMMANDS["simulate"], settings=chosen), task).status
        == "done"
    )
    take = files.read(folder / "S01_001.c3d")
    points = take.unlabelled
    some = points.frame >= 40
    late = replace(
        points,
        frame=points.frame[some],
        source=points.source[some],
        positions=points.positions[some],
        residual=points.residual[some],
        cameras=points.cameras[some],
    )
    for first in (1, FIRST):
        made = replace(take, first_frame=first, unlabelled=late, parameters={})
        files.write(folder / f"from_{first}.c3d", made)
    return folder


@pytest.fixture(scope="module")
def subject(folder):
    return (folder / "subjects" / "S01.h5",)


def test_where_a_hand_was_found_first_is_a_number_of_the_source(folder, subject):
    starts = []
    for first in (1, FIRST):
        output = folder / f"labels_{first}.h5"
        path = folder / f"from_{first}.c3d"
        report = run("label", LabelConfig(), path, output=output, subjects=subject)
        starts.append(report.figures["start_frame"])
    assert starts[1] - starts[0] == FIRST - 1
    assert FIRST + 40 <= starts[1] < FIRST + files.read(path).frames


@pytest.mark.parametrize("command", ["label", "clean"])
def test_events_name_the_frames_in_which_a_marker_was_missing(folder, subject, command):
    output = folder / f"{command}.h5"
    settings = {"label": LabelConfig(), "clean": CLEANING}[command]
    path = folder / f"from_{FIRST}.c3d"
    run(command, settings, path, output=output, subjects=subject)
    with h5py.File(output) as file:
        first, frames = file.attrs["first_frame"], file.attrs["frames"]
        labels = [label.decode() for label in file["markers/labels"][:]]
        gone = file["markers/origin"][:] != Origin.MEASURED
        texts = [text.decode() for text in file["events/text"][:]]
        starts, stops = file["events/start"][:], file["events/stop"][:]
    assert first == FIRST
    told = np.zeros_like(gone)
    spans = {
        (text.split()[2].rstrip(":"), int(start), int(stop))
        for text, start, stop in zip(texts, starts, stops, strict=True)
        if text.startswith(("gap of ", "gap in "))
    }
    for label, start, stop in spans:
        assert FIRST <= start <= stop < FIRST + frames
        told[start - FIRST : stop - FIRST + 1, labels.index(label)] = True
    np.testing.assert_array_equal(told, gone)
    assert {label for label, start, _ in spans if start == FIRST} == set(labels)


def test_filling_again_replaces_the_events_of_the_first_time(folder, subject):
    settings = Filling(fill=FillConfig(), solve=SolveConfig())
    once, twice = folder / "once.h5", folder / "twice.h5"
    labels = folder / "labels_again.h5"
    path = folder / f"from_{FIRST}.c3d"
    run("label", LabelConfig(), path, output=labels, subjects=subject)
    run("fill-gaps", settings, labels, output=once, subjects=subject)
    run("fill-gaps", settings, once, output=twice, subjects=subject)
    assert files.read(once).events == files.read(twice).events


def test_a_doubtful_stretch_is_named_by_its_numbers(folder, subject):
    take = files.read(folder / "labelled" / "S01_001.c3d")
    places = take.markers.positions.copy()
    places[100:130, take.markers.index("R_INDEX_TIP")] += [0.0, 0.05, 0.05]
    made = replace(
        take,
        first_frame=FIRST,
        markers=replace(take.markers, positions=places),
        parameters={},
    )
    files.write(folder / "moved.h5", made)
    settings = Solving(solve=SolveConfig(), standard=False)
    output = folder / "solved.h5"
    report = run(
        "solve", settings, folder / "moved.h5", output=output, subjects=subject
    )
    (told,) = [words for words in texts(report.remarks) if "R_INDEX_TIP" in words]
    numbers = told.split("frames from ")[1].split(",")[0].split(" to ")
    first, last = map(int, numbers)
    assert FIRST + 100 <= first < last < FIRST + 130


def test_inspect_says_where_points_are_missing_by_number(folder):
    report = run("inspect", None, folder / f"from_{FIRST}.c3d")
    assert any(f"from frame {FIRST} on" in trap for trap in report.figures["traps"])
    assert report.figures["first_frame"] == FIRST
