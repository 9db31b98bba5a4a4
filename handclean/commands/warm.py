"""Kernels compiled and cached, a part of them; a step for ``warm`` to do in a process.

The source is no file: its name is that of the part.
"""

import numpy as np

from handclean.commands.shared import kernels as warming
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome

FIGURES = {
    "compiled": "kernels that were compiled",
    "loaded": "kernels that were loaded from the cache",
}


def warm(source: Source, settings: None) -> Outcome:
    """Do a part of what commands do, so that it is compiled."""
    before = warming.counts()
    warming.PARTS[source.name]()
    loaded, compiled = np.subtract(warming.counts(), before).tolist()
    figures = {"compiled": compiled, "loaded": loaded}
    return Outcome(line=f"{compiled} compiled, {loaded} loaded", figures=figures)
