"""One batch of damaged inputs, in a process of its own: see ``driver.py``.

For every input a line ``begin N`` is written before it is read and a line of JSON
after it, so that whoever started this process knows where it hangs or dies.
"""

import json
import os
import resource
import sys
import time
import traceback
import warnings
from importlib import import_module
from pathlib import Path

from handclean.errors import HandcleanError
from tests.fuzz.inputs import Reader, damaged


def reader_of(name: str) -> Reader:
    """``MODULE.NAME``: entry NAME of ``READERS`` in ``tests/fuzz/MODULE.py``."""
    module, _, own = name.partition(".")
    found: Reader = import_module(f"tests.fuzz.{module}").READERS[own]
    return found


def main(name: str, folder: str, first: str, count: str, seed: str) -> None:
    """Read inputs of these numbers, with a folder of their own to work in."""
    os.chdir(folder)
    warnings.simplefilter("error")  # none should reach the terminal
    reader = reader_of(name)
    paths = sorted(p for p in Path(folder, "seeds").iterdir() if p.is_file())
    seeds = [path.read_bytes() for path in paths]
    for path in paths:  # what is loaded once is no input's doing
        _tried(reader, path)
    for number in range(int(first), int(first) + int(count)):
        path = Path(folder, "input" + paths[number % len(paths)].suffix)
        path.write_bytes(damaged(reader, seeds, number, int(seed)))
        _say(f"begin {number}")
        _forget_peaks()
        memory, processor = _memory("VmRSS"), _processor()
        found = _tried(reader, path)
        found["seconds"] = round(_processor() - processor, 3)
        found["bytes"] = max(0, _memory("VmHWM") - memory)
        found["size"] = path.stat().st_size
        _say(json.dumps(found))


def _tried(reader: Reader, path: Path) -> dict[str, object]:
    try:
        reader.read(path)
    except HandcleanError:
        return {"read": False}
    except BaseException as error:
        return {"read": False, "fault": f"{type(error).__name__}: {error}"[:300]} | {
            "trace": traceback.format_exc()[-3000:]
        }
    return {"read": True}


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _family() -> list[int]:
    """This process and its children, theirs too."""
    found = [os.getpid()]
    for pid in found:
        try:
            for task in Path(f"/proc/{pid}/task").iterdir():
                found += map(int, (task / "children").read_text().split())
        except OSError:
            continue
    return found


def _forget_peaks() -> None:
    for pid in _family():
        try:
            Path(f"/proc/{pid}/clear_refs").write_text("5")
        except OSError:
            continue


def _memory(what: str) -> int:
    """[bytes] now (VmRSS) or at most (VmHWM), of all processes that are ours."""
    total = 0
    for pid in _family():
        try:
            text = Path(f"/proc/{pid}/status").read_text()
        except OSError:
            continue
        at = text.find(what + ":")
        total += int(text[at:].split()[1]) * 1024 if at >= 0 else 0
    return total


def _processor() -> float:
    """[s] of processor time, of all processes that are ours or were."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    total = time.process_time() + ended.ru_utime + ended.ru_stime
    for pid in _family()[1:]:
        try:
            fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


if __name__ == "__main__":
    main(*sys.argv[1:])
