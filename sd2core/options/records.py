"""Records of options: what each field says of itself, for all that offer it.

A record is a frozen dataclass by inheriting from :class:`OptionRecord`; it has no decorator. Type,
bounds and default of an option stand at its field; its words are in the docstring's ``Parameters``,
with what a value is called after the name, and without the default where that is a number or a
choice, or with ``{default}`` in its place. A command of ``sd2`` is such a record, and takes options
from others by inheriting from them, and may have other words for them; a section of a plan is one,
too.
"""

from __future__ import annotations

import math
import re
import types
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields, is_dataclass
from functools import cache
from inspect import cleandoc, get_annotations
from pathlib import Path
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    NoReturn,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from sd2core.errors import Sd2Error
from sd2core.files.tables import capitalised
from sd2core.options.bounds import Bounds
from sd2core.options.kinds import Typed, number_reader

Note = TypeVar("Note")


class OptionError(Sd2Error, ValueError):
    """Options that cannot be; a plan that is read says where in it they stand."""


# Named tuples, which are made in a third of the time of a dataclass.
class Place(NamedTuple):
    """How a field is typed where it is not an option of its own name with one value.

    Parameters
    ----------
    flags : tuple of str
        Names of the option, the first being the usual one.
    argument : bool
        True if it has a place and no name.
    one_of : str
        Of the options with the same word here only one may be given.
    needed : bool
        True if one of these must be given.
    many : {"", "together", "again"}
        Of a field that is a tuple: its values stand after one another, or each after the option.
    bare : object
        Value of the option where it is typed without one; None: it needs one.
    endings : tuple of str
        Of a file that is written: how its name may end.
    typed : bool
        False if it is no option of a command.
    """

    flags: tuple[str, ...] = ()
    argument: bool = False
    one_of: str = ""
    needed: bool = False
    many: Literal["", "together", "again"] = ""
    bare: Any = None
    endings: tuple[str, ...] = ()
    typed: bool = True


ARGUMENT = Place(argument=True)
ARGUMENTS = Place(argument=True, many="together")
NOT_TYPED = Place(typed=False)
"""Of a field for files and programs."""


class Section(NamedTuple):
    """Marks a mapping of those options of another record that are given."""

    kind: type


class Group(NamedTuple):
    """Heading that the options of a record, or one of them, stand under, and a sentence below."""

    title: str
    text: str | None = None


# The methods that `dataclass` compiles for each class are those of OptionRecord: to compile them
# took a fifth of the time of a command's help.
_make_dataclass = dataclass(kw_only=True, init=False, repr=False, eq=False)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
class OptionRecord:
    """Base of records of options: their fields are given by name, and checked when one is made."""

    # A class may have a GROUP for its fields, but for those that have one from a base. Without
    # a type these are no fields, nor what is taken for one.
    __pydantic_config__ = {"extra": "forbid", "strict": True}  # noqa: RUF012

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(cls) -> None:
        _make_dataclass(cls)

    def __init__(self, **values: Any) -> None:
        own, kind = vars(self), type(self).__name__
        for one in fields(self):
            if one.name in values:
                own[one.name] = values.pop(one.name)
            elif one.default_factory is not MISSING:
                own[one.name] = one.default_factory()
            elif one.default is not MISSING:
                own[one.name] = one.default
            else:
                raise TypeError(f"{kind} is made without {one.name}")
        if values:
            raise TypeError(f"{kind} has no {next(iter(values))}")
        self.__post_init__()

    def __post_init__(self) -> None:
        check(self)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise FrozenInstanceError(f"{type(self).__name__}.{name} stays as it is")

    def __delattr__(self, name: str) -> NoReturn:
        raise FrozenInstanceError(f"{type(self).__name__}.{name} stays as it is")

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash(tuple(getattr(self, one.name) for one in fields(self)))

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in vars(self).items())
        return f"{type(self).__name__}({values})"


_make_dataclass(OptionRecord)


class Option(NamedTuple):
    """A field of a record, as what offers it wants to know it."""

    name: str
    kind: Any  # int, float, bool, str, Path, tuple; of one value where there are several
    default: Any  # MISSING where it must be given
    words: str  # of the help, with the default
    called: str | None  # a value, as in "--bins N"
    bounds: Bounds  # without ends where none are stated
    typed: Typed | None
    choices: tuple[Any, ...]
    place: Place
    group: Group | None
    section: str = ""  # field of the command's record with what is given of this one's

    @property
    def flags(self) -> tuple[str, ...]:
        """Names as they are typed; of an argument its own."""
        if self.place.argument:
            return (self.name,)
        return self.place.flags or (flag(self.name),)

    @property
    def read(self) -> Callable[[str], Any] | None:
        """Function that reads a typed value, or None for a text."""
        if self.typed is not None:
            return self.typed.read
        if self.kind in (int, float) and not self.choices:
            return number_reader(self.bounds)
        return self.kind if self.kind in (int, str, Path) else None

    @property
    def sentence(self) -> str:
        """The words, beginning with a capital."""
        return capitalised(self.words)

    @property
    def dest(self) -> str:
        """Name that no option of another section of the command has."""
        return f"{self.section}.{self.name}" if self.section else self.name

    def of(self, record: OptionRecord) -> Any:
        """Value in a record, None where it is not given in its section."""
        if self.section:
            return getattr(record, self.section).get(self.name)
        return getattr(record, self.name)

    def values(self, value: Any) -> tuple[Any, ...]:
        """The values of an option that takes several, or its only one."""
        return tuple(value) if self.place.many else (value,)

    def written(self, value: Any, *, always: bool = False) -> list[str]:
        """The words that say this value; of a value as it is by default there are none."""
        if not self.place.typed or value is None or value is False:
            return []
        if value == self.default and not (self.place.argument or self.section or always):
            return []
        if (value is True and self.kind is bool) or value == self.place.bare:
            return [self.flags[0]]
        texts = [self.typed.write(one) if self.typed else str(one) for one in self.values(value)]
        if self.place.argument:  # a file that begins as an option does
            return [f"./{text}" if text.startswith("-") else text for text in texts]
        if self.place.many == "together":
            return [self.flags[0], *texts]
        return [word for text in texts for word in _with_value(self.flags[0], text)]


def _with_value(name: str, text: str) -> tuple[str, ...]:
    """Words of an option; a text that begins as one does is not mistaken for it.

    Of negative numbers the command line sees to that, so that they stand as they are read best.
    """
    return (f"{name}={text}",) if re.match(r"-(?!\.?\d)", text) else (name, text)


def typed_options(kind: type[OptionRecord]) -> tuple[Option, ...]:
    """Options of a record that a command has."""
    return tuple(one for one in options_of(kind) if one.place.typed)


def flag(name: str) -> str:
    """Option of a name as it is typed: ``--v-max`` of ``v_max``."""
    return f"--{name.replace('_', '-')}"


def options_of(kind: type[OptionRecord]) -> tuple[Option, ...]:
    """Options of a record: its own, then those of its bases."""
    read_once: Any = _options_of  # of a class, which has a hash whatever its records have
    return read_once(kind)


def option_named(kind: type[OptionRecord], name: str) -> Option:
    """The option of a record with this name."""
    return next(one for one in options_of(kind) if one.name == name)


@cache
def _options_of(kind: Any) -> tuple[Option, ...]:
    return tuple(_options(kind))


def given(record: Any, names: Iterable[str]) -> dict[str, Any]:
    """Values of the named options that the command has and the user gave."""
    values = {name: getattr(record, name, None) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def given_flags(record: OptionRecord, names: Iterable[str]) -> list[str]:
    """Flags of the named options that the user gave, as they are typed."""
    flags = {one.name: one.flags[0] for one in options_of(type(record))}
    return [flags[name] for name in given(record, names)]


def changed(record: OptionRecord) -> list[str]:
    """Names of the options that are not as by default."""
    options = [one for one in options_of(type(record)) if not one.section]
    return [one.name for one in options if one.of(record) != one.default]


def given_of(record: OptionRecord) -> dict[str, Any]:
    """The options that are not as by default, for a section of a command."""
    return {name: getattr(record, name) for name in changed(record)}


def changed_flags(record: OptionRecord, names: Collection[str] = ()) -> list[str]:
    """Options that are not as by default, as they are typed; some by their names, or all."""
    flags = []
    for option in typed_options(type(record)):
        value = option.of(record)
        is_changed = value is not None and (option.section or value != option.default)
        if is_changed and (not names or option.name in names):
            flags.append(option.flags[0])
    return flags


def check(record: OptionRecord) -> None:
    """Refuse a value that its field does not allow, and two of which one may be given."""
    rivals: dict[str, list[Option]] = {}
    for option in options_of(type(record)):
        value = option.of(record)
        is_given = value is not None and value != option.default
        if is_given:
            for one in option.values(value):
                _check_value(option, one)
        if option.place.one_of and (is_given or option.place.needed):
            known = rivals.setdefault(option.place.one_of, [])
            known += [option] * is_given
    for name, given in rivals.items():
        if len(given) > 1:
            first, second = (one.flags[0] for one in given[:2])
            raise OptionError(f"{first} is given with {second}", "one of them")
        if not given:
            every = [one.flags[0] for one in options_of(type(record)) if one.place.one_of == name]
            raise OptionError(f"None of {', '.join(every)} is given", "one of them")


def _check_value(option: Option, value: Any) -> None:
    if option.choices:
        fits = value in option.choices
        words = f"one of {', '.join(map(str, option.choices))}"
    elif option.kind in (int, float):
        bounds = option.bounds
        number = isinstance(value, int | float) and not isinstance(value, bool)
        fits, words = number and math.isfinite(value) and value in bounds, bounds.words
    else:
        return
    if not fits:
        raise OptionError(f"{option.name} is {value!r}", words)


def words_of(command: str, record: OptionRecord, named: Collection[str] = ()) -> list[str]:
    """Words of ``sd2`` that say the same, command first.

    What is as by default is left out, but for the ``named`` options.
    """
    arguments: list[str] = []
    words: list[str] = []
    for option in options_of(type(record)):
        written = option.written(option.of(record), always=option.name in named)
        (arguments if option.place.argument else words).extend(written)
    return [*command.split(), *arguments, *words]


def _options(kind: type, section: str = "") -> Iterator[Option]:
    hints = get_type_hints(kind, include_extras=True)
    ready = {one.name: one for one in fields(kind)}
    for name, group in _declared(kind).items():
        plain, notes = _unwrapped(hints[name])
        if inner := _note(notes, Section):
            yield from _options(inner.kind, name)
            continue
        place = _note(notes, Place) or Place()
        if place.many:
            plain, of_each = _unwrapped(get_args(plain)[0])
            notes += of_each
        choices = get_args(plain) if get_origin(plain) is Literal else ()
        factory = ready[name].default_factory
        default = ready[name].default if factory is MISSING else factory()
        descriptions = [texts[name] for texts in map(_documented, kind.__mro__) if name in texts]
        if not descriptions:
            raise Sd2Error(
                f"The docstring of {kind.__name__} says nothing of {name}", "words on each option"
            )
        called, words = descriptions[0]
        if _ends_with_default(default, choices):
            text = str(default) if choices else f"{default:g}"
            words = words.replace("{default}", text)
            if not re.search(r"\(default|default\)", words):
                words += f" (default: {text})"
        yield Option(
            name,
            type(choices[0]) if choices else get_origin(plain) or plain,
            default,
            words,
            called,
            _note(notes, Bounds) or Bounds(whole=plain is int),
            _note(notes, Typed),
            choices,
            place,
            _note(notes, Group) or group,
            section,
        )


def _note(notes: list[Any], kind: type[Note]) -> Note | None:
    return next((note for note in notes if isinstance(note, kind)), None)


def _ends_with_default(default: Any, choices: tuple[Any, ...]) -> bool:
    """True if the words of an option end with its default."""
    number = isinstance(default, int | float) and not isinstance(default, bool)
    return number or (bool(choices) and default in choices)


def _declared(kind: type) -> dict[str, Group | None]:
    """The fields, own ones first, and the heading of each."""
    own, group = get_annotations(kind), vars(kind).get("GROUP")
    headings = dict.fromkeys((one.name for one in fields(kind) if one.name in own), group)
    for base in kind.__bases__:
        if is_dataclass(base):
            for name, nearer in _declared(base).items():
                headings.setdefault(name, nearer or group)
    return headings


@cache
def _documented(kind: Any) -> Mapping[str, tuple[str | None, str]]:
    """Name of the value and words of each field that a docstring describes."""
    _, _, text = cleandoc(kind.__doc__ or "").partition("Parameters\n----------\n")
    texts: dict[str, tuple[str | None, str]] = {}
    for block in re.split(r"\n(?=\S)", text.partition("\n\n")[0]):
        head, _, body = block.partition("\n")
        names, _, called = map(str.strip, head.partition(" : "))
        for name in names.split(", "):
            texts[name] = called or None, " ".join(body.split())
    return texts


def _unwrapped(hint: Any) -> tuple[Any, list[Any]]:
    """Type and notes of ``Annotated[…] | None`` in any nesting; the outer notes first."""
    notes: list[Any] = []
    while True:
        if get_origin(hint) is Annotated:
            hint, *more = get_args(hint)
            notes += reversed(more)
        elif get_origin(hint) in (Union, types.UnionType) and type(None) in get_args(hint):
            hint = next(one for one in get_args(hint) if one is not type(None))
        else:
            return hint, notes
