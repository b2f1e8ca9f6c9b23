"""Dialogs: Record, with the recording that grows, and a look at what camera and radar see."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSignalBlocker, QSize, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QDialogButtonBox, QLabel, QLineEdit, QMessageBox, QToolButton, QWidget

from sd2app.live.process import DCA1000, REPLAY, ListenRequest, ListenSetup, PlaceCheck, ways
from sd2app.live.protocol_dialog import TOML, ProtocolDialog, ProtocolDraft
from sd2app.manual.help import with_help
from sd2app.widgets.canvas import Canvas
from sd2app.widgets.dialogs import Dialog, accepted, accepting, ask_file, ask_new, closing
from sd2app.widgets.inputs import Choice
from sd2app.widgets.layouts import STRETCH, column_of, form_of, grid_of, row_of
from sd2app.widgets.mesh_painting import paint_picture
from sd2app.widgets.panel import ElidedLabel, copy_button, outlined, say, sentence, title
from sd2core.errors import Sd2Error
from sd2core.io.kinds import RADAR_SUFFIXES
from sd2core.io.readers import RADAR_FILES, suffixes_of
from sd2core.live.protocol import PAPER
from sd2core.live.radars import A121, TI
from sd2core.live.rehearsal import TEST
from sd2core.placements.placements import Place

_NAMES = {"motion": "Motion", "range": "Range", "view": "View", "agreement": "Agreement"}
_PICTURE = QSize(416, 234)
_LINES = 3
"""Of a sentence, so that nothing moves when it gets another."""
_WAITS = "Walk towards both and away again, a few times."


class CheckDialog(Dialog):
    """A view of :class:`PlaceCheck`; accepted where the place is to be kept."""

    def __init__(self, check: PlaceCheck, request: ListenRequest, parent: QWidget) -> None:
        super().__init__("Check the place", parent)
        self._check = check
        picture = _LivePicture(check, self)
        self._head = sentence("", "title")
        self._rows = {
            name: (QLabel(self), title(text), sentence("")) for name, text in _NAMES.items()
        }
        for mark, name, words in self._rows.values():
            words.setMinimumHeight(_LINES * words.fontMetrics().lineSpacing())
            for label in (mark, name, words):
                label.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        findings = grid_of(*self._rows.values(), gaps_px=(10, 12), wide=(2,))
        self._place = sentence("")
        tip = "Keep it as the planned placement of what is recorded"
        self._take = outlined("Take over", tip, self.accept, self)
        buttons = closing(self)
        action = QDialogButtonBox.ButtonRole.ResetRole
        self._stop = buttons.addButton("Stop", action)
        self._stop.clicked.connect(check.stop)
        self._again = buttons.addButton("Again", action)
        self._again.clicked.connect(partial(check.start, request))
        column = column_of(self._head, findings, STRETCH, spacing_px=16, margins_px=0)
        below = row_of((self._place, 1), self._take, spacing_px=12)
        parts = row_of((picture, 1), (column, 1), spacing_px=20)
        foot = with_help("Check the place", buttons)
        self.setLayout(column_of((parts, 1), below, foot, spacing_px=16, margins_px=16))
        check.changed.connect(self._refresh)
        self._refresh()
        self.resize(1000, self.sizeHint().height() + _LINES * self.fontMetrics().lineSpacing())

    def done(self, result: int) -> None:
        """Let go of radar and camera with it."""
        self._check.close()
        super().done(result)

    def _refresh(self) -> None:
        check = self._check
        self._stop.setVisible(check.busy)
        self._stop.setEnabled(check.state != "stopping")
        self._again.setVisible(not check.busy)
        findings = {one.name: one for one in check.findings}
        say(self._head, self._words(), "warning" if check.state == "failed" else "title")
        for name, (mark, _, words) in self._rows.items():
            one = findings.get(name)
            text, role = (
                ("…", "muted") if one is None else ("✓", "") if one.passed else ("✗", "warning")
            )
            say(mark, text, role)
            mark.setAccessibleName("not known" if one is None else "good" if one.passed else "bad")
            say(words, "" if one is None else one.sentence, "muted" if one is None else role)
        place = check.place
        self._take.setEnabled(place is not None)
        say(self._place, _place_words(place))

    def _words(self) -> str:
        check = self._check
        if check.state == "failed":
            return check.text
        if check.busy:
            return f"{_WAITS} {check.left_s} s left." if check.findings else "Opening both…"
        bad = sum(not one.passed for one in check.findings)
        return f"{bad} of {len(check.findings)} are bad." if bad else "All is good."


class _LivePicture(Canvas):
    """The newest picture of the camera, as large as there is room."""

    def __init__(self, check: PlaceCheck, parent: QWidget) -> None:
        super().__init__(parent)
        self._check = check
        self.setObjectName("panel")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setAccessibleName("What the camera sees")
        self.setMinimumSize(_PICTURE)
        self.follow(check.changed)

    def paint(self, painter: QPainter) -> None:
        """Paint the picture."""
        if self._check.picture is not None:
            paint_picture(painter, self.rect(), self._check.picture)


def _place_words(place: Place | None) -> str:
    if place is None:
        return "Where the radar is follows once range and view are good."
    return f"As seen from whoever moves, a radar beside the camera is at {place.words}."


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
