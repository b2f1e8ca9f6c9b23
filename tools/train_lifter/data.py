"""Takes on disk, made by several processes: ``python -m tools.train_lifter data``."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

from sd2core.body.landmark_models import DEFAULT_MODEL, LandmarkModel, landmark_models
from sd2core.errors import Sd2Error
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT
from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from tools.train_lifter.takes import Motion, Take, TakeMaker


class Data(Motion):
    """Options of ``data``.

    Parameters
    ----------
    out : OUT
        folder of the takes
    takes : N
        how many
    processes : P
        at work at once
    models : FOLDER
        the landmark models
    landmark_model
        which of them looks
    """

    out: Annotated[Path, ARGUMENT]
    takes: Count = 400
    processes: Count = 2
    models: Path | None = None
    landmark_model: LandmarkModel = DEFAULT_MODEL


_maker: TakeMaker | None = None


def make_lifter_data(options: Data, progress: Progress = silent) -> int:
    """Make the takes of a folder that are not there yet, each whole or not at all; their number."""
    landmark_models(options.models, model=options.landmark_model)
    options.out.mkdir(parents=True, exist_ok=True)
    missing = [n for n in range(options.takes) if not take_path(options.out, n).exists()]
    done = options.takes - len(missing)
    progress(done, options.takes)
    with ProcessPoolExecutor(options.processes, get_context("spawn"), _start, (options,)) as pool:
        for made, _ in enumerate(pool.map(partial(_make, options.out), missing), start=1):
            progress(done + made, options.takes)
    return len(missing)


def take_path(folder: Path, number: int) -> Path:
    """Path of one take."""
    return folder / f"take-{number:05d}.npz"


def load_takes(folder: Path) -> list[Take]:
    """All takes of a folder, in the order of their numbers; Sd2Error if there are none."""
    takes = [Take.load(path) for path in sorted(folder.glob("take-*.npz"))]
    if not takes:
        raise Sd2Error(
            f"There are no takes in {folder}",
            "a folder made by `python -m tools.train_lifter data`",
        )
    return takes


def _start(options: Data) -> None:
    end_with_parent()
    from sd2core.body.blazepose import PoseLandmarker

    global _maker
    models = landmark_models(options.models, model=options.landmark_model)
    _maker = TakeMaker(PoseLandmarker(models.landmarker), options)


def _make(folder: Path, number: int) -> None:
    assert _maker is not None
    _maker.make(number).save(take_path(folder, number))
