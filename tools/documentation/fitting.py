"""Makes ``fitting.md`` and its pictures: ``make fitting``, about fifteen minutes.

Every figure is measured when this runs. Clips and fits stay in ``build/fitting`` (or the
folder that is named); what is there is not made again, and its time is not known. The
real videos are left out where the recordings are not there (``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sd2core.accuracy.cache import this_machine
from sd2core.compare.figure import draw_comparison
from sd2core.compare.meshes import compare_meshes
from sd2core.files.figure_files import save_figure
from sd2core.io.mesh import load_mesh
from sd2core.io.video import open_video
from sd2core.numerics.compiled import warm_up
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, IMAGES, SHARED
from tools.fitting.__main__ import main as run_fitting
from tools.fitting.truth import read_truth
from tools.motion_capture.__main__ import main as run_motion_capture

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

PAGE = """\
# How good the fit from video is

How well does a body that `sd2 fit` makes of a video follow the person, above all along the line of
sight? Measured by

```
make fitting
```

on {machine}: videos of simulated people, sixteen with made motions and, where the motion capture is
there, thirty-six that move as recorded people did; nothing in the program was trained with these
motions and persons, nor tuned on them. The fit is given the camera's focal length and the person's
height. The motion in real videos is not known: there a body can only be held against the picture.

![Frames of eight of the clips](images/fit-truth.png)

**Line-of-sight velocity** is that of a limb towards the camera. **Map L1** is the sum of the
absolute differences between the synthetic Doppler maps of the fitted and of the true mesh over the
sum of the true one: of the expected map of the fit, the **plain** one, and what the fit's map
**states**. **Spread** is that of the joints' velocities within a frame, fitted over true, **peak
kept** the largest fitted speed along the line of sight over the true one. Of a clip those joints
count that move (0.1 m/s or more); of motions of real people clips count in which one does. **Ends**
are the first and last five frames, over those between. **Bold**: missed.

{tables}
The clip {compared}, true and fitted:

![Doppler maps and velocities of one clip, true and fitted](images/fit-compared.png)

**What limits it** is depth: given the true depths and velocities along the optical axis, the same
fit is well within all that is wanted ([decision 19](decisions/0019-known-truth-for-the-fit.md)).

**What this cannot say.** The simulated bodies are of the family that is fitted, their cloth has
no folds and nothing stands before them. Of a real video neither focal length nor height is known; a
wrong height scales all distances and velocities alike.
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    warm_up()
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else BUILD / "fitting"
    folder.mkdir(parents=True, exist_ok=True)
    clips, fits, tables = folder / "clips", folder / "fits", folder / "tables.md"
    motions = []
    if (SHARED / "motion").is_dir():
        _run(run_motion_capture, "drive", SHARED / "motion", folder / "motions")
        motions = ["--motions", folder / "motions"]
    _run(run_fitting, "clips", clips, *motions)
    _frames(clips)
    videos = [SHARED / "video" / name for name in REAL]
    real = [video for video in videos if video.exists()]
    score = ["score", clips, "--keep", fits, "--markdown", tables]
    _run(run_fitting, *score, *(["--real", *real] * bool(real)))
    truth = read_truth(clips / COMPARED)
    pair = [truth.mesh(), load_mesh(fits / f"{COMPARED}.zarr")]
    compared = compare_meshes(pair, ["true", "fitted"])
    save_figure(draw_comparison(compared), IMAGES / "fit-compared.png")
    page = PAGE.format(machine=this_machine(), tables=tables.read_text("utf-8"), compared=COMPARED)
    write_page("fitting.md", page)


def _run(program: Callable[[Sequence[str]], int], *arguments: object) -> None:
    code = program([str(argument) for argument in arguments])
    if code:
        sys.exit(code)


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
