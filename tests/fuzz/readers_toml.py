"""TOML of every kind: settings, marker sets, joint trees, landmarks, gloves, maps."""

import shutil
from pathlib import Path

from handclean import config
from handclean.cli import tables
from handclean.glove import definitions, hands, poses
from handclean.hand import marker_set
from handclean.hand.skeleton import load_skeleton, rigid_subject
from handclean.hand.template import template
from handclean.io import landmarks
from handclean.io.gltf.skinned_map import load_skinned_map
from handclean.io.shared import joint_map
from handclean.simulation.scenarios import find_scenario, settings_for
from tests.fuzz.inputs import TEXT, Reader

PROJECT = Path(__file__).parents[2]
TREE = """name = "pliers"
kind = "articulated"
[[bone]]
name = "left"
[[bone]]
name = "right"
parent = "left"
offset = [0.0, 10.0, 0.0]
[[bone.hinge]]
name = "open"
axis = [0.0, 0.0, 1.0]
limits = [-90, 90]
[[marker]]
label = "A"
bone = "left"
at = [1.0, 2.0, 3.0]
[[marker]]
label = "B"
bone = "right"
at = [10.5, -2.0, 3e1]
"""
RIGID = """name = "cube"
kind = "rigid"
source = "made up"
[[marker]]
label = "A"
at = [0.0, 0.0, 0.0]
[[marker]]
label = "B"
at = [50.0, 0.0, 0.0]
[[marker]]
label = "C"
at = [0.0, 50.0, 0.0]
"""
VERTEX = """name = "few"
side = "right"
[[marker]]
label = "A"
vertex = 12
[[marker]]
label = "B"
vertex = 1200
lift = 3.0
"""
SCENARIO = """kind = "grasp"
trials = 3
rate_hz = 100.0
marker_set = "maycock26"
grasps = ["sphere_power"]
"""


ODD = [
    *(
        "[]",
        "{}",
        "1",
        "-1",
        "0",
        "1e308",
        "-1e-320",
        "nan",
        "inf",
        "true",
        '""',
        '"x"',
    ),
    *("[1, 2, 3]", "[[1, 2, 3]]", "[nan, 1, 2]", "{ a = 1 }", "[{}]", "[[]]", '["a"]'),
    *("1979-05-27", "07:32:00", "9223372036854775807", "[1, [2]]", '["a", 1]', "1.5"),
]
"""Values that somebody may write for another."""


def value(rng, content, other):
    """Put something else for a value, or take it from another key."""
    lines = content.split(b"\n")
    places = [n for n, line in enumerate(lines) if b" = " in line]
    if not places:
        return content
    at, there = (places[int(rng.integers(len(places)))] for _ in range(2))
    put = ODD[int(rng.integers(len(ODD)))].encode()
    if rng.random() < 0.2:
        put = lines[there].partition(b" = ")[2]
    lines[at] = lines[at].partition(b" = ")[0] + b" = " + put
    if rng.random() < 0.1:
        del lines[at]
    return b"\n".join(lines)


def of(pattern):
    """Write the files of ours that a pattern finds, the first three."""

    def seeds(folder):
        for path in sorted(PROJECT.glob(f"handclean/data/{pattern}"))[:3]:
            shutil.copy(path, folder)

    return seeds


def texts(*contents):
    """Write texts."""

    def seeds(folder):
        for number, content in enumerate(contents):
            (folder / f"{number}.toml").write_text(content)

    return seeds


def sets(folder):
    """Sets of hands and of things."""
    of("marker_sets/*6.toml")(folder)
    texts(RIGID, VERTEX)(folder)


def markers(path):
    """Read a set, and put it on what it is for."""
    found = marker_set.load_marker_set(path)
    if found.kind == "rigid":
        rigid_subject(found)
    else:
        found.on(template("right", forearm=found.forearm))


def settings(path):
    """Check a configuration, and load a table."""
    classes = tables.classes()
    config.check(path, classes)
    for name, cls in classes.items():
        config.load(path, name, cls)


def key_poses(path):
    """Read key poses anew; they are kept otherwise."""
    poses.key_poses.__wrapped__(path)


def text(*read):
    """Read a text that is mutated as TOML."""

    def reader(seeds):
        def all_of(path):
            for one in read:
                one(path)

        return Reader(read=all_of, seeds=seeds, mutators=(*TEXT, *(value,) * 9))

    return reader


def marks(path):
    """Read landmarks."""
    landmarks.read_landmarks(path, "mm")


def skinned(path):
    """Read what a joint map says of skins, too."""
    load_skinned_map(str(path))


def scenario(path):
    """Read a scenario."""
    settings_for(find_scenario(path))


def configuration(folder):
    """Write the file that ships, and one of a few lines."""
    shutil.copy(PROJECT / "configs" / "default.toml", folder)
    texts('[fill-gaps]\nmax_gap_s = 0.5\nmethod = "linear"\n[solve]\ndamping = 0.1\n')(
        folder
    )


READERS = {
    "subject": text(load_skeleton)(texts(TREE)),
    "landmarks": text(marks)(
        texts('unit = "mm"\nthumb_tip = [1, 2.5, 3]\nindex_tip = [9, 8, 7.0]\n')
    ),
    "marker_set": text(markers)(sets),
    "glove": text(definitions.load_glove)(of("gloves/*[0-9].toml")),
    "hand_of_gloves": text(hands.load_hand)(of("gloves/hands/*.toml")),
    "key_poses": text(key_poses)(of("gloves/key_poses.toml")),
    "joint_map": text(joint_map.load_joint_map, skinned)(of("joint_maps/*.toml")),
    "config": text(settings)(configuration),
    "scenario": text(scenario)(texts(SCENARIO)),
}
