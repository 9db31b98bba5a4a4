"""Figures of README and of docstrings are those of RESULTS.md, or of the code."""

import re
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def figures():
    sys.path.insert(0, str(HERE))
    try:
        import figures
    finally:
        sys.path.remove(str(HERE))
    return figures


@pytest.fixture(scope="module")
def template(figures):
    return figures.TEMPLATE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def results(figures):
    return figures.run.RESULTS.read_text(encoding="utf-8")


def test_the_readme_has_the_figures_of_the_tables(figures, template, results):
    shown = figures.SECTION.search(README)[0]
    assert shown == figures.measured(template, results), "'make figures' writes them"


def test_a_figure_that_changes_in_a_table_changes_in_the_readme(
    figures, template, results
):
    changed = re.sub(r"(\| S0\d_\w+ \| )\d+", r"\g<1>7", results, count=1)
    assert "| `label` | 7 |" not in figures.measured(template, results)
    assert "| `label` | 7 |" in figures.measured(template, changed)


TYPED = {
    "accuracy": "500 0.085 0.12 95",
    "ik": "26 1.01 1",
    "subject": "1 1 2 2",
    "label": "1 2 26",
    "layout_errors": "4 8 14 2 5 6 10 1",
    "scan": "0.5 17",
    "glove": "0 25",
    "glove_gp": "100",
    "surface": "1000 26 14",
    "gaps": "0.1 2 3 95",
    "c3d": "60 000 3",
    "": "2 3.11",
}
"""Numbers of the template that are none of ours: the papers', and what was done."""


def test_no_figure_of_ours_is_typed_by_hand(figures, template):
    for part in template.split("\n\n")[1:]:
        sections = {m[1].split(":")[0] for m in figures.PLACE.finditer(part)}
        allowed = {n for name in sections or {""} for n in TYPED.get(name, "").split()}
        prose = re.sub(
            r"`[^`]*`|schroeder2017|\(\d{4}\)", "", figures.PLACE.sub("", part)
        )
        prose = re.sub(r"× 4|F1|sig18|\w+\d\w*\.\w+", "", prose)
        typed = set(re.findall(r"\d+(?:\.\d+)?", prose))
        assert typed <= allowed, part[:60]


def test_every_section_is_shown(figures, template):
    shown = {m[1].split(":")[0] for m in figures.PLACE.finditer(template)}
    known = {path.stem[6:] for path in HERE.glob("bench_*.py")}
    assert shown <= known
    assert known - shown == {"simulation", "layouts"}  # README speaks of neither
    for name in shown:
        assert re.search(rf"`(python tests/bench/)?run\.py {name}`", template), name
        assert re.search(rf"\{{{name}: [^|]*\| commit\}}", template), name


TABLES = """## one

**Title A**

| what | x | y |
| --- | --- | --- |
| a | 1.25 ± 0.5 | 24126 |
| b | 2.35 ± 0.7 | 1.5 |

*2026-01-01, commit abc1234567, a machine; took 1 s.*

**Of an earlier run: Title A**

| what | x | y |
| --- | --- | --- |
| a | 9 | 9 |
| peer | 3 |  |

*2025-01-01, commit 0000000000, a machine; took 1 s.*
"""


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ("one: a | x | 1", "1.3"),
        ("one: a | x | #2 1", "0.5"),
        ("one: Title A; b | x | 0 *100", "235"),
        ("one: a | y | 0", "24 126"),
        ("one: a | y | s3", "24 100"),
        ("one: b | y | 0", "2"),
        ("one: Title A | x | min 1", "1.3"),
        ("one: Title A | x | max 0", "2"),
        ("one: Title A | x | count", "2"),
        ("one: peer | x | 0", "3"),
        ("one: ~peer; a | x | 0", "9"),
        ("one: | commit", "commit abc1234567"),
        ("one: ~peer | commit", "commit 0000000000"),
        ("one: b | y", "1.5"),
    ],
)
def test_places_and_what_is_made_of_them(figures, place, text):
    assert figures.Figures(TABLES).value(place) == text


@pytest.mark.parametrize(
    "place",
    [
        "one: c | x | 1",
        "one: a | z | 1",
        "two: a | x | 1",
        "one: Title A | x | 1",
        "one: a | x | min",
        "one: ~nobody | commit",
    ],
)
def test_a_place_that_is_not_there_is_an_error(figures, place):
    with pytest.raises(KeyError):
        figures.Figures(TABLES).value(place)


def test_a_paragraph_that_was_never_measured_is_left_out(figures):
    text = "## Measured\n\nOne {one: a | x | 1}.\n\nTwo {two: a | x | 1}."
    assert figures.measured(text, TABLES) == "## Measured\n\nOne 1.3.\n\n"


def test_a_quick_run_is_called_one(figures):
    text = TABLES.replace("## one\n", f"## one\n\n{figures.run.QUICK}\n")
    made = figures.Figures(text)
    assert made.value("one: a | commit") == "commit abc1234567, a quick run"
    assert made.value("one: ~peer | commit") == "commit 0000000000"


def test_the_skin_has_as_many_vertices_as_the_readme_says():
    from handclean.hand.template import template
    from handclean.hand.template_surface import template_surface

    tree = template("right")
    fine = len(template_surface(tree).vertices)
    coarse = len(template_surface(tree, coarse=True).vertices)
    said = f"{round(fine, -2):,} vertices (a coarse twin has {round(coarse, -2)}"
    if coarse // 100 != round(coarse / 100):
        said = f"{round(fine, -2):,} vertices (a coarse twin has {coarse // 100 * 100}"
    assert said.replace(",", " ") in README


def rows_of(figures, results, *keys):
    return figures.Figures(results).rows("layouts", list(keys))[1]


def test_what_annealing_says_of_the_swarm_is_so(figures, results):
    for count in ("4 markers", "6 markers", "8 markers"):
        rows = rows_of(figures, results, "Figure 9")
        (ours,) = (
            r for r in rows if r[""].startswith(count) and r["search"] == "anneal"
        )
        assert (ours["best found"], ours["ties"]) == ("100%", "100%")
    ends = {
        row["search"]: row
        for row in rows_of(figures, results, "Figure 9", "10 markers, 5 dimensions")
    }
    share = {
        key: float(ends["anneal"][key].rstrip("%"))
        for key in ("beats the swarm", "loses")
    }
    assert share["beats the swarm"] > share["loses"]
    worst = {name: float(row["worst gap"].rstrip("%")) for name, row in ends.items()}
    assert worst["anneal"] < worst["swarm"]
    times = {row[""]: row for row in rows_of(figures, results, "Growth")}
    for name, row in times.items():
        faster = float(row["anneal"]) < float(row["swarm"])
        assert faster == (name not in ("14 markers", "all joints, 13 markers")), name


def test_what_the_objective_says_of_its_weights_is_so(figures, results):
    from handclean.layouts import objective

    doc = " ".join(objective.__doc__.split())
    rows = rows_of(figures, results, "Figure 7", "10")

    def of(motion, w1, w2):
        (row,) = (
            r for r in rows if (r[""], r["w1"], r["w2"]) == (motion, str(w1), str(w2))
        )
        return round(float(row["mean condition"])), round(
            float(row["smallest distance, mm"])
        )

    first, both = of("all grasps", 0.1, 0.0), of("all grasps", 0.1, 100.0)
    assert f"two sit {first[1]} mm apart, for both {both[1]} mm" in doc
    assert f"goes from {first[0]} to {both[0]}" in doc
    assert f"for the second alone it is {of('all grasps', 0.0, 1.0)[0]}." in doc
    first, both = of("precision grasps", 0.1, 0.0), of("precision grasps", 0.1, 100.0)
    alone = of("precision grasps", 0.0, 1.0)[0]
    said = f"{first[1]} and {both[1]} mm, {first[0]} and {both[0]}, and {alone}."
    assert f"On precision grasps: {said}" in doc
    far = of("all grasps", 0.1, 1000.0), of("precision grasps", 0.1, 1000.0)
    said = f"{far[0][1]} and {far[1][1]} mm, but condition numbers of {far[0][0]} and"
    assert f"w2 = 1000 would give {said} {far[1][0]}." in doc
