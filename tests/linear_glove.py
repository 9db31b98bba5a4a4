"""A glove of 14 sensors whose readings are lines of the rotations."""

from dataclasses import replace

import numpy as np

from handclean.glove import samples
from handclean.glove.definitions import load_glove
from handclean.glove.settings import GloveFitConfig

GLOVE = load_glove("generic14")
QUICK = GloveFitConfig(model="spgp", pseudo_inputs=15, starts=1, evaluations=40)


def linear_samples(rng, count=120, kinds=3, noise=0.0):
    """Readings that are lines of the rotations, abduction stretched by both MCPs."""
    ranges = GLOVE.hand.ranges
    truth = rng.uniform(*ranges.T, (count, len(ranges)))
    values = readings_of(truth) + noise * rng.normal(size=(count, 14))
    one = samples.make_samples(GLOVE, values, truth, samples.FK, "free", "S01")
    group = np.arange(count) % kinds
    return replace(one, group=group, groups=tuple(f"g{k}" for k in range(kinds)))


def readings_of(truth):
    low, high = GLOVE.hand.ranges.T
    out = np.zeros((len(truth), 14))
    for row in GLOVE.measured:
        r = GLOVE.hand.index(row.rotation)
        share = (truth[:, r] - low[r]) / (high[r] - low[r])
        for other in row.affected_by:
            rotation = {x.measured_by: x.rotation for x in GLOVE.measured}[other]
            o = GLOVE.hand.index(rotation)
            share = share + 0.2 * (truth[:, o] - low[o]) / (high[o] - low[o])
        out[:, GLOVE.sensors.index(row.measured_by)] = 40.0 + 100.0 * share
    return out
