"""Labels, lines, bars and buttons of the panels at the side."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Literal

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QButtonGroup,
    QFrame,
    QHBoxLayout,
    QLabel,
    QLayout,
    QMenu,
    QMessageBox,
    QProgressBar,
    QSizePolicy,
    QSplitter,
    QStackedWidget,
    QToolButton,
    QWidget,
)

from sd2app.widgets.layouts import STRETCH, Part, column_of, grid_of, row_of
from sd2core.errors import Sd2Error


def title(text: str, name: str = "") -> QLabel:
    """A heading; one that changes has a name for screen readers, and wraps."""
    label = QLabel(text)
    label.setObjectName("title")
    label.setAccessibleName(name)
    label.setWordWrap(bool(name))
    return label


def copy_button(
    line: Callable[[], str], parent: QWidget, tip: str = "The same as a command for a terminal"
) -> QToolButton:
    """A button *Copy command*, which puts a command line on the clipboard, or says why not."""

    def copy() -> None:
        try:
            QApplication.clipboard().setText(line())
        except (Sd2Error, OSError) as error:
            QMessageBox.warning(parent, "Copy command", str(error))

    return outlined("Copy command", tip, copy, parent)


def sentence(text: str, role: str = "muted") -> QLabel:
    """Words that wrap and can be selected."""
    label = QLabel(text)
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setObjectName(role)
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label


def say(label: QLabel, text: str, role: str = "muted") -> None:
    """Show a text in the style of a role, such as ``muted`` or ``warning``."""
    if label.objectName() != role:
        label.setObjectName(role)
        label.style().unpolish(label)
        label.style().polish(label)
    label.setText(text)


def show_words(label: QLabel, text: str) -> None:
    """Show a text, and take no room without one."""
    label.setText(text)
    label.setVisible(bool(text))


def rule() -> QFrame:
    """A line between two parts."""
    line = QFrame()
    line.setFixedHeight(1)
    line.setObjectName("rule")
    return line


def outlined(
    text: str,
    tip: str,
    run: Callable[[], object] | QMenu | None,
    parent: QWidget,
    *,
    name: str = "",
    look: Literal["outlined", "primary", ""] = "outlined",
) -> QToolButton:
    """A button that does something or opens a menu, by its look with a border, filled or bare.

    A text that is only a sign has a ``name`` for screen readers.
    """
    button = QToolButton(parent)
    button.setObjectName(look)
    button.setText(text)
    button.setToolTip(tip)
    button.setAccessibleName(name or text)
    button.setAccessibleDescription(tip)
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    if isinstance(run, QMenu):
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        button.setMenu(run)
    elif run is not None:
        button.clicked.connect(lambda: run())
    return button


class StateBar(QFrame):
    """Line over the content about work under way; as high in all states, so that nothing moves."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setObjectName("panel")
        self.setAccessibleName(name)
        self.setMinimumHeight(40)

    def lay_out(
        self,
        parts: Sequence[Part],
        buttons: Mapping[str, tuple[str, str, Callable[[], object]]],
        spacing_px: int,
    ) -> None:
        """Put parts before the buttons, each a text, a tip that is its name too, and its use."""
        self._buttons = {
            id: outlined(text, tip, run, self, name=tip, look="" if text == "✕" else "outlined")
            for id, (text, tip, run) in buttons.items()
        }
        made = (*parts, *self._buttons.values())
        self.setLayout(row_of(*made, spacing_px=spacing_px, margins_px=(12, 4, 4, 4)))

    def show_buttons(self, shown: Collection[str]) -> None:
        """Show the buttons of these names."""
        for name, button in self._buttons.items():
            button.setVisible(name in shown)


class Fold(QToolButton):
    """Heading with an arrow that shows and hides what is below it; hidden at first."""

    def __init__(self, text: str, tip: str, content: QWidget, parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("fold")
        self.setCheckable(True)
        self.setText(text)
        self.setToolTip(tip)
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._content = content
        self.toggled.connect(self._unfold)
        self._unfold(False)

    def _unfold(self, shown: bool) -> None:
        self._content.setVisible(shown)
        self.setArrowType(Qt.ArrowType.DownArrow if shown else Qt.ArrowType.RightArrow)


def side_by_side(*widgets: QWidget, spacing_px: int = 8) -> QHBoxLayout:
    """Widgets in a row that begins at the left and leaves the rest empty."""
    return row_of(*widgets, STRETCH, spacing_px=spacing_px)


class FactRows(QWidget):
    """Rows of a name and a value, as many as there are facts, up to ``most``.

    ``at_the_edge``: values stand at the right edge and long names wrap, instead of values
    following names.
    """

    def __init__(self, most: int, at_the_edge: bool, parent: QWidget) -> None:
        super().__init__(parent)
        self._cells: list[tuple[QLabel, QLabel]] = []
        for _ in range(most):
            name, value = sentence(""), QLabel(self)
            value.setTextFormat(Qt.TextFormat.PlainText)
            name.setWordWrap(at_the_edge)
            value.setWordWrap(not at_the_edge)
            if at_the_edge:
                value.setAlignment(Qt.AlignmentFlag.AlignRight)
            else:
                name.setAlignment(Qt.AlignmentFlag.AlignTop)
            self._cells.append((name, value))
        wide = 0 if at_the_edge else 1
        self.setLayout(grid_of(*self._cells, gaps_px=(12, 2), wide=(wide,)))

    def show_facts(self, facts: Sequence[tuple[str, str]]) -> None:
        """Show facts, and nothing where there are none."""
        self.setVisible(bool(facts))
        for row, (name, value) in enumerate(self._cells):
            texts = facts[row] if row < len(facts) else ("", "")
            for label, text in zip((name, value), texts, strict=True):
                label.setText(text)
                label.setVisible(row < len(facts))


_MIN_LETTERS = 7
"""Of a text that is cut short; fewer say nothing."""


class ElidedLabel(QLabel):
    """A label as narrow as need be; the whole text is in its tooltip and its accessible name.

    With the ``longest`` of its texts it takes room for that, so that nothing beside it moves.
    """

    def __init__(self, parent: QWidget | None = None, role: str = "", longest: str = "") -> None:
        super().__init__(parent)
        self._longest = longest
        self.setObjectName(role)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)

    def setText(self, text: str) -> None:
        """Show a text."""
        if text != self.text():
            super().setText(text)
            self.setToolTip(text)
            self.setAccessibleName(text)

    def minimumSizeHint(self) -> QSize:
        """Size of a few words; where the longest is known, it may go."""
        return QSize(0 if self._longest else 40, super().minimumSizeHint().height())

    def sizeHint(self) -> QSize:
        """Size of the whole text."""
        metrics = self.fontMetrics()
        return QSize(metrics.horizontalAdvance(self._longest or self.text()) + 4, metrics.height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the text, elided where there is no room."""
        with QPainter(self) as painter:
            painter.setPen(self.palette().color(self.foregroundRole()))
            text = self.fontMetrics().elidedText(
                self.text(), Qt.TextElideMode.ElideRight, self.width()
            )
            cut = text != self.text() and len(text) < _MIN_LETTERS
            painter.drawText(self.rect(), int(self.alignment()), "…" if cut else text)


def panel(name: str) -> QFrame:
    """An empty panel."""
    frame = QFrame()
    frame.setObjectName("panel")
    frame.setAccessibleName(name.capitalize())
    # A click anywhere in it takes the keyboard back from a number box.
    frame.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
    return frame


def splitter(
    orientation: Qt.Orientation, widgets: Sequence[QWidget], sizes: tuple[int, ...]
) -> QSplitter:
    """Widgets side by side or below each other, of these sizes to begin with."""
    made = QSplitter(orientation)
    made.setChildrenCollapsible(False)
    made.setHandleWidth(8)
    for widget in widgets:
        made.addWidget(widget)
    made.setSizes(list(sizes))
    # Extra room goes to the middle of the top row and to the left of the bottom row.
    for index, size in enumerate(sizes):
        made.setStretchFactor(index, 1 if size == max(sizes) else 0)
    return made


def fill(frame: QFrame, content: QWidget | QLayout) -> None:
    """Fill an empty panel."""
    frame.setLayout(column_of(content, spacing_px=0, margins_px=1))


def replace_content(content: QWidget, by: QWidget) -> None:
    """Put a widget in the place of what a panel was filled with."""
    frame = content.parentWidget()
    layout = frame.layout() if frame is not None else None
    assert layout is not None
    layout.replaceWidget(content, by)
    content.deleteLater()


_PARTS = 1000


class ProgressBar(QProgressBar):
    """Low bar without a text in it; ``name`` is for screen readers."""

    def __init__(self, name: str, width_px: int | None = None, height_px: int = 14) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setTextVisible(False)
        self.setMaximumHeight(height_px)
        if width_px is not None:
            self.setFixedWidth(width_px)

    def show_count(self, done: int, total: int) -> None:
        """Show how much is done; of a total of zero, that something is."""
        self.setRange(0, total)
        self.setValue(done)

    def show_share(self, share: float | None) -> None:
        """Show the share that is done; None: not known, it is busy."""
        if share is None:
            self.show_count(0, 0)
        else:
            self.show_count(round(share * _PARTS), _PARTS)


class LatePage(QFrame):
    """Page that is made when it is first shown."""

    def __init__(self, make: Callable[[], QWidget]) -> None:
        super().__init__()
        self._make: Callable[[], QWidget] | None = make

    def showEvent(self, event: QShowEvent) -> None:
        """Make the page."""
        if self._make is not None:
            page, self._make = self._make(), None
            layout = column_of(page, spacing_px=0, margins_px=0)
            self.setLayout(layout)
            page.show()
            layout.activate()  # Qt does so just before it comes here
        super().showEvent(event)


class InnerPages(QWidget):
    """Buttons on top, the page below; ``beside`` is put to the right of the buttons.

    Each of the ``pages`` has a name and a tip for its button.
    """

    turned = Signal(int)  # number of the page that is shown now

    def __init__(
        self, *pages: tuple[str, str, QWidget], beside: QWidget | None = None, inset_px: int = 0
    ) -> None:
        super().__init__()
        self.setObjectName("page")
        self.names = [name for name, _, _ in pages]
        self._pages = QStackedWidget(self)
        self._pages.currentChanged.connect(self.turned)
        self._buttons = QButtonGroup(self)
        for place, (name, tip, page) in enumerate(pages):
            self._pages.addWidget(page)
            button = outlined(name, tip, None, self, look="")
            button.setCheckable(True)
            button.setChecked(place == 0)
            self._buttons.addButton(button, place)
        self._buttons.idClicked.connect(self._pages.setCurrentIndex)
        self._pages.currentChanged.connect(self._give_room)
        self._give_room(0)
        top = row_of(
            *self._buttons.buttons(), STRETCH if beside is None else (beside, 1), spacing_px=6
        )
        top.setContentsMargins(inset_px, 0, inset_px, 0)
        self.setLayout(column_of(top, (self._pages, 1), spacing_px=6, margins_px=0))

    @property
    def shown(self) -> int:
        """Number of the page that is shown."""
        return self._pages.currentIndex()

    @property
    def page(self) -> str:
        """First name of the page that is shown."""
        return self.names[self.shown]

    def turn_to(self, page: str) -> None:
        """Show a page by its first name."""
        place = self.names.index(page)
        self._buttons.button(place).setChecked(True)
        self._pages.setCurrentIndex(place)

    def name_page(self, place: int, name: str) -> None:
        """Rename the button of a page."""
        button = self._buttons.button(place)
        button.setText(name)
        button.setAccessibleName(name)

    def _give_room(self, shown: int) -> None:
        """The page that is shown says how much room is needed, and no other."""
        policy = QSizePolicy.Policy
        for place in range(self._pages.count()):
            kept = policy.Preferred if place == shown else policy.Ignored
            page = self._pages.widget(place)
            assert page is not None
            page.setSizePolicy(policy.Preferred, kept)
            # The arrows lead to the others.
            focus = Qt.FocusPolicy.TabFocus if place == shown else Qt.FocusPolicy.NoFocus
            self._buttons.button(place).setFocusPolicy(focus)
