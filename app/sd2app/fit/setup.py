"""Set-up of a fit: video, person, height, camera, folder."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from sd2app.background.latest import Emit, LatestRunner
from sd2app.fit.request import FitRequest, Person, read_request
from sd2app.session.video_frames import VideoFrames
from sd2app.widgets.text import quoted
from sd2core.body.camera import DEFAULT_FIELD_OF_VIEW_DEG
from sd2core.body.shape import DEFAULT_STATURE_M as DEFAULT_STATURE_M
from sd2core.options.bounds import FIELD_OF_VIEW_DEG, STATURE_M
from sd2core.options.records import words_of
from sd2core.recording.recording import FILE_NAME, SUFFIX, Recording

CameraWay = Literal["file", "angle", "focal"]
_SMALLEST_PERSON = 0.02
"""Smallest side of a rectangle as share of the picture; less is a click."""


@dataclass(frozen=True)
class FitChoices:
    """Choices of the user for the fit of a video."""

    folder: Path | None = None  # the recording to be made
    stature_m: float | None = None  # None: estimated
    camera: CameraWay = "file"  # source of the focal length
    angle_deg: float = DEFAULT_FIELD_OF_VIEW_DEG  # across the longer side of the picture
    person: Person | None = None  # rectangle around the person; None: one is chosen
    people: tuple[int, ...] = ()  # those who are ticked in the list of everybody


class FitSetupModel(VideoFrames):
    """Choices for a fit, and the frame of the video on which the person is picked.

    The rectangle around a person belongs to the frame it was drawn on.
    """

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.choices = FitChoices()
        self.video: Path | None = None
        self.portraits: list[Portrait] = []
        """Everybody in the video, once they were looked for."""
        self.searched: float | None = None  # share of the video; None: nobody is looked for
        self._finder = LatestRunner("people", self, self._take_people, self._find_no_one)
        self._finder.partial.connect(self._search)

    def choose_video(self, path: Path, open_now: Recording | None = None) -> None:
        """Choose another video; the open recording of it, if saved, gets the mesh."""
        self.video = path
        self.stop_finding()
        self.portraits = []
        folder = folder_for(path, open_now)
        self.choices = replace(self.choices, folder=folder, person=None, people=())
        self.open_video(path)

    def _take_video(self, reader: Any) -> None:
        if len(reader) < 2:
            self.problem = f"{reader.path.name} has one frame: a body is fitted to a video."
        super()._take_video(reader)

    # --- everybody ------------------------------------------------------------------------

    def find_people(self) -> None:
        """Look for everybody in the video."""
        video = self.video
        if video is not None:
            self.searched = 0.0
            self._finder.submit(lambda emit: portraits_of(video, emit))
            self.changed.emit()

    def stop_finding(self) -> None:
        """Look for them no longer."""
        self._finder.cancel()
        self.searched = None
        self.changed.emit()

    def tick(self, number: int, fitted: bool) -> None:
        """Fit a person of the list, or not."""
        people = set(self.choices.people) - {number}
        if fitted:
            people.add(number)
        self.change(people=tuple(sorted(people)), person=None)

    def _search(self, share: float) -> None:
        self.searched = share
        self.changed.emit()

    def _take_people(self, portraits: list[Portrait]) -> None:
        self.portraits, self.searched = portraits, None
        self.changed.emit()

    def _find_no_one(self, error: Exception) -> None:
        self.searched = None
        self._refuse(error)

    # --- the choices ----------------------------------------------------------------------

    @property
    def completes(self) -> bool:
        """True if the recording exists and gets the mesh."""
        folder = self.choices.folder
        return folder is not None and (folder / FILE_NAME).exists()

    @property
    def focal_px(self) -> float | None:
        """Field of view as a focal length in pixels, None while the video is not open."""
        if self.size is None:
            return None
        return max(self.size) / 2.0 / math.tan(math.radians(self.choices.angle_deg) / 2.0)

    @property
    def kept(self) -> FitRequest | None:
        """Request of a stopped fit of this video in the folder."""
        folder = self.choices.folder
        kept = read_request(folder) if folder is not None else None
        return kept if kept is not None and kept.video == self.video else None

    @property
    def continues(self) -> bool:
        """True if that can be continued: it was made with the same choices."""
        return self.ready and self.kept is not None and self.request().asks_the_same(self.kept)

    @property
    def ready(self) -> bool:
        """True if the fit can begin."""
        return self.reader is not None and self.choices.folder is not None and not self.problem

    def change(self, **changes: Any) -> None:
        """Change some of the :attr:`choices`; height and field of view are held in bounds."""
        if changes.get("stature_m") is not None:
            changes["stature_m"] = STATURE_M.nearest(changes["stature_m"])
        if "angle_deg" in changes:
            changes["angle_deg"] = FIELD_OF_VIEW_DEG.nearest(changes["angle_deg"])
        choices = replace(self.choices, **changes)
        if choices != self.choices:
            self.choices = choices
            self.changed.emit()

    def set_focal(self, focal_px: float) -> None:
        """Say the focal length in pixels of the picture."""
        if self.size is not None and focal_px > 0:
            angle_rad = 2.0 * math.atan(max(self.size) / 2.0 / focal_px)
            self.change(angle_deg=math.degrees(angle_rad))

    def set_person(self, left: float, top: float, right: float, bottom: float) -> None:
        """Draw the rectangle on the frame that is shown, corners in pixels in any order."""
        if self.size is None:
            return
        (width, height), xs, ys = self.size, sorted((left, right)), sorted((top, bottom))
        x0, x1 = (round(min(max(x, 0), width)) for x in xs)
        y0, y1 = (round(min(max(y, 0), height)) for y in ys)
        if min((x1 - x0) / width, (y1 - y0) / height) < _SMALLEST_PERSON:
            return
        self.change(person=Person(self.frame, x0, y0, x1 - x0, y1 - y0), people=())

    def request(self) -> FitRequest:
        """All of it; only when :attr:`ready`."""
        choices = self.choices
        assert self.video is not None
        assert choices.folder is not None
        return FitRequest(
            video=self.video,
            folder=choices.folder,
            stature_m=choices.stature_m,
            focal_px=None if choices.camera == "file" else self.focal_px,
            person=choices.person,
            people=choices.people,
        )

    @property
    def line(self) -> str:
        """Command for a terminal that makes the mesh beside the recording; when ready."""
        request = self.request()
        name = f"{request.folder.name.removesuffix(SUFFIX)}.zarr"
        return quoted(words_of("fit", request.command(request.folder.with_name(name))))

    # --- inside ---------------------------------------------------------------------------

    def first_frame(self) -> int:
        """The frame of the person who was chosen before, else the one in the middle."""
        if (kept := self.kept) is not None:
            who = {"person": kept.person, "people": kept.people}
            self.change(stature_m=kept.stature_m, camera="file", **who)
            if kept.focal_px is not None:
                self.change(camera="focal")
                self.set_focal(kept.focal_px)
        person = self.choices.person
        return super().first_frame() if person is None else person.frame


def folder_for(video: Path, open_now: Recording | None = None) -> Path:
    """Default folder to save in.

    The recording that is open where it is saved, is of this video and has no mesh; a
    folder in which a fit of this video was stopped; else a new name beside the video.
    """
    if open_now is not None and open_now.video == video and open_now.mesh is None:
        saved = (open_now.folder / FILE_NAME).exists()
        if saved:
            return open_now.folder
    for number in count(1):
        ending = "" if number == 1 else f"-{number}"
        folder = video.with_name(f"{video.stem}{ending}{SUFFIX}")
        kept = read_request(folder)
        if not folder.exists() or (kept is not None and kept.video == video):
            return folder
    raise AssertionError


PICTURE_PX = 96


@dataclass(frozen=True, eq=False)
class Portrait:
    """Somebody in a video."""

    number: int
    words: str  # when they are there and how sure that is
    frame: int  # of the picture
    picture: NDArray[np.uint8]  # (PICTURE_PX, PICTURE_PX, 3), RGB


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
            words = f"Person {each.number}\n{each.from_s:.1f} to {each.to_s:.1f} s"
            words += f"\n{100.0 * each.certainty:.0f} % certain"
            words += f"\nmay be person {each.may_be}" if each.may_be else ""
            picture = roi.cut(video.read(frame), PICTURE_PX)
            portraits.append(Portrait(each.number, words, frame, picture))
        return portraits
