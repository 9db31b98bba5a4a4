"""Compiled loops over plain arrays: no checks, no input or output.

``jit`` is defined here and nowhere else. No ``fastmath``: it breaks NaN, and NaN is
our "missing". With ``NUMBA_DISABLE_JIT=1`` every kernel runs as plain Python.
"""

from collections.abc import Callable
from typing import Any

import numba

jit: Callable[..., Any] = numba.njit(cache=True, error_model="numpy")
