"""What the house is like inside: lines by room, long functions, stops of a take.

``python tests/bench/house.py [PROJECT]`` prints tables for a checkout, this one when
none is named. A *stop* is a function that is called while a small take goes through
``label``, ``fill``, ``solve`` or ``read_c3d``, counted once; the compiled ones run as
Python. A *climb* is a stop in a file that had been left for another one before: whoever
reads along has to go back to it.
"""

import ast
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

LONG_LINES = 40  # of code in a function
LONG_MODULE = 300  # lines
MANY_PARAMETERS = 8
WARNING_WORDS = {
    *("traps", "oddities", "repairs", "notes", "words", "told", "findings"),
    *("remarks", "warnings", "noted", "said", "lost"),
}
"""Words that name what is worth telling, as names of variables, fields, functions."""

ENTRIES = {
    "read_c3d": ("c3d", "read_c3d"),
    "label": ("label", "label"),
    "fill": ("fill", "fill"),
    "solve": ("take", "solve"),
}
"""Where counting begins: file (or, of a C3D, the folder) and function."""


def functions_of(tree):
    kinds = ast.FunctionDef | ast.AsyncFunctionDef
    return [node for node in ast.walk(tree) if isinstance(node, kinds)]


def parameters_of(function):
    a = function.args
    return len(a.posonlyargs) + len(a.args) + len(a.kwonlyargs)


def lines_of(function):
    body = function.body[1:] if ast.get_docstring(function) else function.body
    return body[-1].end_lineno - body[0].lineno + 1 if body else 0


def constants_of(tree):
    targets = [
        target
        for node in tree.body
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
    ]
    names = [target.id for target in targets if isinstance(target, ast.Name)]
    return [name for name in names if name.strip("_").isupper()]


def names_in(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.FunctionDef):
            yield node.name


def rooms(project):
    """Count what stands in each room of the package, and in all."""
    package = project / "handclean"
    rows, total, words = {}, Counter(), set()
    for path in sorted(package.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        parts = path.relative_to(package).parts
        room = parts[0] if len(parts) > 1 else "(top)"
        counts = Counter(modules=1, lines=len(text.splitlines()))
        counts["modules over 300 lines"] = counts["lines"] > LONG_MODULE
        counts["constants"] = len(constants_of(tree))
        for function in functions_of(tree):
            counts["functions"] += 1
            counts["over 40 lines"] += lines_of(function) > LONG_LINES
            counts["over 8 parameters"] += parameters_of(function) > MANY_PARAMETERS
        rows.setdefault(room, Counter()).update(counts)
        total.update(counts)
        words |= {n.strip("_") for n in names_in(tree)} & WARNING_WORDS
    tests = 0
    for path in (project / "tests").rglob("test_*.py"):
        found = functions_of(ast.parse(path.read_text(encoding="utf-8")))
        tests += sum(function.name.startswith("test_") for function in found)
    return {**rows, "all": total}, sorted(words), tests


TRACE = """
import json, sys
from pathlib import Path
package, out, place, function = sys.argv[1:5]
line = sys.argv[5:]
from handclean.cli.main import main
found, depth = {}, 0

def is_entry(code):
    file = Path(code.co_filename)
    return code.co_name == function and place in (file.stem, file.parent.name)

def see(frame, event, arg):
    global depth
    code = frame.f_code
    if event not in ("call", "return") or not code.co_filename.startswith(package):
        return
    if event == "call" and (depth or is_entry(code)):
        depth += is_entry(code)
        file = code.co_filename[len(package):]
        found.setdefault((file, code.co_qualname, code.co_firstlineno))
    elif event == "return" and depth:
        depth -= is_entry(code)

sys.setprofile(see)
try:
    main(line)
except SystemExit:
    pass
sys.setprofile(None)
json.dump(list(found), open(out, "w"))
"""


def walks(project):
    """Return the functions that a small take stops at, in order of their first call."""
    with tempfile.TemporaryDirectory() as folder:
        env = {**os.environ, "PYTHONPATH": str(project), "NUMBA_DISABLE_JIT": "1"}

        def run(*words):
            call = [sys.executable, "-m", "handclean", *words]
            subprocess.run(call, cwd=folder, env=env, check=True, capture_output=True)

        scene = ["--duration-s", "0.5", "--rate-hz", "60", "--seed", "3"]
        run("simulate", "rom", "-o", "s", *scene)
        take = next(Path(folder, "s").glob("*.c3d"))
        subject = next(Path(folder, "s", "subjects").glob("*.h5"))
        given = ["--subject", str(subject), "-q"]
        run("label", str(take), "-o", "l.h5", *given)
        lines = {
            "read_c3d": ["inspect", str(take)],
            "label": ["label", str(take), "-o", "l2.h5", *given],
            "fill": ["fill-gaps", "l.h5", "-o", "f.h5", *given],
            "solve": ["solve", "l.h5", "-o", "v.h5", *given],
        }
        found = {}
        for name, line in lines.items():
            out = Path(folder, f"{name}.json")
            package = f"{project}/handclean/"
            call = [sys.executable, "-c", TRACE, package, str(out), *ENTRIES[name]]
            subprocess.run([*call, *line], cwd=folder, env=env, check=True)
            found[name] = json.loads(out.read_text())
        return found


def stops_and_climbs(walk):
    stops = [
        (file, name)
        for file, name, _ in walk
        if not name.rpartition(".")[2].startswith("<")  # a comprehension is no stop
    ]
    climbs, left, here = 0, set(), None
    for file, _ in stops:
        if file != here:
            climbs += file in left
            left.add(here)
            here = file
    return len(stops), climbs


def main():
    project = Path(sys.argv[1] if len(sys.argv) > 1 else __file__).resolve()
    project = project if project.is_dir() else project.parents[2]
    rows, words, tests = rooms(project)
    columns = ("modules", "lines", "functions", "over 40 lines", "over 8 parameters")
    columns += ("modules over 300 lines", "constants")
    print("| room |", " | ".join(columns), "|")
    print("|---" * (len(columns) + 1) + "|")
    for room, counts in rows.items():
        print(f"| {room} |", " | ".join(str(counts[c]) for c in columns), "|")
    print(f"\nwords for a warning: {len(words)} ({', '.join(words)})")
    print(f"test functions: {tests}\n")
    print("| a take through | stops | files | climbs |\n|---|---|---|---|")
    for name, walk in walks(project).items():
        stops, climbs = stops_and_climbs(walk)
        files = len({file for file, *_ in walk})
        print(f"| {name} | {stops} | {files} | {climbs} |")


if __name__ == "__main__":
    main()
