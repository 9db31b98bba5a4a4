"""The house's floors: a module imports its own package and lower floors only.

Inside the large packages the wings have floors of their own.
"""

import ast
from pathlib import Path

import pytest

FLOORS = [
    {"errors"},
    {"tomltext"},
    {"tomlfile", "settings"},
    {"arrays", "config", "remarks"},
    {"kernels"},
    {"numerics"},
    {"tree"},
    {"recording", "hand"},
    {"ik", "simulation"},
    {"labels", "gaps", "layouts", "subject", "glove", "io", "report"},
    {"runner"},
    {"api"},
    {"commands"},
    {"cli"},
    {"factory"},
]
WINGS = {
    "io": [
        {"formats"},
        {"shared"},
        {"c3d", "bvh", "hdf5", "mesh", "text"},
        {"gltf", "glove"},
        {
            "finite",
            "keeps",
            "landmarks",
            "marker_sets",
            "shapes",
            "take_remarks",
            "takes",
        },
        {"contents"},
        {"files"},
    ],
    "labels": [
        {"clusters", "points", "settings"},
        {"target"},
        {"track"},
        {"search", "baseline"},
        {"review"},
        {"track_take"},
        {"checks"},
        {"label"},
    ],
    "commands": [{"shared"}],  # and the commands above it, which `clean` is made of
}
PACKAGE = Path(__file__).parents[1] / "handclean"


def levels(floors):
    return {name: level for level, names in enumerate(floors) for name in names}


FLOOR = levels(FLOORS)
WING = {name: levels(floors) for name, floors in WINGS.items()}


def imported(path):
    """Paths inside handclean that a file imports, wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        parts = [name.split(".")[1:] for name in names if name.startswith("handclean.")]
        yield from (part for part in parts if part != ["__version__"])


def parts_of(path):
    return path.relative_to(PACKAGE).with_suffix("").parts


FILES = sorted(PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: "/".join(parts_of(path)))
def test_imports_only_look_down(path):
    own = parts_of(path)[0]
    if own in ("__init__", "__main__"):
        return
    wrong = {p[0] for p in imported(path) if p[0] != own and FLOOR[p[0]] >= FLOOR[own]}
    assert not wrong, f"{own} may not import {', '.join(sorted(wrong))}"


@pytest.mark.parametrize(
    "path",
    [path for path in FILES if parts_of(path)[0] in WINGS],
    ids=lambda path: "/".join(parts_of(path)),
)
def test_wings_only_look_down(path):
    package, own = parts_of(path)[:2]
    floor = WING[package]
    inside = {p[1] for p in imported(path) if p[0] == package and p[1] != own}
    top = len(WINGS[package])
    wrong = {p for p in inside if floor.get(p, top) >= floor.get(own, top + 1)}
    assert not wrong, f"{package}/{own} may not import {', '.join(sorted(wrong))}"


def test_every_module_has_a_place_in_its_wing():
    for package in ("io", "labels"):
        known = set(WING[package]) | {"__init__"}
        assert {parts_of(p)[1] for p in FILES if parts_of(p)[0] == package} <= known
