"""A format of a fake: a box is JSON that holds a text, its record, and its digest.

And what options would say of a fake's input.
"""

import hashlib
import json
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from handclean.errors import UsageError
from handclean.remarks import remark
from handclean.runner.command import Command
from handclean.runner.records import Records, entries

SUFFIX = ".box"


def write_box(path, kind, text, provenance):
    """Write a box; ``kind`` is what people call what is in it."""
    held = {"kind": kind, "text": text, "provenance": list(provenance)}
    path.write_text(json.dumps({**held, "sha256": digest(held)}))


def digest(held):
    return hashlib.sha256(json.dumps(held).encode()).hexdigest()


def opened(path):
    """What a box holds; nothing where it is none."""
    try:
        held = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    return held if isinstance(held, dict) else {}


@dataclass(frozen=True)
class Boxes:
    """The formats of a fake; a file is damaged if that is its name."""

    usual: tuple[str, ...] = (".raw", ".cut")

    def kind(self, path):
        if path.suffix == SUFFIX:
            return opened(path).get("kind", "")
        return path.suffix.removeprefix(".")

    def carries_record(self, path):
        return path.suffix.lower() == SUFFIX

    def record(self, path):
        return entries(opened(path).get("provenance"))

    def intact(self, path):
        held = opened(path)
        told = held.pop("sha256", None)
        return None if told is None else told == digest(held)

    @contextmanager
    def reading(self, sources):
        names = [s.path.name for s in sources if s.path.stem == "damaged"]
        yield [remark("damage", f"{name} is damaged") for name in names]


RECORDS = Records(Boxes())


@dataclass(frozen=True, kw_only=True)
class Whose:
    """Who and what an input is of; the ``Given`` of a fake."""

    who: tuple[Path, ...] = ()
    style: str = ""
    mood: str = ""
    who_for: str = ""
    unfound: str = ""

    columns = ("who", "style", "mood")

    def with_cells(self, cells, at):
        if cells.get("mood") == "bad":
            raise UsageError("mood should be good, not 'bad'", where=at)
        who = tuple(Path(name) for name in cells.get("who", "").split(";") if name)
        return replace(
            self,
            who=who or self.who,
            style=cells.get("style") or self.style,
            mood=cells.get("mood") or self.mood,
        )

    def for_input(self, path):
        if not self.who_for or self.who:
            return self
        who = path.with_name(self.who_for)
        found = {"who": (who,)} if who.is_file() else {"unfound": str(who)}
        return replace(self, **found)

    def expect_found(self):
        if self.unfound:
            raise UsageError(f"there is no {self.unfound}")

    def files(self):
        files = {f"who {n}": path for n, path in enumerate(self.who, start=1)}
        return files | ({"style": Path(self.style)} if "." in self.style else {})

    def record(self):
        return {"mood": self.mood, "style": "" if "." in self.style else self.style}


def tally(suffixes=(SUFFIX, ".csv"), **parts):
    """The command that does what its inputs say, see the module of that name."""
    parts = {"reads": (".txt", SUFFIX), "step": "tally", **parts}
    return Command(name="tally", formats=Boxes(), suffixes=suffixes, **parts)
