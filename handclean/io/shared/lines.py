"""The lines of a text, out of pieces of it, so that the whole is never in memory."""

from collections import deque
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from handclean.errors import FileError, Place

MOST_COLUMNS = 100_000
"""Columns of a table, at most (chosen)."""

_LONGEST_TITLE = 10_000
"""[bytes] of a line that may be a title (chosen)."""


class Title(NamedTuple):
    """A line that holds a title alone, and its number."""

    number: int
    title: str


class Lines:
    """The lines of a text, one after another, with their numbers (from 1).

    Parameters
    ----------
    content : the text, or what begins to give it anew in pieces of whole lines; the
        last may lack its end.
    """

    def __init__(
        self, path: Path, content: bytes | Callable[[], Iterator[bytes]]
    ) -> None:
        self.path = path
        self._again = content if callable(content) else lambda: iter([content])
        self._begin()

    def _begin(self) -> None:
        self.number = 0
        self.ended = True
        """Whether the line read last had an end; a file that was cut may lack it."""
        self._pieces = self._again()
        self._ahead: deque[bytes] = deque()
        self._piece, self._at = b"", 0
        self._last: int | None = None

    @property
    def where(self) -> Place:
        """The file and the line read last, for messages."""
        return Place(self.path, f" line {self.number}")

    def titles(self, wanted: Collection[str], marks: bytes) -> list[Title]:
        """Find lines of the whole text that are one of some words, beside marks."""
        found, above = [], 1
        known = {word.encode(): word for word in wanted}
        for piece in self._again():
            letters = np.frombuffer(piece, np.uint8)
            starts = np.concatenate([[0], np.flatnonzero(letters == ord("\n")) + 1])
            first = letters[starts[starts < len(piece)]]
            for k in np.flatnonzero((first > ord("9")) | (first == ord('"'))).tolist():
                line = piece[starts[k] : starts[k] + _LONGEST_TITLE].split(b"\n", 1)[0]
                if (word := line.strip(marks)) in known:
                    found.append(Title(above + k, known[word]))
            above += len(starts) - 1
        return found

    def narrow(self, first: int, last: int | None) -> None:
        """Begin anew at a line, by its number, and end after another."""
        self._begin()
        while self._fill():
            count = self._piece.count(b"\n")
            if self.number + count >= first:
                break
            self.number += count
            self._at = len(self._piece)
        while self.number < first - 1 and self.next() is not None:
            pass
        self._last = last

    def change_rest(self, change: Callable[[bytes], bytes]) -> None:
        """Change what is not read yet, in pieces of whole lines, to be read so."""
        self._piece, self._at = change(self._piece[self._at :]), 0
        self._ahead = deque(map(change, self._ahead))
        self._pieces = map(change, self._pieces)

    def _fill(self) -> bool:
        """Go to the piece that the next line is in; False if there is none."""
        while self._at >= len(self._piece):
            piece = self._ahead.popleft() if self._ahead else next(self._pieces, b"")
            if not piece:
                return False
            self._piece, self._at = piece, 0
        return self._last is None or self.number < self._last

    def next(self) -> bytes | None:
        """Return the next line without its end, None after the last."""
        if not self._fill():
            return None
        stop = self._piece.find(b"\n", self._at)
        self.ended = stop >= 0
        stop = stop if self.ended else len(self._piece)
        line = self._piece[self._at : stop]
        self._at = stop + 1
        self.number += 1
        return line

    def peek(self, after: int = 0) -> bytes | None:
        """Return the next line, or one ``after`` it, and leave all to be read."""
        if self._last is not None and self.number + after >= self._last:
            return None
        piece, at, ahead = self._piece, self._at, 0
        for _ in range(after + 1):
            while at >= len(piece):
                if ahead == len(self._ahead):
                    if not (more := next(self._pieces, b"")):
                        return None
                    self._ahead.append(more)
                piece, at, ahead = self._ahead[ahead], 0, ahead + 1
            start, stop = at, piece.find(b"\n", at)
            at = (stop if stop >= 0 else len(piece)) + 1
        return piece[start : at - 1]

    def block(self, size: int) -> bytes:
        """Return whole lines with their ends, about ``size`` bytes of them.

        Nothing but the last line may lack its end; that is no whole line.
        """
        if not self._fill():
            return b""
        piece, at = self._piece, self._at
        stop = piece.rfind(b"\n", at, at + size) + 1
        block = piece[at : stop or piece.find(b"\n", at) + 1]
        if self._last is not None:
            left = self._last - self.number
            if block.count(b"\n") > left:
                block = b"".join(block.splitlines(keepends=True)[:left])
        return block

    def skip(self, block: bytes, count: int) -> None:
        """Read past a block of so many whole lines."""
        self._at += len(block)
        self.number += count
        self.ended = True

    def cells(self, delimiter: bytes | None) -> list[bytes]:
        """Return the next line's cells, stripped.

        Raises
        ------
        FileError
            If there is no further line, or it has more columns than any recording.
        """
        line = self.next()
        if line is None:
            raise FileError(self.path, f"ends after line {self.number}")
        cells = line.split(delimiter, MOST_COLUMNS)
        if len(cells) > MOST_COLUMNS:
            raise FileError(self.where, f"has more than {MOST_COLUMNS} columns")
        return [cell.strip() for cell in cells]
