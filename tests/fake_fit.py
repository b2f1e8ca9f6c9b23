"""Speaks as ``sd2 fit --progress-json`` does, and fits nothing.

``fake_fit.py [--frames N] [--pause-s S] [--stop-at N] [--refuse TEXT] FOLDER fit VIDEO --out
OUT …``;
the mesh it writes is a folder with nothing in it, or with ``--body`` an octahedron that moves.
``OUT.partial`` holds how many frames are done.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

from sd2core.cli.background import run_in_folder
from sd2core.options.fitting import meshes_of
from sd2core.runs.command_folder import CommandFolder

STAGES = ["find", "refine", "fit", "write"]


def say(**content: object) -> None:
    print(json.dumps(content), flush=True)


def person(frame: int) -> tuple[list[list[float]], list[float]]:
    """Landmarks that stand upright in a picture of 160 × 120 and move to the right."""
    import math

    points = [[60.0 + frame + 8.0 * math.cos(k), 10.0 + 3.0 * k] for k in range(33)]
    return points, [1.0 - 0.02 * k for k in range(33)]


def write_mesh(out: Path, frames: int) -> None:
    import numpy as np

    from sd2core.io.mesh import save_mesh
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.timebase import Timebase

    corners = 0.3 * np.concatenate([np.eye(3), -np.eye(3)])
    vertices = np.repeat(corners[None], frames, axis=0).astype(np.float32)
    vertices[:, :, 2] += 2.0
    vertices[:, :, 0] += np.linspace(0.0, 0.3, frames, dtype=np.float32)[:, None]
    octants = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    # Every second octant is a mirror image of its neighbours.
    faces = np.array([o if sum(k > 2 for k in o) % 2 == 0 else o[::-1] for o in octants], np.int32)
    save_mesh(MeshSequence(vertices, faces, Timebase.regular(frames, 30.0)), out)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--pause-s", type=float, default=0.0)
    parser.add_argument("--stop-at", type=int, default=-1)
    parser.add_argument("--refuse", default="")
    parser.add_argument("--die-at", type=int, default=-1)
    parser.add_argument("--body", action="store_true")
    parser.add_argument("--width", type=int, default=160)
    parser.add_argument("--height", type=int, default=120)
    parser.add_argument("folder", type=Path)
    parser.add_argument("command", choices=["fit"])
    parser.add_argument("video", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--overwrite", action="store_true")
    parser.add_argument("--progress-json", action="store_true", required=True)
    parser.add_argument("--stature-m", type=float)
    parser.add_argument("--focal-px", type=float)
    parser.add_argument("--person-box")
    parser.add_argument("--person-frame")
    parser.add_argument("--people", default="")
    options = parser.parse_args()
    return run_in_folder(CommandFolder(options.folder), lambda: fit(options))


def fit(options: argparse.Namespace) -> int:
    partial = options.out.with_name(options.out.name + ".partial")
    first = int(partial.read_text()) if partial.exists() else 0
    size = {"width": options.width, "height": options.height}
    say(event="start", format="sd2-fit-progress", version=1, video=str(options.video),
        out=str(options.out), frames=options.frames, frames_per_s=30.0, stages=STAGES,
        resumed=partial.exists(), **size)  # fmt: skip
    say(event="something-new", text="a reader ignores what it does not know")
    if options.refuse:
        say(event="error", text=options.refuse)
        print(f"sd2: {options.refuse}", file=sys.stderr)
        return 1
    for frame in range(first, options.frames):
        # Before it is said: whoever hears of a frame may end this process.
        partial.write_text(str(frame + 1))
        image_px, visibility = person(frame)
        say(event="landmarks", stage="find", frame=frame, image_px=image_px, visibility=visibility)
        say(event="progress", stage="find", done=frame + 1, total=options.frames, unit="frame")
        if frame == options.die_at:
            os.abort()
        time.sleep(3600 if frame == options.stop_at else options.pause_s)
    for stage in STAGES[1:]:
        say(event="progress", stage=stage, done=1, total=1, unit="step")
    say(event="note", text="This was no fit.")
    people = [int(number) for number in options.people.split(",") if number]
    for out in meshes_of(options.out, people):
        if options.body:
            write_mesh(out, options.frames)
        else:
            out.mkdir()
    partial.unlink()
    say(event="done", out=str(options.out), frames=options.frames, present=options.frames,
        seconds=0.1)  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
