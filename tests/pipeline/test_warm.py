"""Warming leaves nothing to compile later."""

import pkgutil
from importlib import import_module

import handclean
from handclean.pipeline import warm

UNUSED = {
    "handclean.kernels.rotations.quaternion_from_matrix",
    "handclean.kernels.rotations.logarithm",
    "handclean.labels.review.refit",
}
"""Kernels that no command calls (they complete the maps of their module), or that only
a take with labels in doubt reaches."""


def everything():
    """Import every module of the package."""
    for module in pkgutil.walk_packages(handclean.__path__, "handclean."):
        if not module.name.endswith("__main__"):
            import_module(module.name)


def called_by(kernel):
    """Kernels that a kernel calls, and those that they call."""
    found, new = set(), {kernel}
    while new:
        found |= new
        functions = [k.py_func for k in new]
        named = {f.__globals__.get(n) for f in functions for n in f.__code__.co_names}
        new = {n for n in named if hasattr(n, "nopython_signatures")} - found
    return found


def test_warming_leaves_no_kernel_uncompiled():
    everything()
    warm.warm()
    known = list(warm.kernels())
    reached = {k for kernel in known if kernel.signatures for k in called_by(kernel)}
    left = {
        f"{k.py_func.__module__}.{k.py_func.__name__}" for k in set(known) - reached
    }
    assert left == UNUSED, "a part in handclean/pipeline/warm.py should reach them"
