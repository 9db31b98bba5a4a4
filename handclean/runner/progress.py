"""How far a step is: the one line on stderr that it may rewrite.

Steps say what they are doing; whether anybody sees it is the command's affair, and in
a worker process nobody does.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from handclean.runner import terminal

_shown: ContextVar[bool] = ContextVar("shown", default=False)


def tell(text: str) -> None:
    """Say what is being done now."""
    if _shown.get():
        sys.stderr.write(f"\r\033[K{terminal.line(text)}")
        sys.stderr.flush()


@contextmanager
def shown(quiet: bool) -> Iterator[None]:
    """Let steps tell how far they are, on a terminal and unless ``quiet``."""
    moving = sys.stderr.isatty() and not quiet
    token = _shown.set(moving)
    try:
        yield
    finally:
        _shown.reset(token)


def done() -> None:
    """Clear the line."""
    if _shown.get():
        sys.stderr.write("\r\033[K")
        sys.stderr.flush()
