"""What is recorded, and the commands that record or watch a place beside the window."""

from __future__ import annotations

import base64
import contextlib
import json
import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import count
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, Signal
from PySide6.QtGui import QImage

from sd2app.background.latest import ClosingModel
from sd2app.settings import Settings, StoredChoices
from sd2app.widgets.text import quoted
from sd2core.cli.listen import Listen
from sd2core.cli.record import Record
from sd2core.errors import Sd2Error
from sd2core.live.checking import Answer
from sd2core.live.protocol import read_protocol
from sd2core.live.radars import A121, LIVE_RADARS, TI
from sd2core.live.rehearsal import TEST
from sd2core.live.sources import LOOPBACK
from sd2core.options.records import words_of
from sd2core.placements.placements import Place
from sd2core.processes import ONE_THREAD
from sd2core.recording.recording import FILE_NAME, SUFFIX, folder_named

DCA1000, REPLAY = "dca1000", "replay"
_DEFAULTS = {
    "way": "dca1000", "setup": "", "address": "", "replay": "", "beside": "", "camera": "",
    "protocol": "",
}  # fmt: skip
_ENDINGS = {DCA1000: (".cfg", ".json"), TI: (".cfg",)}
"""Configurations of the radars that need one."""


@dataclass(frozen=True)
class ListenRequest:
    """Radar, or capture that is replayed; a camera; where frames go."""

    folder: Path  # the recording, or that of the session
    way: str = REPLAY  # kind of source, one of :func:`ways`
    setup: Path | None = None  # configuration of the radar
    address: str = ""  # of this computer, with or without a port; empty: of this computer alone
    replay: Path | None = None  # capture
    camera: str = ""  # as of `sd2 record`; empty: none
    protocol: str = ""  # of a guided session, likewise
    place: Place | None = None  # of the radar, as seen from the person

    def words(self, *, steered: bool = True) -> list[str]:
        """Words of the ``sd2`` command that does it; ``steered`` by another program, or typed."""
        if self.camera:
            take = Record(
                camera=self.camera,
                radar=self._named_radar,
                setup=self._needed_setup,
                out=self.folder,
                json=steered,
                protocol=self.protocol or None,
                placement=None if self.place is None else astuple(self.place),
                previews=steered and not self.protocol,
            )
            return words_of("record", take)
        command = Listen(
            dca1000=self.address if self.way == DCA1000 else None,
            replay=self.replay if self.way == REPLAY else None,
            radar=None if self.way in (DCA1000, REPLAY) else self.way,
            setup=self._needed_setup,
            out=self.folder,
            json=steered,
            columns=steered,
        )
        return words_of("listen", command)

    def check_words(self, seconds: float) -> list[str]:
        """Words of the ``sd2`` command that says what radar and camera see of the place."""
        look = Record(
            camera=self.camera, radar=self._named_radar, setup=self._needed_setup, check=True,
            seconds=seconds, json=True, previews=True,
        )  # fmt: skip
        return words_of("record", look)

    @property
    def line(self) -> str:
        """Command for a terminal that records the same."""
        return quoted(self.words(steered=False))

    @property
    def needs_setup(self) -> bool:
        """True for a radar that runs with a configuration."""
        return self.way in _ENDINGS

    @property
    def _needed_setup(self) -> Path | None:
        return self.setup if self.needs_setup else None

    @property
    def _named_radar(self) -> str:
        return {DCA1000: self.address or LOOPBACK, REPLAY: str(self.replay)}.get(self.way, self.way)

    @property
    def continues(self) -> bool:
        """True if the recording or the session exists: it goes on."""
        return self.folder.is_dir() if self.protocol else (self.folder / FILE_NAME).is_file()

    @property
    def problem(self) -> str:
        """Problem that keeps a recording from beginning; empty without any."""
        if self.protocol:
            if not self.camera:
                return "Choose a camera: takes of a protocol are filmed."
            try:
                read_protocol(self.protocol)
            except Sd2Error as error:
                return str(error)
        elif self.camera and self.folder.exists():
            return f"{self.folder.name} exists: what is filmed is not continued. Choose another."
        return self.problem_of_radar

    @property
    def problem_of_radar(self) -> str:
        """Problem of the radar alone; empty without any."""
        if self.way == REPLAY:
            if self.replay is None:
                return "Choose the capture that is replayed."
            return "" if self.replay.exists() else f"{self.replay} does not exist."
        if not self.needs_setup:
            return ""
        if self.setup is None:
            return "Choose the .cfg or .json that the radar runs with: samples do not say it."
        if not self.setup.is_file():
            return f"{self.setup} does not exist."
        if self.setup.suffix.lower() not in _ENDINGS[self.way]:
            known = " or .json of mmWave Studio" if self.way == DCA1000 else ""
            return f"{self.setup.name} is no .cfg of the mmWave SDK{known}."
        return ""


def ways() -> tuple[str, ...]:
    """Kinds of sources: a DCA1000, a replay, and radars by name."""
    return DCA1000, REPLAY, TEST, A121, TI, *LIVE_RADARS.names()


class ListenSetup(QObject):
    """Choices, of which all but the recording's name are kept from one time to the next."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._choices = StoredChoices(settings, "listen", _DEFAULTS, {"way": ways()})
        beside = Path(self._choices["beside"] or Path.home())
        beside = beside if beside.is_dir() else Path.home()
        self._place: Place | None = None
        self._recording, self._session = free_name(beside), free_name(beside, "session", "")

    @property
    def chosen(self) -> ListenRequest:
        """Choices so far."""
        chosen = self._choices
        return ListenRequest(
            self._session if chosen["protocol"] else self._recording,
            chosen["way"],
            Path(chosen["setup"]) if chosen["setup"] else None,
            chosen["address"],
            Path(chosen["replay"]) if chosen["replay"] else None,
            chosen["camera"],
            chosen["protocol"],
            self._place,
        )

    def choose(self, name: str, value: object) -> None:
        """Choose ``way``, ``address``, ``setup``, ``replay``, ``camera`` or ``protocol``."""
        if self._choices.set(name, str(value).strip()):
            self.changed.emit()

    def choose_place(self, place: Place | None) -> None:
        """Choose the radar's place as seen from the person, for this time."""
        self._place = place
        self.changed.emit()

    def choose_folder(self, folder: Path) -> None:
        """Choose the folder of the recording or of the session."""
        if self._choices["protocol"]:
            self._session = folder
        else:
            self._recording = folder_named(folder)
        self._choices.set("beside", str(self.chosen.folder.parent))
        self.changed.emit()


def free_name(beside: Path, kind: str = "live", suffix: str = SUFFIX) -> Path:
    """Name in a folder that is not taken, by default of a recording."""
    names = (beside / f"{kind}-{number}{suffix}" for number in count(1))
    return next(path for path in names if not path.exists())


COMMAND = (sys.executable, "-m", "sd2core.cli")
CHECK_S = 60.0
State = Literal["idle", "opening", "starting", "running", "stopping", "stopped", "failed"]

_STOP_MS = 10_000
"""By then, all that waited to be stored is stored, or never will be."""


class SteeredCommand(ClosingModel):
    """A command that tells lines of JSON, and is steered by keys as on a terminal.

    A subclass takes its events.
    """

    changed = Signal()
    warned = Signal(str)

    first_event: ClassVar[str]
    """With it the command has begun its work."""

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: QProcess | None = None
        self.state: State = "idle"
        self.text = ""  # why it failed
        self.request: ListenRequest | None = None

    @property
    def busy(self) -> bool:
        """True until it has ended."""
        return self.state in ("opening", "starting", "running", "stopping")

    def press(self, key: str) -> None:
        """Press a key, as on a terminal."""
        if self._process is not None and self.state == "running":
            self._process.write(key.encode())

    def stop(self) -> None:
        """End it; what is stored is kept."""
        if self._process is not None and self.state != "stopping":
            self._press_stop(self._process)
            self._set_state("stopping")

    def close(self) -> None:
        """End it with what shows it, and wait until all that was received is stored."""
        super().close()
        if (process := self._process) is not None:
            process.blockSignals(True)
            self._press_stop(process)
            if not process.waitForFinished(_STOP_MS):
                process.kill()
                process.waitForFinished(_STOP_MS)
            self._process, self.state = None, "stopped"

    def _launch(self, words: Sequence[str]) -> None:
        self.text = ""
        self._process = process = QProcess(self)
        environment = QProcessEnvironment.systemEnvironment()
        for name, value in {**ONE_THREAD, "PYTHONIOENCODING": "utf-8"}.items():
            environment.insert(name, value)
        process.setProcessEnvironment(environment)
        process.readyReadStandardOutput.connect(self._read)
        process.finished.connect(self._finish)
        process.errorOccurred.connect(self._fail_to_start)
        self._set_state("starting")
        program, *first = self._command
        process.start(program, [*first, *words])

    def _press_stop(self, process: QProcess) -> None:
        process.write(b"q")
        process.closeWriteChannel()

    def _read(self) -> None:
        process = self._process
        while process is not None and process.canReadLine():
            # A line that another program wrote, or half of one, is left out.
            with contextlib.suppress(ValueError, KeyError, TypeError):
                event = json.loads(bytes(process.readLine().data()))
                self._take(event)
                if event["event"] == self.first_event and self.state == "starting":
                    self._set_state("running")
        self._taken()

    def _finish(self, code: int) -> None:
        self._read()
        if self._process is not None:
            said = bytes(self._process.readAllStandardError().data())
            self._end(code, said.decode("utf-8", "replace"))

    def _fail_to_start(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart and self._process is not None:
            why = self._process.errorString()
            self._end(1, f"{self._command[0]} cannot be started: {why}")

    def _take(self, event: dict[str, Any]) -> None:
        raise NotImplementedError

    def _taken(self) -> None:
        """Follow the events that had come."""
        self.changed.emit()

    def _end(self, code: int, error_text: str) -> None:
        if self._process is not None:
            self._process.deleteLater()
            self._process = None
        silent = "It ended without saying why."
        self.text = (error_text.strip().removeprefix("sd2: ") or silent) if code else ""
        self._set_state("failed" if code else "stopped")

    def _set_state(self, state: State) -> None:
        if state != self.state:
            self.state = state
            self.changed.emit()


def picture_in(event: dict[str, Any]) -> NDArray[np.uint8]:
    """RGB picture (H, W, 3) that an event holds as JPEG."""
    image = QImage.fromData(base64.b64decode(event["picture"]))
    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).copy()


class PlaceCheck(SteeredCommand):
    """``sd2 record --check`` beside the window."""

    first_event = "findings"

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.findings: tuple[Answer, ...] = ()
        self.place: Place | None = None  # of a radar beside the camera, as seen from what moves
        self.left_s = 0
        self.picture: NDArray[np.uint8] | None = None  # newest of the camera, RGB (H, W, 3)

    def start(self, request: ListenRequest) -> None:
        """Watch both for a minute."""
        if not self.busy:
            self.findings, self.place, self.left_s = (), None, round(CHECK_S)
            self._launch(request.check_words(CHECK_S))

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "preview":
                self.picture = picture_in(event)
            case "findings":
                self.findings = tuple(Answer(**one) for one in event["findings"])
                self.place = None if event["place"] is None else Place(**event["place"])
                self.left_s = event["left_s"]

    def _end(self, code: int, error_text: str) -> None:
        # The exit code tells bad findings, too.
        super()._end(code if self.left_s else 0, error_text)
