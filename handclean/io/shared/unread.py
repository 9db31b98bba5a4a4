"""Files of other programs that are not read: what they are, and what to do instead.

They are known by their suffix; one with the suffix of a text, by its first bytes.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn

from handclean.errors import FileError

_TRIAL = "export the trial as C3D"
_SCENE = "export a skeleton as BVH, a hand with its skin as .glb"
_SHEET = "save the table as CSV"
_ARCHIVE = "unpack it"
_VIDEO = "give the points that were found in it"

_KINDS = (
    (".mat", "a MATLAB file", "export C3D or TSV instead, or save the table as CSV"),
    (".fbx", "an FBX scene", "export its skeleton as BVH, its markers as C3D"),
    (".qtm", "a Qualisys measurement", "export its 3D data as C3D or TSV"),
    (".tak", "a take of OptiTrack Motive", "export it from Motive as C3D or CSV"),
    (".x1d .x2d .vsk .vst .enf .xcp .mcp .v", "a file of Vicon Nexus", _TRIAL),
    (".trb", "a binary TRC of Motion Analysis", "save it as TRC or C3D"),
    (".anb .anc", "analog data of Motion Analysis", _TRIAL),
    (".cap .vc1", "camera data of Motion Analysis", _TRIAL),
    (".htr .htr2", "a skeleton's motion by Motion Analysis", "save it as BVH"),
    (".asf .amc", "an Acclaim skeleton or its motion", "convert it to BVH"),
    (".mvn .mvnx", "a recording of Xsens MVN", "export it as C3D or BVH"),
    (".mdh .mdm .cmo", "a file of Visual3D", "export the markers as C3D"),
    (".ndf .oad", "a file of NDI First Principles", "export the markers as C3D or CSV"),
    (".sto .osim", "a file of OpenSim", "markers are in its TRC"),
    (".gltf", "a glTF in several files", "save it as one .glb"),
    (".blend .ma .mb .max .c4d .dae .abc", "a scene of an animation program", _SCENE),
    (".usd .usda .usdc .usdz", "a scene in USD", _SCENE),
    (".xlsx .xls .xlsm .ods", "a spreadsheet", "save the sheet as CSV"),
    (".npy .npz", "arrays of numpy", _SHEET),
    (".parquet .feather .arrow", "a table of Arrow", _SHEET),
    (".pkl .pickle", "a Python pickle, which may hold any code", _SHEET),
    (".json .jsonl .yaml .yml .xml", "data without a format for takes", _SHEET),
    (".txt .dat .asc", "a text that does not say its format", "name it .csv or .tsv"),
    (".hdf5 .hdf", "an HDF5 file under another name", "name it .h5"),
    (".zip .7z .tar .gz .tgz .xz .bz2", "packed", _ARCHIVE),
    (".avi .mp4 .mov .mkv .m4v", "a video", _VIDEO),
)
"""Suffixes, what a file is, what to do."""

UNREAD: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        suffix: (what, right)
        for suffixes, what, right in _KINDS
        for suffix in suffixes.split()
    }
)
"""What a file of a suffix is, and what to do instead."""

_BEGINNINGS = (
    (b"MATLAB ", ".mat"),
    (b"Kaydara FBX", ".fbx"),
    (b"\x89HDF", ".hdf5"),
    (b"PK\x03\x04", ".xlsx"),
    (b"\xd0\xcf\x11\xe0", ".xls"),
    (b"\x1f\x8b", ".gz"),
    (b"\x93NUMPY", ".npy"),
    (b"PAR1", ".parquet"),
    (b"\x80\x04\x95", ".pkl"),
)
"""First bytes, and the suffix of such files."""

_BINARY = ((b"glTF", "a .glb"), (b"%PDF", "a PDF"))


def refuse_unread(path: Path, known: str) -> NoReturn:
    """Refuse a file of a suffix that no reader has, saying what it is.

    Parameters
    ----------
    known : suffixes that are read.

    Raises
    ------
    FileError
    """
    suffix = path.suffix.lower()
    if suffix in UNREAD:
        what, right = UNREAD[suffix]
        raise FileError(path, f"is {what}, and not read", right)
    raise FileError(path, f"no format is called '{suffix}'", f"readable: {known}")


def refuse_binary(path: Path, content: bytes) -> NoReturn:
    """Refuse bytes that are no text, saying what they are where that is known.

    Raises
    ------
    FileError
    """
    for begins, suffix in _BEGINNINGS:
        if content.startswith(begins):
            what, right = UNREAD[suffix]
            raise FileError(path, f"is not text but {what}", right)
    for begins, what in _BINARY:
        if content.startswith(begins):
            raise FileError(path, f"is not text but {what}", "give it its own suffix")
    if content[1:2] == b"P" and len(content) % 512 == 0:
        raise FileError(path, "is not text but a C3D", "give it the suffix .c3d")
    raise FileError(path, "is not text: it holds zero bytes")
