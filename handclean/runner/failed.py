"""The list of failed inputs, ready to be a manifest: ``--failed FILE``.

It replaces an older list, and nothing else but with ``--overwrite``, which keeps what
stood there.
"""

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from handclean.errors import UsageError
from handclean.runner import manifest, outputs, plan, staging
from handclean.runner.batch import Batch, Task
from handclean.runner.manifest import Line
from handclean.runner.places import expect_unused, identity
from handclean.runner.records import Records


def expect_free(batch: Batch, tasks: Sequence[Task], records: Records) -> None:
    """Expect a place for the list, before anything is done.

    Raises
    ------
    UsageError
        If it cannot be written, if a file of this command or any other than an older
        list stands there.
    """
    path = batch.failed
    if path is None:
        return
    there = path.absolute() if path.exists() else path.absolute().parent
    if path.is_dir() or not there.exists() or not os.access(there, os.W_OK):
        raise UsageError("cannot be written; --failed should name a file", where=path)
    older = _is_list(path, batch)
    read = [other for other in batch.reads if not (older and _is(path, other))]
    expect_unused(path, tasks, records, read)
    if path.exists() and not (older or batch.overwrite):
        raise UsageError(
            "is there already and no list of failed inputs; --failed should name "
            f"another file (--overwrite replaces it and keeps it as {path.name}~)",
            where=path,
        )


def write(
    batch: Batch,
    tasks: Sequence[Task],
    lines: Sequence[Line],
    unfinished: Mapping[int, str],
) -> tuple[str, str]:
    """List the failed inputs where that is asked for; say what went wrong or was kept.

    Parameters
    ----------
    unfinished : why, by index of the tasks that failed or were not done.

    Returns
    -------
    why the list could not be written, or ""; what was kept, or ""
    """
    path = batch.failed
    if path is None:
        return "", ""
    placed = plan.failed_lines(tasks, lines)
    listed = (
        replace(line, reason=unfinished[i])
        for i, line in enumerate(placed)
        if i in unfinished
    )
    text = manifest.to_csv(listed, batch.given.columns)
    place = Path(os.path.realpath(path))
    temporary = staging.temporary(place, staging.token(), 0)
    try:
        temporary.write_bytes(os.fsencode(text))
        kept = ""
        if path.exists() and not _is_list(path, batch):
            kept = f"--failed: {outputs.keep(place, path).text}"
        os.replace(temporary, place)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        reason = (error.strerror or str(error)).lower()
        return f"--failed {path}: cannot be written: {reason}", ""
    return "", kept


def _is_list(path: Path, batch: Batch) -> bool:
    """Whether a file is an older list, or empty."""
    header = manifest.to_csv((), batch.given.columns)
    without_reason = header.replace(f",{manifest.REASON}\n", "\n")  # up to 0.1
    try:
        with path.open("rb") as file:
            return file.readline(len(header)).decode() in ("", header, without_reason)
    except (OSError, ValueError):
        return False


def _is(one: Path, other: Path) -> bool:
    return identity(one) == identity(other)
