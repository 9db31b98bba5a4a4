"""The one table of formats: what reads, writes and inspects a file of each suffix.

To add a format, write its functions in a module of its own and add one line here. The
readers, the command line, its completion, the plans of outputs and the table of what
each format keeps follow from it.

Functions are named ``module:function``, below `handclean.io`, and imported when they
are first called: help and completion know every suffix without any reader. What they
take and return depends on what the format holds.

====== ============================ ==================================================
holds  ``read``                     ``write``
====== ============================ ==================================================
take   (path, options) -> `Reading` (path, recording, options) -> remarks or None
hand   (path) -> `ImportedHand`     (path, recording, options) -> remarks
mesh   (path, bytes) -> `RawMesh`   (path, `Mesh`) -> remarks
====== ============================ ==================================================

The remarks are on what the file cannot hold. ``inspect`` takes (path, options)
and returns plain JSON values. Options are passed by name, and only those that the entry
lists: ``rate_hz``, ``unit``, ``lenient``, ``believe_coordinates`` where files are read;
``surfaces``, ``unnamed``, ``bvh_up`` where they are written.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

TAKE, HAND, MESH = "take", "hand", "mesh"
"""What a file holds when it is read."""

_ASKED = ("rate_hz", "unit", "lenient")
"""Options of every format whose files may leave out their rate or unit."""

_EVERYTHING = frozenset(
    {
        *{"markers", "points", "marks", "raw", "confidence", "residuals"},
        *{"angles", "roots", "trust", "skeletons", "events", "source_events"},
        *{"analog", "source", "first_frame", "start_time", "up_axis"},
    }
)
"""All parts of a take, as `handclean.io.keeps.PARTS` names them."""


@dataclass(frozen=True, kw_only=True)
class Format:
    """A file format.

    Attributes
    ----------
    suffix : with its dot, in lower case.
    holds : `TAKE`, `HAND` or `MESH`.
    read, write, inspect : names of functions, see the module; "" for none.
    options : names of the options that its functions take.
    keeps : parts of a take that it keeps when one is written, see
        `handclean.io.keeps`; none for formats into which no take is written.
    """

    suffix: str
    holds: str = TAKE
    read: str = ""
    write: str = ""
    inspect: str = "contents:inspect_take"
    options: tuple[str, ...] = ()
    keeps: frozenset[str] = frozenset()


FORMATS = (
    Format(
        suffix=".c3d",
        read="c3d.read:read_c3d_take",
        write="c3d.read:write_c3d",
        inspect="contents:inspect_c3d_take",
        options=(*_ASKED, "believe_coordinates"),
        keeps=_EVERYTHING
        - {"raw", "confidence", "roots", "skeletons", "events", "start_time"},
    ),
    Format(
        suffix=".h5",
        read="hdf5.take:read_h5_take",
        write="hdf5.session:write_session",
        inspect="contents:inspect_h5",
        options=("rate_hz", "unit"),
        keeps=_EVERYTHING,
    ),
    Format(
        suffix=".trc",
        read="text.trc_read:read_trc",
        write="text.trc_write:write_trc",
        options=(*_ASKED, "unnamed"),
        keeps=frozenset({"markers", "first_frame", "start_time"}),
    ),
    Format(
        suffix=".csv",
        read="text.csv_read:read_csv",
        write="text.csv_write:write_csv",
        inspect="contents:inspect_csv",
        options=_ASKED,
        keeps=frozenset(
            {
                *{"markers", "points", "marks", "angles", "roots", "trust"},
                *{"first_frame", "start_time", "up_axis"},
            }
        ),
    ),
    Format(suffix=".tsv", read="text.qualisys:read_tsv", options=_ASKED),
    Format(
        suffix=".mot",
        write="text.mot:write_mot",
        inspect="text.mot:inspect_mot",
        keeps=frozenset({"angles", "roots", "trust", "start_time"}),
    ),
    Format(
        suffix=".bvh",
        read="bvh.angles:read_bvh_angles",
        write="bvh.write:write_bvh",
        options=(*_ASKED, "bvh_up"),
        keeps=frozenset({"angles", "roots", "skeletons", "up_axis"}),
    ),
    Format(
        suffix=".glb",
        holds=HAND,
        read="shapes:read_hand",
        write="gltf.write:write_glb",
        inspect="shapes:inspect_glb",
        options=("surfaces",),
        keeps=frozenset({"angles", "roots", "trust", "skeletons", "up_axis"}),
    ),
    Format(
        suffix=".ply",
        holds=MESH,
        read="mesh.ply:parse_ply",
        write="mesh.write:write_ply",
        inspect="shapes:inspect_mesh",
        options=("unit",),
    ),
    Format(
        suffix=".obj",
        holds=MESH,
        read="mesh.obj_stl:parse_obj",
        write="mesh.write:write_obj",
        inspect="shapes:inspect_mesh",
        options=("unit",),
    ),
    Format(
        suffix=".stl",
        holds=MESH,
        read="mesh.obj_stl:parse_stl",
        write="mesh.write:write_stl",
        inspect="shapes:inspect_mesh",
        options=("unit",),
    ),
)

BY_SUFFIX: Mapping[str, Format] = MappingProxyType({f.suffix: f for f in FORMATS})

TAKES_READ = tuple(f.suffix for f in FORMATS if f.holds == TAKE and f.read)
"""Suffixes of files that are read as takes."""

TAKES_WRITTEN = tuple(f.suffix for f in FORMATS if f.keeps)
"""Suffixes with which a take can be written."""

MESHES = tuple(f.suffix for f in FORMATS if f.holds == MESH)
"""Suffixes of meshes and point clouds, read and written."""

HANDS = tuple(f.suffix for f in FORMATS if f.holds == HAND)
"""Suffixes of files that may hold a skinned hand."""

SUBJECTS = (".h5", *HANDS, *MESHES)
"""Suffixes with which a subject, or its skin, can be written."""


def by_suffix(path: Path | str) -> Format | None:
    """Return the format that a path's suffix names, None if there is none."""
    return BY_SUFFIX.get(Path(path).suffix.lower())


def function(name: str) -> Callable[..., Any]:
    """Import a function that the table names."""
    module, _, attribute = name.partition(":")
    found: Callable[..., Any] = getattr(
        import_module(f"handclean.io.{module}"), attribute
    )
    return found


def chosen(wanted: Format, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the options given that a format's functions take."""
    return {name: given[name] for name in wanted.options if name in given}
