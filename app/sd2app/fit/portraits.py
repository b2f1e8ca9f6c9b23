"""Everybody in a video with a picture of each, to choose from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2app.background.latest import Emit

PICTURE_PX = 96


@dataclass(frozen=True, eq=False)
class Portrait:
    """Somebody in a video."""

    number: int
    from_s: float
    to_s: float
    certainty: float  # that all looks show one person, from 0 to 1
    may_be: int | None  # somebody seen before
    frame: int  # of the picture
    picture: NDArray[np.uint8]  # (PICTURE_PX, PICTURE_PX, 3), RGB

    @property
    def words(self) -> str:
        """When they are there and how sure that is."""
        again = f"\nmay be person {self.may_be}" if self.may_be else ""
        return (
            f"Person {self.number}\n{self.from_s:.1f} to {self.to_s:.1f} s"
            f"\n{100.0 * self.certainty:.0f} % certain{again}"
        )


def portraits_of(path: Path, emit: Emit) -> list[Portrait]:
    """Find everybody in a video; ``emit`` gets the share that is done.

    Raises Sd2Error if nobody is found, or the landmark models are not there.
    """
    from sd2core.body.landmark_models import landmark_models
    from sd2core.body.people import find_people
    from sd2core.io.video import open_video

    models = landmark_models(progress=lambda *_: emit(None))
    with open_video(path, lambda *_: emit(None)) as video:
        people = find_people(video, models, lambda done, total: emit(done / total))
        portraits = []
        for each in people:
            frame, roi = each.portrait
            facts = (each.number, each.from_s, each.to_s, each.certainty, each.may_be, frame)
            portraits.append(Portrait(*facts, roi.cut(video.read(frame), PICTURE_PX)))
        return portraits
