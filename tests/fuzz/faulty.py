"""Readers that do over one of three files what the driver should report."""

import ctypes
import subprocess
import sys
import time
import warnings

from handclean.errors import HandcleanError
from tests.fuzz.inputs import Reader

_SPIN = "import time\nwhile time.process_time() < 1.5: pass"


def seeds(folder):
    for number in range(3):
        (folder / f"{number}.txt").write_text(str(number))


def same(rng, content, other):
    return content


def over_one(fault):
    def read(path):
        if path.read_text() == "1" and "input" in path.name:
            fault()

    return Reader(read=read, seeds=seeds, mutators=(same,))


def raises():
    raise KeyError("x")


def refuses():
    raise HandcleanError("no")


def warns():
    warnings.warn("all NaN", RuntimeWarning, stacklevel=2)


def dies():
    ctypes.string_at(0)


def hangs():
    time.sleep(1e6)


def works():
    exec(_SPIN, {})


def child_works():
    subprocess.run([sys.executable, "-c", _SPIN], check=True)


def hoards():
    assert bytes(range(256)) * (60_000_000 // 256)


READERS = {
    "raises": over_one(raises),
    "warns": over_one(warns),
    "dies": over_one(dies),
    "hangs": over_one(hangs),
    "works": over_one(works),
    "child_works": over_one(child_works),
    "hoards": over_one(hoards),
    "sound": over_one(refuses),
}
