"""Keeps a folder as ``sd2 batch`` does, and makes nothing.

``fake_batch.py [--step-s S] [--refuse TEXT] [--fail N] [--die-at N] [--break TEXT] batch PLAN
--workers N``: per file of the plan one map and one denoised map.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import time
from dataclasses import asdict
from pathlib import Path

from sd2core.batch.folder import PROGRESS_FORMAT, BatchFolder
from sd2core.batch.plan_file import plan_text, read_plan
from sd2core.runs.control import Control, write_control
from sd2core.runs.progress import ProgressWriter
from sd2core.sensor import VirtualSensor

ERROR = {"found": "It is damaged", "expected": "a mesh", "remedy": "Make it again"}


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--step-s", type=float, default=0.0)
    parser.add_argument("--fail", type=int, default=0)
    parser.add_argument("--die-at", type=int, default=0)
    parser.add_argument("--break", dest="break_down", default="")
    parser.add_argument("--refuse", default="")
    parser.add_argument("--slow-start-s", type=float, default=0.0)
    parser.add_argument("command", choices=["batch"])
    parser.add_argument("plan", type=Path)
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    time.sleep(options.slow_start_s)
    if options.refuse:
        print(f"sd2: {options.refuse}", file=sys.stderr)
        return 1
    return run(read_plan(options.plan), options)


def run(plan, options: argparse.Namespace) -> int:
    folder = BatchFolder(Path(plan.out))
    folder.prepare()
    lock = folder.lock()
    write_control(folder.control, "run")
    control = Control(folder.control)
    control.take_signals()
    folder.set_state("running", started_unix_s=time.time())
    folder.plan.write_text(plan_text(plan, folder.path), encoding="utf-8")
    steps = ("inspect", "synthesise", "denoise")
    files = plan.recordings.files
    counts = {"there": {}, "done": dict.fromkeys(steps, 0), "failed": 0, "waiting": 0}
    counts["total"] = dict.fromkeys(steps, len(files))
    outcome, error = "finished", None
    with ProgressWriter(folder.progress) as lines:
        lines.say(
            "start", format=PROGRESS_FORMAT, version=1, out=str(folder.path), steps=list(steps),
            recordings=len(files), placements=plan.placement_count, plan=str(options.plan),
        )  # fmt: skip
        for number, file in enumerate(files, start=1):
            if control.word() == "stop":
                outcome = "stopped"
                break
            if options.break_down:
                outcome, error = "failed", {**ERROR, "found": options.break_down}
                break
            if number == options.die_at:
                os.kill(os.getpid(), signal.SIGKILL)
            with folder.log.open("a", encoding="utf-8") as log:
                log.write(f"looked at {Path(file).name}\n")
            if number <= options.fail:
                counts["failed"] += 1
                counts["waiting"] += 1
                lines.say("failed", step="synthesise", recording=Path(file).name, placement=2,
                          error=ERROR, worker_died=False)  # fmt: skip
            else:
                for step in steps:
                    counts["done"][step] += 1
            lines.say("progress", **counts, running=1, workers=options.workers, last=None,
                      elapsed_s=60.0 * number, left_s=60.0 * (len(files) - number))  # fmt: skip
            time.sleep(options.step_s)
        if outcome == "finished":
            write_results(folder, files[options.fail :])
        lines.say("end", outcome=outcome, **counts, elapsed_s=90.0, report=str(folder.report),
                  dataset=None, error=error)  # fmt: skip
    folder.set_state(outcome)
    lock.release()
    return 1 if counts["failed"] else 0


def write_results(folder: BatchFolder, files) -> None:
    rows = [
        {
            "recording": Path(file).name, "subject": Path(file).stem, "source": file,
            "mesh": file, "placement": placement,
            "sensor": asdict(VirtualSensor((0.5 * placement, 0.0, 0.25))),
            "target_m": [0.0, 0.0, 0.25],
            "start": start, "stop": start + 30,
            "synthetic": "synthetic/aa/a.npz", "denoised": "denoised/bb/b.npz",
        }
        for file in files
        for placement in (1, 2)
        for start in (0, 30)
    ]  # fmt: skip
    folder.results.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    (folder.path / "dataset.card.md").write_text("# A data set", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
