"""Dialog Record: a camera, a radar or a capture, and the recording that grows."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSignalBlocker
from PySide6.QtWidgets import QLabel, QLineEdit, QMessageBox, QToolButton, QWidget

from sd2app.live.check_dialog import CheckDialog
from sd2app.live.process import PlaceCheck
from sd2app.live.protocol_dialog import TOML, ProtocolDialog
from sd2app.live.protocol_draft import ProtocolDraft
from sd2app.live.setup import DCA1000, REPLAY, ListenSetup, ways
from sd2app.manual.help import with_help
from sd2app.widgets.dialogs import Dialog, accepted, accepting, ask_file, ask_new
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import STRETCH, column_of, form_of, row_of
from sd2app.widgets.panel import ElidedLabel, copy_button, outlined, say, sentence
from sd2core.errors import Sd2Error
from sd2core.io.kinds import RADAR_SUFFIXES
from sd2core.io.readers import RADAR_FILES, suffixes_of
from sd2core.live.protocol import PAPER
from sd2core.live.radars import A121, TI
from sd2core.live.rehearsal import TEST

_SETUPS = "Configuration of the radar (*.cfg *.json);;All files (*)"
_CAPTURES = "Radar captures and recordings ({} radar.npy recording.json live.json);;All files (*)"
_VIDEOS = "Videos (*.mp4 *.mov *.mkv *.avi *.webm);;All files (*)"
_WAYS = {
    DCA1000: "a TI radar with a DCA1000 that runs",
    TI: "a TI board with a DCA1000, started from here",
    REPLAY: "a capture, replayed at its own rate",
    TEST: "a test radar (simulated)",
    A121: "an Acconeer A121",
}
_CAMERAS = {
    "": "none",
    "0": "the first camera",
    "1": "the second camera",
    "test": "test pictures (simulated)",
    "file": "a video, played at its rate…",
}
_PROTOCOLS = {
    "": "none: one recording",
    PAPER: "the paper's: six people, four gestures",
    "file": "a file…",
}
_NONE = "none chosen"


def _captures() -> str:
    suffixes = sorted(RADAR_SUFFIXES | suffixes_of(RADAR_FILES))
    return _CAPTURES.format(" ".join(f"*{one}" for one in suffixes))


class ListenDialog(Dialog):
    """A view of :class:`ListenSetup`."""

    def __init__(self, setup: ListenSetup, parent: QWidget) -> None:
        super().__init__("Record", parent)
        self._setup = setup
        known = {way: _WAYS.get(way, f"{way} (plug-in)") for way in ways()}
        self._way = Choice(
            "Where frames come from", self, known, lambda way: setup.choose("way", way)
        )
        self._camera = Choice("Camera", self, dict(_CAMERAS), self._choose_camera)
        self._protocol = Choice("Protocol", self, dict(_PROTOCOLS), self._choose_protocol)
        self._file = ElidedLabel(self)
        self._folder = ElidedLabel(self)
        self._address = QLineEdit(setup.chosen.address, self)
        self._address.setAccessibleName("Address of this computer")
        self._address.setPlaceholderText("127.0.0.1:4098, which only this computer reaches")
        self._address.textEdited.connect(lambda text: setup.choose("address", text))
        self._hint = sentence(
            "A DCA1000 sends to 192.168.33.30, unless it is told otherwise: the network card\n"
            "it is plugged into must have that address, and it is what you give here."
        )
        self._hint.setWordWrap(False)  # in a form, what wraps gets too much room or too little
        self._message = sentence("")
        self._file_name, self._address_name = QLabel(self), QLabel("Address", self)
        buttons, self._begin = accepting(self, "Record")
        self._file_button = self._button(self._ask_file)
        tip = "Say what camera and radar see of somebody who walks, and where the radar is"
        self._place = ElidedLabel(self)
        self._check = outlined("Check…", tip, self._check_place, self)
        forget = partial(setup.choose_place, None)
        self._forget = outlined("✕", "Forget the place", forget, self, name="Forget", look="")
        tip = "Make a protocol, the paper's to begin with, or edit the one that is chosen"
        edit = outlined("Edit…", tip, self._edit_protocol, self)
        form = form_of(
            ("Camera", self._camera),
            ("Radar", self._way),
            (self._file_name, row_of((self._file, 1), self._file_button, spacing_px=8)),
            (self._address_name, self._address),
            ("", self._hint),
            ("Place", row_of((self._place, 1), self._forget, self._check, spacing_px=8)),
            ("Protocol", row_of((self._protocol, 1), edit, spacing_px=8)),
            ("Into", row_of((self._folder, 1), self._button(self._ask_folder), spacing_px=8)),
            gaps_px=(16, 12),
        )
        self._copy = copy_button(lambda: setup.chosen.line, self)
        foot = with_help("Record", buttons, self._copy)
        self.setLayout(column_of(form, STRETCH, self._message, foot, spacing_px=16, margins_px=16))
        setup.changed.connect(self._refresh)
        self._refresh()
        self.resize(620, self.sizeHint().height())

    def _button(self, run: Callable[[], None]) -> QToolButton:
        return outlined("Choose…", "Choose another", run, self)

    def _refresh(self) -> None:
        chosen = self._setup.chosen
        is_radar = chosen.way == DCA1000
        self._way.show_value(chosen.way)
        _show_file(self._camera, chosen.camera)
        _show_file(self._protocol, chosen.protocol)
        for part in (self._file_name, self._file, self._file_button):
            part.setVisible(chosen.needs_setup or chosen.way == REPLAY)
        self._file_name.setText("Configuration" if chosen.needs_setup else "Capture")
        file = chosen.setup if chosen.needs_setup else chosen.replay
        self._file.setText(str(file) if file is not None else _NONE)
        for widget in (self._address_name, self._address, self._hint):
            widget.setVisible(is_radar)
        self._folder.setText(str(chosen.folder))
        self._check.setEnabled(bool(chosen.camera) and not chosen.problem_of_radar)
        self._forget.setVisible(chosen.place is not None and bool(chosen.camera))
        checked = "not checked" if chosen.place is None else chosen.place.words
        self._place.setText(checked if chosen.camera else "is checked with a camera")
        words, role = chosen.problem, "muted"
        if not words and chosen.continues and chosen.protocol:
            words = f"{chosen.folder.name} exists: takes that it lacks are recorded."
        elif not words and chosen.continues:
            words = f"{chosen.folder.name} exists: frames are added to it, if it is of this radar."
        say(self._message, words, role)
        for button in (self._begin, self._copy):
            button.setEnabled(not chosen.problem)
        self._begin.setText("Continue" if chosen.continues else "Record")

    def _choose_camera(self, camera: str) -> None:
        self._choose("camera", camera, self._camera, "Video to play", _VIDEOS)

    def _choose_protocol(self, protocol: str) -> None:
        self._choose("protocol", protocol, self._protocol, "Protocol", TOML)

    def _choose(self, name: str, value: str, choice: Choice, title: str, kinds: str) -> None:
        """Choose a value, or a file that is asked for."""
        if value == "file":
            value = str(ask_file(self, title, kinds, "") or getattr(self._setup.chosen, name))
        self._setup.choose(name, value)
        _show_file(choice, getattr(self._setup.chosen, name))

    def _edit_protocol(self) -> None:
        try:
            draft = ProtocolDraft(self._setup.chosen.protocol or PAPER, self)
        except Sd2Error as error:
            QMessageBox.warning(self, "Protocol", str(error))
            return
        if accepted(ProtocolDialog(draft, self)) and draft.path is not None:
            self._choose_protocol(str(draft.path))

    def _check_place(self) -> None:
        check, chosen = PlaceCheck(self), self._setup.chosen
        check.start(chosen)
        if accepted(CheckDialog(check, chosen, self)):
            self._setup.choose_place(check.place)
        check.deleteLater()

    def _ask_file(self) -> None:
        setup, chosen = self._setup, self._setup.chosen
        if chosen.needs_setup:
            start = str(chosen.setup or "")
            if path := ask_file(self, "Configuration that the radar runs with", _SETUPS, start):
                setup.choose("setup", path)
        elif path := ask_file(self, "Capture", _captures(), str(chosen.replay or "")):
            setup.choose("replay", path)

    def _ask_folder(self) -> None:
        start = str(self._setup.chosen.folder)
        kind = "Folder of a session (*)" if self._setup.chosen.protocol else "Recording (*.sd2)"
        if folder := ask_new(self, "Record into", start, kind):
            self._setup.choose_folder(folder)


def _show_file(choice: Choice, value: str) -> None:
    """Show a value that is among the choices, or the name of the file that was chosen."""
    if choice.findData(value) < 0:
        with QSignalBlocker(choice):
            choice.addItem(Path(value).name, value)
    choice.show_value(value)
