"""Makes ``fitting.md`` and its pictures: ``make fitting``, about ten minutes.

Every figure is measured when this runs. Clips and fits stay in ``build/fitting``; what is there is
not made again, and its time is not known. The real videos are left out where the recordings are not
there (``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sd2core.files.figure_files import save_figure
from sd2core.io.video import open_video
from sd2core.numerics.compiled import warm_up
from tools.documentation.measured import BUILD, DOCS, IMAGES, SHARED, write_filled
from tools.documentation.runs import run, sd2

REAL = ("walk.mkv", "help.mkv", "again.mkv")

SHOWN = (
    ("horizontal-slow", 2.2),
    ("horizontal-normal", 2.0),
    ("vertical-slow", 1.2),
    ("all-fast", 1.2),
    ("horizontal-fast", 1.2),
    ("vertical-fast", 1.1),
    ("walk", 2.0),
    ("turn-other", 1.6),
)
COMPARED = "all-normal"


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    warm_up()
    folder = BUILD / "fitting"
    folder.mkdir(parents=True, exist_ok=True)
    clips, fits, tables = folder / "clips", folder / "fits", folder / "tables.md"
    motions = []
    if (SHARED / "motion").is_dir():
        run("tools.motion_capture", "drive", SHARED / "motion", folder / "motions")
        motions = ["--motions", folder / "motions"]
    run("tools.fitting", "clips", clips, *motions)
    _frames(clips)
    videos = [SHARED / "video" / name for name in REAL]
    real = [video for video in videos if video.exists()]
    score = ["score", clips, "--keep", fits, "--markdown", tables]
    run("tools.fitting", *score, *(["--real", *real] * bool(real)))
    pair = clips / COMPARED / "mesh.zarr", fits / f"{COMPARED}.zarr"
    figure = IMAGES / "fit-compared.png"
    sd2("compare-meshes", *pair, "--names", "true,fitted", "--figure", figure, "--overwrite")
    shutil.copyfile(tables.with_suffix(".csv"), DOCS / "fitting-clips.csv")
    write_filled("fitting.md", tables=tables.read_text("utf-8"), compared=COMPARED)


def _frames(clips: Path) -> None:
    """One frame of each clip that is shown."""
    figure = Figure(figsize=(9.6, 3.7), dpi=100)
    for number, (name, time_s) in enumerate(SHOWN):
        with open_video(clips / name / "video.mp4") as video:
            picture = np.asarray(video.read(video.timebase.frame_at(time_s)))
        column, row = number % 4, number // 4
        axes = figure.add_axes((0.25 * column, 0.5 - 0.5 * row, 0.249, 0.498))
        axes.imshow(picture)
        axes.set_axis_off()
    save_figure(figure, IMAGES / "fit-truth.png")


if __name__ == "__main__":
    main()
