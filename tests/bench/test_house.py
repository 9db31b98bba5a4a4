"""The scripts that look at the house itself: what they count, what they change."""

import ast
import importlib.util
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def module(name):
    """Import a module of this folder."""
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    sys.modules[name] = found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


house, mutations = module("house"), module("mutations")

CODE = '''"""Text."""

_NEAR_M = 0.1


def f(a, b, *, c):
    """Say nothing."""
    for n in range(3):
        a[n] = b * n + c


def g(a):
    return a < 3
'''


@pytest.fixture
def project(tmp_path):
    for room in mutations.TESTS:
        folder = tmp_path / "handclean" / room
        folder.mkdir(parents=True)
        (folder / "code.py").write_text(CODE)
    return tmp_path


def test_a_room_is_counted(project):
    (project / "tests").mkdir()
    (project / "tests" / "test_x.py").write_text("def test_a():\n    pass\n")
    rows, words, tests = house.rooms(project)
    assert (rows["ik"]["modules"], rows["ik"]["functions"]) == (1, 2)
    assert (rows["all"]["constants"], tests) == (3, 1)
    assert rows["all"]["over 8 parameters"] == 0
    assert not words


def test_a_climb_goes_back_to_a_file_that_was_left():
    walk = [("a", "f", 1), ("b", "g", 1), ("b", "h", 2), ("a", "k", 9), ("c", "m", 1)]
    assert house.stops_and_climbs(walk) == (5, 1)
    assert house.stops_and_climbs([*walk, ("c", "m.<listcomp>", 3)]) == (5, 1)


def test_mutations_are_drawn_the_same_and_each_changes_one_thing(project):
    drawn = mutations.drawn(12, 1, project)
    assert drawn == mutations.drawn(12, 1, project)
    assert {m.kind for m in drawn} == {
        "does nothing",
        "comparison turned",
        "doubled",
        "sign changed",
    }
    for mutation in drawn:
        path = project / "handclean" / mutation.file
        mutation.put(project)
        changed = path.read_text()
        assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(CODE))
        path.write_text(CODE)


def test_every_drawn_mutation_of_the_package_is_code():
    for mutation in mutations.drawn(200, 7):
        content = (mutations.ROOT / "handclean" / mutation.file).read_bytes()
        assert mutation.text.encode() not in content[mutation.start : mutation.stop]
        changed = content[: mutation.start] + mutation.text.encode()
        ast.parse(changed + content[mutation.stop :])


def test_the_faults_by_name_are_where_the_list_says():
    found = mutations.named()
    assert [len(some) for some in found] == [1, 1, 2, 1, 1, 1, 1, 1]
    for some in found:
        for mutation in some:
            path = mutations.ROOT / "handclean" / mutation.file
            content = path.read_bytes()
            changed = content[: mutation.start] + mutation.text.encode()
            ast.parse(changed + content[mutation.stop :])
