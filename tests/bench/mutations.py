"""Which faults the tests notice: small mutations of the labeller, the solver, the gaps.

``python tests/bench/mutations.py [--seed N] [--count N] [--first K] [--list]`` draws
mutations, puts each into a copy of the project, runs the tests of the package it is in
until one fails, and prints a table. The kinds: a pass does nothing, a comparison is
turned, a product is doubled, a sign is changed. The named ones come first; they stayed
green once. One takes minutes, as what depends on it is compiled anew; what does not is
loaded from the code of an earlier one.
"""

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TESTS = {
    "labels": ["tests/labels", "tests/commands/test_chain.py"],
    "ik": ["tests/ik", "tests/commands/shared/test_bridged.py", "tests/gaps"],
    "gaps": ["tests/gaps", "tests/commands/test_chain.py"],
}
"""Tests that are run for a package, those that find most first."""

OUTSIDE = ("labels/review/", "gaps/")
"""Where the aim does not hold: these insides are to be replaced."""

LONGEST_S = 1800.0
"""[s] of one run; a mutation that never ends is noticed, too."""

TURNED = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}


NAMED = (
    ("repair off", "labels/track_take.py", "if setup.labelling.repair:", "if False:"),
    ("review off", "labels/track_take.py", "if setup.labelling.review:", "if False:"),
    ("links off", "labels/track/links.py", "if weight <= 0.0:", "if True:"),
    (
        "implausible frames trusted",
        "ik/residual_test.py",
        "return np.asarray(~far)",
        "return np.ones(len(far), dtype=bool)",
    ),
    (
        "posture not led through a gap",
        "gaps/posture.py",
        "poses = _led_through(model, solved, expected & ~seen, limits)",
        "poses = np.array(solved)",
    ),
    (
        "doubt_jumps off",
        "gaps/posture.py",
        "decided = doubt_jumps(decided, model, solved, seen, expected)",
        "decided = decided",
    ),
    (
        "even_noise off",
        "ik/doubt.py",
        "noise = even_noise(noise, positions, solution.residual, left)",
        "noise = np.array(noise)",
    ),
)
"""Faults by name: file, text, what replaces it. No test noticed them once."""


@dataclass(frozen=True)
class Mutation:
    """One fault: where it is, what it is, and the text that replaces another."""

    file: str
    line: int
    function: str
    kind: str
    start: int
    stop: int
    text: str

    def __str__(self):
        return f"{self.file}:{self.line} {self.function}: {self.kind}".replace(
            " :", ":"
        )

    def put(self, project):
        path = project / "handclean" / self.file
        content = path.read_bytes()
        changed = content[: self.start] + self.text.encode() + content[self.stop :]
        ast.parse(changed)
        path.write_bytes(changed)


def named(project=ROOT):
    """Return the faults by name, and the first two of them together."""
    found = []
    for kind, file, old, new in NAMED:
        content = (project / "handclean" / file).read_bytes()
        start = content.index(old.encode())
        line = content[:start].count(b"\n") + 1
        stop = start + len(old.encode())
        found.append(Mutation(file, line, "", kind, start, stop, new))
    both = sorted(found[:2], key=lambda m: -m.start)  # the later one first
    return [[found[0]], [found[1]], both, *([mutation] for mutation in found[2:])]


class Places:
    """Turns nodes of a file into ranges of its bytes."""

    def __init__(self, content):
        self.starts = [0]
        for line in content.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))

    def of(self, node):
        start = self.starts[node.lineno - 1] + node.col_offset
        return start, self.starts[node.end_lineno - 1] + node.end_col_offset


def in_function(function, name, file, places):
    """All mutations of a function."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    returns = [n for n in ast.walk(function) if isinstance(n, ast.Return) and n.value]
    if not returns and body:
        start, _ = places.of(body[0])
        text = "return\n" + " " * body[0].col_offset
        yield Mutation(file, body[0].lineno, name, "does nothing", start, start, text)
    for node in ast.walk(ast.Module(body, [])):
        changed, kind = None, ""
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            turned = TURNED.get(type(node.ops[0]))
            if turned is not None:
                changed = ast.Compare(node.left, [turned()], node.comparators)
                kind = "comparison turned"
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
            changed = ast.BinOp(ast.Constant(2.0), ast.Mult(), node)
            kind = "doubled"
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
            other = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
            changed = ast.BinOp(node.left, other, node.right)
            kind = "sign changed"
        if changed is not None:
            start, stop = places.of(node)
            text = f"({ast.unparse(changed)})"
            yield Mutation(file, node.lineno, name, kind, start, stop, text)


def of_file(path, package):
    content = path.read_bytes()
    places = Places(content)
    file = path.relative_to(package).as_posix()
    for node in ast.parse(content).body:
        if isinstance(node, ast.FunctionDef):
            yield from in_function(node, node.name, file, places)


def drawn(count, seed, project=ROOT):
    """Draw mutations, as many of each kind as there are, without those of one line."""
    package = project / "handclean"
    every = [
        mutation
        for room in TESTS
        for path in sorted((package / room).rglob("*.py"))
        for mutation in of_file(path, package)
    ]
    rng = random.Random(seed)
    kinds = {}
    for mutation in every:
        kinds.setdefault(mutation.kind, []).append(mutation)
    for some in kinds.values():
        rng.shuffle(some)
    found, lines = [], set()
    while len(found) < count and any(kinds.values()):
        for some in kinds.values():
            while some:
                mutation = some.pop()
                if (mutation.file, mutation.line) not in lines:
                    lines.add((mutation.file, mutation.line))
                    found.append(mutation)
                    break
    return found[:count]


def tried(mutations, cache, project=ROOT):
    """Run the tests with mutations put in; return the first test that failed, or ""."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "project")
        skip = shutil.ignore_patterns(".git", ".venv", "__pycache__", "demo_out")
        shutil.copytree(project, copy, ignore=skip)
        for mutation in mutations:
            mutation.put(copy)
        room = mutations[0].file.split("/")[0]
        line = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
        line += ["-m", "not slow and not bench", *TESTS[room]]
        env = {**os.environ, "PYTHONPATH": str(copy), "OPENBLAS_NUM_THREADS": "1"}
        env["NUMBA_CACHE_DIR"] = cache
        try:
            done = subprocess.run(
                line,
                cwd=copy,
                env=env,
                capture_output=True,
                text=True,
                timeout=LONGEST_S,
            )
        except subprocess.TimeoutExpired:
            return "(never ended)"
        if done.returncode == 0:
            return ""
        if done.returncode > 1:  # 1: tests failed; below 0: a signal ended it
            raise RuntimeError(f"pytest did not run: {done.stdout}{done.stderr}")
        failed = [row for row in done.stdout.splitlines() if row.startswith("FAILED")]
        failed += [row for row in done.stdout.splitlines() if row.startswith("ERROR")]
        return failed[0].split(" - ")[0].split(" ", 1)[1] if failed else "(crashed)"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[0])
    parser.add_argument("--seed", type=int, default=2015)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--last", type=int, default=None)
    parser.add_argument("--list", action="store_true", help="only say what is drawn")
    given = parser.parse_args()
    first = named()[: given.count]
    rest = drawn(given.count - len(first), given.seed)
    mutations = [*first, *([mutation] for mutation in rest)]
    caught, aimed, aimed_caught = 0, 0, 0
    print("| mutation | noticed by | seconds |\n|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as cache:
        for some in mutations[given.first : given.last]:
            begin = time.monotonic()
            by = "" if given.list else tried(some, cache)
            names = " and ".join(map(str, some))
            spent = time.monotonic() - begin
            print(f"| {names} | {by or 'nobody'} | {spent:.0f} |", flush=True)
            caught += bool(by)
            if not some[0].file.startswith(OUTSIDE) and some not in first[:3]:
                aimed += 1
                aimed_caught += bool(by)
    done = len(mutations[given.first : given.last])
    print(f"\nnoticed: {caught} of {done}; where aimed: {aimed_caught} of {aimed}")


if __name__ == "__main__":
    main()
