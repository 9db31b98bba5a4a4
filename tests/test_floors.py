"""The house's floors: a module imports its own package and lower floors only."""

import ast
from pathlib import Path

import pytest

FLOORS = [
    {"errors"},
    {"toml"},
    {"arrays", "config"},
    {"kernels"},
    {"numerics"},
    {"tree"},
    {"recording", "hand"},
    {"ik", "simulation", "sculpt"},
    {"labels", "gaps", "layouts", "subject", "glove", "io", "report"},
    {"pipeline"},
    {"cli"},
]
FLOOR = {name: level for level, names in enumerate(FLOORS) for name in names}
PACKAGE = Path(__file__).parents[1] / "handclean"


def imported_parts(path):
    """Parts of handclean that a file imports, wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        parts = (n.split(".")[1] for n in names if n.startswith("handclean."))
        yield from (part for part in parts if part != "__version__")


@pytest.mark.parametrize(
    "path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: str(p.relative_to(PACKAGE))
)
def test_imports_only_look_down(path):
    own = path.relative_to(PACKAGE).with_suffix("").parts[0]
    if own in ("__init__", "__main__"):
        return
    wrong = {p for p in imported_parts(path) if p != own and FLOOR[p] >= FLOOR[own]}
    assert not wrong, f"{own} may not import {', '.join(sorted(wrong))}"
