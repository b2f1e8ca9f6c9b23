"""Takes on disk, made by several processes: ``python -m tools.train_lifter data``."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path

from sd2core.body.landmark_models import DEFAULT_MODEL, LandmarkModel, landmark_models
from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from tools.motion_capture.bodies import BodyMotion, load_motions
from tools.train_lifter.deeds import Manner
from tools.train_lifter.takes import Take, TakeMaker

_maker: TakeMaker | None = None
_motions: list[BodyMotion] = []


def make_lifter_data(
    folder: Path,
    takes: int,
    seed: int = 0,
    *,
    held_out: bool = False,
    manner: Manner = "any",
    motions: Path | None = None,
    processes: int = 2,
    models: Path | None = None,
    landmark_model: LandmarkModel = DEFAULT_MODEL,
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
    manner : {"any", "natural", "gestures", "forearms"}
        How simulated people move.
    motions : Path, optional
        Folder made by ``python -m tools.motion_capture``: people move as those in it do. With
        ``held_out``, as the people who are kept for calibration.
    models : Path, optional
        Folder of the landmark models.
    landmark_model : {"full", "heavy"}
        Which of them looks.

    Returns
    -------
    int
        How many were made.
    """
    landmark_models(models, model=landmark_model)
    folder.mkdir(parents=True, exist_ok=True)
    missing = [n for n in range(takes) if not take_path(folder, n).exists()]
    job = partial(_make, folder, seed, held_out, manner)
    if motions is not None:
        job = partial(_make_captured, folder, seed, held_out)
    done = takes - len(missing)
    progress(done, takes)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(
        processes,
        mp_context=context,
        initializer=_start,
        initargs=(models, landmark_model, motions, held_out),
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


def _start(
    models: Path | None, landmark_model: LandmarkModel, motions: Path | None, held_out: bool
) -> None:
    end_with_parent()
    from sd2core.body.blazepose import PoseLandmarker

    global _maker, _motions
    _maker = TakeMaker(PoseLandmarker(landmark_models(models, model=landmark_model).landmarker))
    if motions is not None:
        _motions = load_motions(motions, "calibrate" if held_out else "learn")


def _make(folder: Path, seed: int, held_out: bool, manner: Manner, number: int) -> None:
    assert _maker is not None
    take = _maker.make((seed, int(held_out), number), held_out=held_out, manner=manner)
    take.save(take_path(folder, number))


def _make_captured(folder: Path, seed: int, held_out: bool, number: int) -> None:
    assert _maker is not None
    _maker.captured((seed, int(held_out), number), _motions).save(take_path(folder, number))
