"""The numbers of the three processors a C3D file may come from.

======  =====  =====================  ==========================================
code    name   16-bit integers        32-bit floats
======  =====  =====================  ==========================================
84      Intel  little-endian          IEEE 754, little-endian
85      DEC    little-endian          VAX F: high half first, each half
                                      little-endian, exponent 2 above IEEE's
86      MIPS   big-endian             IEEE 754, big-endian
======  =====  =====================  ==========================================

A VAX F float is ``0.1f x 2^(e - 128)``, an IEEE one ``1.f x 2^(e - 127)``: the same
bits stand for a quarter of the value, so that the exponent is moved by two. VAX has no
infinity and no NaN; exponent 0 with the sign set is its reserved operand, read as NaN.
"""

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.arrays import Floats32

Words = NDArray[np.unsignedinteger[Any]]
Shorts = NDArray[np.int16]

_EXPONENT = np.uint32(0x7F800000)
_TWO = np.uint32(0x01000000)  # two, in the place of the exponent
_SIGN = np.uint32(0x80000000)
_NAN = np.uint32(0x7FC00000)
_HALF = np.uint32(16)


class Processor(IntEnum):
    """The machine whose numbers a file uses, by its code in the parameter section."""

    INTEL = 84
    DEC = 85
    MIPS = 86

    @property
    def label(self) -> str:
        """Name for people."""
        return {84: "Intel", 85: "DEC", 86: "MIPS"}[self]

    def word(self, size: int) -> np.dtype[Any]:
        """Unsigned words of ``size`` bytes as they lie in the file."""
        return np.dtype(f"{'>' if self is Processor.MIPS else '<'}u{size}")


def shorts_from_words(words: Words, processor: Processor) -> Shorts:
    """Signed 16-bit integers, native, of any shape."""
    return words.view(processor.word(2).str.replace("u", "i")).astype(
        np.int16, copy=False
    )


def words_from_shorts(values: Shorts, processor: Processor) -> Words:
    """File words of native 16-bit integers."""
    return values.astype(np.int16, copy=False).view(np.uint16).astype(processor.word(2))


def floats_from_words(words: Words, processor: Processor) -> Floats32:
    """Native floats of any shape; no copy where the file is as the machine is."""
    if processor is not Processor.DEC:
        order = processor.word(4).str.replace("u", "f")
        return words.view(order).astype(np.float32, copy=False)
    native = words.astype(np.uint32)
    bits = (native << _HALF) | (native >> _HALF)
    exponent = bits & _EXPONENT
    moved = np.where(exponent > _TWO, bits - _TWO, np.uint32(0))
    moved[(exponent == 0) & (bits & _SIGN != 0)] = _NAN
    return moved.view(np.float32)


def words_from_floats(values: Floats32, processor: Processor) -> Words:
    """File words of native floats; DEC ones must be finite and below 1.7e38."""
    bits = values.astype(np.float32, copy=False).view(np.uint32)
    if processor is not Processor.DEC:
        return bits.astype(processor.word(4), copy=False)
    moved = np.where(bits & _EXPONENT, bits + _TWO, np.uint32(0))
    return ((moved << _HALF) | (moved >> _HALF)).astype(processor.word(4))


def shorts_at(raw: bytes, processor: Processor) -> Shorts:
    """Signed 16-bit integers in raw bytes; an odd byte at the end is left out."""
    whole = raw[: len(raw) // 2 * 2]
    return shorts_from_words(np.frombuffer(whole, processor.word(2)), processor)


def floats_at(raw: bytes, processor: Processor) -> Floats32:
    """Floats in raw bytes; what is left at the end is left out."""
    whole = raw[: len(raw) // 4 * 4]
    return floats_from_words(np.frombuffer(whole, processor.word(4)), processor)
