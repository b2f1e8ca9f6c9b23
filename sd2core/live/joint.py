"""A camera and a radar together, into recordings on one clock."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error
from sd2core.live.cameras import CameraChoice
from sd2core.live.clocks import Clocks, correct_drift, link_clocks
from sd2core.live.filming import VIDEO_NAME, Film
from sd2core.live.listening import Listening
from sd2core.live.reception import Reception
from sd2core.live.recording import GrowingRecording
from sd2core.placements.placements import Placements
from sd2core.recording.recording import Recording, open_recording

if TYPE_CHECKING:
    from sd2core.live.clocks import ClockLine
    from sd2core.live.sources import Source


class Station(contextlib.AbstractContextManager["Station"]):
    """A camera and a radar that stay open while recording after recording is made of them.

    They are opened by the first one; those that have ended, and a radar that is replayed, by the
    next one again. A context manager, which closes both.

    Parameters
    ----------
    camera : CameraChoice
    open_source : callable
        Opens the radar.
    delays_s : callable
        Delays of both in seconds, as measured or as known of them.
    placements : Placements, optional
        Planned placements of the recordings, where the radar's place is known.
    previews : bool
        True if small pictures of the camera are wanted, too.
    """

    def __init__(
        self,
        camera: CameraChoice,
        open_source: Callable[[], Source],
        delays_s: Callable[[Film, Source], tuple[float, float]],
        *,
        placements: Placements | None = None,
        previews: bool = False,
    ) -> None:
        self._camera, self._open_source, self._delays_s = camera, open_source, delays_s
        self._placements, self._previews = placements, previews
        self._film: Film | None = None
        self._reception: Reception | None = None

    def __exit__(self, *_: object) -> None:
        self._close_source()
        self._close_film()

    def begin(self, folder: Path) -> JointRecording:
        """Record into ``NAME.sd2``, which does not exist.

        Raises Sd2Error when it does, or camera or radar cannot be opened; nothing is left behind.
        """
        recording = GrowingRecording(folder, keep_arrivals=True)
        if recording.folder.exists():
            raise Sd2Error(f"{recording.folder} exists", "a new folder", "Give another as --out")
        reception, film = self._opened_source(), self._opened_film()
        delays_s = self._delays_s(film, reception.source)
        return JointRecording(recording, film, reception, delays_s, self._placements)

    def _opened_source(self) -> Reception:
        reception = self._reception
        if reception is not None and (reception.is_over or reception.source.head(0.0).replayed):
            self._close_source()
        if self._reception is None:
            self._reception = Reception(self._open_source())
        return self._reception

    def _opened_film(self) -> Film:
        if self._film is not None and (self._film.is_over or self._camera.is_played):
            self._close_film()
        if self._film is None:
            self._film = Film(self._camera, previews=self._previews)
        return self._film

    def _close_source(self) -> None:
        if self._reception is not None:
            self._reception.close()
        self._reception = None

    def _close_film(self) -> None:
        if self._film is not None:
            self._film.close()
        self._film = None


class JointRecording(contextlib.AbstractContextManager["JointRecording"]):
    """Video and radar of a recording, linked as soon as both are there.

    A context manager: what is still open of the recording at its end is closed.
    """

    def __init__(
        self,
        recording: GrowingRecording,
        film: Film,
        reception: Reception,
        delays_s: tuple[float, float],
        placements: Placements | None,
    ) -> None:
        self._recording, self._reception = recording, reception
        self.folder, self.source = recording.folder, reception.source
        self.listening = Listening(reception, recording)
        self.film, self.delays_s = film, delays_s
        self.about = f"{film.about}\n{self.source.about}"
        self._placements, self.linked = placements, False
        self.folder.mkdir()
        film.begin(self.folder / VIDEO_NAME)

    def __exit__(self, *_: object) -> None:
        self._recording.close()
        with contextlib.suppress(OSError):
            self.folder.rmdir()  # where nothing has begun

    def follow(self) -> None:
        """Link both the first time that there is something of both; raise what stopped filming."""
        self.film.check()
        filmed = self.film.filmed
        if not self.linked and filmed.first_s is not None and self._recording.frames:
            self._link()
            self.linked = True

    def progress(self) -> dict[str, Any]:
        """Numbers of pictures, and whether the recording names its video."""
        filmed = self.film.filmed
        return {
            "pictures": filmed.recorded, "pictures_dropped": filmed.dropped, "linked": self.linked
        }  # fmt: skip

    def stop(self) -> None:
        """Stop, and store all that was received."""
        try:
            self.film.end()
        finally:
            self.listening.stop()

    def correct_clocks(self) -> ClockLine | None:
        """Put both on one clock by all that arrived; None where one of them gave nothing.

        A video alone becomes a recording, too.
        """
        if not (self.film.filmed.recorded and self.listening.counts.recorded):
            if self.film.filmed.recorded:
                video = self.folder / VIDEO_NAME
                Recording.create(self.folder, video=video, simulated=self.film.simulated)
            return None
        line = self._link()
        correct_drift(self._recording.radar, line)
        return line

    def _link(self) -> ClockLine:
        first_s = self.film.filmed.first_s
        assert first_s is not None
        recording = open_recording(self.folder)
        recording.video = self.folder / VIDEO_NAME
        recording.simulated = recording.simulated or self.film.simulated
        recording.placements = self._placements
        return link_clocks(recording, Clocks(first_s, *self.delays_s), self._reception.rate)
