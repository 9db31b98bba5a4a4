"""What a fuzzed reader consists of, and ways to damage bytes.

A reader is a function of a path, seeds (small valid files) and mutators. A mutator is
``(rng, content, other) -> content``; ``other`` is another seed, for splicing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Mutator = Callable[[np.random.Generator, bytes, bytes], bytes]

_WORDS = (
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0x8000,
    0xFFFF,
    2**31 - 1,
    2**31,
    2**32 - 1,
)
_NUMBERS = [
    *b"nan -inf 1e308 1e-320 -0 0 1 -1 9999999 2147483648 1e9999 0x10 1_000".split(),
    *b"18446744073709551616 1,5 -nan(ind) 1.#QNAN NULL NA true".split(),
    *(b"", b"9" * 400, "٣".encode(), b"\xa0", b"\x1b[31m", b"\xff\xfe", b"\0"),
]
_NUMBER = b"0123456789+-.eE"


@dataclass(frozen=True, kw_only=True)
class Reader:
    """Something that reads files.

    Attributes
    ----------
    read : reads one; may raise nothing but `HandcleanError`.
    seeds : writes valid files into a folder that is there and empty.
    mutators : one to four of them are applied to a seed.
    """

    read: Callable[[Path], object]
    seeds: Callable[[Path], object]
    mutators: tuple[Mutator, ...]


def damaged(reader: Reader, seeds: list[bytes], number: int, seed: int) -> bytes:
    """Input of a number: always the same bytes, whatever ran before."""
    rng = np.random.default_rng((seed, number))
    content = seeds[number % len(seeds)]
    for _ in range(int(rng.choice([1, 1, 2, 4]))):
        mutate = reader.mutators[int(rng.integers(len(reader.mutators)))]
        other = seeds[int(rng.integers(len(seeds)))]
        content = mutate(rng, content, other)
    return content


def _at(rng, content):
    return int(rng.integers(len(content) + 1))


def flip(rng, content, other):
    """Turn one bit, or a few."""
    out = bytearray(content)
    for _ in range(int(rng.choice([1, 1, 1, 8])) if out else 0):
        out[int(rng.integers(len(out)))] ^= 1 << int(rng.integers(8))
    return bytes(out)


def word(rng, content, other):
    """Put a number of 1, 2, 4 or 8 bytes that is at an edge."""
    size = int(rng.choice([1, 2, 4, 8]))
    value = int(rng.choice(_WORDS)) + int(rng.integers(-1, 2))
    order = "little" if rng.random() < 0.8 else "big"
    put = (value % 256**size).to_bytes(size, order)
    at = _at(rng, content)
    return (content[:at] + put + content[at + size :])[: len(content) or size]


def cut(rng, content, other):
    """Cut the end off."""
    return content[: _at(rng, content)]


def drop(rng, content, other):
    """Leave a piece out."""
    at, size = _at(rng, content), int(rng.integers(1, 64))
    return content[:at] + content[at + size :]


def repeat(rng, content, other):
    """Say a piece again, up to 50 times."""
    at, size = _at(rng, content), int(rng.integers(1, 64))
    times = int(rng.choice([1, 2, 50]))
    return content[:at] + content[at : at + size] * times + content[at:]


def splice(rng, content, other):
    """Put a piece of another file over a piece of this one."""
    at, start, size = _at(rng, content), _at(rng, other), int(rng.integers(1, 512))
    return content[:at] + other[start : start + size] + content[at + size :]


def blank(rng, content, other):
    """Make a piece zeros, as a lost block of a disk."""
    at, size = _at(rng, content), int(rng.choice([8, 64, 512]))
    size = min(size, len(content) - at)
    return content[:at] + bytes(size) + content[at + size :]


BYTES: tuple[Mutator, ...] = (flip, word, cut, drop, repeat, splice, blank)
"""For binary files."""


def number(rng, content, other):
    """Put something else for a number that the text has."""
    starts = [
        i
        for i in range(len(content))
        if content[i] in _NUMBER and (i == 0 or content[i - 1] not in _NUMBER)
    ]
    if not starts:
        return content
    at = end = starts[int(rng.integers(len(starts)))]
    while end < len(content) and content[end] in _NUMBER:
        end += 1
    return content[:at] + _NUMBERS[int(rng.integers(len(_NUMBERS)))] + content[end:]


def mark(rng, content, other):
    """Change, add or remove a mark of the text: a comma, a quote, a line end."""
    at = _at(rng, content)
    some = b",;\t\n\r\"'[]{}()=:#. \0\xff"
    put = bytes([some[int(rng.integers(len(some)))]])
    keep = content[at + int(rng.integers(2)) :]
    return content[:at] + (put * int(rng.choice([0, 1, 1, 1000]))) + keep


def line(rng, content, other):
    """Leave a line out, say it again, or put another in its place."""
    lines = content.splitlines(keepends=True) or [b""]
    at = int(rng.integers(len(lines)))
    from_here = lines[int(rng.integers(len(lines)))]
    there = other.splitlines(keepends=True) or [b""]
    from_there = there[int(rng.integers(len(there)))]
    choices = [[], [lines[at]] * 2, [from_here], [from_there], [lines[at]] * 500]
    put = choices[int(rng.integers(len(choices)))]
    return b"".join(lines[:at] + put + lines[at + 1 :])


TEXT: tuple[Mutator, ...] = (
    number,
    number,
    mark,
    line,
    flip,
    cut,
    drop,
    repeat,
    splice,
)
"""For text files."""
