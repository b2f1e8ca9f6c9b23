"""Speaks as ``sd2 export --progress-json`` in a folder of its own does, and writes no data set.

``fake_export.py HOW FOLDER export PLACE --out OUT …``; HOW is ``done``, ``refused``,
``silent`` or ``slow``, which goes on until it is stopped, or until there is ``OUT.go``. What
it was asked for is in ``OUT.asked``.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

from sd2core.runs.command_folder import CommandFolder


def say(**content: object) -> None:
    print(json.dumps(content), flush=True)


def main() -> int:
    how, folder, words = sys.argv[1], CommandFolder(Path(sys.argv[2])), sys.argv[3:]
    lock = folder.lock()
    folder.set_state("running")
    folder.note_end(code := work(how, folder, words))
    lock.release()
    return code


def work(how: str, folder: CommandFolder, words: list[str]) -> int:
    out = Path(words[words.index("--out") + 1])
    out.with_name(f"{out.name}.asked").write_text(json.dumps(words))
    if how == "silent":
        print("sd2: the disk is full", file=sys.stderr)
        return 1
    say(event="start", format="sd2-export-progress", version=1, sources=2)
    say(event="progress", done=500, total=2000, stage="segments")
    if how == "refused":
        say(event="error", text="It cannot be.")
        return 1
    while how == "slow" and not out.with_name(f"{out.name}.go").exists():
        time.sleep(0.05)
        if folder.stop_wanted:
            return 130
    say(event="something new", whatever=1)
    say(event="progress", done=2000, total=2000, stage="segments")
    say(
        event="done", dataset=str(out), card=str(out.with_suffix(".card.md")),
        sheet=str(out.with_suffix(".png")), segments=7, sources=2, failed=["b: it is damaged"],
    )  # fmt: skip
    return 1


if __name__ == "__main__":
    sys.exit(main())
