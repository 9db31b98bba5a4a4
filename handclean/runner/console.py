"""What a run tells: results on stdout, all else on stderr."""

import json
import re
import sys
from collections import Counter
from collections.abc import Sequence
from typing import Any, TextIO

from handclean.runner import provenance, steps, terminal
from handclean.runner.batch import Batch, Report, Task


class Console:
    """Tells how tasks went, in their order, and how far the run is.

    stdout has one line per input: its result, or with ``json`` one object, failed
    ones too. stderr has errors, unless ``quiet`` also warnings, progress when it is a
    terminal, and how it all went.
    """

    def __init__(self, batch: Batch, total: int) -> None:
        self._json = batch.json
        self._quiet = batch.quiet
        self._verbose = batch.verbose
        self._total = total
        self._ended = 0
        self._moving = sys.stderr.isatty() and not batch.quiet and total > 1

    def ended(self) -> None:
        """Count a task that ended."""
        self._ended += 1
        if self._moving:
            self._write(sys.stderr, f"\r\033[K{self._ended} of {self._total}", end="")

    def tell(self, task: Task, report: Report, unmet: Sequence[str]) -> None:
        """Tell the result of a task."""
        where = _about(task)
        if self._json:
            told = _readable(_object(task, report))
            self._result(json.dumps(told, allow_nan=False))
        elif report.status != "failed":
            self._result(terminal.safe(_line(task, report)))
            if report.details and not self._quiet:
                self._result(terminal.safe(report.details))
        if not self._quiet:
            for warning in report.warnings:
                self.note(f"{where}: warning: {warning}")
        if report.status == "failed":
            self.note(report.error)
        if self._verbose and report.trace:
            for text in report.trace.splitlines():
                self._note(terminal.safe(text))
        if self._verbose:
            parts = steps.in_words(report.steps)
            parts = f" ({parts})" if parts else ""
            self.note(f"{where}: {report.status} in {report.seconds:.3f} s{parts}")
        for text in unmet:
            self.note(f"{where}: {text}")

    def note(self, text: str) -> None:
        """Write a line to stderr, clear of the progress."""
        self._note(terminal.line(text))

    def _note(self, text: str) -> None:
        clear = "\r\033[K" if self._moving else ""
        self._write(sys.stderr, clear + text)

    def summarise(self, reports: Sequence[Report]) -> None:
        """Say how many inputs were done, skipped and failed, if there were several."""
        if self._quiet or len(reports) < 2:
            return
        counts = Counter(report.status for report in reports)
        states = ("done", "skipped", "failed")
        parts = [f"{counts[state]} {state}" for state in states if counts[state]]
        self.note(", ".join(parts))

    def close(self) -> None:
        """Clear the progress away."""
        if self._moving:
            self._write(sys.stderr, "\r\033[K", end="")

    def _result(self, text: str) -> None:
        if self._moving and sys.stdout.isatty():
            self._write(sys.stderr, "\r\033[K", end="")
        self._write(sys.stdout, text)

    def _write(self, stream: TextIO, text: str, end: str = "\n") -> None:
        try:
            stream.write(text + end)
            stream.flush()
        except OSError as error:
            name = "stdout" if stream is sys.stdout else "stderr"
            raise OSError(error.errno, error.strerror or str(error), name) from None


def _about(task: Task) -> str:
    """Name what words about a task are about: its input; of several, the output."""
    if len(task.sources) == 1:
        return task.sources[0].name
    return str(task.outputs[0]) if task.outputs else task.sources[-1].name


def _object(task: Task, report: Report) -> dict[str, Any]:
    inputs = [source.name for source in task.sources]
    outputs = [str(path) for path in task.outputs]
    return {
        "input": inputs if task.reduces else inputs[0],
        "output": outputs[0] if len(outputs) == 1 else outputs or None,
        "status": report.status,
        "error": report.error or None,
        "seconds": report.seconds,
        "warnings": list(report.warnings),
        "remarks": [provenance.plain(one.as_json()) for one in report.remarks],
        **report.figures,
    }


def _readable(value: Any) -> Any:
    """The value with a sign in place of every byte of a name that is no UTF-8.

    Python keeps such bytes as lone surrogates, which no JSON may hold.
    """
    if isinstance(value, str):
        return re.sub("[\ud800-\udfff]", "\ufffd", value)
    if isinstance(value, dict):
        return {_readable(key): _readable(part) for key, part in value.items()}
    return [_readable(part) for part in value] if isinstance(value, list) else value


def _line(task: Task, report: Report) -> str:
    inputs = task.sources[0].name
    if task.reduces:
        few = ", ".join(source.name for source in task.sources)
        inputs = few if len(task.sources) <= 2 else f"{len(task.sources)} inputs"
    arrow = f" -> {task.outputs[0]}" if task.outputs else ""
    skipped = "skipped, as before: " if report.status == "skipped" else ""
    return " ".join(f"{inputs}{arrow}: {skipped}{report.line}".splitlines())
