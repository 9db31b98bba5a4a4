"""Files of recordings, hands and meshes: their formats, their units, their axes.

Only this package knows a format of such files, and what unit, angle or axis it uses.
All that it hands over, and all that it is given to write, is in metres, radians and
seconds. `handclean.io.formats` is the table of formats, `handclean.io.files` the door.

Millimetres and degrees occur elsewhere in two places only: in definitions in TOML that
people write (marker sets, joint trees, gloves, key poses, settings), which the module
that defines them converts as it reads them through `handclean.tomlfile`; and in the
words and figures that people read.
"""
