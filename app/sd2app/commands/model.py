"""Forms of commands: what is typed into them, the runs that they start, and a mesh made smooth."""

from __future__ import annotations

import os
import shlex
from argparse import ArgumentTypeError
from collections.abc import Callable, Sequence
from dataclasses import MISSING
from functools import cached_property
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import CommandRun
from sd2app.background.runs import Runs, free_folder
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2app.widgets.text import quoted
from sd2core.cli import build_parser
from sd2core.cli.command_parser import Command, commands_of
from sd2core.cli.refine import Refine
from sd2core.errors import Sd2Error
from sd2core.files.paths import free_path, plain_path, user_data
from sd2core.files.recording_json import MeshReading
from sd2core.files.resources import is_bundled
from sd2core.files.tables import capitalised
from sd2core.io.mesh_models import is_estimate
from sd2core.options.records import Option, OptionRecord, typed_options, words_of
from sd2core.runs.command_folder import COMMAND_IN_FOLDER, last_output

_OF_TERMINALS = {"json", "progress_json"}
_OPENED = ("recording", "recordings", "mesh", "path", "paths")
"""Names of arguments that the open recording is for."""


class AnyCommandRun(CommandRun):
    """A command under way, or one that has ended."""

    facts = ""  # what it printed

    def inspect(self) -> str:
        """Read the end of what it printed, but for lines for programs."""
        lines = last_output(self.folder.output).splitlines()
        return "\n".join(line for line in lines if not line.startswith('{"event"'))


class CommandForms(Runs[AnyCommandRun]):
    """A command that is chosen, what is typed for it, and runs of commands.

    ``command`` runs ``sd2`` commands in a folder. ``folder`` holds the runs.
    """

    monitor, remembered = AnyCommandRun, "commands/run"
    shown_by = "File → Any command…"

    def __init__(
        self,
        settings: Settings,
        parent: QObject,
        folder: Path | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
    ) -> None:
        super().__init__(settings, folder or user_data("commands"), parent, command)
        self._texts: dict[str, dict[str, str]] = {}  # by the command's name
        self._chosen = ""
        self.opened: Path | None = None  # what is open in the window

    # --- what is known ------------------------------------------------------------------------

    @cached_property
    def commands(self) -> dict[str, Command]:
        """All commands, by their names."""
        return {one.name: one for one in commands_of(build_parser()[0])}

    @property
    def chosen(self) -> Command:
        """The command whose form is shown."""
        return self.commands[self._chosen or next(iter(self.commands))]

    @property
    def options(self) -> tuple[Option, ...]:
        """Options of the chosen command."""
        every = typed_options(self.chosen.record)
        return tuple(one for one in every if one.name not in _OF_TERMINALS)

    def text(self, option: Option) -> str:
        """Text typed for an option; empty: as by default. A switch that is on is ``yes``."""
        return self._typed.get(option.dest, "")

    @property
    def missing(self) -> Option | None:
        """The first option that has to be typed and is not yet."""
        needed = (one for one in self.options if one.default is MISSING and not one.section)
        return next((one for one in needed if not self.text(one).strip()), None)

    @property
    def wrong(self) -> str:
        """Fault of what is typed, whatever is missing; empty without any."""
        return _refusal(self._values)

    @property
    def problem(self) -> str:
        """Why the command cannot be started as it stands; empty where it can."""
        return _refusal(lambda: self.record)

    @property
    def record(self) -> OptionRecord:
        """The command as it is typed; Sd2Error where that is wrong, or something is missing."""
        values = self._values()
        if (missing := self.missing) is not None:
            raise Sd2Error(f"{name_of(missing)} is missing", missing.words)
        return self.chosen.record(**values)

    def _values(self) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for option in self.options:
            if text := self.text(option):
                place = values.setdefault(option.section, {}) if option.section else values
                place[option.name] = _read(option, text)
        return values

    @property
    def words(self) -> list[str]:
        """The command's words."""
        return words_of(self.chosen.name, self.record)

    @property
    def line(self) -> str:
        """The command for a terminal; Sd2Error as :attr:`record`."""
        return quoted(self.words)

    # --- changes ------------------------------------------------------------------------------

    def choose(self, name: str) -> None:
        """Show the form of a command, with what was typed into it before."""
        self._chosen = name
        self.select(None)
        for option in self.options:
            wanted = option.place.argument and option.name in _OPENED and not self.text(option)
            if self.opened is not None and wanted:
                several = bool(option.place.many)
                path = str(self.opened)
                self._typed[option.dest] = shlex.quote(path) if several else path
        self.changed.emit()

    def fill(self, record: OptionRecord) -> None:
        """Show the form of a command with everything typed that a record says."""
        named = (name for name, one in self.commands.items() if one.record is type(record))
        self._chosen = next(named)
        self.select(None)
        self._texts[self._chosen] = {
            option.dest: words[-1].removeprefix(f"{option.flags[0]}=")
            for option in self.options
            if (words := option.written(option.of(record)))
        }
        self.changed.emit()

    def set_text(self, option: Option, text: str) -> None:
        """Type something for an option."""
        self._typed[option.dest] = text
        self.changed.emit()

    def start(self) -> None:
        """Start the command; Sd2Error if it cannot be, OSError if its folder cannot be made."""
        words, record = self.words, self.record
        if any(one.name == "progress_json" for one in typed_options(self.chosen.record)):
            words.append("--progress-json")
        path = free_folder(self._folder, self.chosen.name, ())
        paths = {name: getattr(record, name, None) for name in ("mesh", "out")}
        about = {name: str(plain_path(path)) for name, path in paths.items() if path is not None}
        self.start_command(path, words, what=self.chosen.name, **about)

    @property
    def _typed(self) -> dict[str, str]:
        return self._texts.setdefault(self.chosen.name, {})


def name_of(option: Option) -> str:
    """Name of an option in a form."""
    return capitalised(option.name.replace("_", " "))


def _refusal(attempt: Callable[[], object]) -> str:
    try:
        attempt()
    except Sd2Error as error:
        return str(error)
    return ""


def _read(option: Option, text: str) -> Any:
    """Value of what was typed; several are separated by spaces, and ``~`` is one's own folder."""
    if option.kind is bool:
        return True
    if option.kind is Path and text.startswith("~"):
        text = os.path.expanduser(text)
    try:
        texts = shlex.split(text) if option.place.many else [text]
        values = tuple((option.read or str)(one) for one in texts)
    except (ArgumentTypeError, ValueError) as error:
        raise Sd2Error(f"{name_of(option)}: {error}") from None
    return values if option.place.many else values[0]


_ENDING = "-smooth.zarr"


class MeshRefining:
    """Fills in the form of ``sd2 refine``, and puts what it made in the place of the mesh."""

    def __init__(self, session: Session, forms: CommandForms) -> None:
        self.document, self._edits, self._forms = session.document, session.edits, forms
        forms.ended.connect(self.take)

    @property
    def why_not(self) -> str:
        """Reason why there is nothing to make smooth; empty where there is a mesh."""
        mesh = self.document.mesh
        if mesh is None:
            return "There is no mesh to make smooth: add one first (File → Add to this recording…)"
        if mesh.uncertainty is not None:
            return "This mesh is smooth already: of `sd2 fit`, or made smooth before"
        return ""

    def fill(self) -> None:
        """Show the form with the mesh as it is read now."""
        content = self.document.content
        assert content is not None
        recording, mesh = content.recording, content.recording.mesh
        assert mesh is not None
        read = recording.mesh_reading.options()
        folder = recording.folder if content.saved else mesh.parent
        folder = Path.home() if is_bundled(folder) else folder
        estimated = is_estimate(mesh)
        rate = read.pop("frames_per_s", None)
        if not estimated:  # the command refuses what would change nothing
            read.pop("focal_px", None)
        self._forms.fill(
            Refine(
                mesh=plain_path(mesh),
                out=free_path(folder, f"{mesh.stem}{_ENDING}", "again", reserved=""),
                video=recording.video if estimated else None,
                faces=recording.faces,
                fps=rate,
                **read,
            )
        )

    def can_take(self, run: AnyCommandRun) -> bool:
        """True for a mesh that was made smooth from the one that is open."""
        recording, made = self.document.recording, run.about
        if run.phase != "finished" or made.get("what") != "refine" or recording is None:
            return False
        return recording.mesh is not None and made.get("mesh") == str(plain_path(recording.mesh))

    def take(self, run: AnyCommandRun) -> None:
        """Put the smooth mesh in the place of the open one, as a step of the history."""
        recording = self.document.recording
        if recording is None or not self.can_take(run):
            return
        # Smooth vertices are placed already; the focal length lays them over the video.
        reading = MeshReading(focal_px=recording.mesh_reading.focal_px)
        smooth = {"mesh": Path(run.about["out"]), "faces": None, "mesh_reading": reading}
        self._edits.read_mesh("Make mesh smooth", smooth)
