"""Which file a figure is to be."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget

from sd2core.files.figure_files import SUFFIXES

FIGURES = ";;".join(f"{suffix[1:].upper()} (*{suffix})" for suffix in SUFFIXES)


def ask_figure(parent: QWidget, title: str, name: str) -> Path | None:
    """Let the user choose; a name without an ending gets that of the kind."""
    chosen, kind = QFileDialog.getSaveFileName(parent, title, f"{name}.png", FIGURES)
    if not chosen:
        return None
    path = Path(chosen)
    return path if path.suffix else path.with_suffix(f".{kind[:3].lower()}")
