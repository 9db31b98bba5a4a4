"""Hands from simulated scans against the truth, stage by stage, and figure 17.

    python tests/bench/bench_scan.py

People from small to large hands, with knuckles, segments, girths and swellings
of their own, each before eight cameras: 0.5 mm noise each way, holes, forearm, sleeve,
table, floating points, landmarks set by hand to 1.5 mm. "skin": distance of the fitted
vertices from the true skin, in the scan's posture, from the wrist outwards ("stump":
behind it, where template and truth end at different places of the forearm). "joints":
distance of joint centres from the true ones, there too. "seconds" are those of the
processor. The true skins have the template's topology, though nothing uses that.

The ablation leaves out one stage at a time, on every fourth person; figure 17 is of
every second person.

Figure 17 of Schroeder et al. 2017: RMS distance of measured markers from the model's in
grasps (26 markers, 0.2 mm noise, sliding skin), with the template, the template in the
hand's size, the scanned hand with markers placed by one second of neutral posture, and
the same refined by a range-of-motion take. For the recordings beside the project, the
template against a hand learnt from the other half of the frames (blocks of two
seconds).
"""

import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
from bench_subject import recordings
from measuring import counted
from scipy.spatial.transform import Rotation

from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import joint_positions, neutral_pose
from handclean.hand.subject import template_subject
from handclean.ik.solve import solve_markers
from handclean.numerics.mean_value import mean_value_coordinates
from handclean.numerics.procrustes import align
from handclean.numerics.triangles import closest
from handclean.recording import trajectories
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate_one, simulate_scan
from handclean.subject.calibrate import calibrate
from handclean.subject.frames import gather, thinned
from handclean.subject.scan.alignment import Aligned, Template
from handclean.subject.scan.cloud import Scan
from handclean.subject.scan.fit import drawn, fit_scan, shipped_start
from handclean.subject.scan.locate import locate_markers
from handclean.subject.scan.rebuild import rebuilt
from handclean.subject.scan.settings import ScanConfig
from handclean.subject.settings import CalibrateConfig
from handclean.subject.start import guess, scaled

PEOPLE = counted("people", 20, quick=3)
ROM_S = counted("seconds of a range-of-motion take", 40, quick=40, tiny=20)
FRAMES = counted("frames that a hand is learnt from", 150, quick=100, tiny=30)
SIMULATED = SimulateConfig(subjects=PEOPLE, trials=PEOPLE, side="right")
MARKERS = "maycock26"

VARIANTS = {
    "all stages": {},
    "no colors used": {"skin": False},
    "no closest points in the alignment": {"rounds": 0},
    "skin not by landmarks first": {"stiff": 1e-6},
    "skin stops at 1e-6": {"soft": 1e-6},
    "skin stops at 1e-7": {"soft": 1e-7},
    "no landmarks beside the points": {"landmark_weight": 0.0},
    "points only (no normals, no colors)": {},
    "no posture, only place and size": {},
}


def scan_of(made, bare=False):
    """What the command would be given."""
    if bare:
        return Scan(points=made.points)
    return Scan(points=made.points, normals=made.normals, colors=made.colors)


def joints_off(tree, pose, made):
    """(16,) [mm] distance of joints from the true ones."""
    true = joint_positions(made.subject.model.tree, made.pose[None])[0]
    return 1e3 * np.linalg.norm(joint_positions(tree, pose[None])[0] - true, axis=1)


def skin_off(vertices, made):
    """(V,) [mm] distance of vertices from the true skin."""
    faces = made.subject.surface.faces
    return 1e3 * closest(made.skin, faces, vertices).distance


def figures(fitted, made, seconds):
    """Everything that is true of one fit."""
    ahead = fitted.aligned.template.surface.vertices[:, 1] >= 0.0
    off = skin_off(fitted.registered.vertices, made)
    before = skin_off(fitted.aligned.vertices(), made)
    found, aligned = fitted.rebuilt, fitted.aligned
    joints = joints_off(found.tree, found.pose, made)
    tree = aligned.template.tree
    rest = joint_positions(tree, aligned.pose[None])[0]
    whole = mean_value_coordinates(rest, aligned.vertices(), found.surface.faces)
    true = joint_positions(made.subject.model.tree, made.pose[None])[0]
    whole = 1e3 * np.linalg.norm(whole @ fitted.registered.vertices - true, axis=1)
    return {
        "size": fitted.report.size,
        "skin": off[ahead].mean(),
        "p95": np.percentile(off[ahead], 95),
        "max": off[ahead].max(),
        "stump": off[~ahead].mean(),
        "joints": joints,
        "covered": fitted.report.covered,
        "aligned skin": before[ahead].mean(),
        "aligned joints": joints_off(tree, aligned.pose, made),
        "whole-mesh joints": whole,
        "seconds": seconds,
    }


def one_person(number):
    """Fit one person's scan with all stages."""
    made = simulate_scan("scan", SIMULATED, number)
    return variant(made, "all stages")


def variant(made, name):
    """Fit a scan with a stage left out."""
    settings = ScanConfig(**VARIANTS[name])
    begin = time.process_time()
    if name.startswith("no posture"):
        return figures(flat(made, settings), made, time.process_time() - begin)
    scan = scan_of(made, name.startswith("points only"))
    fitted = fit_scan(scan, made.landmarks, settings, side="right")
    return figures(fitted, made, time.process_time() - begin)


def flat(made, settings):
    """Fit the flat template, put onto the landmarks as it is."""
    whole = fit_scan(scan_of(made), made.landmarks, settings, side="right")
    start = shipped_start("right")
    rows = whole.aligned.template.landmarks
    places = whole.cloud.snapped(np.array([made.landmarks[n] for n in start.landmarks]))
    motion = align(start.surface.vertices[rows], places, scaled=True)
    template = Template(tree=start.tree, surface=start.surface, landmarks=rows)
    pose = neutral_pose(start.tree)
    pose[:3] = motion.translation
    pose[[4, 5, 6, 3]] = Rotation.from_matrix(motion.rotation).as_quat()
    aligned = Aligned(
        template=template.sized(motion.scale), pose=pose, landmark_m=motion.rms
    )
    registered = drawn(aligned, places, whole.cloud, settings)
    return replace(
        whole,
        aligned=aligned,
        registered=registered,
        rebuilt=rebuilt(aligned, registered.vertices),
    )


def without(number):
    """Fit one person's scan with each stage left out in turn."""
    made = simulate_scan("scan", SIMULATED, number)
    return {name: variant(made, name) for name in VARIANTS}


def alignment_error(model, positions):
    """[mm] RMS distance of measured markers from the model's, over all frames."""
    residual = solve_markers(model, positions).residual
    return 1e3 * float(np.sqrt(np.nanmean(residual**2)))


def measured(take, labels, step):
    """(T, M, 3) [m] every so manieth frame, NaN where nothing was measured."""
    frames = gather([take], labels)
    return np.where(frames.seen[:, :, None], frames.targets, np.nan)[::step]


def one_alignment(number):
    """Figure 17 for one person."""
    made = simulate_scan("scan", replace(SIMULATED, scan_points=60_000), number)
    scanned = fit_scan(scan_of(made), made.landmarks, ScanConfig(), side="right")
    marker_set = load_marker_set(MARKERS)
    about = replace(SIMULATED, marker_set=MARKERS, rate_hz=50.0)
    about_rom = replace(about, duration_s=float(ROM_S))
    rom = simulate_one("rom", about_rom, number).labelled
    test = simulate_one("grasp", replace(about, duration_s=15.0), number).labelled
    positions = measured(test, marker_set.labels, 5)
    neutral = replace(
        rom,
        frames=50,
        markers=trajectories(rom.markers.positions[:50], rom.markers.labels),
        unlabelled=None,
        events=(),
    )
    frames = gather([rom], marker_set.labels)
    plain = template_subject(marker_set, "right").model
    size = guess(marker_set, frames.only(thinned(frames, 12)), "right").size
    quick = CalibrateConfig(frames=FRAMES, holdout=0.0)
    placed = locate_markers(scanned.subject, [neutral], marker_set, quick)
    refined = locate_markers(scanned.subject, [neutral, rom], marker_set, quick)
    return {
        "template": alignment_error(plain, positions),
        "template, scaled": alignment_error(scaled(plain, size), positions),
        "scan": alignment_error(placed.subject.model, positions),
        "scan, refined": alignment_error(refined.subject.model, positions),
    }


def real():
    """Figure 17 for recordings, with hands from markers."""
    rows = []
    for name, marker_set_name, takes in recordings():
        marker_set = load_marker_set(marker_set_name)
        frames = gather(takes, marker_set.labels)
        block = 2.0 * frames.rates[0]
        odd = (np.floor(frames.frame / block) % 2).astype(bool)
        shown = frames.seen.mean(axis=1) >= 0.6
        learn = [masked(take, odd[frames.take == k]) for k, take in enumerate(takes)]
        quick = CalibrateConfig(frames=FRAMES, holdout=0.0)
        found, _ = calibrate(learn, marker_set, quick)
        rest = frames.only(np.flatnonzero(~odd & shown))
        rest = rest.only(thinned(rest, 800))
        positions = np.where(rest.seen[:, :, None], rest.targets, np.nan)
        plain = template_subject(marker_set).model
        size = guess(marker_set, rest.only(thinned(rest, 12)), marker_set.side).size
        rows.append(
            {
                "recording": name,
                "template [mm]": f"{alignment_error(plain, positions):.2f}",
                "template, scaled": (
                    f"{alignment_error(scaled(plain, size), positions):.2f}"
                ),
                "from markers": f"{alignment_error(found.model, positions):.2f}",
            }
        )
    return rows


def masked(take, hidden):
    """A take in which some frames were not measured."""
    positions = np.where(
        take.markers.measured[:, :, None], take.markers.positions, np.nan
    )
    positions[hidden] = np.nan
    return replace(
        take,
        markers=trajectories(positions, take.markers.labels),
        unlabelled=None,
        events=(),
    )


def summary(name, parts):
    """One row of the mean over people."""
    joints = np.array([part["joints"] for part in parts])
    return {
        "": name,
        "skin mean [mm]": f"{np.mean([p['skin'] for p in parts]):.2f}",
        "skin p95": f"{np.mean([p['p95'] for p in parts]):.2f}",
        "skin max": f"{np.mean([p['max'] for p in parts]):.1f}",
        "joints mean [mm]": f"{joints.mean():.2f}",
        "joints max": f"{joints.max(axis=1).mean():.1f}",
        "seconds": f"{np.mean([p['seconds'] for p in parts]):.1f}",
    }


def rows():
    """All tables."""
    with ProcessPoolExecutor(min(2, os.cpu_count() or 1)) as pool:
        all_people = list(pool.map(one_person, range(PEOPLE)))
        left_out = list(pool.map(without, range(0, PEOPLE, 4)))
        aligned = list(pool.map(one_alignment, range(0, PEOPLE, 2)))
    by_joint = np.array([part["joints"] for part in all_people])
    start = np.array([part["aligned joints"] for part in all_people])
    whole = np.array([part["whole-mesh joints"] for part in all_people])
    names = template_subject(load_marker_set(MARKERS)).model.tree.joints
    people = [
        {
            "person": number + 1,
            "size": f"{part['size']:.2f}",
            "skin mean [mm]": f"{part['skin']:.2f}",
            "p95": f"{part['p95']:.2f}",
            "max": f"{part['max']:.1f}",
            "stump": f"{part['stump']:.1f}",
            "joints mean [mm]": f"{part['joints'].mean():.2f}",
            "joints max": f"{part['joints'].max():.1f}",
            "aligned only: skin": f"{part['aligned skin']:.2f}",
            "joints": f"{part['aligned joints'].mean():.2f}",
            "covered": f"{100 * part['covered']:.0f} %",
            "seconds": f"{part['seconds']:.1f}",
        }
        for number, part in enumerate(all_people)
    ]
    joints = [
        {
            "joint": name,
            "mean [mm]": f"{by_joint[:, k].mean():.2f}",
            "max": f"{by_joint[:, k].max():.1f}",
            "aligned only": f"{start[:, k].mean():.2f}",
            "coordinates in the whole mesh": f"{whole[:, k].mean():.2f}",
        }
        for k, name in enumerate(names[: by_joint.shape[1]])
    ]
    figure = [
        {
            "model": model,
            "mean [mm]": f"{np.mean([part[model] for part in aligned]):.2f}",
            "best person": f"{np.min([part[model] for part in aligned]):.2f}",
            "worst person": f"{np.max([part[model] for part in aligned]):.2f}",
        }
        for model in aligned[0]
    ]
    return {
        "people": people,
        "joint centres": joints,
        "a stage left out": [
            summary(name, [part[name] for part in left_out]) for name in VARIANTS
        ],
        "figure 17, simulated": figure,
        "figure 17, recordings": real(),
    }


if __name__ == "__main__":
    for title, table in rows().items():
        print(f"\n{title}")
        for row in table:
            print("  ", "  ".join(f"{key} {value}" for key, value in row.items()))
