"""Judge a filler of your own on the gaps of the benchmark, beside the ridge.

``judge.py MODULE:FUNCTION`` imports ``FUNCTION(tracks) -> fill(gap)``: the contract of
`handclean.gaps.tracks` (what a filler may look at, what it gives, how it refuses). Each
gap is cut alone; the filler is prepared anew for each.

For a filler in another language ``judge.py --write FOLDER`` writes the takes and
``gaps.csv`` there, and ``judge.py --filled filled.csv`` judges what comes back: columns
gap, frame, marker, x, y, z [m], a line for each hidden sample. Numbers count from 0. A
gap's markers are hidden in its frames, first to last, and may not be looked at there.

The recordings are those of the folder that HANDCLEAN_DATA names.
"""

import argparse
import json
import sys
from importlib import import_module
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from gaps import cells, errors, takes
from handclean.gaps.family.table import BASELINES


def arguments(given):
    """What was asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("filler", nargs="?", metavar="MODULE:FUNCTION")
    what.add_argument("--write", type=Path, metavar="FOLDER")
    what.add_argument("--filled", type=Path, metavar="FILE.csv")
    parser.add_argument("--each", type=int, default=cells.EACH, metavar="N")
    parser.add_argument("--seeds", type=int, nargs="+", default=cells.SEEDS)
    return parser.parse_args(given)


def loaded(name):
    """The function ``prepare`` that a filler's name tells."""
    module, _, function = name.partition(":")
    try:
        return getattr(import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        sys.exit(f"{name}: should be MODULE:FUNCTION that can be imported; {error}")


def from_file(path, taken, holes):
    """Errors of what a file fills, and of the ridge, at the same gaps."""
    try:
        filled = cells.read_filled(path, holes)
    except (OSError, KeyError, TypeError, ValueError) as error:
        sys.exit(f"{path}: {error}")
    of_take = {take.name: take for take in taken}
    ridge = {"ridge": BASELINES["ridge"].prepare}
    found = errors.Errors()
    for number, hole in enumerate(holes):
        take = of_take[hole.take]
        one = errors.judged(take, [hole], ridge)
        errors.note(one, "filled", take, hole, filled.get(number))
        found.add(one)
    return found


def main(given=None):
    """Judge, and print tables as JSON lines."""
    asked = arguments(given)
    taken = takes.real()
    if not taken:
        sys.exit("no recordings; HANDCLEAN_DATA should name their folder")
    holes = [
        hole
        for take in taken
        for seed in asked.seeds
        for hole in cells.holes(take, seed, asked.each)
    ]
    if asked.write is not None:
        cells.write(asked.write, taken, holes)
        return
    if asked.filled is not None:
        found, name = from_file(asked.filled, taken, holes), "filled"
    else:
        name = asked.filler
        fillers = {"ridge": BASELINES["ridge"].prepare, name: loaded(name)}
        found = errors.Errors()
        for take in taken:
            own = [hole for hole in holes if hole.take == take.name]
            found.add(errors.judged(take, own, fillers))
    tables = {
        "all cells": errors.overall(found),
        "by take": errors.by_take(found, (name,)),
        "by cell": errors.by_cell(found, name),
        "mean error, mm": errors.millimetres(found),
    }
    for title, rows in tables.items():
        for row in rows:
            print(json.dumps({"table": title, **row}, default=float))
    missed = int(np.count_nonzero(np.isnan(found.mean[name])))
    print(f"{missed} of {len(holes)} gaps not filled", file=sys.stderr)


if __name__ == "__main__":
    main()
