"""Parts: what our HDF5 files consist of, with checks on what comes out of them.

A part is a group: small facts as attributes, and below it arrays with their units,
texts, plain values and further parts. `handclean.io.hdf5.file` puts parts into files.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handclean.errors import FileError, HandcleanError, Place, Where
from handclean.tomlfile import LONGEST_NAME
from handclean.tree import JointTree

Fact = str | int | float | bool


def within(where: Where, name: str) -> Place | str:
    """Return the place of a part of what is at ``where``."""
    if isinstance(where, Path):
        where = Place(where)
    return where / name if isinstance(where, Place) else f"{where}/{name}"


@dataclass(frozen=True)
class Array:
    """Numbers and their unit; "" for numbers that have none.

    ``tables``: small arrays that belong to them, by name.
    """

    values: NDArray[Any]
    units: str = ""
    tables: Mapping[str, NDArray[Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """A group: attributes, and named arrays, texts, plain values and parts.

    Attributes
    ----------
    attrs : small facts.
    items : `Array`, `Part`, str, list or tuple of str, bool, int, float, or whatever
        JSON can hold.
    where : file and group, for messages.
    """

    attrs: Mapping[str, Fact] = field(default_factory=dict)
    items: Mapping[str, Any] = field(default_factory=dict)
    where: Where = ""

    def fail(self, wrong: str, right: str = "") -> FileError:
        """Return the error to raise about this part."""
        return FileError(self.where, wrong, right)

    def has(self, name: str) -> bool:
        """Whether there is an item of that name."""
        return name in self.items

    def part(self, name: str) -> "Part":
        """Return a part, an empty one if it is not there.

        Raises
        ------
        FileError
            If it is not a group.
        """
        found = self.items.get(name, Part(where=within(self.where, name)))
        if not isinstance(found, Part):
            raise self.fail(f"{name} should be a group")
        return found

    def parts(self) -> Iterator[tuple[str, "Part"]]:
        """Go through the parts of this part."""
        for name, item in self.items.items():
            if isinstance(item, Part):
                yield name, item

    def array(
        self, name: str, units: str, dtype: Any, *shape: int | None
    ) -> NDArray[Any]:
        """Return an array, checked and converted.

        Parameters
        ----------
        units : as the dataset should state them.
        dtype : to convert to; whole numbers are not made of others.
        shape : expected sizes; None matches any.

        Raises
        ------
        FileError
            If it is not there or not as expected.
        """
        found = self.items.get(name)
        if not isinstance(found, Array):
            raise self.fail(f"has no array '{name}'")
        values = found.values
        if found.units != units:
            raise self.fail(f"{name} is in '{found.units}'", f"'{units}' is expected")
        fits = values.ndim == len(shape) and all(
            want in (None, size) for want, size in zip(shape, values.shape, strict=True)
        )
        if not fits:
            text = ", ".join("any" if want is None else str(want) for want in shape)
            raise self.fail(f"{name} has shape {values.shape}", f"not ({text})")
        wanted = np.dtype(dtype)
        loses = values.dtype.kind == "f" and wanted.kind != "f"
        if loses or (wanted.kind == "b") != (values.dtype.kind == "b"):
            raise self.fail(f"{name} holds {values.dtype} numbers", f"not {wanted}")
        if wanted.kind in "iu" and values.size:
            info = np.iinfo(wanted)
            if not info.min <= int(values.min()) <= int(values.max()) <= info.max:
                raise self.fail(f"{name} holds numbers beyond {wanted}")
        with np.errstate(invalid="ignore"):  # a signalling NaN
            return values.astype(wanted)

    def table(self, name: str, of: str, columns: int) -> NDArray[Any] | None:
        """Return a small table of finite numbers of an array; None if it has none.

        Parameters
        ----------
        of : the array; columns : as many the table should have.

        Raises
        ------
        FileError
            If it is no such table.
        """
        found = self.items.get(of)
        values = found.tables.get(name) if isinstance(found, Array) else None
        if values is None:
            return None
        if values.ndim != 2 or values.shape[1] != columns:
            shape = f"(any, {columns})"
            raise self.fail(f"{name} of {of} has shape {values.shape}", f"not {shape}")
        if not np.isfinite(values).all():
            raise self.fail(f"{name} of {of} holds numbers that are not finite")
        return values

    def texts(self, name: str, count: int | None = None) -> tuple[str, ...]:
        """Return a list of texts.

        Raises
        ------
        FileError
            If it is not there or not as long as expected.
        """
        found = self.items.get(name)
        if not isinstance(found, (list, tuple)):
            raise self.fail(f"has no texts '{name}'")
        if count is not None and len(found) != count:
            raise self.fail(f"{name} holds {len(found)} texts", f"not {count}")
        return tuple(map(str, found))

    def names(self, name: str, count: int | None = None) -> tuple[str, ...]:
        """Return a list of names: texts that are not too long for one.

        Raises
        ------
        FileError
            If it is not there, not as long as expected, or one of them is too long.
        """
        found = self.texts(name, count)
        longest = max(map(len, found), default=0)
        if longest > LONGEST_NAME:
            wrong = f"{name} holds a name of {longest} characters"
            raise self.fail(wrong, f"{LONGEST_NAME} are the most")
        return found

    def text(self, name: str, default: str | None = None) -> str:
        """Return an attribute that is a text.

        Raises
        ------
        FileError
            If it is not there and has no default, or is no text.
        """
        found = self.attrs.get(name, default)
        if not isinstance(found, str):
            raise self.fail(f"has no text '{name}' in its attributes")
        return found

    def number(self, name: str, default: float | None = None) -> float:
        """Return an attribute that is a number.

        Raises
        ------
        FileError
            If it is not there and has no default, or is no number.
        """
        found = self.attrs.get(name, default)
        if isinstance(found, str) or found is None:
            raise self.fail(f"has no number '{name}' in its attributes")
        return found


def expect_finite(part: Part, unknown: Collection[str] = ()) -> None:
    """Expect finite numbers in a part and all parts in it.

    Parameters
    ----------
    unknown : names of arrays whose numbers may be NaN, not known.

    Raises
    ------
    FileError
        If one is not; it names the array, and the first row that is wrong.
    """
    right = "all its numbers should be finite"
    for name, fact in part.attrs.items():
        if isinstance(fact, float) and not np.isfinite(fact):
            raise part.fail(f"{name} is {fact}", right)
    for name, item in part.items.items():
        if isinstance(item, Part):
            expect_finite(item, unknown)
        elif isinstance(item, Array) and item.values.dtype.kind == "f":
            bad = np.isinf(item.values)
            if name not in unknown:
                bad |= np.isnan(item.values)
            if bad.any():
                at = tuple(int(i) for i in np.argwhere(bad)[0])
                row = f" in row {at[0] + 1}" if at else ""
                raise part.fail(f"{name} holds {item.values[at]:g}{row}", right)


def tree_part(tree: JointTree) -> Part:
    """A joint tree as a part."""
    return Part(
        {
            "kind": tree.kind,
            "side": tree.side,
            "subject": tree.subject,
            "scale": float(tree.scale),
        },
        {
            "bones": tree.bones,
            "joints": tree.joints,
            "parents": Array(tree.parents),
            "offsets": Array(tree.offsets, "m"),
            "hinges": tree.hinges,
            "hinge_bone": Array(tree.hinge_bone),
            "axes": Array(tree.axes),
            "limits": Array(tree.limits, "rad"),
        },
    )


def tree_from(part: Part) -> JointTree:
    """Return the joint tree that a part holds.

    Raises
    ------
    FileError
        If it holds none.
    """
    bones, hinges = part.names("bones"), part.names("hinges")
    size, dofs = len(bones), len(hinges)
    axes = part.array("axes", "", np.float64, dofs, 3)
    if np.any(np.abs(axes) > 2.0):
        raise part.fail("hinge axes should have length 1")
    try:
        return JointTree(
            kind=part.text("kind"),
            side=part.text("side"),
            subject=part.text("subject", ""),
            scale=part.number("scale", 1.0),
            bones=bones,
            joints=part.names("joints", size),
            parents=part.array("parents", "", np.int64, size),
            offsets=part.array("offsets", "m", np.float64, size, 3),
            hinges=hinges,
            hinge_bone=part.array("hinge_bone", "", np.int64, dofs),
            axes=axes,
            limits=part.array("limits", "rad", np.float64, dofs, 2),
        )
    except FileError:
        raise
    except HandcleanError as error:
        raise part.fail(error.wrong) from None
