"""Fifteen cells: gaps of five lengths, of one marker, of four, of a whole finger.

Every filler is judged on the same gaps, each cut alone into a take in which nothing
else is missing. The file form, for fillers in any language: ``gaps.csv`` has a line for
each gap (number, take, seed, length_s, pattern, markers, first and last frame, from 0),
and beside it each take is a CSV of its own, one line a frame, three columns [m] a
marker. Whoever fills them writes ``filled.csv``: gap, frame, marker, x, y, z [m].
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LENGTHS_S = (0.1, 0.2, 0.5, 1.0, 2.0)
PATTERNS = ("1", "4", "finger")
SEEDS = (101, 102, 103, 104, 105)
"""Not used while fillers were made."""

EACH = 12
"""Gaps of a cell, take and seed."""


HEAD = (
    "gap", "take", "rate_hz", "seed", "length_s", "pattern", "markers", "first", "last"
)  # fmt: skip
"""Columns of ``gaps.csv``."""


@dataclass(frozen=True)
class Hole:
    """Markers ``hidden`` in frames ``first`` to ``stop`` (exclusive) of a take."""

    take: str
    seed: int
    length_s: float
    pattern: str
    hidden: tuple
    first: int
    stop: int

    @property
    def cell(self):
        """Pattern and length."""
        return self.pattern, self.length_s


def holes(take, seed, each=EACH):
    """Draw the gaps of a take: as ``cells`` of the yardstick draws them."""
    rng = np.random.default_rng(seed)
    frames, markers = take.positions.shape[:2]
    found = []
    for length in LENGTHS_S:
        n = round(length * take.rate)
        for pattern in PATTERNS:
            for _ in range(each if frames > n + 2 * take.margin else 0):
                if pattern == "finger":
                    hidden = take.fingers[rng.integers(len(take.fingers))]
                else:
                    hidden = np.sort(rng.choice(markers, int(pattern), replace=False))
                first = int(rng.integers(take.margin, frames - n - take.margin))
                columns = tuple(int(m) for m in hidden)
                found.append(
                    Hole(take.name, seed, length, pattern, columns, first, first + n)
                )
    return found


def write(folder, takes, found):
    """Write takes and gaps for fillers of others."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for take in takes:
        head = ",".join(f"{label} {axis}" for label in take.labels for axis in "xyz")
        rows = take.positions.reshape(len(take.positions), -1)
        name = folder / f"{take.name.replace(' ', '_')}.csv"
        np.savetxt(name, rows, "%.9g", ",", header=head, comments="")
    with (folder / "gaps.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(
            [
                "gap",
                "take",
                "rate_hz",
                "seed",
                "length_s",
                "pattern",
                "markers",
                "first",
                "last",
            ]
        )
        rates = {take.name: take.rate for take in takes}
        for number, hole in enumerate(found):
            out.writerow(
                [
                    number,
                    hole.take.replace(" ", "_"),
                    rates[hole.take],
                    hole.seed,
                    hole.length_s,
                    hole.pattern,
                    " ".join(map(str, hole.hidden)),
                    hole.first,
                    hole.stop - 1,
                ]
            )


def read_filled(path, found):
    """Places (N, k, 3) [m] by gap of a ``filled.csv``; those not whole are left out.

    Raises
    ------
    ValueError
        If a line names no gap, or a frame or marker that is not of its gap.
    """
    places = {}
    with Path(path).open(newline="") as file:
        for line, row in enumerate(csv.DictReader(file), 2):
            number, frame, marker = (
                int(row[key]) for key in ("gap", "frame", "marker")
            )
            if not 0 <= number < len(found):
                raise ValueError(f"{path}, line {line}: there is no gap {number}")
            hole = found[number]
            if marker not in hole.hidden or not hole.first <= frame < hole.stop:
                raise ValueError(
                    f"{path}, line {line}: frame {frame} of marker {marker} is not "
                    f"of gap {number}"
                )
            shape = (hole.stop - hole.first, len(hole.hidden), 3)
            part = places.setdefault(number, np.full(shape, np.nan))
            at = frame - hole.first, hole.hidden.index(marker)
            part[at] = [float(row[axis]) for axis in "xyz"]
    return {n: part for n, part in places.items() if np.isfinite(part).all()}
