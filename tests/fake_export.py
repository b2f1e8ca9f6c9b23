"""Speaks as ``sd2 export --progress-json`` does, and writes nothing.

``fake_export.py HOW export PLACE --out OUT …``; HOW is ``done``, ``refused``, ``silent`` or
``slow``, which goes on until it is stopped. What it was asked for is in ``OUT.asked``.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path


def say(**content: object) -> None:
    print(json.dumps(content), flush=True)


def main() -> int:
    how, words = sys.argv[1], sys.argv[2:]
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
    while how == "slow":
        time.sleep(0.05)
    say(event="something new", whatever=1)
    say(event="progress", done=2000, total=2000, stage="segments")
    say(
        event="done", dataset=str(out), card=str(out.with_suffix(".card.md")),
        sheet=str(out.with_suffix(".png")), segments=7, sources=2, failed=["b: it is damaged"],
    )  # fmt: skip
    return 1


if __name__ == "__main__":
    sys.exit(main())
