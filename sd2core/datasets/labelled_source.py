"""Names of labelled data as they are typed, for the command line too, whose help loads no NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class LabelledSource(NamedTuple):
    """Labelled data and its subject, empty where none was given."""

    path: Path
    subject: str = ""

    @classmethod
    def parsed(cls, text: str) -> LabelledSource:
        """Parse ``PATH`` or ``PERSON=PATH``."""
        name, sign, path = text.partition("=")
        if sign and name and path and "/" not in name and not Path(text).exists():
            return cls(Path(path), name)
        return cls(Path(text))

    def __str__(self) -> str:
        return f"{self.subject}={self.path}" if self.subject else str(self.path)
