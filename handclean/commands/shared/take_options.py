"""What is said of a take on the command line or in a manifest: whose hands it shows."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from handclean.commands.shared import subject_patterns
from handclean.errors import UsageError
from handclean.runner.batch import Batch, Source

SIDES = ("left", "right", "both")
COLUMNS = ("subject", "marker_set", "side")
"""Columns of a manifest. Several subjects, one per hand, stand in one cell with ``;``
between them."""


@dataclass(frozen=True, kw_only=True)
class TakeOptions:
    """What is said of a take; the `Given` that the runner hands to the steps.

    Attributes
    ----------
    subjects, marker_set, side : whose hands, with what markers, which of them.
    subject_for : patterns by which the subjects of each take are found.
    unfound : what such a pattern did not find, or "".
    rate_hz, unit : for files that do not say; [Hz], one of mm, cm, m.
    lenient : save what can be saved of a damaged file.
    believe_coordinates : of a C3D that marks every point as missing.
    """

    subjects: tuple[Path, ...] = ()
    marker_set: str = ""
    side: str = ""
    subject_for: tuple[str, ...] = ()
    unfound: str = ""
    rate_hz: float | None = None
    unit: str | None = None
    lenient: bool = False
    believe_coordinates: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of a manifest that say of one take what options say of all."""
        return COLUMNS

    @property
    def marker_set_file(self) -> Path | None:
        """The marker set as a file, or None when it is the name of a shipped one."""
        path = Path(self.marker_set)
        return path if path.suffix == ".toml" else None

    def with_cells(self, cells: Mapping[str, str], at: str) -> "TakeOptions":
        """Return the options with what a line of a manifest says instead.

        Raises
        ------
        UsageError
            If the side is none.
        """
        if not cells:
            return self
        side = cells.get("side", "")
        if side and side not in SIDES:
            wrong = f"side should be left, right or both, not '{side}'"
            raise UsageError(wrong, where=at)
        subjects = cells.get("subject", "").split(";")
        return replace(
            self,
            subjects=tuple(Path(name) for name in subjects if name) or self.subjects,
            marker_set=cells.get("marker_set") or self.marker_set,
            side=side or self.side,
        )

    def for_input(self, path: Path) -> "TakeOptions":
        """Return the options of one take, with the subjects that patterns find for it.

        What a manifest says of the take comes first.

        Raises
        ------
        UsageError
            If a pattern is none.
        """
        if not self.subject_for or self.subjects:
            return self
        subjects: list[Path] = []
        for pattern in self.subject_for:
            found = subject_patterns.found(pattern, path)
            if not found:
                place = subject_patterns.filled(pattern, path)
                return replace(self, unfound=f"'{pattern}': there is no {place}")
            subjects += found
        return replace(self, subjects=tuple(subjects))

    def expect_found(self) -> None:
        """Expect that patterns found the subjects of the take.

        Raises
        ------
        UsageError
            If one found none.
        """
        if self.unfound:
            raise UsageError(f"--subject-for {self.unfound}")

    def files(self) -> dict[str, Path]:
        """Files that a step reads of it, by role."""
        numbered = enumerate(self.subjects, start=1)
        files = {f"subject {number}": path for number, path in numbered}
        if self.marker_set_file is not None:
            files["marker_set"] = self.marker_set_file
        return files

    def record(self) -> dict[str, Any]:
        """What a record keeps of it beside the digests of those files."""
        return {
            "side": self.side,
            "rate_hz": self.rate_hz,
            "unit": self.unit,
            "lenient": self.lenient or None,
            "believe_coordinates": self.believe_coordinates or None,
            "marker_set": "" if self.marker_set_file else self.marker_set,
        }


def options_of(asked: Batch | Source) -> TakeOptions:
    """Return what is said of the takes of a batch, or of one take."""
    return asked.given if isinstance(asked.given, TakeOptions) else TakeOptions()


def with_options(source: Source, **changes: Any) -> Source:
    """Return a source of which something else is said."""
    return replace(source, given=replace(options_of(source), **changes))
