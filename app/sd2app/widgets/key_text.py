"""Keys as texts."""

from __future__ import annotations

import functools

from PySide6.QtGui import QKeySequence


def canonical(key: str) -> str:
    """A key as Qt writes it, the same on every machine; empty where it is none."""
    sequence = QKeySequence(key)
    one = sequence.count() == 1
    return sequence.toString(QKeySequence.SequenceFormat.PortableText) if one else ""


@functools.lru_cache
def native(key: str) -> str:
    """A key as it is written on this machine."""
    return QKeySequence(key).toString(QKeySequence.SequenceFormat.NativeText)
