"""Settings of the window, kept between sessions."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Mapping
from pathlib import Path
from typing import Any, TypeVar

from PySide6.QtCore import QByteArray, QSettings

from sd2core.errors import Sd2Error
from sd2core.files.texts import parse_json

T = TypeVar("T")

MAX_RECENT = 10
DEFAULT_TOLERANCE = 0.05


class _Memory:
    """Stands in for QSettings; nothing of it is kept."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {}
        self.value, self.setValue = self._values.get, self._values.__setitem__


class Settings:
    """Typed access to the user's settings."""

    @classmethod
    def forgetful(cls) -> Settings:
        """Settings that start empty and are not kept."""
        return cls(_Memory())

    def __init__(self, store: QSettings | _Memory | None = None) -> None:
        self._store: Any = QSettings("SD2 Studio", "SD2 Studio") if store is None else store

    @property
    def recent(self) -> list[tuple[Path, ...]]:
        """Paths opened together lately, the newest first."""
        return [tuple(map(Path, str(paths).split("\n"))) for paths in self.paths("recent")]

    def add_recent(self, *paths: Path) -> None:
        """Remember paths that are opened together as the newest."""
        groups = [paths, *(known for known in self.recent if known != paths)]
        self.set_paths("recent", [Path("\n".join(map(str, one))) for one in groups[:MAX_RECENT]])

    def choice(self, name: str) -> bool | None:
        """Boolean that the user chose; None where the user left it open."""
        return None if self._store.value(name) is None else self.stored(name, False)

    def stored(self, name: str, default: T) -> T:
        """A value of the default's type; the default where what is stored is none."""
        value, kind = self._store.value(name), type(default)
        if kind is bool and value is not None:
            value = str(value).lower() == "true"  # it may have been stored as text
        try:
            return default if value is None else kind(value)  # type: ignore[call-arg]
        except (TypeError, ValueError):
            return default

    def table(self, name: str) -> dict[str, Any]:
        """A table that was kept as JSON; empty where it is none, or is damaged."""
        try:
            table = parse_json(self.stored(name, "{}"), "The setting", "a table")
        except Sd2Error:
            return {}
        return table if isinstance(table, dict) else {}

    def keep_table(self, name: str, table: Mapping[str, Any]) -> None:
        """Remember a table."""
        self.set_value(name, json.dumps(table))

    def paths(self, name: str) -> list[Path]:
        """A list of paths."""
        value = self._store.value(name, [])
        paths = [value] if isinstance(value, str) and value else list(value or [])
        return [Path(path) for path in paths]

    def set_paths(self, name: str, paths: list[Path]) -> None:
        """Remember a list of paths."""
        self._store.setValue(name, [str(path) for path in paths])

    def set_value(self, name: str, value: object) -> None:
        """Remember a value."""
        self._store.setValue(name, value)

    @property
    def dark(self) -> bool | None:
        """Theme the user chose, or None to follow the system."""
        return self.choice("dark")

    @dark.setter
    def dark(self, dark: bool | None) -> None:
        self._store.setValue("dark", dark)

    @property
    def tolerance(self) -> float:
        """Error of a map that the user accepts: relative L1 after smoothing."""
        tolerance = self.stored("tolerance", DEFAULT_TOLERANCE)
        return tolerance if 0 < tolerance <= 1 else DEFAULT_TOLERANCE

    @tolerance.setter
    def tolerance(self, tolerance: float) -> None:
        self._store.setValue("tolerance", tolerance)

    def layout(self, name: str) -> QByteArray | None:
        """Saved geometry of a part of the window."""
        value = self._store.value(f"layout/{name}")
        return value if isinstance(value, QByteArray) else None

    def set_layout(self, name: str, state: QByteArray) -> None:
        """Remember the geometry of a part of the window."""
        self._store.setValue(f"layout/{name}", state)


class StoredChoices:
    """Choices kept under ``place`` in the settings, of the types of their defaults.

    A default also replaces a stored value of another type, or one that is not among the
    ``known`` values of its choice.
    """

    def __init__(
        self,
        settings: Settings,
        place: str,
        defaults: Mapping[str, Any],
        known: Mapping[str, Container[Any]] | None = None,
    ) -> None:
        self._settings, self._place = settings, place
        self.defaults = dict(defaults)
        self._values = {
            name: settings.stored(f"{place}/{name}", default) for name, default in defaults.items()
        }
        for name, values in (known or {}).items():
            if self._values[name] not in values:
                self._values[name] = self.defaults[name]

    def __getitem__(self, name: str) -> Any:
        """Value of a choice; raises KeyError if there is none of that name."""
        return self._values[name]

    @property
    def others(self) -> dict[str, Any]:
        """Choices that differ from their defaults."""
        return {name: value for name, value in self._values.items() if value != self.defaults[name]}

    def set(self, name: str, value: Any) -> bool:
        """Set a choice; True if its value changed. Raises KeyError as :meth:`__getitem__`."""
        kind: Callable[[Any], Any] = type(self.defaults[name])
        if kind(value) == self._values[name]:
            return False
        self._values[name] = kind(value)
        self._settings.set_value(f"{self._place}/{name}", kind(value))
        return True
