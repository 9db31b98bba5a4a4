"""Machine code that ships: made for any processor against made for this one.

All kernels are compiled twice, with an empty cache: for this processor, and for any of
its kind (`NUMBA_CPU_NAME=generic`), as in a wheel. Then processes take turns with the
one and the other; each does every piece of work some times and gives the fastest, in
seconds of the processor. "Generic / native" is the median over the turns. "Bits equal"
compares all numbers of the results.
"""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring import counted

from handclean.gaps.fill import fill
from handclean.hand import model
from handclean.hand.skinning import posed, project, skin_jacobian
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.labels.label import label
from handclean.layouts.feasible import feasible
from handclean.layouts.optimize import SEARCHES, optimize
from handclean.layouts.problem import make_problem, on_bones
from handclean.layouts.settings import LayoutConfig
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate

ROOT = Path(__file__).parents[2]
TURNS = counted("turns of both", 5, quick=1)
TIMES = counted("repetitions in a turn", 5, quick=2)
TAKE = SimulateConfig(duration_s=8.0, rate_hz=100.0, dropouts_per_s=0.5)
CODES = {"native": {}, "generic": {"NUMBA_CPU_NAME": "generic"}}


def work():
    """Pieces of work by name; each returns arrays."""
    made = next(iter(simulate("demo", TAKE)))
    prior = read_prior()

    def layout(method):
        tree = template("left")
        surface = template_surface(tree, coarse=True)
        few = LayoutConfig(keyframes=5, visibility=1.0, particles=40, iterations=40)
        on = on_bones(surface, tree, feasible(surface, tree, few))
        motion = made.truth.motions["right"]
        problem = make_problem(on, [motion.angles], motion.names, few, surface=surface)
        chosen = optimize(
            problem, replace(few, method=method), np.random.default_rng(0)
        )
        return [np.array(chosen.chosen)]

    def skin():
        tree = template("left")
        surface = template_surface(tree)
        pose = model.neutral_pose(tree)
        places = posed(surface, tree, np.tile(pose, (20, 1)))
        on = project(surface, places[0], 1.02 * places[0][:300])
        return [places, skin_jacobian(surface, tree, on, pose)]

    def labelled():
        found, _ = label(made.unlabelled, made.subject, prior=prior)
        return [found.markers.positions, found.markers.confidence]

    def solved(with_prior):
        given = prior if with_prior else None
        [motion] = solve(made.labelled, made.subject, prior=given).motions.values()
        return [motion.angles, motion.translation, motion.rotation]

    def filled():
        return [fill(made.labelled, made.subject, prior=prior)[0].markers.positions]

    pieces = {
        "label": labelled,
        "fill-gaps": filled,
        "solve": lambda: solved(True),
        "solve, no prior": lambda: solved(False),
        "skin": skin,
    }
    for method in SEARCHES:
        pieces[f"optimize-layout, {method}"] = lambda method=method: layout(method)
    return pieces


def measured(times):
    """[s] and digest of each piece of work, in this process."""
    found = {}
    for name, piece in work().items():
        arrays, best = piece(), np.inf
        for _ in range(times):
            began = time.process_time()
            piece()
            best = min(best, time.process_time() - began)
        digest = hashlib.sha256()
        for array in arrays:
            digest.update(np.ascontiguousarray(array).tobytes())
        found[name] = best, digest.hexdigest()
    return found


def in_a_process(code, cache):
    environment = {**os.environ, **CODES[code], "NUMBA_CACHE_DIR": str(cache)}
    environment["PYTHONPATH"] = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
    line = [sys.executable, __file__, str(TIMES)]
    done = subprocess.run(
        line, env=environment, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def rows():
    """One row per piece of work."""
    turns = {code: [] for code in CODES}
    with tempfile.TemporaryDirectory() as folder:
        caches = {code: Path(folder) / code for code in CODES}
        for turn in range(TURNS + 1):
            for code, cache in caches.items():
                found = in_a_process(code, cache)
                if turn:  # the first compiles
                    turns[code].append(found)
    table = []
    for name in turns["native"][0]:
        native, generic = (
            np.array([turn[name][0] for turn in turns[code]])
            for code in ("native", "generic")
        )
        digests = {turn[name][1] for code in CODES for turn in turns[code]}
        table.append(
            {
                "work": name,
                "native [s]": f"{native.min():.4f}",
                "generic [s]": f"{generic.min():.4f}",
                "generic / native": f"{np.median(generic / native):.3f}",
                "bits equal": "yes" if len(digests) == 1 else "no",
            }
        )
    return table


if __name__ == "__main__":
    print(json.dumps(measured(int(sys.argv[1]))))
