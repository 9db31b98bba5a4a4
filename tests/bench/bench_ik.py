"""Inverse kinematics, frames per second on one core, beside the peers.

The peers' hand, motion and scoring are those of the folder named by HANDCLEAN_PEERS
(default: the peers kept beside the project); their environments are under $PEERS. Rows
of peers that are not there stay as an earlier run had them, with that run's rows of
ours beside them, since only rows of one run compare. Everything runs in one go, on the
same work: 26 markers, 26 degrees of freedom, 5 000 frames, 0.5 mm noise; "within" is
the share of frames whose marker RMS is at most 1.01 times its converged optimum plus
one micrometre.
"""

import importlib.util
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from measuring import absent
from scipy.optimize import least_squares

from handclean.hand.model import Model, jacobian, marker_positions, moved
from handclean.ik.prior import PosturePrior
from handclean.ik.solve import solve_markers
from handclean.tree import JointTree

BESIDE = Path(__file__).parents[3] / "shared" / "peers"
SCRIPTS = Path(os.environ.get("HANDCLEAN_PEERS", BESIDE))
ENVIRONMENTS = Path(os.environ.get("PEERS", ".peers"))

PEERS = (  # environment, script and its arguments, the words of the rows to keep
    ("momentum", ["ik_momentum.py"], ("pymomentum",)),
    ("base", ["ik_numba.py"], ("numba",)),
    ("mink", ["ik_mink.py"], ("mujoco", "mink")),
    ("pinocchio", ["ik_pin.py"], ("pink", "pinocchio")),
    ("opensim", ["ik_opensim.py"], ("opensim",)),
)


def peer_hand():
    """The peers' module ``hand`` and its data, or None."""
    path = SCRIPTS / "hand.py"
    if not path.is_file():
        return None
    sys.dont_write_bytecode = True
    os.environ["PEERS"] = str(ENVIRONMENTS.resolve())  # where it keeps its data
    spec = importlib.util.spec_from_file_location("hand", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not Path(module.D, "hand.npz").is_file():
        subprocess.run([sys.executable, "-B", str(path)], check=True)
    return module


def model_of(hand):
    """The peers' hand as one of ours: yaws of the fingers go into the axes."""
    turn, offsets, axes = [np.eye(3)], [np.zeros(3)], []
    for b in range(1, hand.NB):
        up = turn[hand.PARENT[b]]
        turn.append(up @ hand.rz(np.array(hand.YAW0[b])))
        offsets.append(up @ hand.OFF[b])
        axes.append(turn[b][:, hand.AXIS[b]])
    names = tuple(f"b{b}" for b in range(hand.NB))
    tree = JointTree(
        kind="hand",
        side="",
        bones=names,
        joints=names,
        parents=np.asarray(hand.PARENT),
        offsets=np.array(offsets),
        hinges=names[1:],
        hinge_bone=np.arange(1, hand.NB),
        axes=np.array(axes),
        limits=np.tile([-3.1, 3.1], (hand.NB - 1, 1)),
    )
    at = np.array([turn[b] @ p for b, p in zip(hand.MB, hand.MP, strict=True)])
    return Model(tree=tree, labels=tuple(hand.MNAMES), bone=hand.MB.copy(), at=at)


def row(name, rate, residual, optimum):
    optimum = optimum[: len(residual)]
    return {
        "solver": name,
        "frames/s": round(rate),
        "max ratio": round(float((residual / optimum).max()), 4),
        "within": round(float((residual <= 1.01 * optimum + 1e-6).mean()), 4),
    }


def ours(model, targets, optimum, prior, name):
    solve_markers(model, targets[:20], prior=prior)
    best = np.inf
    for _ in range(7):
        begin = time.perf_counter()
        found = solve_markers(model, targets, prior=prior)
        best = min(best, time.perf_counter() - begin)
    return row(name, len(targets) / best, found.residual, optimum)


def scipy_row(model, targets, optimum, frames=40):
    """What a user writes first: least_squares with the analytic Jacobian."""
    pose = solve_markers(model, targets[:1]).poses[0]
    residual = np.zeros(frames)
    jacobian(model, pose)
    marker_positions(model, pose[None])
    begin = time.perf_counter()
    for t in range(frames):

        def error(step, t=t, pose=pose):
            place = marker_positions(model, moved(pose, step)[None])[0]
            return (place - targets[t]).ravel()

        def slope(step, pose=pose):
            return jacobian(model, moved(pose, step)).reshape(-1, len(step))

        found = least_squares(error, np.zeros(len(pose) - 1), slope, method="lm")
        pose = moved(pose, found.x)
        residual[t] = np.sqrt(2 * found.cost / targets.shape[1])
    rate = frames / (time.perf_counter() - begin)
    return row("scipy least_squares (lm, our Jacobian)", rate, residual, optimum)


def peer_rows():
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    environment["PEERS"] = str(ENVIRONMENTS.resolve())
    for name, command, words in PEERS:
        python = ENVIRONMENTS / name / "bin" / "python"
        missing = set(words)
        if not python.exists():
            absent(*words)
            continue
        done = subprocess.run(
            [str(python.absolute()), "-B", *command],
            cwd=SCRIPTS,
            env=environment,
            capture_output=True,
            text=True,
            timeout=900,
            check=False,
        )
        for line in done.stdout.splitlines():
            if not line.startswith("{"):
                continue
            found = json.loads(line)
            if found.get("peer", "").startswith(words):
                missing -= {word for word in words if found["peer"].startswith(word)}
                detail = " ".join(
                    f"{key}={found[key]}"
                    for key in ("iters", "maxit", "tol", "reg", "accuracy")
                    if key in found
                )
                yield {
                    "solver": f"{found['peer']} {detail}".strip(),
                    "frames/s": round(found["fps"]),
                    "max ratio": round(found["max_ratio"], 4),
                    "within": round(1.0 - found["frac_over_1pct"], 4),
                }
        absent(*(word for word in words if word in missing))


def rows():
    """One row per solver, ours first; frames/s on one core."""
    hand = peer_hand()
    if hand is None:
        absent("handclean", *(word for _, _, words in PEERS for word in words))
        return []
    angles, targets, _, optimum = hand.load()
    model = model_of(hand)
    spread = angles[:, 6:] - angles[:, 6:].mean(axis=0)
    size, directions = np.linalg.svd(spread, full_matrices=False)[1:]
    prior = PosturePrior(
        names=model.tree.hinges,
        mean=angles[:, 6:].mean(axis=0),
        components=directions[:6].T.copy(),
        deviations=size[:6] / np.sqrt(len(angles)),
        variance_share=(size**2 / (size**2).sum())[:6],
    )
    table = [
        ours(model, targets, optimum, prior, "handclean solve --per-frame"),
        ours(model, targets, optimum, None, "handclean solve --standard"),
        scipy_row(model, targets, optimum),
        *peer_rows(),
    ]
    fair = [r["frames/s"] for r in table if "pymomentum" in r["solver"]]
    if fair:
        held = [
            r["frames/s"]
            for r in table
            if "pymomentum" in r["solver"] and r["within"] == 1.0
        ]
        table[0]["against the fastest pymomentum that is within"] = round(
            table[0]["frames/s"] / max(held or fair), 2
        )
    return table


if __name__ == "__main__":
    for line in rows():
        sys.stdout.write(json.dumps(line) + "\n")
