"""One window for many tests, for as long as each of them leaves it as it was found.

A new window takes longer than most of what is asked of it. Here the next test gets the window of
the last one with a recording opened in it anew, if all that the window remembers (models, views,
settings, widgets on screen) is then what a new window remembers; else it gets a new one.
"""

from __future__ import annotations

import enum
import shutil
import sys
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import fake_class_command
import numpy as np
from PySide6.QtCore import QByteArray, QCoreApplication, QEvent, QModelIndex
from PySide6.QtGui import QAction, QUndoStack
from PySide6.QtWidgets import QApplication, QSplitter, QTableView, QToolTip, QWidget
from window_models import models_of

from sd2app.session.display import HeatmapLevels
from sd2app.settings import DEFAULT_TOLERANCE, Settings
from sd2app.shell.parts import Parts
from sd2app.shell.status_bar import StatusLine
from sd2app.shell.window import MainWindow
from sd2core.doppler.alignment import WITHIN_S
from sd2core.files.paths import user_data
from sd2core.labels.recovery import recovery_folder

_PLAIN = (str, int, float, complex, bytes, type(None), enum.Enum, Path)
_PASSING = (
    *("revision", "renderings", "_origin_s"),  # counted up, or of the clock
    *("_image", "_picture", "_strongest", "_dirty", "_fine"),  # painted when it is next on screen
    *("_prefetcher", "_masks_of"),  # looked ahead, for the next frame
    *("_lister", "_thread", "_synthesizers._made", "_kept"),  # made in the background, or kept
    # Of a drag that is over, or of typing.
    *("edits._before", "edits._dragged", "_last_px", "_pressed_px", "_drops", "_name._before"),
    *("_tabbed", "_behind"),  # where Tab went last; actions that are followed soon
    *("_notices._at", "limb_menu._offered"),  # found anew when a notice or the menu appears
    # Of the start page, hidden.
    *("start.recent", "_pictures._writer.busy", "_pictures._writer._pending"),
    *("_tour._before", "]._target"),  # of a tour that is over
    *("edges_s", "limb_hand._model._mesh_parts"),  # worked out once, when first asked for
    # Of places and a search that are no more.
    *("inertial_hand._model._chosen", "limb_hand._surface._model._chosen", "].result"),
    *("._body", "scene.inertial.points"),  # what places were last drawn about, and their markers
    *("scene.markers.points", "scene.markers._colours", "scene.markers._colour_array"),
    *("scene.markers._length_m", "scene.view._planned[2].wavelength_m"),
    *("sensor_glyph.shapes[0].points", "sensor_glyph.shapes[1].points"),  # of the last beam
    # Tables that are filled when they are next on screen.
    *("spans.table._model.rows", "spans.table._model._row_of"),
    *("_label_set._model.rows", "_label_set._model._counts", "_label_set._model._alike"),
    "_label_set._model.label_set",
)
"""Ends of names of what says nothing of what is shown or will be."""
_HASHED_BYTES = 1 << 20


def new_window(qtbot: Any, fake: Any, fake_models: Any, fake_classes: Any) -> MainWindow:
    """Window without a recording, all views in place."""
    window = MainWindow(
        _set_as_for_a_test(Settings.forgetful()),
        Parts(
            accuracy=fake.library,
            denoisers=fake_models.library,
            classifiers=fake_classes.library,
            learn_command=(sys.executable, "-u", fake_class_command.__file__),
            pictures=user_data("pictures"),
        ),
    )
    window.resize(1280, 800)
    window.show()
    window.populate()
    qtbot.waitUntil(lambda: window.settled, timeout=120_000)
    return window


def _set_as_for_a_test(settings: Settings) -> Settings:
    for name in ("folded", "over"):  # the panel at the side is open and beside the maps
        settings.set_value(f"layouts/Look/{name}", False)
    return settings


def close_window(window: MainWindow) -> None:
    """Give up a window, whatever was edited in it."""
    if window.ready:
        models_of(window).document.undo_stack.clear()
        window.features.live.model.close()
    window.close()
    # Styling the next window would style all that are still there.
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def opened(window: MainWindow, qtbot: Any, recording: Path) -> MainWindow:
    """The window on a recording, everything computed."""
    with qtbot.waitSignal(models_of(window).document.opened, timeout=120_000):
        window.open_paths([recording])
    qtbot.waitUntil(lambda: window.settled, timeout=120_000)
    qtbot.waitUntil(lambda: models_of(window).synthesis.complete, timeout=120_000)
    return window


class KeptWindow:
    """The window that tests share, or None, and what it shares with them."""

    def __init__(self) -> None:
        self.window: MainWindow | None = None
        self.fakes: dict[str, Any] = {}
        self.data: Path | None = None
        self._focus: QWidget | None = None
        self._splitters: list[tuple[QSplitter, QByteArray]] = []
        self._remembered: dict[str, str] = {}
        self.of_another_file = False
        self._reused = self._in_vain = 0

    def begin_file(self) -> None:
        """Count anew how often the tests of a file leave the window as they found it."""
        self.of_another_file = self.window is not None
        self._reused = self._in_vain = 0

    def fake(self, name: str, kind: Callable[[], Any]) -> Any:
        """A fake as it is made: that of the window that is kept, or a new one."""
        if self.window is None:
            return kind()
        fake = self.fakes[name]
        fake.gate.set()
        fake.__init__()
        return fake

    def open(self, qtbot: Any, recording: Path, data: Path, fakes: dict[str, Any]) -> MainWindow:
        """Window on a recording as a new one would be: the one that is kept, or a new one."""
        self.of_another_file = False
        if self.window is not None:
            before = {name: _copied(fake) for name, fake in fakes.items()}
            # Models that are there from the start have been listed by then.
            listed = any(getattr(fake, "cards", None) for fake in fakes.values())
            # Opening again takes time too: not where most tests of a file leave something behind.
            tried = not listed and self._in_vain <= self._reused + 1
            if tried and self._as_new(qtbot, recording):
                self._reused += 1
            else:
                self._in_vain += tried
                self.close()
                for name, fake in fakes.items():
                    vars(fake).update(before[name])
        if self.window is None:
            empty(data)
            self.window = new_window(qtbot, **fakes)
            self.fakes, self.data = fakes, data
            opened(self.window, qtbot, recording)
            self._focus = QApplication.focusWidget()
            splitters = self.window.findChildren(QSplitter)
            self._splitters = [(one, one.saveState()) for one in splitters]
            self._remembered = remembered(self.window, recording)
        return self.window

    def close(self) -> None:
        """Give up the window."""
        if self.window is not None:
            for fake in self.fakes.values():
                fake.gate.set()
            close_window(self.window)
        self.window, self.data, self.of_another_file = None, None, False

    def _as_new(self, qtbot: Any, recording: Path) -> bool:
        window = self.window
        assert window is not None
        if not window.ready or not window.isVisible() or QApplication.activeModalWidget():
            return False
        models = models_of(window)
        models.document.undo_stack.clear()
        models.playback.set_speed(1.0)
        models.playback.set_loop(False)
        models.display.set_levels(**vars(HeatmapLevels()))
        models.display.set_mesh_colour("velocity")
        window.features.sensor.alignment.within_s = WITHIN_S
        window.features.scene.view.scene._followed = None
        QToolTip.hideText()
        models.pointer.leave()
        models.keys.reset_all()
        models.trade.tolerance = DEFAULT_TOLERANCE
        models.trade.measured.set_family("histogram")
        for table in window.findChildren(QTableView):
            table.setCurrentIndex(QModelIndex())
        window.side.bring_up("Sensor", "Sensor")
        window.messages.dismiss()
        window.messages.forget()
        for splitter, state in self._splitters:
            splitter.restoreState(state)
        window.activateWindow()
        if self._focus is not None:
            self._focus.setFocus()
        window.session.settings._store._values.clear()
        _set_as_for_a_test(window.session.settings)
        opened(window, qtbot, recording)
        models.labels.set_label(models.labels.labels.label_set.labels[0].name)
        held = models.label_session._place._folder
        for folder in recovery_folder().iterdir():
            if folder != held:
                shutil.rmtree(folder)
        return remembered(window, recording) == self._remembered


def _copied(fake: Any) -> dict[str, Any]:
    """What a fake knows, its lists copied."""
    return {
        name: value.copy() if isinstance(value, (list, dict)) else value
        for name, value in vars(fake).items()
    }


def empty(folder: Path) -> None:
    """Delete what is in a folder."""
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def remembered(window: MainWindow, recording: Path) -> dict[str, str]:
    """Everything that a window remembers, by where; the recording's folder has no name in it."""
    found: dict[str, str] = {}
    seen: set[int] = set()
    parts = {"session": window.session, "features": window.features, "window": vars(window)}
    rest: list[tuple[str, Any]] = [("", parts)]
    while rest:
        name, value = rest.pop()
        if _passes(name):
            continue
        kind = _kind(type(value))
        if kind == "plain":
            found[name] = repr(value).replace(str(recording), "<recording>")
        elif kind == "array":
            content = hash(value.tobytes()) if value.nbytes <= _HASHED_BYTES else ""
            found[name] = f"{value.dtype} {value.shape} {content}"
        elif kind == "history":
            found[name] = f"{value.count()} {value.index()} {value.isClean()}"
        elif kind == "sequence":
            found[name] = f"{len(value)}"
            rest += [(f"{name}[{place}]", item) for place, item in enumerate(value)]
        elif kind == "set":
            found[name] = f"{sorted(map(repr, value))}" if _plain(value) else f"{len(value)}"
        elif kind == "value":
            found[name] = type(value).__name__
            rest += [(f"{name}.{key}", item) for key, item in _attributes(value)]
        elif kind == "foreign" or id(value) in seen:
            continue
        elif kind == "dict":
            seen.add(id(value))
            found[name] = f"{len(value)}"
            rest += [
                (f"{name}[{key if isinstance(key, _PLAIN) else place}]", item)
                for place, (key, item) in enumerate(value.items())
            ]
        else:
            seen.add(id(value))
            found[name] = type(value).__name__
            rest += [(f"{name}.{key}", item) for key, item in sorted(_attributes(value))]
    on_screen = Counter(_widgets(window, ""))
    return found | {f"on screen: {text}": f"{count}" for text, count in on_screen.items()}


@cache
def _passes(name: str) -> bool:
    return name.rstrip("]").endswith(_PASSING)


@cache
def _kind(kind: type) -> str:
    """How the objects of a type are looked at."""
    if issubclass(kind, (*_PLAIN, np.generic)):
        return "plain"
    if issubclass(kind, np.ndarray):
        return "array"
    if issubclass(kind, QUndoStack):
        return "history"
    if issubclass(kind, (tuple, list)):
        return "sequence"
    if issubclass(kind, (set, frozenset)):
        return "set"
    parameters = getattr(kind, "__dataclass_params__", None)
    # Equal to its copies, so that it does not matter who shares it.
    if parameters is not None and parameters.frozen and parameters.eq:
        return "value"
    if issubclass(kind, dict):
        return "dict"
    ours = parameters is not None or kind.__module__.startswith(("sd2app", "fake_"))
    return "ours" if ours else "foreign"


def _plain(values: Any) -> bool:
    return all(isinstance(value, _PLAIN) for value in values)


def _attributes(value: Any) -> list[tuple[str, Any]]:
    slots = [(name, getattr(value, name)) for name in _slots(type(value)) if hasattr(value, name)]
    return [*getattr(value, "__dict__", {}).items(), *slots]


@cache
def _slots(kind: type) -> list[str]:
    return [name for base in kind.__mro__ for name in getattr(base, "__slots__", ())]


def _widgets(widget: QWidget, place: str) -> list[str]:
    """What is to be seen of a widget and those in it."""
    place = f"{place}/{type(widget).__name__}#{widget.objectName()}"
    states = [widget.isEnabled(), widget.hasFocus(), widget.geometry().getRect()]
    for ask in ("text", "isChecked", "value", "currentText"):
        if callable(method := getattr(widget, ask, None)):
            try:
                states.append(method())
            except TypeError:  # it asks for a row
                continue
    found = [f"{place} {states}"]
    for child in widget.children():
        if isinstance(child, StatusLine):
            continue  # it says what is being worked on
        if child.objectName() == "qtooltip_label":
            continue  # it goes soon
        if isinstance(child, QWidget) and child.isVisible():
            found += _widgets(child, place)
        elif isinstance(child, QAction):
            found.append(
                f"{place} {child.text().replace('&', '')} {child.isEnabled()} {child.isChecked()}"
            )
    return found
