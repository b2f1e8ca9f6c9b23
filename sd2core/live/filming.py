"""A camera's pictures into videos, in a process of its own.

``python -m sd2core.live.filming`` reads its settings as one line of JSON, then on each line the
video to film into, ``null`` to end it; the camera stays open until the input ends. It says on its
output, line by line, what it has: the times are those of the monotonic clock, which all processes
of a computer share.
"""

from __future__ import annotations

import base64
import contextlib
import json
import queue
import subprocess
import sys
import threading
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.appended import AppendedFile
from sd2core.io.video_writing import VideoEncoder
from sd2core.live.cameras import Camera, CameraChoice, shrunk
from sd2core.processes import end_beside

VIDEO_NAME = "video.mp4"

_CRF, _PRESET = 19, "superfast"
_WAITING_BYTES = 256 << 20
"""Pictures that may wait for the encoder: three seconds of 1280 × 720, twelve of 640 × 360."""
_TELL_S = 0.1
_LOOK_S = 1.0
_PREVIEW_PX = 320
_PREVIEW_QUALITY = 70
_END_S = 40.0
"""By then all that waited is encoded, or never will be."""


@dataclass
class Filmed:
    """Progress of a video that a camera is taking."""

    recorded: int = 0
    dropped: int = 0  # the encoder was too slow
    first_s: float | None = None  # arrival of the first picture
    put_back: int = 0  # times that the video was deleted, and written again


class Film:
    """A camera that is open in a process of its own, and films into one video after the other.

    Parameters
    ----------
    choice : CameraChoice
    previews : bool
        True if small pictures are wanted, too.

    Raises
    ------
    Sd2Error
        If the camera cannot be opened.
    """

    def __init__(self, choice: CameraChoice, *, previews: bool = False) -> None:
        self.filmed = Filmed()
        self._preview: str | None = None
        self.about = ""
        self.delay_s = 0.0
        self.simulated = False
        self._has_ended = threading.Event()  # the video that was filmed into
        self._error: Sd2Error | None = None
        self._reader: threading.Thread | None = None
        self._process = subprocess.Popen(
            [sys.executable, "-m", "sd2core.live.filming"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            start_new_session=True,  # Ctrl-C is for the one that films, who ends it
        )
        self._send({"camera": asdict(choice), "previews": previews})
        self._hear()
        if self._error is not None:
            self.close()
            raise self._error
        self._reader = threading.Thread(target=self._hear_all, name="sd2-film", daemon=True)
        self._reader.start()

    @property
    def is_over(self) -> bool:
        """True once the camera gives no more, or filming has failed."""
        return self._reader is None or not self._reader.is_alive()

    def next_preview(self) -> str | None:
        """Newest small picture that was not asked for before, as JPEG in base64."""
        preview, self._preview = self._preview, None
        return preview

    def check(self) -> None:
        """Raise what has stopped filming."""
        if self._error is not None:
            raise self._error

    def begin(self, video: Path) -> None:
        """Film into a file, in a folder that exists, from the next picture on."""
        self.filmed = Filmed()
        self._has_ended.clear()
        self._send(str(video.absolute()))

    def end(self) -> None:
        """End the video, and wait until all its pictures are in it; the camera stays open."""
        self._send(None)
        end_s = time.monotonic() + _END_S
        while not (self._has_ended.wait(_TELL_S) or self.is_over or time.monotonic() > end_s):
            pass
        self.check()

    def close(self) -> None:
        """Let go of the camera."""
        assert self._process.stdout is not None
        end_beside(self._process, _END_S)
        if self._reader is not None:
            self._reader.join(_END_S)  # all that was told is heard
        self._process.stdout.close()

    def _send(self, order: Any) -> None:
        assert self._process.stdin is not None
        # Where the process has ended, what it told before says whether that was right.
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()

    def _hear(self) -> bool:
        """Take one line; False at the end."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            if self._process.wait() and self._error is None:
                self._error = Sd2Error("The process that films was stopped from outside")
            return False
        message = json.loads(line)
        match message.pop("event"):
            case "camera":
                self.about, self.delay_s = message["about"], message["delay_s"]
                self.simulated = message["simulated"]
            case "filmed":
                picture = message.pop("picture", None)
                self.filmed = Filmed(**message)
                self._preview = picture or self._preview
            case "ended":
                self._has_ended.set()
            case "failed":
                self._error = Sd2Error(**message)
        return True

    def _hear_all(self) -> None:
        while self._hear():
            pass


def main() -> int:
    """Film as the lines of the input say, until it ends."""
    settings = json.loads(sys.stdin.readline())
    try:
        camera = CameraChoice(**settings["camera"]).open()
    except (Sd2Error, OSError) as error:
        return _failed(error)
    _tell("camera", about=camera.about, delay_s=camera.delay_s, simulated=camera.simulated)
    try:
        _Filming(camera, previews=settings["previews"]).run()
    except (Sd2Error, OSError) as error:
        return _failed(error)
    return 0


def _failed(error: Sd2Error | OSError) -> int:
    failure = error if isinstance(error, Sd2Error) else Sd2Error(str(error))
    _tell("failed", **failure.arguments)
    return 1


_Taken = tuple[NDArray[np.uint8], float]
"""Picture (height, width, 3), and when it was there."""


class _Filming:
    """Pictures on their way from the camera, in a thread of its own, to the encoder."""

    def __init__(self, camera: Camera, *, previews: bool) -> None:
        self._camera, self._previews = camera, previews
        # Pictures with their times; the video that those behind it go into, or None; the end.
        self._waiting: queue.SimpleQueue[_Taken | Path | Literal["end"] | None]
        self._waiting = queue.SimpleQueue()
        width, height = camera.size_px
        self._most_waiting = max(_WAITING_BYTES // (3 * width * height), 2)
        self._lock = threading.Lock()
        self._is_filming = False
        self._stop = threading.Event()
        self._video: _Video | None = None
        self._dropped = 0  # of this video

    def run(self) -> None:
        """Film until the input ends or the camera does."""
        threading.Thread(target=self._take_orders, daemon=True).start()
        while (taken := self._waiting.get()) != "end":
            if isinstance(taken, tuple):
                if self._video is not None:
                    self._video.add(*taken, self._dropped)
            else:
                self._end_video()
                self._video = None if taken is None else _Video(self._camera, taken, self._previews)
        self._end_video()
        self._camera.close()

    def _take_orders(self) -> None:
        reading = threading.Thread(target=self._take_pictures, daemon=True)
        for line in sys.stdin:
            order = json.loads(line)
            with self._lock:
                self._is_filming = order is not None
                self._dropped = 0 if self._is_filming else self._dropped
                self._waiting.put(None if order is None else Path(order))
            if reading.ident is None:  # a file is played from here on
                reading.start()
        self._stop.set()
        if reading.ident is None:
            self._waiting.put("end")

    def _take_pictures(self) -> None:
        while not self._stop.is_set() and (taken := self._camera.read()) is not None:
            with self._lock:
                if not self._is_filming:
                    continue
                if self._waiting.qsize() < self._most_waiting:
                    self._waiting.put(taken)
                else:
                    self._dropped += 1
        self._waiting.put("end")

    def _end_video(self) -> None:
        if self._video is not None:
            self._video.close(self._dropped)
            self._video = None
            _tell("ended")


class _Video:
    """Video that is filmed into."""

    def __init__(self, camera: Camera, path: Path, previews: bool) -> None:
        self._previews = previews
        self._file = AppendedFile(path)
        self._encoder = VideoEncoder(
            self._file, camera.rate_hz, camera.size_px, crf=_CRF, preset=_PRESET, grows=True
        )
        self._filmed = Filmed()
        self._reported_s = self._looked_s = 0.0

    def add(self, picture: NDArray[np.uint8], taken_s: float, dropped: int) -> None:
        """Encode a picture, and tell now and then what there is."""
        filmed = self._filmed
        if filmed.first_s is None:
            filmed.first_s = taken_s
        self._encoder.add(picture, taken_s - filmed.first_s)
        filmed.recorded += 1
        filmed.dropped = dropped
        now_s = time.monotonic()
        if now_s > self._looked_s + _LOOK_S:
            self._looked_s = now_s
            self._look()
        if now_s > self._reported_s + _TELL_S:
            self._reported_s = now_s
            self._tell_progress(picture if self._previews else None)

    def close(self, dropped: int) -> None:
        """Encode what is left."""
        self._encoder.close()
        self._look()
        self._file.close()
        self._filmed.dropped = dropped
        self._tell_progress(None)

    def _look(self) -> None:
        """Put the video back if somebody has deleted it."""
        if not self._file.is_there:
            self._file.put_back()
            self._filmed.put_back += 1

    def _tell_progress(self, picture: NDArray[np.uint8] | None) -> None:
        progress: dict[str, Any] = asdict(self._filmed)
        if picture is not None:
            progress["picture"] = preview_of(picture)
        _tell("filmed", **progress)


def preview_of(picture: NDArray[np.uint8]) -> str:
    """Preview of a picture: JPEG as Base64."""
    import cv2

    small = shrunk(picture, _PREVIEW_PX)
    made = cv2.imencode(".jpg", small[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, _PREVIEW_QUALITY])
    return base64.b64encode(made[1].data).decode("ascii")


def _tell(event: str, **about: Any) -> None:
    print(json.dumps({"event": event, **about}), flush=True)


if __name__ == "__main__":
    sys.exit(main())
