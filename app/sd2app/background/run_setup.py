"""Set-up of a run: its choices and its data, which is looked into in the background."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import BackgroundModel, LatestRunner
from sd2app.settings import Settings, StoredChoices
from sd2core.files.paths import plain_path


@dataclass(frozen=True)
class Source:
    """Something that a run works on."""

    path: Path
    problem: str = field(default="", kw_only=True)  # why it cannot be used


D = TypeVar("D", bound=Source)


class RunSetup(BackgroundModel, Generic[D]):
    """Choices for a run and the data that it works on, kept from one start to the next.

    The paths of the data are kept in the settings under ``stored``.
    """

    kind: ClassVar[type[Any]]
    """Class of the data, made of its path alone until it has been looked into."""

    changed = Signal()

    def __init__(
        self,
        settings: Settings,
        values: StoredChoices,
        stored: str,
        data: Sequence[D],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._settings, self._values, self._stored = settings, values, stored
        self.data = tuple(data)  # to work on
        self._runner = LatestRunner("data of a run", self, self._take)
        self.refresh()

    def look_into(self, source: D) -> D:
        """Read the content of data from disk, in the background."""
        raise NotImplementedError

    def data_problem(self, nothing: str) -> str:
        """Reason why the data cannot be worked on, ``nothing`` without any; empty if it can."""
        return next((one.problem for one in self.data if one.problem), "" if self.data else nothing)

    def value(self, name: str) -> Any:
        """One of the settings."""
        return self._values[name]

    def set_value(self, name: str, value: Any) -> None:
        """Choose a setting; KeyError if there is no such setting."""
        if self._values.set(name, value):
            self.changed.emit()

    def add(self, *paths: Path) -> None:
        """Add data; a file inside of a recording or of a Zarr group stands for that."""
        plain = [plain_path(path) for path in paths]
        meant = [
            one.parent if one.name in ("zarr.json", "recording.json") else one for one in plain
        ]
        known = {one.path for one in self.data}
        new = [path for path in dict.fromkeys(meant) if path not in known]
        if new:
            self.keep((*self.data, *map(self.kind, new)))

    def remove(self, *paths: Path) -> None:
        """Remove data."""
        self.keep(tuple(one for one in self.data if one.path not in paths))

    def keep(self, data: tuple[D, ...]) -> None:
        """Work on this data, and remember it."""
        self._runner.cancel()
        self.data = data
        self._settings.set_paths(self._stored, [one.path for one in data])
        self.refresh()
        self.changed.emit()

    def refresh(self) -> None:
        """Read the data again: a campaign grows while it is being made."""
        chosen = self.data
        if chosen:
            self._runner.submit(lambda emit: tuple(map(self.look_into, chosen)))

    def _take(self, data: tuple[D, ...]) -> None:
        self.data = data
        self.changed.emit()
