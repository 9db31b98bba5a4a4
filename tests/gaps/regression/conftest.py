"""Takes to fill: a hand that moves, and the same take elsewhere."""

import numpy as np
import pytest

from handclean.gaps.tracks import Tracks


@pytest.fixture(scope="session")
def turned():
    """Moves positions as a whole: turned by a third about (1, 1, 1), and shifted."""
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

    def move(positions):
        return positions @ turn.T + np.array([0.3, -1.2, 0.8])

    return move


@pytest.fixture(scope="session")
def bending():
    """(T, 8, 3) a palm of four markers, and two fingers of two that bend together."""
    rng = np.random.default_rng(11)
    t = np.arange(2400) / 120.0
    bend = 0.8 + 0.5 * np.sin(1.3 * t) + 0.3 * np.sin(2.9 * t + 1.0)
    also = 0.7 * bend + 0.15 * np.sin(0.7 * t)
    places = np.zeros((len(t), 8, 3))
    places[:, :4] = 0.04 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.1], [1, 1, 0]])
    for base, angle, at in ((4, bend, 0.0), (6, also, 0.04)):
        for k, far in enumerate((0.03, 0.06)):
            here = angle * (1.0 + 0.5 * k)
            places[:, base + k] = np.stack(
                [np.full(len(t), at), 0.05 + far * np.cos(here), -far * np.sin(here)], 1
            )
    yaw = 0.3 * np.sin(0.5 * t)
    turn = np.zeros((len(t), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaw)
    turn[:, 0, 1], turn[:, 1, 0], turn[:, 2, 2] = -np.sin(yaw), np.sin(yaw), 1.0
    world = np.einsum("tij,tmj->tmi", turn, places)
    world += 0.2 * np.sin(0.4 * t)[:, None, None]
    return world + rng.normal(scale=1e-4, size=world.shape)


@pytest.fixture(scope="session")
def tracks_of():
    """Makes tracks of positions, with gaps (column, start, stop) cut."""

    def make(positions, *gaps):
        places = positions.copy()
        for column, start, stop in gaps:
            places[start:stop, column] = np.nan
        return Tracks(positions=places, rate=120.0, bones=np.full(places.shape[1], -1))

    return make
