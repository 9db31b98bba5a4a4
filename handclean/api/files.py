"""Takes and subjects from files and into files, and what is in a file."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from handclean.api.contents import contents_of
from handclean.api.given import Subjects
from handclean.api.hands import names_of
from handclean.errors import FileError, UsageError
from handclean.hand.subject import Subject
from handclean.io import files
from handclean.io.hdf5.subject import read_subject as read_subject_file
from handclean.io.hdf5.subject import write_subject
from handclean.recording import Recording
from handclean.remarks import Remark
from handclean.runner import outputs, provenance, records


def read(
    path: Path | str,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    lenient: bool = False,
) -> Recording:
    """Read a take: ``.c3d``, ``.h5``, ``.trc``, ``.csv``, ``.tsv`` or ``.bvh``.

    Parameters
    ----------
    path : path
        The file; its suffix says the format.
    rate_hz : float, optional
        Frames per second [Hz], for files that do not say.
    unit : {"mm", "cm", "m"}, optional
        Of lengths, for files that do not say.
    lenient : bool
        Save what can be saved of a damaged file.

    Returns
    -------
    Recording
        Plain numpy arrays in SI units; ``remarks`` tell what is odd about the file.

    Raises
    ------
    FileError
        If the file cannot be read as what its suffix says.
    UsageError
        If rate or unit are needed and not given, or the rate contradicts the file.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=0.5, rate_hz=50.0)[0]
    >>> _ = hc.write(trial.labelled, "take.c3d")
    >>> take = hc.read("take.c3d")
    >>> take.frames, take.rate
    (25, 50.0)
    """
    take = files.read(path, rate_hz=rate_hz, unit=unit, lenient=lenient)
    if take.provenance:
        return take
    return replace(take, provenance=records.beside(Path(path)))


def read_subject(path: Path | str) -> Subject:
    """Read a subject that ``handclean calibrate-hand`` or `write` wrote.

    Parameters
    ----------
    path : path
        An ``.h5`` file.

    Returns
    -------
    Subject
        Lengths in metres, angles in radians.

    Raises
    ------
    FileError
        If the file is not a subject.

    Examples
    --------
    >>> import handclean as hc
    >>> subject = hc.simulate("free", duration_s=0.5, rate_hz=50.0)[0].subject
    >>> _ = hc.write(subject, "S01.h5")
    >>> hc.read_subject("S01.h5").name
    'S01'
    """
    subject = read_subject_file(Path(path))
    object.__setattr__(subject, "file_sha256", records.digest(Path(path)))
    return subject


def write(
    what: Recording | Subject, path: Path | str, *, subjects: Subjects = ()
) -> tuple[Remark, ...]:
    """Write a take or a subject; the file appears whole or not at all.

    A file that stands there is replaced. What made a take or a subject is recorded in
    an ``.h5`` itself, beside any other file in ``NAME.made.json``, so that `read` and
    the commands know it again.

    Parameters
    ----------
    what : Recording or Subject
        A subject is written as ``.h5``.
    path : path
        Its suffix picks the format: ``.c3d``, ``.h5``, ``.trc``, ``.csv``, ``.mot``,
        ``.bvh`` or ``.glb``. Only ``.h5`` holds everything.
    subjects : Subject or sequence of Subject
        Whose skins the hands have in a ``.glb``; the template's by default.

    Returns
    -------
    tuple of Remark
        What the format cannot hold, or holds otherwise, and what was kept of a file
        that stood in the record's place.

    Raises
    ------
    FileError
        If there is nothing of what the format holds, or the file cannot be written.
    UsageError
        If there is no such format.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=0.5, rate_hz=50.0)[0]
    >>> hc.write(trial.labelled, "take.h5")
    ()
    """
    path = Path(path)
    has_record = path.suffix.lower() == ".h5"
    if isinstance(what, Subject) and not has_record:
        raise UsageError("a subject is written as .h5", where=path)
    made = [subjects] if isinstance(subjects, Subject) else list(subjects)
    skins = {
        name: subject.surface
        for name, subject in zip(names_of(made), made, strict=True)
        if subject.surface is not None
    }
    try:
        with TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            staged = Path(folder) / path.name
            remarks: tuple[Remark, ...] = ()
            if isinstance(what, Subject):
                write_subject(staged, what, what.provenance)
            else:
                remarks = files.write(staged, what, surfaces=skins)
                if not has_record:
                    remarks += _put_record(staged, path, what.provenance, remarks)
            os.replace(staged, path)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise FileError(path, f"cannot be written: {reason}") from None
    return remarks


def _put_record(
    staged: Path,
    path: Path,
    history: Sequence[Mapping[str, Any]],
    remarks: Sequence[Remark],
) -> tuple[Remark, ...]:
    """Put the record of a staged file beside its place; remark on what was kept there.

    A take that no step has made has none, and an old record goes.
    """
    place = records.sidecar(path)
    is_foreign = place.exists() and not records.is_record(place)
    if not history:
        if not is_foreign:
            place.unlink(missing_ok=True)
        return ()
    kept = (outputs.keep(place, place),) if is_foreign else ()
    *earlier, last = history
    last = {"warnings": [], "remarks": [], **last}
    whole = provenance.with_remarks(last, remarks, path)
    record = staged.with_name(place.name)
    records.write_sidecar(record, staged, (*earlier, whole))
    os.replace(record, place)
    return kept


def inspect(
    path: Path | str, *, rate_hz: float | None = None, unit: str | None = None
) -> Mapping[str, Any]:
    """Return what is in a file and what is odd about it.

    Parameters
    ----------
    path : path
        A file of any format that handclean reads or writes.
    rate_hz, unit : optional
        As in `read`; a file that does not say them is looked at without.

    Returns
    -------
    mapping
        Plain values by the names of ``handclean inspect --json``: ``frames``, ``rate``
        [Hz], ``markers``, ``gaps``, ``remarks`` ... What the command lists as ``other``
        stands among them.

    Raises
    ------
    FileError
        If the file cannot be read at all.
    UsageError
        If the rate contradicts it.

    Examples
    --------
    >>> import handclean as hc
    >>> trial = hc.simulate("free", duration_s=0.5, rate_hz=50.0)[0]
    >>> _ = hc.write(trial.labelled, "take.c3d")
    >>> about = hc.inspect("take.c3d")
    >>> about["format"], about["frames"], len(about["markers"])
    ('c3d', 25, 26)
    """
    return contents_of(Path(path), rate_hz=rate_hz, unit=unit)
