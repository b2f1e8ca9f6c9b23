"""Takes on disk, made by several processes: ``python -m tools.train_lifter data``."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path

from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from tools.train_lifter.deeds import Manner
from tools.train_lifter.takes import Take, TakeMaker

_maker: TakeMaker | None = None


def make_lifter_data(
    folder: Path,
    takes: int,
    seed: int = 0,
    *,
    held_out: bool = False,
    manner: Manner = "any",
    processes: int = 2,
    models: Path | None = None,
    progress: Progress = silent,
) -> int:
    """Make the takes of a folder that are not there yet.

    Parameters
    ----------
    folder : Path
        Made when missing; ``take-NNNNN.npz`` are written whole or not at all.
    takes : int
        How many there shall be.
    held_out : bool
        With the motion that is kept for testing.
    manner : {"any", "natural", "gestures"}
        How people move.
    models : Path, optional
        Folder of the landmark models.

    Returns
    -------
    int
        How many were made.
    """
    from sd2core.body.landmark_models import landmark_models

    landmark_models(models)
    folder.mkdir(parents=True, exist_ok=True)
    missing = [n for n in range(takes) if not take_path(folder, n).exists()]
    job = partial(_make, folder, seed, held_out, manner)
    done = takes - len(missing)
    progress(done, takes)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        processes, mp_context=context, initializer=_start, initargs=(models,)
    ) as pool:
        futures = [pool.submit(job, number) for number in missing]
        try:
            for future in as_completed(futures):
                future.result()
                done += 1
                progress(done, takes)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return len(missing)


def take_path(folder: Path, number: int) -> Path:
    """Path of one take."""
    return folder / f"take-{number:05d}.npz"


def load_takes(folder: Path) -> list[Take]:
    """All takes of a folder, in the order of their numbers."""
    return [Take.load(path) for path in sorted(folder.glob("take-*.npz"))]


def _start(models: Path | None) -> None:
    end_with_parent()
    from sd2core.body.blazepose import PoseLandmarker
    from sd2core.body.landmark_models import landmark_models

    global _maker
    _maker = TakeMaker(PoseLandmarker(landmark_models(models).landmarker))


def _make(folder: Path, seed: int, held_out: bool, manner: Manner, number: int) -> None:
    assert _maker is not None
    take = _maker.make((seed, int(held_out), number), held_out=held_out, manner=manner)
    take.save(take_path(folder, number))
