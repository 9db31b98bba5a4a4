"""A C3D file opened: its header, parameters, labels and samples as they lie there.

Nothing here interprets a sample. Everything that is odd about the file's form is kept
as a remark: ``remarks`` tell what was decided where the file contradicts itself or is
broken, ``asides`` what its owner should know but what changes nothing.
"""

import stat
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from handclean.arrays import Bytes
from handclean.errors import FileError
from handclean.io.c3d.head import Head, coding_of, parse_head, with_frames
from handclean.io.c3d.layout import Layout, find_layout
from handclean.io.c3d.numbers import Words
from handclean.io.c3d.parameters import Section
from handclean.io.c3d.remarks import of_form
from handclean.io.c3d.samples import Coding
from handclean.io.shared.reading import reading_errors
from handclean.remarks import Remark, remark


@dataclass(frozen=True, kw_only=True)
class Structure:
    """A file opened.

    Attributes
    ----------
    frames : (T, words) raw words of whole frames, points first, then analog.
    tail : bytes after them.
    """

    path: Path
    head: Head
    layout: Layout
    frames: Words
    tail: Bytes
    remarks: tuple[Remark, ...] = ()
    asides: tuple[Remark, ...] = ()

    @property
    def points(self) -> int:
        """Points per frame."""
        return self.layout.points

    def coding(self, metres: float) -> Coding:
        """How the samples are coded, given the unit."""
        if not self.points:  # of analog channels alone; they have their own scales
            return Coding(
                processor=self.head.processor,
                is_float=self.layout.is_float,
                scale=1.0,
                metres=metres,
            )
        return coding_of(self.head, self.layout.is_float, metres, self.path)


def load(path: Path) -> Bytes:
    """Return the bytes of a regular file that is not empty.

    Raises
    ------
    FileError
    """
    with reading_errors(path):
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise FileError(path, "is no regular file", "give a C3D file")
        with open(path, "rb") as file:
            raw = np.fromfile(file, np.uint8)
    if not raw.size:
        raise FileError(path, "is empty", "a C3D file begins with a header")
    return raw


def open_c3d(
    path: Path, lenient: bool = False, *, needs_points: bool = True
) -> Structure:
    """Open a file.

    Parameters
    ----------
    lenient : take the whole frames of a truncated file.
    needs_points : refuse a file of analog channels alone.

    Raises
    ------
    FileError
        If it is missing, not a C3D file, without frames or points, or truncated.
    """
    raw = load(path)
    head = parse_head(raw, path)
    layout = find_layout(raw, head.at, head.header, head.section)
    end = head.parameters_at + len(_parsed(head.section))
    if head.parameters_at + 4 <= layout.data_at < end:
        head = parse_head(raw, path, layout.data_at)
        layout = find_layout(raw, head.at, head.header, head.section)
    if not layout.points and layout.analog_words and needs_points:
        right = "a take has points; inspect tells of the channels"
        raise FileError(path, "has no points, only analog channels", right)
    if not layout.points and not layout.analog_words:
        raise FileError(path, "has no points", "POINT:USED should be 1 or more")
    if not layout.frames:
        raise FileError(path, "has no frames", "POINT:FRAMES should be 1 or more")
    head = replace(head, raw=raw[: layout.data_at].tobytes())
    remarks = list(layout.remarks)
    if layout.held < layout.frames:
        wrong = f"is truncated: {layout.held} of {layout.frames} frames can be saved"
        if not lenient or not layout.held:
            raise FileError(path, wrong, "--lenient reads them" if layout.held else "")
        remarks.append(remark("damage", f"the file {wrong}"))
        head = with_frames(head, layout.held, layout.first_frame)
    end = layout.data_at + layout.held * layout.frame_bytes
    words = raw[layout.data_at : end].view(head.processor.word(layout.word_bytes))
    return Structure(
        path=path,
        head=head,
        layout=layout,
        frames=words.reshape(layout.held, layout.words),
        tail=raw[end:] if layout.held == layout.frames else raw[:0],
        remarks=tuple(remarks) + head.section.remarks,
        asides=tuple(of_form(head, layout, len(raw) - end)),
    )


def _parsed(section: Section) -> bytes:
    return section.lead + b"".join(e.raw for e in section.entries)
