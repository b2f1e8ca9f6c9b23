"""A camera and a radar together, into one recording on one clock."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from sd2core.errors import Sd2Error
from sd2core.live.clocks import Clocks, correct_drift, link_clocks
from sd2core.live.filming import VIDEO_NAME, CameraChoice, Film
from sd2core.live.listening import Listening
from sd2core.live.recording import GrowingRecording
from sd2core.placements.placements import Placements
from sd2core.recording.recording import Recording, open_recording

if TYPE_CHECKING:
    from sd2core.live.clocks import ClockLine
    from sd2core.live.sources import Source


class JointRecording:
    """Video and radar of a recording, linked as soon as both are there.

    A context manager: what is still open at its end is stopped.

    Parameters
    ----------
    folder : Path
        ``NAME.sd2``, which does not exist.
    camera : CameraChoice
    source : Source
        Is closed at the end, also where this cannot be made.
    delays_s : callable
        Delays of both in seconds, as measured or as known of them.
    previews : bool
        True if small pictures of the camera are wanted, too.

    Raises
    ------
    Sd2Error
        When the folder exists, or camera or radar cannot be opened; nothing is left behind.
    """

    def __init__(
        self,
        folder: Path,
        camera: CameraChoice,
        source: Source,
        delays_s: Callable[[Film, Source], tuple[float, float]],
        *,
        previews: bool = False,
    ) -> None:
        with contextlib.ExitStack() as stack:
            self.source = source
            stack.callback(source.close)
            self._recording = GrowingRecording(folder, keep_arrivals=True)
            self.folder = self._recording.folder
            if self.folder.exists():
                raise Sd2Error(f"{self.folder} exists", "a new folder", "Give another as --out")
            stack.callback(self._recording.close)
            self.listening = Listening(source, self._recording)
            self.folder.mkdir()
            stack.callback(_remove_empty, self.folder)
            self.film = Film(camera, self.folder / VIDEO_NAME, previews=previews)
            stack.callback(self.film.stop)
            self._stack = stack.pop_all()
        self.delays_s = delays_s(self.film, source)
        self.about = f"{self.film.about}\n{source.about}"
        self.linked = False
        self.placements: Placements | None = None
        """Planned placements of the recording, where the radar's place is known."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

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
            self.film.stop()
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
        recording.placements = self.placements
        return link_clocks(recording, Clocks(first_s, *self.delays_s))


def _remove_empty(folder: Path) -> None:
    """Remove the folder of a recording that did not begin."""
    with contextlib.suppress(OSError):
        folder.rmdir()
