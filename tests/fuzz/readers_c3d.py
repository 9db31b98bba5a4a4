"""C3D: inspected, read in every way there is, and written again."""

import io

import numpy as np

from handclean.io import files
from handclean.io.c3d.read import write_c3d
from tests.fuzz.inputs import BYTES, Reader
from tests.io.c3d.c3d_oracles import c3d_bytes, take

EVENTS = {"EVENT": {"LABELS": ["go"], "TIMES": np.array([[0.0, 0.1]])}}
GROUPS = {"POINT": {"ANGLES": ["RELB"], "Y_SCREEN": "+Z", "LONG_FRAMES": 9.0}}
LABELS = ["RSHO", "*1", "RELB", "RWRI", "RWRI"]


def read(path):
    """All that commands do with a C3D."""
    files.inspect(path)
    taken = files.read(path, lenient=True, believe_coordinates=True)
    write_c3d(io.BytesIO(), taken)
    files.read(path, unit="mm", rate_hz=taken.rate)


def seeds(folder):
    """Small files of every processor, numbers and way of counting frames."""
    rng = np.random.default_rng(0)
    for n, processor in enumerate(("intel", "dec", "mips")):
        for is_float in (True, False):
            raw, words = take(rng, 9, 5, is_float)
            content = c3d_bytes(
                raw,
                words if n else -np.ones_like(words),
                LABELS,
                processor=processor,
                is_float=is_float,
                analog=rng.integers(0, 99, (9, 6)) if n != 1 else None,
                per_frame=3 if n != 1 else 0,
                count=("trial", "float", "long")[n],
                groups=GROUPS | EVENTS,
                header_events=[(0.25, "GO")],
                first=1 + 994 * n,
            )
            (folder / f"{processor}{is_float}.c3d").write_bytes(content)
    two = bytearray(c3d_bytes(*take(rng, 9, 5, False), LABELS, is_float=False))
    two[12:16] = np.float32(0.01).tobytes()
    (folder / "two.c3d").write_bytes(two)
    nothing = np.zeros((9, 0, 3)), np.zeros((9, 0), int)
    analog = c3d_bytes(*nothing, analog=np.ones((9, 4)), per_frame=2)
    (folder / "analog.c3d").write_bytes(analog)


READERS = {"c3d": Reader(read=read, seeds=seeds, mutators=BYTES)}
