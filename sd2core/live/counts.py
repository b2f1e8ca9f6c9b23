"""Numbers of frames of a radar that is listened to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

from sd2core.files.tables import counted


@dataclass
class Counts:
    """Numbers of frames by what became of them."""

    recorded: int = 0
    dropped: int = 0  # received, not stored: the disk was too slow
    lost: int = 0  # sent, not received
    damaged: int = 0  # stored, with zeros in place of lost packets
    not_shown: int = 0  # stored, not in the live map: the caller was too slow

    @classmethod
    def of(cls, message: Mapping[str, Any]) -> Self:
        """Numbers that ``sd2 listen --json`` tells."""
        return cls(**{one.name: int(message[one.name]) for one in fields(cls)})

    @property
    def whole(self) -> bool:
        """True if nothing is missing in the recording."""
        return not (self.dropped or self.lost or self.damaged)

    @property
    def frames(self) -> str:
        """Number of frames recorded, of all that were sent: ``47 of 50 frames``."""
        sent = self.recorded + self.dropped + self.lost
        return (
            counted(sent, "frame")
            if sent == self.recorded
            else (f"{self.recorded:,} of {counted(sent, 'frame')}")
        )

    @property
    def missing(self) -> str:
        """Frames that the recording lacks, or that lack something; empty if none do."""
        losses = {"dropped": self.dropped, "lost": self.lost, "damaged": self.damaged}
        return ", ".join(f"{number:,} {what}" for what, number in losses.items() if number)
