"""handclean: offline cleaning of optical hand motion capture.

What commands do, as functions of takes and subjects::

    import handclean as hc

    take = hc.read("take_07.c3d")
    subject = hc.calibrate_hand([hc.read("rom.c3d")], marker_set="maycock26")
    clean = hc.clean(take, [subject])
    hc.write(clean, "take_07.clean.h5")

``help(hc.clean)`` and the like tell more. Each part is imported when it is first used,
so that ``import handclean`` costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

__version__ = "0.1.0"

_PARTS = {
    "read": "api.files",
    "read_subject": "api.files",
    "write": "api.files",
    "inspect": "api.files",
    "label": "api.label",
    "fill_gaps": "api.fill_gaps",
    "solve": "api.solve",
    "clean": "api.clean",
    "calibrate_hand": "api.calibrate_hand",
    "compare": "api.compare",
    "simulate": "api.simulate",
    "Recording": "recording",
    "Subject": "hand.subject",
    "Remark": "remarks",
    "HandcleanError": "errors",
}
"""Public names, with the modules they are from."""

if TYPE_CHECKING:
    from handclean.api.calibrate_hand import calibrate_hand as calibrate_hand
    from handclean.api.clean import clean as clean
    from handclean.api.compare import compare as compare
    from handclean.api.files import inspect as inspect
    from handclean.api.files import read as read
    from handclean.api.files import read_subject as read_subject
    from handclean.api.files import write as write
    from handclean.api.fill_gaps import fill_gaps as fill_gaps
    from handclean.api.label import label as label
    from handclean.api.simulate import simulate as simulate
    from handclean.api.solve import solve as solve
    from handclean.errors import HandcleanError as HandcleanError
    from handclean.hand.subject import Subject as Subject
    from handclean.recording import Recording as Recording
    from handclean.remarks import Remark as Remark
else:

    def __getattr__(name: str) -> object:
        """Import a public name when it is first asked for (PEP 562)."""
        if name not in _PARTS:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        found = getattr(import_module(f"{__name__}.{_PARTS[name]}"), name)
        globals()[name] = found
        return found

    def __dir__() -> list[str]:
        """List the public names, imported or not."""
        return sorted({*globals(), *_PARTS} - {"TYPE_CHECKING", "import_module"})
