r"""What may be written to a terminal: text from files does no more than be read.

A label can hold codes that move the cursor, clear the screen or turn the reading
direction round; they are written as what they are, ``\x1b``. JSON escapes by itself.
"""

import os
import re
import sys
import warnings

MOST_CHARACTERS = 500
"""Characters of an error or a warning; the middle of a longer one is left out
(chosen)."""

_CUT = " ... "
_UNSAFE = re.compile(
    "[\0-\x08\x0b-\x1f\x7f-\x9f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f"
    "\ufeff\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e007f]"
)
"""Controls (but for tab and line feed), what turns the reading direction, what is not
seen, and bytes of names that are no UTF-8."""


def safe(text: str) -> str:
    r"""Return text of any lines in which what a terminal would obey is escaped.

    >>> safe("a\x1b[31mred")
    'a\\x1b[31mred'
    """
    return _UNSAFE.sub(
        lambda found: found[0].encode("unicode_escape").decode("ascii"), text
    )


def line(text: str) -> str:
    """Return text as one safe line of no more than `MOST_CHARACTERS` characters."""
    return shortened(safe(" ".join(text.split())))


def shortened(text: str) -> str:
    """Leave out the middle of text that is too long; both ends say most."""
    if len(text) <= MOST_CHARACTERS:
        return text
    tail = MOST_CHARACTERS // 3
    return text[: MOST_CHARACTERS - tail - len(_CUT)] + _CUT + text[-tail:]


def open_closed() -> None:
    """Open standard streams that are closed onto nowhere.

    Otherwise the first file that is opened would take their place, and what is meant
    for them would be written into it.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(descriptor)
        except OSError:
            opened = os.open(os.devnull, os.O_RDWR)
            if opened != descriptor:
                os.dup2(opened, descriptor)
                os.close(opened)
            os.set_inheritable(descriptor, True)
        if getattr(sys, name) is None:
            mode = "w" if descriptor else "r"
            stream = os.fdopen(descriptor, mode, encoding="utf-8", closefd=False)
            setattr(sys, name, stream)


def hush() -> None:
    """Keep back what libraries warn of in their own words, unless somebody asked.

    What a person should know of a file handclean says itself.
    """
    if not sys.warnoptions and all(rule[0] != "error" for rule in warnings.filters):
        warnings.simplefilter("ignore")
