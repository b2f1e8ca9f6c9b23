"""Choices by name, kept from one start to the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sd2app.settings import Settings


class StoredChoices:
    """Values of the types of their defaults.

    Parameters
    ----------
    settings : Settings
    place : str
        Under which they are kept.
    defaults : mapping
        By name; also where what is kept is of another type, or not among those known.
    known : mapping, optional
        Values that there are, of choices that have no others.
    """

    def __init__(
        self,
        settings: Settings,
        place: str,
        defaults: Mapping[str, Any],
        known: Mapping[str, Sequence[Any]] | None = None,
    ) -> None:
        self._settings, self._place = settings, place
        self.defaults = dict(defaults)
        self._values = {
            name: settings.flag(f"{place}/{name}", default)
            if isinstance(default, bool)
            else settings.stored(f"{place}/{name}", default)
            for name, default in defaults.items()
        }
        for name, values in (known or {}).items():
            if self._values[name] not in values:
                self._values[name] = self.defaults[name]

    def __getitem__(self, name: str) -> Any:
        """One of them; raises KeyError when there is no such choice."""
        return self._values[name]

    @property
    def others(self) -> dict[str, Any]:
        """Those that are not as they are by default."""
        return {name: value for name, value in self._values.items() if value != self.defaults[name]}

    def set(self, name: str, value: Any) -> bool:
        """Choose; whether that is another value. Raises KeyError as :meth:`__getitem__`."""
        kind: Callable[[Any], Any] = type(self.defaults[name])
        if kind(value) == self._values[name]:
            return False
        self._values[name] = kind(value)
        self._settings.set_value(f"{self._place}/{name}", kind(value))
        return True
