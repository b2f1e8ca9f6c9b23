"""Plug-ins: what other packages add to the program, found by their entry points.

A group of them is read when a name or a file is none of the program's own, or when all are listed;
what is built in goes first. ``docs/how-to/write-a-plug-in.md`` says what each group takes.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from sd2core.errors import Sd2Error
from sd2core.progress import Cancelled

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

SD2_PLUGIN_API = 1
"""Version of what plug-ins are made of; a module with plug-ins has the one it is written for."""

Kind = TypeVar("Kind")


@dataclass(frozen=True, eq=False)
class PlugIn(Generic[Kind]):
    """A plug-in that is installed; nothing of it is imported before it is loaded."""

    group: Group[Kind]
    entry: EntryPoint

    @property
    def name(self) -> str:
        """Name of its entry point."""
        return self.entry.name

    @property
    def package(self) -> str:
        """Package that has it, as pip calls it."""
        return self.entry.dist.name if self.entry.dist else "unknown"

    @property
    def words(self) -> str:
        """Name, group and package, to begin a sentence with."""
        return f"The plug-in {self.name} ({self.group.name}) of the package {self.package}"

    @property
    def _remedy(self) -> str:
        return f"Update {self.package}, or uninstall it"

    def load(self) -> Kind:
        """Import it. Raises Sd2Error, with its package, if it cannot be used."""
        if self.name in self.group.built_in:
            raise Sd2Error(f"{self.words} is called like what is built in", "another name")
        others = (one for one in self.group.entries if one is not self)
        if rival := next((one for one in others if one.name == self.name), None):
            remedy = f"Uninstall {self.package} or {rival.package}"
            raise Sd2Error(f"{self.words} is called like that of {rival.package}", "one", remedy)
        try:
            made = self.entry.load()
        except Sd2Error as error:
            raise Sd2Error(
                f"{self.words} cannot be used: {error.found}", error.expected, self._remedy
            ) from error
        except Exception as error:  # whatever its import meets
            cause = f"{type(error).__name__}: {error}"
            raise Sd2Error(f"{self.words} cannot be loaded ({cause})", "", self._remedy) from error
        version = getattr(sys.modules[self.entry.module], "SD2_PLUGIN_API", None)
        if version != SD2_PLUGIN_API:
            state = "does not say its version" if version is None else f"is of version {version!r}"
            expected = f"SD2_PLUGIN_API = {SD2_PLUGIN_API} in its module"
            raise Sd2Error(f"{self.words} {state}", expected, self._remedy)
        return self._checked(made, self.group.kind)

    def use(self, act: Callable[[Kind], Any], expected: Any) -> Any:
        """Apply a function to it; a failure, or a result of another type, names its package."""
        made = self.load()
        try:
            result = act(made)
        except (Sd2Error, Cancelled, OSError, MemoryError):
            raise
        except Exception as error:
            if os.environ.get("SD2_TRACEBACK") == "1":
                raise
            raise Sd2Error(
                f"{self.words} failed ({type(error).__name__}: {error})",
                remedy=f"{self._remedy}; its makers want what is printed with SD2_TRACEBACK=1 set",
            ) from error
        return self._checked(result, expected)

    def _checked(self, made: Any, expected: Any) -> Any:
        if isinstance(made, expected):
            return made
        wanted = getattr(expected, "__name__", str(expected))
        raise Sd2Error(f"{self.words} gives a {type(made).__name__}", f"a {wanted}", self._remedy)


@dataclass(frozen=True, eq=False)
class Group(Generic[Kind]):
    """Plug-ins of one purpose: entry points of the group ``sd2_studio.NAME``.

    Parameters
    ----------
    name : str
        Name of the group.
    kind : type
        Type of its plug-ins.
    built_in : collection of str
        Names that they cannot have, as what is built in has them.
    """

    name: str
    kind: type[Kind]
    built_in: Collection[str] = ()

    @property
    def entries(self) -> tuple[PlugIn[Kind], ...]:
        """All that are installed, sorted by name and package."""
        return _installed(self)

    def __contains__(self, name: object) -> bool:
        """True if what is built in or a plug-in is called so."""
        return name in self.built_in or any(one.name == name for one in self.entries)

    def find(self, name: str) -> PlugIn[Kind] | None:
        """The plug-in of a name, which may be of no use; None if there is none."""
        return next((one for one in self.entries if one.name == name), None)

    def names(self) -> list[str]:
        """Names of all that are not built in; nothing is imported."""
        names = dict.fromkeys(one.name for one in self.entries)
        return [name for name in names if name not in self.built_in]

    def loaded(self) -> Iterator[tuple[PlugIn[Kind], Kind | Sd2Error]]:
        """All that are installed, each with what it is, or why it cannot be used."""
        for plug_in in self.entries:
            try:
                yield plug_in, plug_in.load()
            except Sd2Error as error:
                yield plug_in, error

    def package_of(self, name: str) -> str:
        """Package that has what is called so; empty for what is built in."""
        plug_in = None if name in self.built_in else self.find(name)
        return "" if plug_in is None else plug_in.package

    def check_installed(self, name: str, package: str, source: object) -> None:
        """Raise Sd2Error if what a file needs is of a package that is not installed."""
        if package and name not in self:
            raise Sd2Error(
                f"{source} needs {name}, a plug-in of the package {package}, which is not there",
                f"{package} beside SD² Studio",
                f"Install it: pip install {package}",
            )


@cache
def _installed(group: Group[Any]) -> tuple[PlugIn[Any], ...]:
    from importlib.metadata import entry_points

    plug_ins = [PlugIn(group, entry) for entry in entry_points(group=f"sd2_studio.{group.name}")]
    return tuple(sorted(plug_ins, key=lambda one: (one.name, one.package)))


def forget() -> None:
    """Look for plug-ins anew when they are asked for next."""
    _installed.cache_clear()
