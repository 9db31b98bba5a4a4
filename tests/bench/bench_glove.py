"""A glove's calibration against the truth (Wang & Neff 2013, section 7).

Simulated glove (18 sensors; curves and coupling outside the models' class, 1.1 degrees
of noise, 8 bits), seeds of which each is another glove and another hand. Calibrated in
one donning: eight key poses, widgets, touching; tested in another, except where said.
Readings are smoothed as `sample` and `apply` do, except where said. "Donned again" is a
calibration adapted by `rewear` to the donning of the test, by two key poses, flat and
fist, and pinches of index and little finger recorded anew. "With markers" has samples
of 600 frames of free movement whose angles were solved, as a laboratory would: the hand
is calibrated from a range-of-motion take of the same 26 markers, each glued within 1 mm
of its place, sliding by 1.5 mm, seen with 0.2 mm of noise; frames that are not trusted
are left out, and the wrist, which no marker tells of, is not among the samples. Errors
are of the 17 measured rotations, mean and standard deviation over rotations, frames and
seeds; figures per seed are mean and standard deviation over seeds. Columns called paper
are what the paper has for its own glove.
"""

import time
from dataclasses import replace
from functools import cache, cached_property

import numpy as np
from measuring import counted

from handclean.glove import calibrate as cal
from handclean.glove import calibration as calibration_of
from handclean.glove import examine, reach, readings, touch
from handclean.glove import samples as taken
from handclean.glove.definitions import load_glove
from handclean.glove.donning import adapt_to_donning
from handclean.glove.gloves import with_coupling
from handclean.glove.poses import key_poses
from handclean.glove.settings import GloveApplyConfig, GloveFitConfig
from handclean.glove.smooth import smoothed
from handclean.hand.marker_set import load_marker_set
from handclean.hand.model import marker_positions
from handclean.ik.solve import solve_markers
from handclean.ik.take import solve
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Recording, trajectories
from handclean.simulation.glove import (
    CALIBRATION_POSES,
    FURTHER_POSES,
    REFIT_POSES,
    TEST_POSES,
    simulate_glove,
)
from handclean.simulation.glove_motions import LONG, tip_distance
from handclean.simulation.settings import SimulateConfig
from handclean.simulation.simulate import simulate_one
from handclean.simulation.timing import shaking
from handclean.subject.calibrate import calibrate
from handclean.subject.settings import CalibrateConfig
from handclean.tree import POSE_HEAD

SEEDS = tuple(range(counted("seeds", 3, quick=1)))
MOST = counted("samples of a rotation, at most", 2000, quick=300, tiny=60)
EVALUATIONS = counted("evaluations of a fit, at most", 130, quick=20, tiny=5)
STARTS = counted("starting points of a fit", 3, quick=1)
FRAMES = counted("frames that a hand is learnt from", 400, quick=200, tiny=40)
LARGEST = counted("pseudo-inputs, at most", 300, quick=300, tiny=20)
SIZES = tuple(size for size in (20, 50, 100, 300) if size <= LARGEST)
MARKERS = "maycock26"
CUTOFF = GloveApplyConfig().cutoff_hz

TABLE_1 = {
    ("TI_ABD", "T_TMC"): (9.6, 25.4),
    ("IM_ABD", "I_MCP"): (22.2, 33.8),
    ("IM_ABD", "M_MCP"): (13.2, 54.1),
    ("IM_ABD", "I_MCP+M_MCP"): (45.7, 114.2),
    ("MR_ABD", "M_MCP"): (34.4, 92.1),
    ("MR_ABD", "R_MCP"): (42.1, 115.5),
    ("MR_ABD", "M_MCP+R_MCP"): (42.5, 120.4),
    ("RP_ABD", "R_MCP"): (27.8, 69.2),
    ("RP_ABD", "P_MCP"): (36.0, 80.5),
    ("RP_ABD", "R_MCP+P_MCP"): (22.7, 93.8),
    ("W_FLEX", "W_ABD"): (13.6, 37.5),
    ("W_ABD", "W_FLEX"): (6.5, 26.3),
}
TABLE_3 = {  # LMC-GPR
    "flat": 0.9, "fist": 1.5, "spread": 0.9, "overbend": 1.7, "thumb-up": 2.0,
    "pointing": 2.2, "pinky-up": 2.5, "rest": 2.4, "ok": 1.5,
}  # fmt: skip


class Session:
    """One person's recordings, and what is sampled from them."""

    def __init__(self, seed, subject=0, glove="cyberglove18", cutoff=CUTOFF):
        settings = SimulateConfig(seed=seed, subjects=3, trials=3, glove=glove)
        self.seed = [seed, subject]
        self.made = simulate_glove(settings, subject, key_poses())
        self.takes = {
            t.name: replace(t, readings=smoothed(t.times, t.readings, cutoff))
            for t in self.made.takes
        }
        base = load_glove(glove)
        self.examined = examine.examine(
            base,
            [
                examine.Moved(where=t.name, sensors=t.moved, readings=t.readings)
                for t in self.made.takes
                if t.moved
            ],
        )
        self.glove = with_coupling(base, {}, self.examined.reading, "bench")
        self.hinges = self.made.wearer.tree.hinges
        hand = self.glove.hand
        self.own = [hand.index(row.rotation) for row in self.glove.measured]
        self.into = hand.from_hinges(self.hinges)

    def truth(self, name):
        return (self.takes[name].angles @ self.into.T)[:, self.own]

    def fk(self, poses=(*CALIBRATION_POSES, *FURTHER_POSES), holds=True):
        glove, hand, out = self.glove, self.glove.hand, []
        for name, take in self.takes.items():
            kind, _, rest = name.removeprefix("w1/").partition("-")
            most = 10 if kind == "pose" else 250
            rows = taken.spread(len(take.times), most)
            if kind == "pose" and rest.rpartition("-")[0] in poses:
                pose = key_poses()[rest.rpartition("-")[0]]
                targets = taken.of_pose(hand, pose, len(rows))
            elif kind == "hold" and holds and name.startswith("w1/"):
                at = max(rest.rfind("+"), rest.rfind("-"))
                if rest[:at] not in hand.rotations:
                    continue
                held = {rest[:at]: np.radians(float(rest[at:]))}
                targets = taken.of_hold(glove, held, len(rows))
            else:
                continue
            if name.startswith("w1/"):
                given = (glove, take.readings[rows], targets, taken.FK, name)
                out.append(taken.make_samples(*given))
        return taken.merged(out)

    @cached_property
    def glued(self):
        """The true hand with its markers near where they should be."""
        rng = np.random.default_rng([*self.seed, 13])
        model = load_marker_set(MARKERS).on(self.made.wearer.tree)
        return replace(model, at=model.at + rng.normal(0.0, 1e-3, model.at.shape))

    def seen(self, times, poses, stream):
        """A take of the markers: they slide, cameras have noise."""
        rng = np.random.default_rng([*self.seed, stream])
        places = marker_positions(self.glued, poses)
        slides = shaking(times, 0.0, 0.5, 1.5e-3, places[0].size, rng)
        places = places + slides.reshape(places.shape)
        places += rng.normal(0.0, 2e-4, places.shape)
        return Recording(
            rate=round(1.0 / float(np.diff(times).mean()), 3),
            frames=len(times),
            markers=trajectories(places, self.glued.labels),
        )

    def poses(self, names, angles):
        """(T, 7 + D) the true hand at rest, its hinges as they are."""
        poses = np.zeros((len(angles), POSE_HEAD + len(self.hinges)))
        poses[:, 3] = 1.0
        for column, name in enumerate(names):
            if name in self.hinges:
                place = POSE_HEAD + self.hinges.index(name)
                poses[:, place] = angles[:, column]
        return poses

    @cached_property
    def learnt(self):
        """The hand as it is calibrated from a range-of-motion take."""
        about = SimulateConfig(rate_hz=60.0, occlusion=False, seed=self.seed[0])
        (motion,) = simulate_one("rom", about, self.seed[1]).truth.motions.values()
        poses = self.poses(motion.names, motion.angles)
        poses[:, :POSE_HEAD] = motion.poses[:, :POSE_HEAD]
        rom = self.seen(np.arange(len(poses)) / 60.0, poses, 14)
        markers = load_marker_set(MARKERS)
        settings = CalibrateConfig(frames=FRAMES, holdout=0.0)
        return calibrate([rom], markers, settings, side="right")[0]

    def markers(self):
        take = self.takes["w1/markers"]
        rows = taken.spread(len(take.times), 600)
        seen = self.seen(take.times, self.poses(self.hinges, take.angles), 15)
        solved = solve(seen, self.learnt, name="right", prior=read_prior())
        motion = solved.motions["right"]
        angles = np.where(motion.trusted[:, None], motion.angles, np.nan)
        hand = self.glove.hand
        targets = taken.of_hinges(hand, motion.names, angles[rows])
        given = (self.glove, take.readings[rows], targets, taken.FK, take.name)
        return taken.make_samples(*given)

    def again(self, calibration):
        """The calibration for the second donning."""
        out = []
        for pose in REFIT_POSES:
            take = self.takes[f"w2/pose-{pose}-2"]
            rows = taken.spread(len(take.times), 60)
            targets = taken.of_pose(self.glove.hand, key_poses()[pose], len(rows))
            given = (self.glove, take.readings[rows], targets, taken.FK, take.name)
            out.append(taken.make_samples(*given))
        pinches, _ = self.ik(calibration, "w2/pinch", ("index", "little"))
        return adapt_to_donning(calibration, taken.merged([*out, pinches])).calibration

    def ik(self, start=None, what="w1/touch", fingers=LONG):
        """Samples of touching, and the share of frames in which tips met."""
        out, reached = [], []
        for finger in fingers:
            take = self.takes[f"{what}-thumb-{finger}"]
            rows = taken.spread(len(take.times), 250)
            chains = reach.chains_of(
                self.glove, self.made.wearer.tree, ["thumb", finger]
            )
            if start is None:
                m = readings.rescaled(self.glove, take.readings[rows])
                sigma = touch.start_sigma(self.glove)
            else:
                m, variance = calibration_of.predict_measured(
                    start, take.readings[rows]
                )
                sigma = np.sqrt(np.maximum(variance, np.radians(1.5) ** 2))
            met = touch.meet(self.glove, chains, m, sigma)
            good = met.apart <= 5e-4
            reached.append(good.mean())
            targets = np.full((len(rows), len(self.glove.hand.rotations)), np.nan)
            targets[:, self.own] = np.where(good[:, None], met.rotations, np.nan)
            given = (self.glove, take.readings[rows], targets, taken.IK, take.name)
            out.append(taken.make_samples(*given))
        return taken.merged(out), float(np.mean(reached))

    def predict(self, calibration, name):
        values = self.takes[name].readings
        if calibration is None:
            return readings.rescaled(self.glove, values), None
        return calibration_of.predict_measured(calibration, values)

    def errors(self, calibration, name):
        return np.degrees(np.abs(self.predict(calibration, name)[0] - self.truth(name)))

    def tips(self, calibration, finger, donning=2):
        name = f"w{donning}/touch-thumb-{finger}"
        mean, _ = self.predict(calibration, name)
        angles, _ = calibration_of.to_hinges(
            self.glove, self.hinges, mean, np.zeros_like(mean)
        )
        return tip_distance(self.made.wearer, finger, angles)

    def z(self, calibration, names):
        out = []
        for name in names:
            mean, variance = self.predict(calibration, name)
            out.append(((mean - self.truth(name)) / np.sqrt(variance)).ravel())
        return np.concatenate(out)


def settings_of(**given):
    few = {"most": MOST, "starts": STARTS, "evaluations": EVALUATIONS}
    return GloveFitConfig(**{**few, **given})


def fitted(session, samples, model, **given):
    settings = settings_of(model=model, **given)
    return cal.calibrate(session.glove, samples, settings)


@cache
def world(seed):
    """A session, its samples, and the four calibrations of table 3."""
    session = Session(seed)
    fk = session.fk()
    start = fitted(session, fk, "spgp")
    ik, reached = session.ik(start)
    _, blind = session.ik()
    both = taken.merged([fk, ik])
    paper = taken.merged([session.fk(poses=CALIBRATION_POSES), ik])
    sparse = fitted(session, both, "spgp")
    made = {
        "raw": None,
        "linear": fitted(
            session, session.fk(poses=CALIBRATION_POSES, holds=False), "linear"
        ),
        "LMC-GPR": fitted(session, both, "lmc-gpr"),
        "SPGP-100": sparse,
        "SPGP-100, donned again": session.again(sparse),
        "FK only, donned again": session.again(start),
        "SPGP-100, four key poses": fitted(session, paper, "spgp"),
        "FK only": start,
        "IK only": fitted(session, ik, "spgp"),
        "with markers": fitted(
            session, taken.merged([both, session.markers()]), "spgp"
        ),
    }
    return session, both, made, (reached, blind)


@cache
def noisy(seed):
    """The same with readings as they are: a session and its SPGP calibration."""
    session = Session(seed, cutoff=0.0)
    fk = session.fk()
    ik, _ = session.ik(fitted(session, fk, "spgp"))
    return session, fitted(session, taken.merged([fk, ik]), "spgp")


def pooled(values):
    values = np.concatenate([np.ravel(v) for v in values])
    return f"{values.mean():.1f} ± {values.std():.1f}"


def over_seeds(values):
    return f"{np.mean(values):.2f} ± {np.std(values):.2f}"


def table_1():
    found = [world(seed)[0].examined for seed in SEEDS]
    rows = []
    for (sensor, by), (sd, most) in TABLE_1.items():
        own = [
            e
            for f in found
            for e in f.effects
            if (e.sensor, "+".join(e.by)) == (sensor, by)
        ]
        rows.append(
            {
                "sensor": sensor,
                "moved": by,
                "sd %": over_seeds([100 * e.sd for e in own]),
                "largest %": over_seeds([100 * e.most for e in own]),
                "paper sd %": sd,
                "paper largest %": most,
                "coupled": f"{sum(e.coupled for e in own)} of {len(own)}",
            }
        )
    known = {key for key in TABLE_1 if "+" not in key[1]}
    other = [
        (e.sensor, e.by[0])
        for f in found
        for e in f.effects
        if e.coupled and len(e.by) == 1 and (e.sensor, e.by[0]) not in known
    ]
    rows.append({"sensor": "others called coupled", "moved": f"{len(other)}: {other}"})
    return rows


def table_3():
    names = ("raw", "linear", "LMC-GPR", "SPGP-100", "SPGP-100, four key poses")
    rows = []
    for pose in TEST_POSES:
        row = {"pose [deg]": pose}
        for name in names:
            every = []
            for seed in SEEDS:
                session, _, made, _ = world(seed)
                every.append(session.errors(made[name], f"w2/pose-{pose}-1"))
            row[name] = pooled(every)
        rows.append(row | {"paper LMC-GPR": TABLE_3[pose]})
    return rows


def figure_11():
    rows = []
    for name in ("raw", "linear", "LMC-GPR", "SPGP-100"):
        row = {"calibration": name}
        for angle in (0, 25):
            means, spreads = [], []
            for seed in SEEDS:
                session, _, made, _ = world(seed)
                take = f"w2/hold-index_middle_abduction{angle:+d}"
                mean, _ = session.predict(made[name], take)
                order = [r.measured_by for r in session.glove.measured]
                values = np.degrees(mean[:, order.index("IM_ABD")])
                means.append(values.mean())
                spreads.append(values.std())
            row[f"{angle} deg: mean"] = over_seeds(means)
            row[f"{angle} deg: sd while fingers move"] = over_seeds(spreads)
        rows.append(row)
    return rows


def figure_12():
    rows = []
    paper = {"raw": 75.3, "linear": 52.5, "LMC-GPR": 0.8, "SPGP-100": 17.5}
    names = (
        "raw", "linear", "FK only", "LMC-GPR", "SPGP-100", "SPGP-100, not smoothed",
        "SPGP-100, donned again", "with markers",
    )  # fmt: skip
    for name in names:
        row = {"calibration": name}
        chosen = [
            noisy(s) if name.endswith("smoothed") else (world(s)[0], world(s)[2][name])
            for s in SEEDS
        ]
        for finger in LONG:
            row[f"thumb-{finger} [mm]"] = over_seeds(
                [1e3 * session.tips(made, finger).mean() for session, made in chosen]
            )
        if not name.endswith("again"):
            row["trained donning, all [mm]"] = over_seeds(
                [
                    1e3 * np.mean([session.tips(made, f, 1).mean() for f in LONG])
                    for session, made in chosen
                ]
            )
        rows.append(row | {"paper, index [mm]": paper.get(name, "")})
    met = [world(seed)[3] for seed in SEEDS]
    rows.append(
        {
            "calibration": "frames of touching whose tips the IK brings together: "
            f"{100 * np.mean([m[0] for m in met]):.0f} % from a calibration by FK, "
            f"{100 * np.mean([m[1] for m in met]):.0f} % from rescaled readings"
        }
    )
    return rows


def figure_13():
    """Fingertips of free movement by the glove, by markers on it, and true."""
    distances = {}

    def add(what, one, other):
        apart = 1e3 * np.linalg.norm(one - other, axis=2)
        distances.setdefault(what, []).append(apart.ravel())

    for seed in SEEDS:
        session, _, made, _ = world(seed)
        wearer = session.made.wearer
        take = session.takes["w2/motion"]
        poses = session.poses(session.hinges, take.angles)
        true = marker_positions(wearer.tips, poses)
        places = session.seen(take.times, poses, 16).markers.positions
        model = load_marker_set(MARKERS).on(wearer.tree)
        by_markers = marker_positions(wearer.tips, solve_markers(model, places).poses)
        add("26 markers against truth", by_markers, true)
        for name in ("linear", "FK only", "LMC-GPR", "SPGP-100", "with markers"):
            mean, _ = session.predict(made[name], take.name)
            angles, _ = calibration_of.to_hinges(
                session.glove, session.hinges, mean, np.zeros_like(mean)
            )
            rows = poses.copy()
            rows[:, 7:] = angles
            tips = marker_positions(wearer.tips, rows)
            add(f"glove, {name}, against truth", tips, true)
            add(f"glove, {name}, against 26 markers", tips, by_markers)
    return [
        {
            "fingertips": what,
            "distance [mm]": pooled(values),
            "95 % [mm]": f"{np.quantile(np.concatenate(values), 0.95):.1f}",
        }
        for what, values in distances.items()
    ]


def figure_14():
    rows = []
    for size in SIZES:
        fk, tips, seconds = [], [], []
        for seed in SEEDS:
            session, both, _, _ = world(seed)
            tasks, _ = cal.fit_tasks(
                session.glove,
                both,
                settings_of(pseudo_inputs=size),
                0,
            )
            begin = time.process_time()
            fits = [cal.run_task(task) for task in tasks]
            seconds.append(time.process_time() - begin)
            made = cal.assemble(session.glove, both, GloveFitConfig(), fits)
            fk.append(
                np.mean(
                    [session.errors(made, f"w2/pose-{p}-1").mean() for p in TEST_POSES]
                )
            )
            tips.append(1e3 * np.mean([session.tips(made, f).mean() for f in LONG]))
        rows.append(
            {
                "M": size,
                "nine poses [deg]": over_seeds(fk),
                "tips when touching [mm]": over_seeds(tips),
                "training, whole glove, processor [s]": over_seeds(seconds),
            }
        )
    return rows


def elsewhere():
    rows = []

    def add(what, errors):
        rows.append({"free movement": what, "error [deg]": pooled(errors)})

    for name in ("linear", "LMC-GPR", "SPGP-100", "FK only", "IK only"):
        add(
            f"{name}, the same donning",
            [world(s)[0].errors(world(s)[2][name], "w1/markers") for s in SEEDS],
        )
    add(
        "SPGP-100, not smoothed, the same donning",
        [noisy(s)[0].errors(noisy(s)[1], "w1/markers") for s in SEEDS],
    )
    for name in ("linear", "LMC-GPR", "SPGP-100", "FK only", "IK only", "with markers"):
        add(
            f"{name}, another donning",
            [world(s)[0].errors(world(s)[2][name], "w2/motion") for s in SEEDS],
        )
    add(
        "SPGP-100, not smoothed, another donning",
        [noisy(s)[0].errors(noisy(s)[1], "w2/motion") for s in SEEDS],
    )
    for name in ("SPGP-100", "FK only"):
        again = f"{name}, donned again"
        add(
            f"{again}, another donning",
            [world(s)[0].errors(world(s)[2][again], "w2/motion") for s in SEEDS],
        )
    left_out, adapted = [], []
    for seed in SEEDS:
        people = [Session(seed, subject) for subject in range(3)]
        for k, person in enumerate(people):
            others = [other.fk() for j, other in enumerate(people) if j != k]
            made = fitted(person, taken.merged(others), "spgp")
            left_out.append(person.errors(made, "w2/motion"))
            adapted.append(person.errors(person.again(made), "w2/motion"))
    add("FK samples of two others, another subject", left_out)
    add("FK samples of two others, donned again, another subject", adapted)
    return rows


def variance():
    rows = []
    tests = {
        "nine poses": [f"w2/pose-{pose}-1" for pose in TEST_POSES],
        "touching": [f"w2/touch-thumb-{finger}" for finger in LONG],
        "free movement": ["w2/motion"],
    }
    for name in (
        "LMC-GPR", "SPGP-100", "SPGP-100, donned again", "FK only", "with markers",
    ):  # fmt: skip
        for what, takes in tests.items():
            every = [world(s)[0].z(world(s)[2][name], takes) for s in SEEDS]
            one = [np.mean(np.abs(z) < 1.0) for z in every]
            two = [np.mean(np.abs(z) < 2.0) for z in every]
            rows.append(
                {
                    "calibration": name,
                    "test": what,
                    "within 1 sigma (0.68)": over_seeds(one),
                    "within 2 sigma (0.95)": over_seeds(two),
                }
            )
    return rows


def gloves():
    rows = []
    for name in ("cyberglove22", "cyberglove18", "generic14", "generic5"):
        session = Session(0, glove=name)
        names = [r.rotation for r in session.glove.measured]
        row = {"glove": name, "sensors": len(session.glove.sensors)}
        fk = session.fk()
        marked = taken.merged([fk, session.markers()])
        for what, samples in (("FK only", fk), ("with markers", marked)):
            made = fitted(session, samples, "spgp", most=min(500, MOST), starts=1)
            errors = session.errors(made, "w2/motion")
            kept = [names.index(fit.rotation) for fit in made.fits]
            row[f"rotations, {what}"] = len(kept)
            row[f"free movement, {what} [deg]"] = pooled([errors[:, kept]])
        rows.append(row)
    return rows


def rows():
    return {
        "Table 1: cross-coupling that examine finds": table_1(),
        "Table 3: nine poses": table_3(),
        "Figure 11: index-middle abduction held by a widget, 25 degrees never seen": (
            figure_11()
        ),
        "Figure 12: distance of fingertips that touch": figure_12(),
        "Figure 13: fingertips in free movement, glove-driven and marker-driven": (
            figure_13()
        ),
        "Figure 14: pseudo-inputs": figure_14(),
        "Other donnings and other people": elsewhere(),
        "Variance: share of the truth within": variance(),
        "Gloves that ship": gloves(),
    }
