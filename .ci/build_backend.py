"""setuptools, told where the list stands of what a source distribution holds.

By itself it looks for ``MANIFEST.in`` at the top, where only what users need stands.
"""

from setuptools.build_meta import *  # noqa: F403
from setuptools.command.egg_info import manifest_maker

manifest_maker.template = ".ci/sdist.in"
