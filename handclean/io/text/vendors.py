"""Tables of tracking systems, which have heads of their own."""

from pathlib import Path

from handclean.errors import FileError
from handclean.io.shared.lines import Lines
from handclean.io.shared.reading import text
from handclean.io.text.described import Described
from handclean.io.text.motive import describe_motive, is_motive
from handclean.io.text.vicon import describe_nexus, is_nexus

_MARKS = '",;\t '
_OTHERS = {
    "pathfiletype": ("is a TRC file", "give it the suffix .trc"),
    "no_of_frames": ("is a Qualisys TSV file", "give it the suffix .tsv"),
    "file_version": ("is a Qualisys TSV file", "give it the suffix .tsv"),
}
"""What a file is that begins with a word, and what to do."""


def describe_vendors(path: Path, lines: Lines) -> Described | None:
    """Read the head of a CSV of Vicon Nexus or OptiTrack Motive; None if it is none.

    Raises
    ------
    FileError
        If that is broken, or the file belongs to another reader.
    """
    first = text((lines.peek() or b"")[:200]).lstrip(_MARKS).replace(";", ",")
    word = first.replace("\t", ",").replace(" ", ",").split(",")[0].strip('"').lower()
    if word in _OTHERS:
        raise FileError(path, *_OTHERS[word])
    if is_nexus(lines):
        return describe_nexus(path, lines)
    if is_motive(lines):
        return describe_motive(path, lines)
    return None
