"""Runs of ``sd2`` commands that the Train panel starts, other than trainings of denoisers."""

from __future__ import annotations

from pathlib import Path

from sd2app.background.runs import KnownRun, Messages
from sd2app.widgets.text import clock_text
from sd2core.runs.command_folder import CommandFolder, commands_in

SENTENCES = Messages(
    busy="{} is under way. Wait for it, or stop it.",
    found="{} is under way. The Train panel shows it.",
    finished="{} is done. The Train panel shows what came of it.",
    failed="{} did not come to its end. The Train panel says more.",
)
_STATES = {0: "finished", 130: "stopped", None: "not ended"}


def known_commands(folder: Path, what: str = "") -> list[KnownRun]:
    """Return the commands of a folder, titled by what they are, or else by their names."""
    return [KnownRun(one.path, _title(one, what), one.live) for one in commands_in(folder)]


def _title(folder: CommandFolder, what: str) -> str:
    state = "under way" if folder.live else _STATES.get(folder.code, "failed")
    started = clock_text(folder.facts.get("started_unix_s", 0.0))
    return f"{started} · {what or folder.path.name} · {state}"
