"""A session as readers of other formats hand over a take: with its unit and remarks."""

from pathlib import Path

from handclean.io.hdf5.session import read_session
from handclean.io.shared.reading import Reading
from handclean.io.shared.rescale import rescaled
from handclean.io.shared.settle import METRES, settle_rate, settle_unit
from handclean.remarks import Remark


def read_h5_take(
    path: Path, *, rate_hz: float | None = None, unit: str | None = None
) -> Reading:
    """Read a session.

    Parameters
    ----------
    rate_hz : must agree with the file.
    unit : of its lengths, where they are not the metres that it says.

    Raises
    ------
    FileError
        If it is not a session, or damaged.
    UsageError
        If the rate contradicts the file, or the unit is none.
    """
    take = read_session(path)
    settle_rate(path, take.rate, rate_hz)
    remarks: list[Remark] = []
    length = settle_unit(path, "m", unit, remarks)
    if remarks:
        take = rescaled(take, METRES[length.lower()])
    return Reading(recording=take, unit=length, remarks=tuple(remarks))
