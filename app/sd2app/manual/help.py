"""The window of the manual, and buttons on panels and dialogs that open it at the right page."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable

from PySide6.QtCore import QObject, QSize, Qt, QUrl, SignalInstance, Slot
from PySide6.QtGui import QCloseEvent, QDesktopServices, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QApplication,
    QDialogButtonBox,
    QHBoxLayout,
    QToolButton,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from sd2app.manual.pages import SEARCH, Entry, Manual, manual_folder
from sd2app.manual.view import SCHEME, PageView, address
from sd2app.settings import Settings
from sd2app.widgets.dialogs import take_room
from sd2app.widgets.inputs import SearchLine
from sd2app.widgets.layouts import column_of, pane, row_of
from sd2app.widgets.panel import outlined, splitter

_SIZE_PX, _LEFT_PX, _ROW_PX = (1000, 820), 290, 24
_LAYOUT, _NAME = "manual", Qt.ItemDataRole.UserRole


class ManualWindow(QWidget):
    """A window of its own, which is kept and shows one page at a time."""

    def __init__(self, manual: Manual, settings: Settings) -> None:
        super().__init__(None, Qt.WindowType.Window)
        self._manual, self._settings = manual, settings
        self.view = PageView(manual, self)
        self.view.sourceChanged.connect(self._name_page)
        self.search = SearchLine("Search the manual", self)
        self.search.textChanged.connect(self._look)
        self.search.returnPressed.connect(self._open_first)
        self.contents = QTreeWidget(self)
        self._items: dict[str, QTreeWidgetItem] = {}
        self._build_contents()
        back = self._button("‹", "Back", self.view.backward, self.view.backwardAvailable)
        forward = self._button("›", "Forward", self.view.forward, self.view.forwardAvailable)
        for key, run in {
            QKeySequence.StandardKey.Back: self.view.backward,
            QKeySequence.StandardKey.Forward: self.view.forward,
            QKeySequence.StandardKey.Find: self._find,
            QKeySequence.StandardKey.Close: self.close,
        }.items():
            QShortcut(key, self).activated.connect(run)
        top = row_of(back, forward, (self.search, 1), spacing_px=2, margins_px=8)
        parts = [pane(top, (self.contents, 1)), self.view]
        both = splitter(Qt.Orientation.Horizontal, parts, (_LEFT_PX, _SIZE_PX[0] - _LEFT_PX))
        both.setHandleWidth(1)
        self.setLayout(column_of(both, margins_px=0))
        take_room(self, *_SIZE_PX)
        if (geometry := settings.layout(_LAYOUT)) is not None:
            self.restoreGeometry(geometry)

    def _button(
        self, text: str, name: str, run: Callable[[], None], possible: SignalInstance
    ) -> QToolButton:
        button = outlined(text, name, run, self, name=name, look="")
        button.setEnabled(False)
        possible.connect(button.setEnabled)
        return button

    def _build_contents(self) -> None:
        self.contents.setHeaderHidden(True)
        self.contents.setAccessibleName("Contents")
        self.contents.setFrameShape(self.contents.Shape.NoFrame)
        self.contents.viewport().setAutoFillBackground(False)
        for signal in (self.contents.itemClicked, self.contents.itemActivated):
            signal.connect(lambda item: self.view.follow(address(item.data(0, _NAME))))
        first = Entry(self._manual.contents.name, self._manual.contents.title)
        for entry in (first, *self._manual.contents.below):
            self._add(entry, self.contents.invisibleRootItem())

    def _add(self, entry: Entry, above: QTreeWidgetItem) -> None:
        self._items[entry.name] = item = QTreeWidgetItem(above, [entry.title])
        item.setData(0, _NAME, entry.name)
        item.setSizeHint(0, QSize(0, _ROW_PX))
        for below in entry.below:
            self._add(below, item)

    def show_address(self, url: QUrl) -> None:
        """Bring the window up with a page."""
        dialog = QApplication.activeModalWidget()
        self.winId()  # makes the handle
        handle, over = self.windowHandle(), None if dialog is None else dialog.windowHandle()
        if handle.transientParent() is not over:
            # A dialog that waits for an answer blocks all windows but its own, as they are shown.
            self.hide()
            handle.setTransientParent(over)  # type: ignore[arg-type]
        self.setWindowState(self.windowState() & ~Qt.WindowState.WindowMinimized)
        self.show()  # before the page, which scrolls to its heading
        self.raise_()
        self.activateWindow()
        self.view.follow(url)

    def _name_page(self) -> None:
        item = self._items.get(self.view.page)
        if item is None:
            self.contents.clearSelection()
        else:
            self.contents.setCurrentItem(item)
            item.setExpanded(True)
        title = self._manual.titles.get(self.view.page, "Search")
        self.setWindowTitle(f"{title} – SD² Studio manual")

    def _find(self) -> None:
        self.search.setFocus(Qt.FocusReason.ShortcutFocusReason)
        self.search.selectAll()

    def _look(self, text: str) -> None:
        """Show what is found while it is typed; without any words, the page before."""
        self._manual.sought = text
        if not text.strip():
            if self.view.page == SEARCH:
                self.view.backward()
        elif self.view.page == SEARCH:
            self.view.reload()
        else:
            self.view.follow(address(SEARCH))

    def _open_first(self) -> None:
        for hit in self._manual.search(self.search.text())[:1]:
            self.view.follow(address(hit.place))

    def closeEvent(self, event: QCloseEvent) -> None:
        """Remember where the window was."""
        self._settings.set_layout(_LAYOUT, self.saveGeometry())
        super().closeEvent(event)


class ManualOpener(QObject):
    """Opens the one window of the manual, which is made when it is first asked for."""

    def __init__(
        self, parser: Callable[[], ArgumentParser], settings: Settings, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._parser, self._settings = parser, settings
        self.window: ManualWindow | None = None

    def answer(self) -> None:
        """Open what anything in the program asks the desktop for by an address of the manual."""
        # PySide's stubs say bytes, which it refuses.
        QDesktopServices.setUrlHandler(SCHEME, self, "show_address")  # type: ignore[arg-type]

    def show_page(self, place: str) -> None:
        """Show a page, at the heading of an anchor behind ``#``; raises OSError without pages."""
        self.show_address(address(place))

    @Slot(QUrl)
    def show_address(self, url: QUrl) -> None:
        """Show the page of an address, as :meth:`show_page` does."""
        if self.window is None:
            self.window = ManualWindow(Manual(manual_folder(), self._parser), self._settings)
        self.window.show_address(url)

    def close(self) -> None:
        """Close the window for good."""
        QDesktopServices.unsetUrlHandler(SCHEME)
        window, self.window = self.window, None
        if window is not None:
            window.close()
            window.deleteLater()


HELP = {
    "Sensor": "first-five-minutes.md#move-the-sensor",
    "Placements": "tutorials/plan-placements.md#1-plan-a-grid",
    "Accuracy": "how-to/choose-accuracy.md",
    "Denoiser": "tutorials/train-a-denoiser.md#3-train",
    "Classifier": "how-to/recognise-gestures.md",
    "Study": "how-to/recognise-gestures.md",
    "Labels": "tutorials/label-fast.md#1-mark-with-keys",
    "Label set": "how-to/use-your-own-label-set.md",
    "Agreement": "tutorials/label-fast.md#3-compare-with-a-second-annotator",
    "New from video": "tutorials/video-to-data-set.md#2-fit-a-body",
    "Mesh over the video": "how-to/compare-with-another-mesh.md#see-it-over-the-video",
    "Record": "how-to/record-a-live-radar.md",
    "Protocol": "how-to/record-a-live-radar.md#a-guided-session",
    "Check the place": "how-to/record-a-live-radar.md#check-the-place-first",
    "Align automatically": "how-to/align-video-and-radar.md",
    "Compare meshes": "how-to/compare-with-another-mesh.md",
    "Inertial sensor": "imu.md#in-the-window",
    "Import labels": "tutorials/label-fast.md#4-take-the-labels-over",
    "Export labels": "tutorials/label-fast.md#5-hand-them-on",
    "Export cut-outs": "tutorials/label-fast.md#5-hand-them-on",
    "Export map": "formats.md#doppler-map-files",
    "Export figure": "how-to/figures-for-a-paper.md",
    "Export data set": "tutorials/video-to-data-set.md#6-export-the-data-set",
    "Batch": "how-to/many-recordings.md",
    "Any command": "how-to/many-recordings.md",
    "Recover labels": "how-to/recover-after-a-crash.md",
    "Keys": "how-to/change-keys.md",
    "Preferences": "how-to/find-your-way-in-the-window.md#what-is-in-no-menu",
}
"""Panels and dialogs, and the heading of the manual that says most about each."""


def show_help(topic: str) -> None:
    """Open the manual about a row of the table."""
    QDesktopServices.openUrl(address(HELP[topic]))


def help_button(topic: str | Callable[[], str], parent: QWidget, key: str = "F1") -> QToolButton:
    """A small "?" that opens the manual about a row of the table, which may change."""
    topic_now = topic if callable(topic) else lambda: topic
    tip = "Help on this panel"
    button = outlined("?", tip, lambda: show_help(topic_now()), parent, name=tip, look="")
    QShortcut(QKeySequence(key), button).activated.connect(button.click)
    return button


def with_help(topic: str, buttons: QDialogButtonBox, *others: QWidget) -> QHBoxLayout:
    """Last row of a dialog: the button and others at the left, then those that end it."""
    return row_of(help_button(topic, buttons), *others, (buttons, 1), spacing_px=8)
