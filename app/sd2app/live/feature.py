"""Listening to a radar: dialog, process, and a recording that grows on screen."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.live.dialog import ListenDialog
from sd2app.live.model import LiveModel
from sd2app.live.process import COMMAND, ListenRequest, ListenSetup
from sd2app.live.prompt_window import GuidedModel, PromptWindow
from sd2app.session.session import Session
from sd2app.widgets.dialogs import Answer, accepted, confirmed
from sd2app.widgets.panel import ElidedLabel, StateBar, say, sentence
from sd2core.files.tables import counted
from sd2core.live.counts import Counts


class LiveBar(StateBar):
    """Hidden until something is listened to."""

    def __init__(self, feature: LiveFeature) -> None:
        super().__init__("Radar that is listened to")
        self._live = live = feature.model
        self._title = ElidedLabel(self, "title")
        self._frames, self._reason = QLabel(self), sentence("", "warning")
        self._numbers = ElidedLabel(self, "muted")
        gap = "Listen again, into the same recording: the pause is a gap"
        buttons = {
            "show": ("Show", "Show this recording again", feature.show_again),
            "stop": ("Stop", "Stop, and keep all that was received", live.stop),
            "go_on": ("Continue", gap, feature.go_on),
            "close": ("✕", "Close this message", live.dismiss),
        }
        parts = (self._title, (self._reason, 1), self._frames, (self._numbers, 1))
        self.lay_out(parts, buttons, spacing_px=12)
        live.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        live = self._live
        self.setVisible(live.state != "idle")
        if live.state == "idle":
            return
        self._title.setText(title_text(live))
        failed = live.state == "failed"
        self._reason.setText(live.text if failed else "")
        self._reason.setVisible(failed)
        for label in (self._frames, self._numbers):
            label.setVisible(not failed)
        whole = live.counts.whole and not live.pictures_dropped
        text = frames_text(live.counts, live.pictures, live.pictures_dropped)
        say(self._frames, text, "" if whole else "warning")
        parts = (level_text(live.level_db), latency_text(live.latency_s))
        listening = live.state == "running"
        self._numbers.setText(" · ".join(filter(None, parts)) if listening else "")
        shown = {
            "stop": live.busy,
            "go_on": live.can_go_on,
            "show": live.can_be_shown,
            "close": not live.busy,
        }
        self.show_buttons([name for name, visible in shown.items() if visible])
        self._buttons["stop"].setEnabled(live.state != "stopping")


class LiveFeature(Feature):
    """A radar, or a capture that is replayed, as it comes."""

    def __init__(self, session: Session, shell: Shell, command: Sequence[str] | None) -> None:
        self._session, self._shell = session, shell
        self.model = LiveModel(session, session.parent, command or COMMAND)
        self.model.warned.connect(shell.warn)
        self.guided = GuidedModel(session.parent, command or COMMAND)
        self.guided.warned.connect(shell.warn)
        self.changing = (self.model.changed, self.guided.changed)
        self.closing = (self.model, self.guided)

    def actions(self) -> Sequence[Action]:
        """Listen, and stop."""
        return (
            Action(
                "listen", "File", "Record…", (),
                "Record a camera and a radar together, or a radar alone, with its Doppler map",
                self._ask,
                why_not=lambda: "A recording is being made already" if self._busy else "",
            ),
        )  # fmt: skip

    def bars(self) -> Sequence[QWidget]:
        """Bar of the radar that is listened to."""
        return (LiveBar(self),)

    @property
    def _busy(self) -> bool:
        return self.model.busy or self.guided.busy

    def _ask(self) -> None:
        window = self._shell.dialog_parent
        setup = ListenSetup(self._session.settings, window)
        listens, chosen = accepted(ListenDialog(setup, window)), setup.chosen
        setup.deleteLater()
        if not listens or chosen.problem:
            return
        if chosen.protocol:
            self._guide(chosen)
        elif self._shell.may_discard():
            self.model.start(chosen)

    def _guide(self, request: ListenRequest) -> None:
        """Run a session in a window of its own; what is open stays open."""
        view = PromptWindow(self.guided, self._shell.dialog_parent)
        view.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.guided.start(request)
        view.open_beside()

    def go_on(self) -> None:
        """Listen again to the same, in place of what is open."""
        if self.model.on_screen or self._shell.may_discard():
            self.model.go_on()

    def show_again(self) -> None:
        """Show what is listened to, in place of what is open."""
        if self._shell.may_discard():
            self.model.show()

    def may_close(self) -> bool:
        """Ask whether listening may stop with the window."""
        busy = self.guided if self.guided.busy else self.model
        request = busy.request
        if not busy.busy or request is None:
            return True
        words = f"Frames go into {request.folder.name}. What was received so far is kept."
        return confirmed(self._shell.dialog_parent, "Stop recording?", words, Answer.Close)


def title_text(live: LiveModel) -> str:
    """State of the recording under way, with its name."""
    assert live.request is not None
    name = live.request.folder.name
    match live.state:
        case "opening":
            return f"Opening {name}…"
        case "starting":
            return f"Beginning to record {name}…"
        case "running" if not live.counts.recorded:
            return "Waiting for the first frame…"
        case "running":
            return f"Recording {name}"
        case "stopping":
            return f"Storing what was received in {name}…"
        case "failed":
            return "Recording has failed"
        case _:
            return f"{name} is recorded"


def frames_text(counts: Counts, pictures: int = 0, pictures_dropped: int = 0) -> str:
    """Number of frames, and what they lack, in words."""
    if not counts.recorded:
        return ""
    filmed = f"{counted(pictures, 'picture')}, " if pictures else ""
    if pictures_dropped:
        filmed = f"{pictures:,} of {counted(pictures + pictures_dropped, 'picture')}, "
    lacks = [
        (counts.dropped, "dropped (this computer was too slow)"),
        (counts.lost, "lost on the way"),
        (counts.damaged, "with lost packets"),
        (counts.not_shown, "stored and not shown yet"),
    ]
    missing = [f"{number:,} {what}" for number, what in lacks if number]
    return f"{filmed}{counts.frames}, {', '.join(missing) or 'none missing'}"


def level_text(level_db: float | None) -> str:
    """Power of the newest column of the map."""
    return "" if level_db is None else f"level {level_db:.1f} dB".replace("-", "−")


def latency_text(latency_s: float | None) -> str:
    """How long a frame takes from its reception to the screen."""
    return "" if latency_s is None else f"on screen {1e3 * latency_s:.0f} ms after it was received"
