"""The hand's surface: speed of skinning, closest points and lines of sight.

    python tests/bench/bench_surface.py

One core, one thread of BLAS, processor time, the best of several runs. Skinning: 200
frames of the template on the 16 bones of the hand, at most four bones a vertex. "one
product" is the same work as one matrix product, (V, 4 B) x (4 B, 3 T), with the first
matrix made beforehand; "a product a frame" is the same one frame at a time; "einsum" is
the formula in numpy, frame by frame. "times ours" is their time over ours: above 1 they
are slower. "four bones everywhere" is the worst case, with bones drawn at random.

Lines of sight: a simulated take of 5 s (1000 frames, 26 markers, 14 cameras), the
forearm and the object included.
"""

import sys
import time

import numpy as np

from handclean.hand.marker_set import load_marker_set
from handclean.hand.skinning import (
    OnSkin,
    bone_transforms,
    posed,
    project,
    skin_jacobian,
    skin_places,
    vertex_jacobian,
)
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.kernels import skin
from handclean.numerics.triangles import box_tree, closest
from handclean.simulation import cameras
from handclean.simulation.grasping import grasp_scene
from handclean.simulation.people import make_person, true_markers
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

FRAMES = 200


def best(work, times=5):
    """[s] of the processor in the best of some runs, after one that does not count."""
    work()
    spent = []
    for _ in range(times):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)


def einsum_frames(vertices, bones, weights, turn, shift):
    """Plain numpy: the mean transform of each vertex, applied, frame by frame."""
    out = np.empty((len(turn), *vertices.shape))
    for t in range(len(turn)):
        mean = np.einsum("vk,vkij->vij", weights, turn[t][bones])
        out[t] = np.einsum("vij,vj->vi", mean, vertices)
        out[t] += np.einsum("vk,vki->vi", weights, shift[t][bones])
    return out


def matrices(vertices, bones, weights, turn, shift):
    """The (V, 4 B) and (4 B, 3 T) matrices whose product is the skinned surface."""
    count = turn.shape[1]
    left = np.zeros((len(vertices), count, 4))
    ends = np.column_stack([vertices, np.ones(len(vertices))])
    for k in range(bones.shape[1]):
        rows = (np.arange(len(vertices)), bones[:, k])
        np.add.at(left, rows, weights[:, k, None] * ends)
    both = np.concatenate([turn, shift[:, :, :, None]], axis=3)
    right = np.ascontiguousarray(both.transpose(1, 3, 0, 2).reshape(4 * count, -1))
    return left.reshape(len(vertices), -1), right


def skinning_row(name, surface, turn, shift):
    """Times of one surface."""
    parts = surface.vertices, surface.bones, surface.weights, turn, shift
    out = np.empty((len(turn), *surface.vertices.shape))
    mesh = skin.Skin(*parts[:3])
    ours = best(lambda: skin.place_vertices_of_frames(mesh, turn, shift, out))
    left, right = matrices(*parts)
    product = np.empty((len(left), right.shape[1]))
    frame = [
        np.ascontiguousarray(right[:, 3 * t : 3 * t + 3]) for t in range(len(turn))
    ]
    each = np.empty((len(turn), len(left), 3))

    def frame_by_frame():
        for t, moved in enumerate(frame):
            np.matmul(left, moved, out=each[t])

    plain = einsum_frames(*parts)
    np.testing.assert_allclose(out, plain, atol=1e-12)
    one = best(lambda: np.matmul(left, right, out=product), 3)
    np.testing.assert_allclose(
        product.reshape(len(left), -1, 3)[:, 5], out[5], atol=1e-12
    )
    several = best(frame_by_frame, 3)
    np.testing.assert_allclose(each, out, atol=1e-12)
    slow = best(lambda: einsum_frames(*parts), 1)
    return {
        "": name,
        "vertices": len(left),
        "on one bone": f"{(surface.weights[:, 1] == 0.0).mean():.0%}",
        "us/frame": round(1e6 * ours / len(turn), 1),
        "one product, times ours": round(one / ours, 2),
        "a product a frame, times ours": round(several / ours, 2),
        "einsum, times ours": round(slow / ours, 1),
    }


def worst(surface, rng):
    """The surface with four bones at every vertex."""
    count, size = len(surface.vertices), 16
    surface.bones[:] = np.argsort(rng.random((count, size)), axis=1)[:, :4]
    surface.weights[:] = -np.sort(-rng.dirichlet(np.ones(4), count), axis=1)
    return surface


def a_motion(tree):
    """(T, 7 + D) a simulated range of motion of the left hand."""
    settings = SimulateConfig(side="left", occlusion=False)
    (trial,) = simulate("rom", settings)
    poses = trial.truth.motions["left"].poses
    step = len(poses) // FRAMES
    return np.ascontiguousarray(poses[::step][:FRAMES])


def skinning_rows():
    tree = template("left")
    turn, shift = bone_transforms(tree, a_motion(tree))
    rows = [
        skinning_row(name, template_surface(tree, coarse=coarse), turn, shift)
        for name, coarse in (("template", False), ("its coarse twin", True))
    ]
    surface = worst(template_surface(tree), np.random.default_rng(0))
    return [*rows, skinning_row("four bones everywhere", surface, turn, shift)]


def other_rows():
    rng = np.random.default_rng(1)
    tree = template("left")
    surface = template_surface(tree)
    poses = a_motion(tree)
    bent = posed(surface, tree, poses[100:101])[0]
    cloud = bent[rng.integers(0, len(bent), 100_000)]
    cloud = cloud + rng.normal(0.0, 0.002, cloud.shape)
    boxes = box_tree(surface.vertices, surface.faces)
    on = OnSkin(
        face=rng.integers(0, len(surface.faces), 26),
        share=rng.dirichlet(np.ones(3), 26),
        lift=np.full(26, 0.004),
    )
    places = skin_places(surface, tree, on, poses[100:101])[0]
    work = {
        "tree of boxes made": lambda: box_tree(surface.vertices, surface.faces),
        "closest points of 100 000 points": lambda: closest(
            bent, surface.faces, cloud, boxes
        ),
        "26 markers projected": lambda: project(surface, bent, places),
        f"26 markers on the skin in {FRAMES} frames": lambda: skin_places(
            surface, tree, on, poses
        ),
        "Jacobian of 26 markers on the skin": lambda: skin_jacobian(
            surface, tree, on, poses[100]
        ),
        "Jacobian of all vertices": lambda: vertex_jacobian(surface, tree, poses[100]),
        "5 s of 26 markers seen by 14 cameras": sight(),
    }
    return [{"": name, "ms": round(1e3 * best(f, 3), 2)} for name, f in work.items()]


def sight():
    """Work: which cameras see which markers of a grasp."""
    who = make_person("P", load_marker_set("maycock26"), np.random.default_rng(0))
    scene = grasp_scene(who, np.arange(1000) / 200.0, (), np.random.default_rng(1))
    rig = cameras.make_rig(14, np.random.default_rng(2))
    markers = true_markers(who, scene.poses)
    return lambda: cameras.seen_by(who, scene, markers, rig)


def rows():
    """The tables."""
    return {"Skinning": skinning_rows(), "Other work on the surface": other_rows()}


if __name__ == "__main__":
    for title, part in rows().items():
        sys.stdout.write(f"{title}\n")
        for row in part:
            sys.stdout.write(f"  {row}\n")
