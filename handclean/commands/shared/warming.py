"""Which parts of what `warm` compiles a command needs; imports nothing heavy."""

from collections.abc import Collection, Mapping

FOR: Mapping[str, Collection[str]] = {
    "clean": ("following", "solving", "reviewing", "chain"),
    "calibrate-hand": ("calibration",),
}
"""Parts of `handclean.commands.shared.kernels` by the command that needs no others.

``clean`` is made of ``label``, ``fill-gaps`` and ``solve``; of ``calibrate-hand`` it is
``markers`` only.
"""
