"""Which readings, glove and hand a command on gloves is given."""

from typing import Any

from handclean.arrays import Floats
from handclean.commands.shared.take_options import options_of
from handclean.errors import FileError
from handclean.glove import readings as checks
from handclean.glove.definitions import load_glove
from handclean.glove.gloves import Glove
from handclean.hand.subject import Subject
from handclean.hand.template import template
from handclean.io.glove.readings import facts_of, open_readings
from handclean.io.glove.readings_file import ReadingsFile
from handclean.io.hdf5.subject import read_subject
from handclean.runner.batch import Source
from handclean.tree import JointTree


def opened(source: Source, glove: Glove) -> tuple[ReadingsFile, Any]:
    """Open a source's readings; return with it the columns of the glove's sensors.

    Raises
    ------
    FileError
        If it is not readings, is of another glove, or lacks a sensor.
    """
    rate = options_of(source).rate_hz
    found = open_readings(source.path, rate_hz=rate, sensors=len(glove.sensors))
    said = found.facts.get("glove")
    if isinstance(said, str) and said and said != glove.name:
        raise FileError(
            source.path, f"was recorded with glove {said}", f"this is of {glove.name}"
        )
    return found, checks.columns(source.path, glove, found.sensors, found.columns)


def whole(source: Source, glove: Glove) -> tuple[ReadingsFile, Floats, Floats]:
    """Read a source whole: the file, (T,) [s] times, (T, S) in the glove's order."""
    found, places = opened(source, glove)
    times, values = found.all()
    return found, times, checks.arranged(values, places)


def glove_of(source: Source, name: str) -> Glove:
    """The glove that is named, or a file, or what the readings say they are of.

    Raises
    ------
    FileError, UnknownNameError
        If there is none, or nothing says which.
    """
    given = source.files.get("glove")
    if given is not None:
        return load_glove(given)
    if name:
        return load_glove(name)
    said = facts_of(source.path).get("glove")
    if not isinstance(said, str) or not said:
        raise FileError(source.path, "does not say its glove", "give --glove")
    return load_glove(said)


def tree_of(source: Source, glove: Glove) -> tuple[JointTree, Subject | None]:
    """The hand in the glove: the subject's, else the template with a forearm."""
    options = options_of(source)
    if options.subjects:
        subject = read_subject(options.subjects[0])
        return glove.hand.tree(subject.model.tree), subject
    side = options.side if options.side in ("left", "right") else "right"
    wrist = "wrist_flexion" in glove.hand.rotations
    return glove.hand.tree(template(side, forearm=wrist)), None
