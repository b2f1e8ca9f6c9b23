"""What the user wants to listen to, as a command."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ListenRequest:
    """A radar that sends by a DCA1000, or a capture that is replayed; and where frames go."""

    folder: Path  # the recording
    setup: Path | None = None  # configuration of the radar
    address: str = ""  # of this computer, with or without a port; empty: of this computer alone
    replay: Path | None = None

    def words(self) -> list[str]:
        """Words of the ``sd2`` command that does it."""
        if self.replay is not None:
            source = ["--replay", str(self.replay)]
        else:
            source = ["--dca1000", self.address] if self.address else ["--dca1000"]
            source += ["--setup", str(self.setup)]
        return ["listen", *source, "--out", str(self.folder), "--json", "--columns"]
