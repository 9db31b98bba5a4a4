"""Write README's section Measured from `measured.md` and the tables of RESULTS.md.

    python tests/bench/figures.py

Every figure of the template is a place in a table, so that none can go stale:
``{section: key; key | column | how}`` is the cell in that column of the row that has
all keys, each a whole cell or what the table's title begins with; ``~word`` is what
must stand in the table, to tell it from one that an earlier run left. ``how`` may have
a function of several rows (min, max, sum, mean, median, count), ``#2`` for the second
number of a cell, ``*1000`` or ``/1000``, and a number of decimals, or ``s3`` for three
significant digits; without it the cell is shown as it is. ``{section: key | commit}``
is the commit the table was measured at. A paragraph of a section that was never
measured is left out.
"""

import re
import statistics
import sys
import textwrap
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import run  # noqa: E402
import tables  # noqa: E402

README = HERE.parents[1] / "README.md"
TEMPLATE = HERE / "measured.md"
SECTION = re.compile(r"^## Measured\n.*?(?=^## )", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
PLACE = re.compile(r"\{([^{}]*)\}")
WIDTH = 90
ACROSS = {
    "min": min,
    "max": max,
    "sum": sum,
    "mean": statistics.fmean,
    "median": statistics.median,
}


class Figures:
    """Figures of a RESULTS.md by what the template calls them."""

    def __init__(self, text):
        self.sections = run.sections(text)

    def tables(self, section, keys):
        """(group, table) that the keys with a tilde and the titles allow."""
        if section not in self.sections:
            raise KeyError(f"no section is called '{section}'")
        words = [key[1:] for key in keys if key.startswith("~")]
        for group in tables.groups(self.sections[section]):
            for table in group.tables:
                if all(table.has(word) for word in words):
                    yield group, table

    def rows(self, section, keys):
        """The group and the rows of the first table that has such rows."""
        wanted = [key for key in keys if not key.startswith("~")]
        for group, table in self.tables(section, keys):
            title = table.title.removeprefix(tables.KEPT).removeprefix(": ")
            rest = [key for key in wanted if not title.startswith(key)]
            found = [r for r in table.rows if all(key in r.values() for key in rest)]
            if found:
                return group, found
        raise KeyError(f"{section}: no row has {'; '.join(keys)}")

    def commit(self, section, keys):
        """Where and how a table was measured, in a few words."""
        (group, _) = next(self.tables(section, keys), (None, None))
        if group is None:
            raise KeyError(f"{section}: no table has {'; '.join(keys)}")
        commit = group.line.split(", ")[1]
        first = tables.groups(self.sections[section])[0]
        if group.line == first.line and run.QUICK in self.sections[section]:
            commit += ", a quick run"
        return commit

    def value(self, place):
        """The text of one figure.

        Raises
        ------
        KeyError
            If there is no such row or column.
        """
        where, *rest = [part.strip() for part in place.split("|")]
        section, _, keys = where.partition(":")
        keys = [key.strip() for key in keys.split(";") if key.strip()]
        if rest == ["commit"]:
            return self.commit(section, keys)
        _, rows = self.rows(section, keys)
        column, how = rest[0], (rest[1].split() if len(rest) > 1 else [])
        cells = [row[column] for row in rows if row.get(column)]
        if not cells:
            raise KeyError(f"{place}: no column is called '{column}'")
        if how == ["count"]:
            return str(len(cells))
        if not how:
            if len(cells) > 1:
                raise KeyError(f"{place}: {len(cells)} rows have it")
            return cells[0]
        return shown(place, cells, how)


def shown(place, cells, how):
    """Numbers of cells, put together and rounded."""
    which = next((int(word[1:]) for word in how if word.startswith("#")), 1)
    numbers = [float(NUMBER.findall(cell)[which - 1]) for cell in cells]
    across = next((ACROSS[word] for word in how if word in ACROSS), None)
    if across is None and len(numbers) > 1:
        raise KeyError(f"{place}: {len(numbers)} rows have it")
    value = float(across(numbers) if across else numbers[0])
    for word in how:
        if word.startswith(("*", "/")):
            factor = float(word[1:])
            value = value * factor if word[0] == "*" else value / factor
    for word in how:
        if re.fullmatch(r"\d+", word):
            return spaced(rounded(value, int(word)))
        if re.fullmatch(r"s\d", word):
            size = Decimal(repr(value)).adjusted()
            return spaced(rounded(value, int(word[1:]) - 1 - size))
    raise KeyError(f"{place}: how many decimals?")


def rounded(value, decimals):
    """A number with so many decimals, halves away from zero; -1: to tens."""
    exact = Decimal(repr(round(value, 9)))  # what a product of two cells should be
    return f"{exact.quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_UP):f}"


def spaced(text):
    """Groups of three digits, for numbers of five and more."""
    whole, point, rest = text.partition(".")
    return (
        f"{int(whole):,}".replace(",", " ") + point + rest if len(whole) > 4 else text
    )


def wrapped(text):
    """Paragraphs in lines of one length; tables and headings as they are."""
    parts = []
    for part in text.split("\n\n"):
        flows = not part.startswith(("|", "#"))
        line = " ".join(part.split())
        options = {"break_on_hyphens": False, "break_long_words": False}
        parts.append(textwrap.fill(line, WIDTH, **options) if flows else part)
    return "\n\n".join(parts)


def measured(template, results):
    """README's section: the template with its figures."""
    figures = Figures(results)
    parts = [
        PLACE.sub(lambda m: figures.value(" ".join(m[1].split())), part)
        for part in template.strip().split("\n\n")
        if {m[1].split(":")[0] for m in PLACE.finditer(part)} <= set(figures.sections)
    ]
    return wrapped("\n\n".join(parts)) + "\n\n"


def main():
    """Write the section anew."""
    text = README.read_text(encoding="utf-8")
    new = measured(
        TEMPLATE.read_text(encoding="utf-8"), run.RESULTS.read_text(encoding="utf-8")
    )
    README.write_text(SECTION.sub(lambda _: new, text), encoding="utf-8")


if __name__ == "__main__":
    main()
