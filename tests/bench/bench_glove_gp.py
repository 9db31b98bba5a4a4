"""Gaussian processes of a data glove: evidence, time, memory (Wang & Neff 2013).

    python tests/bench/bench_glove_gp.py

Simulated glove of 18 sensors. "Table 2": abduction between index and middle finger from
its sensor and the flexion sensors beside it, samples of widgets and touching in one
donning; predicted 267 frames of free movement in another. Rotations in degrees, so that
NLML and noise read like the paper's (mean and standard deviation over gloves and
persons). Samples are 2000 of a full run. "Peers": the same samples of one of them, zero
mean and squared exponential for scikit-learn, whose linear kernel is of another form;
GPy fits LMC-GPR. They are there if they are installed. "Table 4": all 17 measured
rotations, one after the other, and as many samples of each. Times are those of the
processor, of one thread.
"""

import importlib
import os
import resource
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import numpy as np
from measuring import absent, counted

from handclean.glove.definitions import load_glove
from handclean.glove.models import fit
from handclean.glove.poses import key_poses
from handclean.glove.samples import of_hinges
from handclean.glove.scaled import TABLE_2
from handclean.numerics.gp.settings import FitSettings
from handclean.simulation.glove import simulate_glove
from handclean.simulation.settings import SimulateConfig

SEEDS = range(counted("gloves and persons", 3, quick=1))
SAMPLES = counted("samples", 2000, quick=300, tiny=120)
MANY = 10 * SAMPLES
LARGEST = counted("pseudo-inputs, at most", 500, quick=500, tiny=50)
CLIP = 267
GLOVE = "cyberglove18"
ABDUCTION = "index_middle_abduction"
PAPER = {
    "m0-rbf": (752.3, 5795, -1.79),
    "m0-lard": (197.5, 7641, 2.39),
    "m0-seard+seard": (4569.2, 4962, -1.79),
    "m0-lard+seard": (333.8, 4545, -1.81),
    "ml-rbf": (2615.5, 4973, -1.80),
    "ml-lard": (219.2, 7635, 2.39),
    "ml-seard+seard": (3760.3, 4600, -1.80),
    "ml-lard+seard": (331.2, 4543, -1.81),
}
PAPER_4 = {20: 6.2, 50: 7.6, 100: 9.7, 300: 32.0, 500: 67.4}
SIZES = tuple(size for size in PAPER_4 if size <= LARGEST)


@cache
def session(seed):
    """Readings and rotations [deg] of each take, by name."""
    settings = SimulateConfig(seed=seed, glove=GLOVE)
    made = simulate_glove(settings, 0, key_poses())
    hand, hinges = load_glove(GLOVE).hand, made.wearer.tree.hinges
    return {
        take.name: (take.readings, np.degrees(of_hinges(hand, hinges, take.angles)))
        for take in made.takes
    }


def gathered(seed, rotation, wanted, count):
    """Inputs and targets of so many samples of takes whose name begins like wanted."""
    glove = load_glove(GLOVE)
    row = glove.row(rotation)
    columns = [glove.sensors.index(sensor) for sensor in row.inputs]
    takes = [two for name, two in session(seed).items() if name.startswith(wanted)]
    inputs = np.concatenate([readings[:, columns] for readings, _ in takes])
    which = glove.hand.index(rotation)
    targets = np.concatenate([rotations[:, which] for _, rotations in takes])
    rows = np.linspace(0, len(targets) - 1, min(count, len(targets))).astype(int)
    return inputs[rows], targets[rows]


def abduction(seed):
    """Samples for one model, and the clip it is tried on."""
    wanted = (f"w1/hold-{ABDUCTION}", "w1/touch-thumb-index", "w1/touch-thumb-middle")
    clip = gathered(seed, ABDUCTION, "w2/motion", 10**6)
    return *gathered(seed, ABDUCTION, wanted, SAMPLES), *(part[:CLIP] for part in clip)


def processor(call):
    """Best processor time of three calls [s]."""
    best = np.inf
    for _ in range(3):
        begin = time.process_time()
        call()
        best = min(best, time.process_time() - begin)
    return best


def spread(values, form="{:.2f}"):
    """Mean and deviation."""
    return f"{form.format(np.mean(values))} ± {form.format(np.std(values))}"


def table_2():
    """The eight models of table 2, one with a polynomial, and the sparse one."""
    rows = []
    for kind in (*TABLE_2, "ml-poly2+seard", "spgp", "linear"):
        train, predict, nlml, noise, off = [], [], [], [], []
        for seed in SEEDS:
            inputs, targets, new, truth = abduction(seed)
            begin = time.process_time()
            made = fit(kind, inputs, targets, FitSettings(), np.random.default_rng(0))
            train.append(time.process_time() - begin)
            mean, _ = made.predict(new)
            predict.append(processor(lambda made=made, new=new: made.predict(new)))
            nlml.append(made.nlml)
            noise.append(np.log(made.noise))
            off.append(np.sqrt(((mean - truth) ** 2).mean()))
        row = {
            "model": kind,
            "train [s]": spread(train),
            "267 frames [s]": f"{np.mean(predict):.4f}",
            "NLML": spread(nlml, "{:.0f}"),
            "log sigma": spread(noise),
            "error [deg]": spread(off),
        }
        if kind in PAPER:
            row["paper: s, NLML, log sigma"] = "{} / {} / {}".format(*PAPER[kind])
        rows.append(row)
    return rows


def one(task):
    """Fit one rotation; processor seconds."""
    inputs, targets, kind, settings = task
    begin = time.process_time()
    made = fit(kind, inputs, targets, settings, np.random.default_rng(0))
    return made, time.process_time() - begin


def whole(kind, pseudo, count=SAMPLES):
    """Tasks of a whole glove."""
    settings = FitSettings(pseudo_inputs=pseudo)
    return [
        (*gathered(0, row.rotation, "w1/", count), kind, settings)
        for row in load_glove(GLOVE).measured
    ]


def glove_row(made, seconds, paper):
    """One line of table 4."""
    glove = load_glove(GLOVE)
    readings, truth = session(0)["w2/motion"]
    off, per_frame = [], 0.0
    for row, model in zip(glove.measured, made, strict=True):
        new = readings[:, [glove.sensors.index(sensor) for sensor in row.inputs]]
        mean, _ = model.predict(new)
        off.append(mean - truth[:, glove.hand.index(row.rotation)])
        per_frame += processor(lambda m=model, n=new: m.predict(n)) / len(new)
    return {
        "train, glove [s]": f"{sum(seconds):.1f}",
        "paper [s]": paper,
        "predict, glove, per frame [ms]": f"{1e3 * per_frame:.4f}",
        "NLML, mean": f"{np.mean([model.nlml for model in made]):.0f}",
        "error [deg]": f"{np.sqrt(np.mean(np.square(off))):.2f}",
    }


def table_4():
    """Pseudo-inputs against time and error; the full model; both cores."""
    rows = []
    for pseudo in SIZES:
        done = [one(task) for task in whole("spgp", pseudo)]
        made, seconds = zip(*done, strict=True)
        row = {"model": f"spgp {pseudo}", **glove_row(made, seconds, PAPER_4[pseudo])}
        rows.append(row)
        if pseudo == 100:
            begin = time.perf_counter()
            with ProcessPoolExecutor(os.cpu_count()) as pool:
                list(pool.map(one, whole("spgp", pseudo)))
            row["wall, all cores [s]"] = f"{time.perf_counter() - begin:.1f}"
    made, seconds = zip(*(one(task) for task in whole("lmc-gpr", 1)), strict=True)
    rows.append({"model": "lmc-gpr", **glove_row(made, seconds, "")})
    return rows


def alone(pseudo, count):
    """Time and memory of one sparse fit, in a process of its own."""
    inputs, targets = gathered(0, ABDUCTION, "w1/", count)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    settings = FitSettings(pseudo_inputs=pseudo, evaluations=15)
    made, seconds = one((inputs, targets, "spgp", settings))
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "N": len(targets),
        "M": pseudo,
        "per evaluation [s]": f"{seconds / made.figures.evaluations:.3f}",
        "memory [MB]": f"{(after - before) / 1024:.0f}",
        "a matrix of M x N [MB]": f"{pseudo * len(targets) * 8 / 2**20:.0f}",
    }


def growth():
    """Sparse fits of more samples and more pseudo-inputs."""
    rows = []
    large = min(1000, SAMPLES // 2)
    for sizes in ((100, SAMPLES), (100, MANY), (300, SAMPLES), (large, SAMPLES)):
        with ProcessPoolExecutor(1) as pool:
            rows.append(pool.submit(alone, *sizes).result())
    return rows


def sklearn_row(inputs, targets):
    """scikit-learn, zero mean and squared exponential."""
    from sklearn.gaussian_process import GaussianProcessRegressor, kernels

    model = GaussianProcessRegressor(
        kernels.ConstantKernel(1.0, (1e-6, 1e6))
        * kernels.RBF(np.ones(inputs.shape[1]), (1e-2, 1e3))
        + kernels.WhiteKernel(0.1, (1e-8, 10.0)),
        alpha=1e-10,
    )
    begin = time.process_time()
    model.fit(inputs, targets)
    return time.process_time() - begin, -model.log_marginal_likelihood_value_


def gpy_row(inputs, targets, sparse=0):
    """GPy: LMC-GPR, or FITC of what a line leaves (it takes no mean)."""
    import GPy

    size = inputs.shape[1]
    kernel = GPy.kern.Linear(size, ARD=True) + GPy.kern.RBF(size, ARD=True)
    begin = time.process_time()
    if sparse:
        columns = np.column_stack([inputs, np.ones(len(inputs))])
        left = targets - columns @ np.linalg.lstsq(columns, targets, rcond=None)[0]
        rng = np.random.default_rng(0)
        pseudo = inputs[rng.permutation(len(inputs))[:sparse]].copy()
        model = GPy.core.SparseGP(
            inputs,
            left[:, None],
            pseudo,
            kernel,
            GPy.likelihoods.Gaussian(variance=0.1),
            inference_method=GPy.inference.latent_function_inference.FITC(),
        )
    else:
        mean = GPy.mappings.Additive(
            GPy.mappings.Linear(size, 1), GPy.mappings.Constant(size, 1)
        )
        model = GPy.models.GPRegression(
            inputs, targets[:, None], kernel, noise_var=0.1, mean_function=mean
        )
    model.optimize("lbfgsb", max_iters=100 if sparse else 1000)
    return time.process_time() - begin, float(model.objective_function())


def peers():
    """What a user would take instead, on the same scaled samples."""
    inputs, targets, _, _ = abduction(0)
    inputs = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    targets = (targets - targets.mean()) / targets.std()
    seconds = {}
    for kind in ("lmc-gpr", "m0-seard", "spgp"):
        made, spent = one((inputs, targets, kind, FitSettings()))
        seconds[kind] = (spent, made.nlml)
    rows = []
    for name, call, kind in (
        ("scikit-learn, m0-seard", sklearn_row, "m0-seard"),
        ("GPy, lmc-gpr", gpy_row, "lmc-gpr"),
        ("GPy, FITC 100", lambda x, y: gpy_row(x, y, 100), "spgp"),
    ):
        module = "sklearn" if name.startswith("scikit") else "GPy"
        try:
            importlib.import_module(module)
        except ImportError:
            absent(name.split(",")[0])
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            spent, nlml = call(inputs, targets)
        rows.append(
            {
                "peer": name,
                "ours [s]": f"{seconds[kind][0]:.2f}",
                "our NLML": f"{seconds[kind][1]:.1f}",
                "theirs [s]": f"{spent:.1f}",
                "their NLML": f"{nlml:.1f}",
                "ratio": f"{spent / seconds[kind][0]:.0f}",
            }
        )
    return rows


def rows():
    """All tables."""
    return {
        f"Table 2: abduction, {SAMPLES} samples": table_2(),
        f"Table 4: the whole glove, {SAMPLES} samples a rotation": table_4(),
        "Sparse: samples and pseudo-inputs (15 evaluations)": growth(),
        f"Peers: {SAMPLES} samples, three inputs, scaled": peers(),
    }


if __name__ == "__main__":
    for title, part in rows().items():
        print(title)
        for line in part:
            print("  ", line)
