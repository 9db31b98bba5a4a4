"""A step that does what its input says: counts its words, or fails in some way."""

import os
import signal
import time
from pathlib import Path

import numpy as np
from boxes import RECORDS, SUFFIX, write_box

from handclean.errors import (
    TAKE,
    FileError,
    HandcleanError,
    Place,
    TakeNumber,
    UsageError,
)
from handclean.remarks import remark
from handclean.runner import read_remarks, seeding
from handclean.runner.outcome import Outcome

EVIL = "\x1b]0;title\x07\u202e"

FIGURES = {"words": "words of the input", "draw": "a random number", "gap": "unknown"}


def tally(source, settings):
    if isinstance(source, tuple):
        text = " ".join(part.path.read_text() for part in source)
        rng = seeding.rng(*source)
    else:
        text = source.path.read_text()
        rng = seeding.rng(source)
    words = text.split()
    if "read" in words:
        for part in source if isinstance(source, tuple) else (source,):
            read_remarks.note(
                part.path, (remark("note", "was read oddly", file=part.path),)
            )
    act(source, *words[:3])
    figures = {"words": len(words), "draw": rng.random(), "gap": float("nan")}

    def write(path, provenance):
        if path.suffix == SUFFIX:
            write_box(path, "tally", text, provenance)
            return None
        path.write_text(text.upper())
        if words[:1] == ["linger"]:
            Path(words[1]).write_text(str(os.getpid()))
            time.sleep(600)
        if words[:1] == ["full"]:
            raise OSError(28, "No space left on device", str(path))
        if words[:1] == ["unfit"]:
            raise FileError(path, "cannot hold this")
        if words[:1] == ["lossy"]:
            return (remark("not-kept", "angles are left out"),)
        return None

    remarks = (remark("note", "is odd", words=len(words)),) if "odd" in words else ()
    if "read" in words:
        remarks += (remark("note", "was read oddly"),)
    if words[:1] == ["evil"]:
        remarks = (remark("labels", f"marker '{EVIL * 100}' is odd"),)
    return Outcome(
        line=f"{len(words)} words" + EVIL * ("evil" in words),
        details=EVIL if "evil" in words else "",
        figures=figures,
        remarks=remarks,
        writers=(write,) if settings != "print" else (),
        history=() if isinstance(source, tuple) else RECORDS.of(source.path),
    )


def act(source, word="", argument="", begun=""):
    if word == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "orphan":  # kill the parent, the first times that are asked for
        with Path(argument).open("a+") as file:
            file.seek(0)
            tried = len(file.readlines())
            file.write(f"{os.getpid()}\n")
        if tried < int(begun):
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(600)
    if word == "exit":
        os._exit(7)
    if word == "wrong":
        raise FileError(source.path, "is wrong", "it should be right")
    if word == "misused":
        raise UsageError("is misused", where=source.path)
    if word == "part":
        raise FileError(Place(source.path, " line 7"), "is wrong")
    if word == "elsewhere":
        raise FileError(Place(Path("other.toml"), " line 7"), "is wrong")
    if word in ("take", "nowhere"):
        raise HandcleanError("has no rate", where=TAKE if word == "take" else None)
    if word == "unsaid":
        raise UsageError("is missing", where="--who")
    if word == "second":
        raise HandcleanError("has no rate", where=TakeNumber(1))
    if word == "appears":
        Path(argument).write_text("theirs")
    if word == "wicked":
        raise FileError(source.path, EVIL * 1000, "it should be right")
    if word == "numpy":
        np.log(np.zeros(1))
    if word == "bug":
        raise ZeroDivisionError("two\nlines")
    if word == "memory":
        raise MemoryError
    if word == "slow":
        time.sleep(float(argument))
    if word == "until":
        Path(begun).write_text("yes")
        while not Path(argument).exists():
            time.sleep(0.01)
    if word == "swallow":  # as numba does when it is stopped while it compiles
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(600)
        except BaseException as error:
            if argument == "change":
                raise RuntimeError("no compiled object yet") from error
    if word == "prints":
        os.write(1, b"noise")
