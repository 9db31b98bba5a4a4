"""What a setting is: a field of a dataclass, a key of a TOML table and an option.

A settings class is a frozen dataclass whose fields are ``Annotated[type, "help"]``,
``type`` being ``str``, ``int``, ``float``, ``bool`` or a tuple of one of them
(``tuple[float, ...]`` or ``tuple[float, float]``), each with a default. What a value
may be stands behind the help, `Limits` of a number or `Words` of a text, and
`Formerly` says a name that the setting had and still answers to::

    max_gap_s: Annotated[float, "Longest gap to fill.", Limits(least=0.0)] = 0.5

    def __post_init__(self) -> None:
        expect_limits(self)

So the same limits hold for the class, the file and the option, and help shows them.
What relates several settings is checked in ``__post_init__``, too, which raises
``ValueError("stiff, middle and soft should fall")``.

Settings classes live in modules that import nothing heavy, so that ``handclean COMMAND
--help`` is instant; for the same reason numpy is not used here.
"""

import dataclasses
import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

SCALARS = (str, int, float, bool)

_LARGEST = {int: 2**31 - 1, float: 1e9}
"""No setting is larger, whatever its unit: what is computed from it stays a number
(chosen)."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Bounds of a number, or of every number of a tuple.

    Attributes
    ----------
    least, most : bounds that are still right; None for none.
    above, below : bounds that are no longer right.
    or_zero : whether 0 is right, too, where the bounds leave it out.
    unit : "s", "Hz"; "" where the setting's name says it.
    in_help : whether help shows them; not where nobody comes near.
    """

    least: float | None = None
    most: float | None = None
    above: float | None = None
    below: float | None = None
    or_zero: bool = False
    unit: str = ""
    in_help: bool = True

    def broken(self, value: float, kind: type) -> str:
        """Say what a value should be; "" if it is within the bounds."""
        if self.or_zero and value == 0:
            return ""
        if self._low(value) and self._high(value):
            return ""
        if self.least is not None and self.most is not None:
            either = "be 0 or " if self.or_zero else ""
            low, high = _number(self.least), _number(self.most)
            return f"{either}lie between {low} and {self._with_unit(high)}"
        if not self._low(value):
            return f"be {self._lower(kind)}"
        return f"be {self._upper()}"

    def shown(self, kind: type) -> str:
        """Return the bounds as help shows them; "" where they are no surprise.

        That a count starts at one, or that no length is negative, needs no words.
        """
        usual = self.least in (None, 0, 1) and self.above in (None, 0)
        if not self.in_help or (usual and self.most is None and self.below is None):
            return ""
        if self.least is not None and self.most is not None:
            either = "0 or " if self.or_zero else ""
            low, high = _number(self.least), _number(self.most)
            return f"{either}{low} to {self._with_unit(high)}"
        return ", ".join(part for part in (self._lower(kind), self._upper()) if part)

    def _low(self, value: float) -> bool:
        """Whether a value keeps the lower bound; NaN does not."""
        least = self.least is None or value >= self.least
        return least and (self.above is None or value > self.above)

    def _high(self, value: float) -> bool:
        most = self.most is None or value <= self.most
        return most and (self.below is None or value < self.below)

    def _lower(self, kind: type) -> str:
        if self.above is not None:
            return f"> {self._with_unit(_number(self.above))}"
        if self.least is None:
            return ""
        least = _number(self.least)
        return f"{least} or more" if kind is int else f">= {self._with_unit(least)}"

    def _upper(self) -> str:
        if self.below is not None:
            return f"< {self._with_unit(_number(self.below))}"
        return "" if self.most is None else f"{_number(self.most)} at most"

    def _with_unit(self, number: str) -> str:
        return f"{number} {self.unit}".rstrip()


@dataclass(frozen=True)
class Words:
    """Words that a text may be.

    Attributes
    ----------
    known : the words; command lines are completed with them.
    others : whether it may be another word, which the step understands.
    or_empty : whether it may be empty.
    """

    known: Collection[str]
    others: bool = False
    or_empty: bool = False

    def broken(self, value: str) -> str:
        """Say what a text should be; "" if it is right."""
        if self.others or value in self.known or (self.or_empty and not value):
            return ""
        return f"be one of {', '.join(self.known)}"


@dataclass(frozen=True)
class Formerly:
    """A name that a setting had: files and options that say it are understood.

    Attributes
    ----------
    name : of the field, as it was.
    """

    name: str


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One setting.

    Attributes
    ----------
    name : of the field and of the TOML key; the option is ``--name-with-dashes``.
    kind : str, int, float or bool; of a tuple, what it holds.
    count : 1 for a single value, n for a tuple of n, None for a tuple of any length.
    is_tuple : whether the value is a tuple.
    help : one sentence.
    default : value when nothing is given.
    limits : of a number; without any, only the largest setting there is.
    words : of a text; None where it is open.
    former : the name it had; "" if it always had this one.
    """

    name: str
    kind: type
    count: int | None
    is_tuple: bool
    help: str
    default: Any
    limits: Limits = Limits()
    words: Words | None = None
    former: str = ""

    @property
    def right(self) -> str:
        """What a value should be, in words."""
        name = self.kind.__name__
        if not self.is_tuple:
            return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
        return (
            f"a list of {name}s"
            if self.count is None
            else (f"a list of {self.count} {name}s")
        )

    @property
    def range(self) -> str:
        """The limits as help shows them; "" where there is nothing to show."""
        return self.limits.shown(self.kind)

    def broken(self, value: Any) -> str:
        """Say which limit a value of the right kind breaks; "" if none."""
        for part in value if self.is_tuple else (value,):
            should = ""
            if self.words is not None:
                should = self.words.broken(part)
                part = f"'{part}'"
            elif self.kind in _LARGEST:
                should = self.limits.broken(part, self.kind)
                if not should and math.isnan(part):
                    should = "be a finite number"
                if not should and abs(part) > _LARGEST[self.kind]:
                    return (
                        f"{self.name} should be {_number(_LARGEST[self.kind])} at most"
                    )
            if should:
                return f"{self.name} should {should}, not {part}"
        return ""


def settings_of(cls: type) -> tuple[Setting, ...]:
    """List the settings of a settings class, in the order of its fields.

    Raises
    ------
    TypeError
        If a field is not what a settings class may hold.
    """
    assert dataclasses.is_dataclass(cls), cls
    hints = get_type_hints(cls, include_extras=True)
    return tuple(
        _setting(field, hints[field.name]) for field in dataclasses.fields(cls)
    )


def expect_limits(settings: Any) -> None:
    """Expect every setting of an object to be within the limits its field declares.

    Raises
    ------
    ValueError
        If one is not: "max_gap_s should be >= 0 s, not -1".
    """
    for setting in settings_of(type(settings)):
        if wrong := setting.broken(getattr(settings, setting.name)):
            raise ValueError(wrong)


def _setting(field: "dataclasses.Field[Any]", hint: Any) -> Setting:
    if get_origin(hint) is not Annotated or field.default is dataclasses.MISSING:
        raise TypeError(f"{field.name} should be Annotated[type, 'help'] = default")
    kind, text, *declared = get_args(hint)
    parts: tuple[Any, ...] = (kind,)
    count: int | None = 1
    if get_origin(kind) is tuple:
        parts = get_args(kind)
        count = len(parts)
        if parts[-1] is Ellipsis:
            parts, count = parts[:1], None
    if len(set(parts)) != 1 or parts[0] not in SCALARS:
        raise TypeError(f"{field.name} should be a plain value or a tuple of one kind")
    limits, words, former = Limits(), None, ""
    for one in declared:
        if isinstance(one, Limits) and parts[0] in _LARGEST:
            limits = one
        elif isinstance(one, Words) and parts[0] is str:
            words = one
        elif isinstance(one, Formerly):
            former = one.name
        else:
            raise TypeError(
                f"{field.name} should have Limits, Words or Formerly, not {one!r}"
            )
    return Setting(
        name=field.name,
        kind=parts[0],
        count=count,
        is_tuple=get_origin(kind) is tuple,
        help=text,
        default=field.default,
        limits=limits,
        words=words,
        former=former,
    )


def _number(value: float) -> str:
    return f"{value:.10g}"
