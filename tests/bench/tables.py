"""Tables in Markdown as RESULTS.md has them: written, read again, kept.

A section has groups: tables, and behind them the line in italics that says when, at
which commit and on what they were measured. The first group is of the last run, others
are kept from runs before it.
"""

import re
from dataclasses import dataclass, field

KEPT = "Of an earlier run"
LINE = re.compile(r"^\*(\d{4}-\d{2}-\d{2}, .*)\*$")


@dataclass
class Table:
    """A table: its title or "", and its lines."""

    title: str
    lines: list[str] = field(default_factory=list)

    @property
    def rows(self):
        """Its rows as dicts of text."""
        cells = [line[2:-2].split(" | ") for line in self.lines]
        return [dict(zip(cells[0], row, strict=False)) for row in cells[2:]]

    def has(self, word):
        """Whether its title or a cell begins like this."""
        title = self.title.removeprefix(KEPT).removeprefix(": ")
        cells = (cell for line in self.lines for cell in line[2:-2].split(" | "))
        return title.startswith(word) or any(cell.startswith(word) for cell in cells)


@dataclass
class Group:
    """Tables that were measured at once, and the line that says so."""

    tables: list[Table]
    line: str


def written(rows):
    """Rows as a Markdown table; a row may lack columns."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(columns) + " |", "|" + " --- |" * len(columns)]
    for row in rows:
        cells = (str(row.get(key, "")).replace("|", "/") for key in columns)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def groups(section):
    """The groups of a section, the last run's first."""
    found, here, title, table = [], [], "", None
    for line in section.splitlines():
        if line.startswith("|"):
            if table is None:
                table, title = Table(title), ""
                here.append(table)
            table.lines.append(line)
            continue
        table = None
        if bold := re.fullmatch(r"\*\*(.+)\*\*", line):
            title = bold[1]
        elif said := LINE.fullmatch(line):
            found.append(Group(here, said[1]))
            here, title = [], ""
        elif line:
            title = ""
    return found


def kept(earlier, missing):
    """The text of the latest tables that have what is missing, each group dated."""
    needed, parts = set(missing), []
    for group in earlier:
        chosen = [t for t in group.tables if any(t.has(word) for word in needed)]
        if not chosen:
            continue
        for table in chosen:
            title = table.title.removeprefix(KEPT).removeprefix(": ")
            title = f"{KEPT}: {title}" if title else KEPT
            parts += [f"**{title}**", "", *table.lines, ""]
        parts += [f"*{group.line}*", ""]
        needed -= {word for word in needed if any(t.has(word) for t in chosen)}
    return parts[:-1]
