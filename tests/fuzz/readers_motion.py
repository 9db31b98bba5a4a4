"""BVH and MOT: inspected, read, and a BVH written as what it may become."""

import numpy as np

from handclean.errors import HandcleanError
from handclean.hand.template import template
from handclean.io import files
from handclean.io.shared.joint_map import shipped
from handclean.recording import Recording, motion_from_poses
from tests.fuzz.inputs import TEXT, Reader


def take(sides):
    """Hands that move a little."""
    rng = np.random.default_rng(0)
    motions, trees = {}, {}
    for side in sides:
        trees[side] = template(side)
        poses = np.zeros((6, 7 + len(trees[side].hinges)))
        poses[:, 3] = 1.0
        poses[:, 7:] = rng.uniform(0.0, 0.4, (6, poses.shape[1] - 7))
        motions[side] = motion_from_poses(trees[side].hinges, poses)
    return Recording(rate=100.0, frames=6, motions=motions, skeletons=trees)


def other(name):
    """A BVH with the joints of a map that is not ours, bones 3 cm apart."""
    joint_map = next(found for found in shipped() if found.name == name)
    tree = template("left")
    lines = ["HIERARCHY"]

    def add(bone, depth):
        name = joint_map.bones[tree.bones[bone]].replace("{side}", "Left")
        at = " ".join(f"{100 * x:.3f}" for x in tree.offsets[bone])
        lines.extend([f"{'JOINT' if depth else 'ROOT'} {name}", "{", f"OFFSET {at}"])
        lines.append("CHANNELS 3 Zrotation Xrotation Yrotation")
        below = np.flatnonzero(tree.parents == bone)
        for child in below:
            add(int(child), depth + 1)
        if not len(below):
            lines.extend(["End Site", "{", "OFFSET 0 2 0", "}"])
        lines.append("}")

    add(0, 0)
    rng = np.random.default_rng(1)
    lines += ["MOTION", "Frames: 6", "Frame Time: 0.01"]
    for row in rng.uniform(-30, 30, (6, 3 * len(tree.bones))):
        lines.append(" ".join(f"{value:.2f}" for value in row))
    return "\n".join(lines) + "\n"


def bvhs(folder):
    """One hand and two of ours, and one of somebody else's."""
    files.write(folder / "a.bvh", take(["right"]))
    files.write(folder / "b.bvh", take(["left", "right"]))
    names = [found.name for found in shipped() if not found.exact]
    for number, name in enumerate(names):
        (folder / f"c{number}.bvh").write_text(other(name))


def bvh(path):
    """All that commands do with a BVH."""
    files.inspect(path)
    taken = files.read(path, lenient=True)
    for suffix in (".bvh", ".mot", ".csv"):
        try:
            files.write(path.with_name("out" + suffix), taken)
        except HandcleanError:
            continue


def mots(folder):
    """One of ours, and a storage file of OpenSim's."""
    files.write(folder / "a.mot", take(["right"]))
    lines = ["Coordinates", "version=1", "nRows=3", "nColumns=3", "inDegrees=yes"]
    lines += ["", "endheader", "time\twrist_flexion\tpro_sup"]
    lines += ["0.00\t1.5\t-3", "0.01\t1.6\t-3.1", "0.02\t1.7\t-3.2"]
    (folder / "b.mot").write_text("\n".join(lines) + "\n")


READERS = {
    "bvh": Reader(read=bvh, seeds=bvhs, mutators=TEXT),
    "mot": Reader(read=files.inspect, seeds=mots, mutators=TEXT),
}
