"""The Train panel: denoisers, or classifiers."""

from __future__ import annotations

from PySide6.QtWidgets import QVBoxLayout, QWidget

from sd2app.widgets.pages import InnerPage, InnerPages


class TrainPage(QWidget):
    """Page for the training of denoisers, or that of classifiers."""

    def __init__(
        self, denoisers: QWidget, classifiers: QWidget, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._pages = InnerPages(
            (
                InnerPage("Denoiser", "Train what makes synthetic maps a radar's", denoisers),
                InnerPage("Classifier", "Train what tells gestures apart", classifiers),
            ),
            parent=self,
        )
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 6, 0, 0)
        layout.addWidget(self._pages)

    def turn_to(self, page: str) -> None:
        """Show a page by its name."""
        self._pages.turn_to({"Denoiser": 0, "Classifier": 1}[page])
