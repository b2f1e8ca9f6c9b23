"""A campaign on disk, take by take, made by several processes: ``sd2 simulate campaign``."""

from __future__ import annotations

import hashlib
import itertools
import json
import multiprocessing
import signal
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from pathlib import Path

from threadpoolctl import threadpool_limits

from sd2core.body.shape import ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.mesh.vertex_parts import PARTS
from sd2core.pairs.store import PairWriter, Take
from sd2core.pairs.summary import TakeKey
from sd2core.processes import end_with_parent
from sd2core.progress import Progress, silent
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.simulate.campaign.motion import LABELS
from sd2core.simulate.campaign.scene import subject_name
from sd2core.simulate.campaign.takes import Campaign, TakeMaker, motions_of, take_name
from sd2core.version import __version__

_maker: TakeMaker | None = None


def make_campaign(
    out: Path,
    campaign: Campaign,
    *,
    subjects: int = 6,
    minutes: float = 90.0,
    processes: int = 2,
    errors: Path | None = None,
    progress: Progress = silent,
) -> int:
    """Make the takes of a campaign that are not there yet, and return their number.

    Takes are written in order, one of each subject in turn, so that a campaign that is
    stopped has equally much of every subject; started again it goes on, as if it
    had not been stopped. A longer one begins with a shorter one's takes.

    Parameters
    ----------
    out : Path
        Folder of the pairs.
    campaign : Campaign
    subjects : int
        1 or more.
    minutes : float
        Length of all subjects together, where placements count once, as in the number of takes.
    processes : int
        With one the takes are made in this process.
    errors : Path, optional
        Errors of fits, in place of the bundled ones.
    progress : Progress
        Counts takes.

    Raises
    ------
    Sd2Error
        When the folder holds something else, or a campaign of other settings.
    """
    if subjects < 1:
        raise Sd2Error(f"{subjects} subjects", "at least one")
    known = FitErrors.load(errors)
    captured = motions_of(campaign, ShapeSpace())
    writer = PairWriter(
        Path(out),
        kind="simulated",
        axis=campaign.synthesis.axis,
        null_bins=campaign.synthesis.null_bins,
        frame_rate_hz=1.0 / campaign.radar.frame_repetition_s,
        labels=LABELS,
        provenance={
            **campaign.provenance(),
            **({} if captured is None else {"motions": captured.provenance}),
            "fit_errors": {**known.provenance, "sha256": digest(known)},
            "version": __version__,
        },
        parts=PARTS if campaign.limbs else (),
    )
    numbers = take_numbers(campaign, subjects, minutes)
    missing = [number for number in numbers if not _written(writer, campaign, *number)]
    done = len(numbers) - len(missing)
    progress(done, len(numbers))
    if processes == 1:
        maker = TakeMaker(campaign, known)
        made = (maker.make(*number) for number in missing)
    else:
        made = _elsewhere(campaign, errors, missing, processes)
    with closing(made):
        for takes in made:
            for take in takes:
                if take.key not in writer.done:
                    writer.append(take)
            done += 1
            progress(done, len(numbers))
    return len(missing)


def take_numbers(campaign: Campaign, subjects: int, minutes: float) -> list[tuple[int, int]]:
    """Numbers of subject and take, in the order in which they are made."""
    each = max(1, round(60.0 * minutes / campaign.take_seconds / subjects))
    return [(subject, take) for take, subject in itertools.product(range(each), range(subjects))]


def digest(errors: FitErrors) -> str:
    """Tells errors of fits apart."""
    text = json.dumps(errors.as_dict(), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _written(writer: PairWriter, campaign: Campaign, subject: int, number: int) -> bool:
    name = subject_name(subject)
    wanted = {TakeKey(name, take_name(number), k) for k in range(campaign.placements)}
    return wanted <= writer.done


def _elsewhere(
    campaign: Campaign, errors: Path | None, numbers: Sequence[tuple[int, int]], processes: int
) -> Generator[list[Take], None, None]:
    """Takes in order, made by processes that end at once with whoever asks for them."""
    context = multiprocessing.get_context("spawn")
    others = multiprocessing.active_children()
    with ProcessPoolExecutor(processes, context, _start, (campaign, errors)) as pool:
        try:
            yield from pool.map(_make, *zip(*numbers, strict=True))
        except BrokenProcessPool as error:
            raise Sd2Error(
                "A process that makes takes has ended by itself",
                f"memory and time for {processes} processes",
                "Run the same command again, with fewer --workers; it goes on where it was",
            ) from error
        except BaseException:
            # Whoever stops does not wait for takes that are under way.
            pool.shutdown(wait=False, cancel_futures=True)
            workers = [one for one in multiprocessing.active_children() if one not in others]
            for worker in workers:
                worker.terminate()
            for worker in workers:
                worker.join()
            raise


def _start(campaign: Campaign, errors: Path | None) -> None:
    global _maker
    # Ctrl+C goes to all of them; the parent sees to the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    threadpool_limits(limits=1, user_api="blas")  # the processes share the cores as they are
    _maker = TakeMaker(campaign, FitErrors.load(errors))


def _make(subject: int, number: int) -> list[Take]:
    assert _maker is not None
    return _maker.make(subject, number)
