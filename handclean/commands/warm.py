"""Kernels compiled and cached, a part of them; a step for ``warm`` to do in a process.

The source is no file: its name is those of the parts, in their order.
"""

from handclean.commands.shared import kernels as warming
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "compiled": "kernels that were compiled",
    "loaded": "kernels that were loaded from the cache",
}


def warm(source: Source, settings: None) -> Outcome:
    """Do some of what commands do, so that it is compiled."""
    for part in source.name.split():
        warming.PARTS[part]()
    loaded, compiled = warming.counts()
    figures = {"compiled": compiled, "loaded": loaded}
    return Outcome(line=f"{compiled} compiled, {loaded} loaded", figures=figures)
