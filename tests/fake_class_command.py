"""Keeps a folder as ``sd2core.cli.background --folder`` does, and learns nothing.

``fake_class_command.py [--step-s S] [--fail TEXT] [--die-at N] FOLDER classify train|table
DATA… --out OUT …``, or ``… FOLDER study PLAN``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

from sd2core.runs.command_folder import CommandFolder

STEPS = 6
STEP_S = "SD2_FAKE_STEP_S"
"""Variable of the environment with the time of a step, where the command line has none."""


def say(event, **content):
    print(json.dumps({"event": event, **content}), flush=True)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--step-s", type=float, default=float(os.environ.get(STEP_S, 0)))
    parser.add_argument("--fail", default="")
    parser.add_argument("--die-at", type=int, default=0)
    parser.add_argument("folder", type=Path)
    parser.add_argument("command")
    parser.add_argument("data", nargs="+")
    parser.add_argument("--out", type=Path)
    for name in ("--quick", "--radar-only", "--same-people", "--progress-json"):
        parser.add_argument(name, action="store_true")
    for name in ("--model", "--features", "--maps", "--steps", "--seed", "--width", "--delay-s"):
        parser.add_argument(name)
    options = parser.parse_args()
    folder = CommandFolder(options.folder)
    lock = folder.lock()
    folder.set_state("running")
    code = work(options, folder)
    folder.note_end(code)
    lock.release()
    return code


def work(options, folder) -> int:
    if options.fail:
        print(f"sd2: {options.fail}", file=sys.stderr)
        return 1
    table, code = options.command == "study" or options.data[0] == "table", 0
    if not table:
        say("start", steps=STEPS, clips=3, frames=900)
    for step in range(1, STEPS + 1):
        time.sleep(options.step_s)
        if options.die_at == step:
            os._exit(9)
        if table:
            say("run", done=step - 1, total=STEPS, elapsed_s=float(step))
        else:
            say("step", step=step, loss=1.0 / step, elapsed_s=2.0 * step)
            if step % 2 == 0:
                say("check", step=step, validation_mean_recall=[0.5, 0.8, 0.7][step // 2 - 1])
        if folder.stop_wanted:
            code = 130
            break
    if table and code == 0:
        out = options.out or Path(options.data[0]).parent / "made"
        out.mkdir(exist_ok=True)
        (out / "study.json").write_text(json.dumps({"conclusion": "It helped."}))
    if not table:
        say("end", best_step=4, interrupted=code == 130)
        options.out.write_bytes(b"a model")
    return code


if __name__ == "__main__":
    sys.exit(main())
