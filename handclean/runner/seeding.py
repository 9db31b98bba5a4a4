"""Random numbers of a task, which depend on nothing but its seed and its inputs."""

import numpy as np

from handclean.runner.batch import Source
from handclean.runner.records import digest


def rng(*sources: Source) -> np.random.Generator:
    """Begin the random numbers of a task, by its seed and its inputs' content.

    They do not depend on names, order of work, jobs or shards.
    """
    digests = [source.sha256 or digest(source.path) for source in sources]
    return np.random.default_rng([sources[0].seed, *(int(d, 16) for d in digests)])
