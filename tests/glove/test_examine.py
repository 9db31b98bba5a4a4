"""The rule of table 1."""

from dataclasses import replace

import numpy as np
import pytest

from handclean.errors import HandcleanError, UnknownNameError
from handclean.glove.definitions import load_glove
from handclean.glove.examine import Moved, examine
from handclean.glove.gloves import with_coupling

GLOVE = load_glove("generic14")


def recordings(rng, stretch, noise=1.0):
    """Every sensor alone over 100 counts, IM_ABD stretched by I_MCP."""
    out, t = [], np.linspace(0.0, 20.0, 600)
    for k, name in enumerate(GLOVE.sensors):
        values = 80.0 + rng.normal(0.0, noise, (600, len(GLOVE.sensors)))
        move = 0.5 - 0.5 * np.cos(t + k)
        values[:, k] += 100.0 * move
        if name == "I_MCP":
            values[:, GLOVE.sensors.index("IM_ABD")] += 100.0 * stretch * move
        out.append(Moved(where=f"{name}.csv", sensors=(name,), readings=values))
    return out


def test_a_sensor_is_coupled_from_12_percent_on(rng):
    few = examine(GLOVE, recordings(rng, 0.05))
    assert all(not by for by in few.affected.values())
    many = examine(GLOVE, recordings(rng, 0.30))
    assert {s: by for s, by in many.affected.items() if by} == {"IM_ABD": ("I_MCP",)}
    effect = next(e for e in many.effects if e.coupled)
    assert effect.sd == pytest.approx(0.30 / np.sqrt(8.0), rel=0.1)
    assert effect.most == pytest.approx(0.15, rel=0.15)


def test_noise_is_no_coupling(rng):
    found = examine(GLOVE, recordings(rng, 0.0, noise=5.0))
    assert all(not by for by in found.affected.values())


def test_active_ranges_are_those_of_the_joint_that_moves_alone(rng):
    low, high = examine(GLOVE, recordings(rng, 0.3)).reading["IM_ABD"]
    assert low == pytest.approx(80.0, abs=3.0)
    assert high == pytest.approx(180.0, abs=3.0)


def test_what_was_found_is_what_the_glove_becomes(rng):
    found = examine(GLOVE, recordings(rng, 0.3))
    glove = with_coupling(GLOVE, found.affected, found.reading, "test")
    assert glove.row("index_middle_abduction").inputs == ("IM_ABD", "I_MCP")
    assert glove.row("middle_ring_abduction").inputs == ("MR_ABD",)


def test_sensors_that_never_moved_alone_are_named(rng):
    some = [r for r in recordings(rng, 0.0) if r.sensors != ("T_IP",)]
    assert examine(GLOVE, some).unknown == ("T_IP",)


def test_what_cannot_be_examined_is_named(rng):
    every = recordings(rng, 0.0)
    dead = every[0].readings.copy()
    dead[:, 0] = 7.0
    with pytest.raises(HandcleanError, match="T_MCP never changed"):
        examine(GLOVE, [replace(every[0], readings=dead)])
    with pytest.raises(UnknownNameError, match="sensor"):
        examine(GLOVE, [replace(every[0], sensors=("THUMB",))])
    with pytest.raises(HandcleanError, match="in none"):
        examine(GLOVE, [replace(every[0], sensors=("T_MCP", "T_IP"))])
