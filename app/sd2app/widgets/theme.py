"""One look for every widget: Fusion, the palette, and an 8-pixel grid."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QApplication

from sd2app.palette import Palette, palette_for

_ROLES = {
    QPalette.ColorRole.Window: "window",
    QPalette.ColorRole.Base: "panel",
    QPalette.ColorRole.AlternateBase: "well",
    QPalette.ColorRole.Button: "panel",
    QPalette.ColorRole.ToolTipBase: "panel",
    QPalette.ColorRole.WindowText: "text",
    QPalette.ColorRole.Text: "text",
    QPalette.ColorRole.ButtonText: "text",
    QPalette.ColorRole.ToolTipText: "text",
    QPalette.ColorRole.PlaceholderText: "muted",
    QPalette.ColorRole.Highlight: "accent",
    QPalette.ColorRole.HighlightedText: "accent_text",
    QPalette.ColorRole.BrightText: "text",
    QPalette.ColorRole.Link: "accent",
    QPalette.ColorRole.LinkVisited: "accent",
    QPalette.ColorRole.Accent: "accent",
}

_FRAMES = {
    "QAbstractSpinBox": ("frame", 100),
    "QComboBox": ("frame", 115),
    "QLineEdit": ("frame", 100),
    "QPushButton": ("frame", 115),
    "QCheckBox": ("muted", 100),
}
"""Colours of frames of what is typed, chosen or ticked; the last are drawn lighter.

With each, to which percentage Fusion brightens it where it is disabled, be that seen more or less.
"""
_OF_A_FRAME = 140
"""By which percentage Fusion divides the brightness of a window for frames on it."""


def apply_theme(application: QApplication, dark: bool) -> None:
    """Give every widget the light or the dark theme, unless the application has it already."""
    colours = palette_for(dark)
    _set_palette(application, colours)
    sheet = _style_sheet(colours)
    # Setting a sheet, be it the same, styles every widget again.
    if application.styleSheet() != sheet:
        application.setStyleSheet(sheet)


def leave_unstyled(application: QApplication) -> None:
    """Take the sheet away until the theme is applied again, while many widgets are made.

    With a sheet, each is styled anew whenever it, or what it is in, is put into another.
    """
    application.setStyleSheet("")


def _set_palette(application: QApplication, colours: Palette) -> None:
    """Draw in Fusion with these colours, unless the application does."""
    palette = QPalette()
    for role, name in _ROLES.items():
        palette.setColor(role, QColor(getattr(colours, name)))
    for role in (
        QPalette.ColorRole.WindowText,
        QPalette.ColorRole.Text,
        QPalette.ColorRole.ButtonText,
    ):
        palette.setColor(QPalette.ColorGroup.Disabled, role, QColor(colours.disabled))
    if application.palette() == palette:
        return
    application.setStyle("Fusion")
    application.setPalette(palette)
    # Fusion frames these by a darker shade of their window, which is not seen on a dark one.
    for kind, (name, brightened) in _FRAMES.items():
        window = QColor(getattr(colours, name)).lighter(_OF_A_FRAME)
        palette.setColor(QPalette.ColorRole.Window, window)
        disabled = window.darker(brightened)
        palette.setColor(QPalette.ColorGroup.Disabled, QPalette.ColorRole.Window, disabled)
        application.setPalette(palette, kind)  # type: ignore[arg-type]  # not bytes


def _style_sheet(c: Palette) -> str:
    return f"""
    QMainWindow, QMenuBar {{ background: {c.window}; }}
    QMenuBar {{ padding: 2px 4px; }}
    QMenuBar::item {{ padding: 4px 8px; border-radius: 4px; background: transparent; }}
    QMenuBar::item:selected {{ background: {c.well}; }}
    QDialogButtonBox {{ dialogbuttonbox-buttons-have-icons: 0; }}
    QSplitter::handle {{ background: {c.window}; }}
    QToolTip {{ border: 1px solid {c.border}; padding: 4px; }}
    QFrame#panel {{ background: {c.panel}; border: 1px solid {c.border}; border-radius: 6px; }}
    QAbstractSpinBox {{ min-height: 16px; }}
    QDoubleSpinBox#marked {{ color: {c.warning}; font-weight: 600; }}
    QFrame#notice {{
        background: {c.panel}; border: 1px solid {c.muted}; border-left: 3px solid {c.accent};
        border-radius: 6px;
    }}
    QLabel#title {{ font-weight: 600; }}
    QLabel#muted, QLabel#unit {{ color: {c.muted}; }}
    QLabel#warning {{ color: {c.warning}; }}
    QLabel#badge {{
        color: {c.warning}; border: 1px solid {c.warning}; border-radius: 4px; padding: 1px 6px;
    }}
    QFrame#drops {{ background: #eb{c.window[1:]}; }}
    QLabel#drop {{ border: 1px dashed {c.frame}; border-radius: 8px; }}
    QLabel#chosen {{
        background: #28{c.accent[1:]}; border: 3px dashed {c.accent}; border-radius: 8px;
    }}
    QToolButton {{ border: 1px solid transparent; border-radius: 4px; padding: 4px; }}
    /* What opens a menu at once has room for the arrow. */
    QToolButton[popupMode="2"] {{ padding-right: 18px; }}
    QToolButton::menu-indicator {{
        subcontrol-origin: padding; subcontrol-position: center right; right: 5px;
    }}
    QToolButton:hover {{ background: {c.well}; }}
    QToolButton:checked {{ background: {c.well}; border-color: {c.frame}; }}
    QToolButton#outlined {{ border-color: {c.frame}; padding: 2px 8px; }}
    QToolButton#outlined[popupMode="2"] {{ padding-right: 18px; }}
    QToolButton#model {{ border-color: {c.frame}; padding: 1px 18px 1px 6px; }}
    QToolButton#primary {{
        background: {c.accent}; color: {c.accent_text}; border-color: {c.accent}; padding: 2px 10px;
    }}
    QToolButton#primary:hover {{ background: {c.accent}; border-color: {c.text}; }}
    QToolButton#primary:focus {{ border-color: {c.text}; }}
    QToolButton#primary:disabled {{
        background: {c.well}; color: {c.disabled}; border-color: {c.frame};
    }}
    QToolButton#fold {{ padding: 2px 4px 2px 0; }}
    QToolButton#fold:checked {{ background: transparent; border-color: transparent; }}
    QToolButton#preset {{ border-color: {c.frame}; padding: 3px 0; }}
    QToolButton#preset:checked {{ border-color: {c.accent}; background: {c.well}; }}
    QFrame#opened {{ border: none; border-right: 1px solid {c.border}; border-radius: 0; }}
    QToolButton#rail {{ border-radius: 6px; }}
    QToolButton:focus, QToolButton#outlined:focus, QToolButton#model:focus {{
        border-color: {c.accent};
    }}
    QToolButton#preset:focus {{ border-color: {c.text}; }}
    QTabBar#layouts::tab {{
        padding: 4px 12px; border: none; border-bottom: 2px solid transparent; color: {c.muted};
    }}
    QTabBar#layouts::tab:selected {{ color: {c.text}; border-bottom-color: {c.accent}; }}
    QTabBar#layouts::tab:hover {{ background: {c.well}; }}
    QTabBar#layouts:focus {{ border: 1px solid {c.accent}; border-radius: 4px; }}
    QTableView, QListWidget, QTreeWidget[frameShape="6"], QPlainTextEdit {{
        border: 1px solid {c.frame}; border-radius: 4px;
    }}
    QTableView:focus, QListWidget:focus, QTreeWidget[frameShape="6"]:focus, QPlainTextEdit:focus {{
        border-color: {c.accent};
    }}
    QSlider::groove {{ background: {c.frame}; height: 4px; border-radius: 2px; }}
    QSlider::sub-page {{ background: {c.accent}; border-radius: 2px; }}
    QSlider::sub-page:disabled {{ background: {c.frame}; }}
    QSlider::handle {{
        background: {c.panel}; border: 1px solid {c.frame}; border-radius: 4px;
        width: 12px; margin: -5px 0;
    }}
    QSlider::handle:focus {{ border-color: {c.accent}; background: {c.accent}; }}
    QHeaderView::section {{
        background: {c.panel}; color: {c.muted}; border: none; border-bottom: 1px solid {c.border};
        padding: 4px 4px 2px 4px;
    }}
    QHeaderView::up-arrow, QHeaderView::down-arrow {{
        subcontrol-position: top center; width: 9px; height: 6px;
    }}
    QScrollBar {{ background: transparent; margin: 0; }}
    QScrollBar:vertical {{ width: 8px; }}
    QScrollBar:horizontal {{ height: 8px; }}
    QScrollBar::handle {{ background: {c.frame}; border-radius: 3px; margin: 1px; }}
    QScrollBar::handle:vertical {{ min-height: 24px; }}
    QScrollBar::handle:horizontal {{ min-width: 24px; }}
    QScrollBar::handle:hover {{ background: {c.muted}; }}
    QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
    QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
    QScrollArea {{ border: none; background: transparent; }}
    QScrollArea > QWidget > QWidget#page {{ background: transparent; }}
    QFrame#rule {{ border: none; background: {c.border}; max-height: 1px; }}
    """


def is_dark(chosen: bool | None) -> bool:
    """The user's choice of theme, or (None) the system's."""
    system = QApplication.styleHints().colorScheme()
    return system == Qt.ColorScheme.Dark if chosen is None else chosen
