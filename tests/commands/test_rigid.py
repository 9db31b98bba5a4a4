"""A rigid marker set and a rigid subject through the commands that take hands."""

import json
from pathlib import Path

import numpy as np
import pytest
from takes import take_batch
from trees import moving, named, nameless, seen_of

from handclean.commands.shared.choices import Cleaning, Filling, Solving
from handclean.commands.table import work_of
from handclean.errors import UsageError
from handclean.gaps.settings import FillConfig
from handclean.hand.marker_set import load_marker_set
from handclean.hand.skeleton import rigid_subject
from handclean.ik.settings import SolveConfig
from handclean.io.files import read, write
from handclean.io.hdf5.subject import write_subject
from handclean.labels.settings import LabelConfig
from handclean.runner import many

SOLVE = SolveConfig()
SETTINGS = {
    "label": LabelConfig(),
    "solve": Solving(solve=SOLVE, standard=False),
    "fill-gaps": Filling(fill=FillConfig(), solve=SOLVE),
    "clean": Cleaning(label=LabelConfig(), fill=FillConfig(), solve=SOLVE),
}
PLACES = ((0, 0, 0), (50, 0, 0), (0, 60, 0), (0, 0, 45), (35, 20, 30))


def cube(side):
    """A marker set of the folder, ``side`` "" for a thing that has none."""
    lines = ['name = "cube"', 'kind = "rigid"'] + [f'side = "{side}"'] * bool(side)
    for number, place in enumerate(PLACES):
        lines += ["[[marker]]", f'label = "C{number}"', f"at = {list(place)}"]
    Path("cube.toml").write_text("\n".join(lines))
    return Path("cube.toml")


@pytest.fixture(params=["", "left", "right"])
def takes(request, tmp_path, monkeypatch, rng):
    """The set, the subject, a labelled take and one without labels, and the truth."""
    monkeypatch.chdir(tmp_path)
    subject = rigid_subject(load_marker_set(cube(request.param)))
    write_subject(Path("cube.h5"), subject)
    poses = moving(rng, subject.model.tree, 80)
    seen = seen_of(rng, subject, poses, gaps=False)
    write("points.c3d", nameless(rng, seen))
    seen[30:38, 4] = np.nan
    write("named.c3d", named(seen, subject))
    return request.param or "rigid", poses


@pytest.mark.parametrize("command", SETTINGS)
@pytest.mark.parametrize("given", ["marker_set", "subjects"])
def test_it_is_labelled_solved_filled_and_cleaned(takes, command, given, capfd):
    name, poses = takes
    path = "points.c3d" if command in ("label", "clean") else "named.c3d"
    whose = {"marker_set": "cube.toml"}
    if given == "subjects":
        whose = {"subjects": (Path("cube.h5"),)}
    batch = take_batch(inputs=(Path(path),), output="out.h5", json=True, **whose)
    assert many.run(work_of(command, batch, SETTINGS[command]), batch) == 0
    figures = json.loads(capfd.readouterr().out)
    assert figures["warnings"] == []
    motion = read("out.h5").motions[name]
    assert motion.names == ()
    away = np.linalg.norm(motion.translation - poses[:, :3], axis=1)
    assert np.nanmax(away) < 1e-3
    same = np.abs(np.sum(motion.rotation * poses[:, 3:7], axis=1))
    assert np.degrees(2.0 * np.arccos(np.clip(same, 0.0, 1.0))).max() < 2.0
    assert motion.trusted.all()


def test_a_side_of_a_thing_without_one_is_wrong_before_the_first_input(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    path = str(cube(""))
    batch = take_batch(
        inputs=(Path("a.c3d"),), output="o", marker_set=path, side="left"
    )
    with pytest.raises(UsageError, match="--side left: marker set cube"):
        many.run(work_of("label", batch, SETTINGS["label"]), batch)
