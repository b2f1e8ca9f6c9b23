"""Dialog to export cut-outs: choice of spans and parts."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHBoxLayout,
    QVBoxLayout,
    QWidget,
)

from sd2app.widgets.inputs import Choice
from sd2app.widgets.panel import sentence
from sd2core.cutouts.source import CutSource, Part
from sd2core.labels.spans import Span

_ABOUT = (
    "Each span becomes a folder of its own, with 0 s at its first frame, and an index lists them"
    " all. Cut-outs that are in the folder already are kept."
)


class CutOutDialog(QDialog):
    """Accepted to choose a folder for :attr:`spans` and :attr:`parts`."""

    def __init__(
        self,
        groups: Sequence[tuple[str, tuple[Span, ...]]],
        source: CutSource,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export cut-outs")
        self._groups, self._source = groups, source
        self._which = Choice("Which spans", self)
        for name, spans in groups:
            self._which.addItem(f"{name} ({len(spans)})")
        self._which.currentIndexChanged.connect(self._refresh)
        maps = ", ".join(source.maps)
        there: dict[Part, tuple[str, bool]] = {
            "video": ("video", source.video is not None),
            "mesh": ("mesh", source.mesh is not None),
            "maps": (f"maps: {maps}" if maps else "maps", bool(maps)),
        }
        self._parts: dict[Part, QCheckBox] = {}
        row = QHBoxLayout()
        row.setSpacing(16)
        for part, (text, has) in there.items():
            box = QCheckBox(text, self)
            box.setEnabled(has)
            box.setChecked(has)
            box.toggled.connect(self._refresh)
            self._parts[part] = box
            row.addWidget(box)
        row.addStretch(1)
        self._size = sentence("")
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel, self)
        self._go = buttons.addButton("Choose folder…", QDialogButtonBox.ButtonRole.AcceptRole)
        self._go.setDefault(True)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        form = QFormLayout()
        form.setHorizontalSpacing(16)
        form.setVerticalSpacing(8)
        form.addRow("Spans", self._which)
        form.addRow("Parts", row)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 16, 16, 16)
        layout.setSpacing(12)
        layout.addLayout(form)
        layout.addWidget(self._size)
        layout.addWidget(sentence(_ABOUT))
        layout.addStretch(1)
        layout.addWidget(buttons)
        self._refresh()
        self.setMinimumWidth(520)

    @property
    def spans(self) -> tuple[Span, ...]:
        """Spans chosen."""
        return self._groups[self._which.currentIndex()][1]

    @property
    def parts(self) -> tuple[Part, ...]:
        """Parts chosen."""
        return tuple(part for part, box in self._parts.items() if box.isChecked())

    def _refresh(self) -> None:
        frames = sum(
            stop - first for first, stop in (self._source.frames_of(one) for one in self.spans)
        )
        seconds = sum(one.duration_s for one in self.spans)
        self._size.setText(f"{frames:,} frames, {seconds:.1f} s in all.")
        self._go.setEnabled(bool(self.spans and self.parts))
