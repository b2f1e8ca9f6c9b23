"""Output of ``sd2 fit --progress-json``; see ``docs/formats.md``."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.cli.running import error_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sd2core.body.fit_video import FitReport, FittedVideo, Stage
    from sd2core.io.video import VideoReader
    from sd2core.progress import Progress

FORMAT = "sd2-fit-progress"
VERSION = 1

_PROGRESS_EVERY_S = 0.05
_LANDMARKS_EVERY_S = 0.1
_UNITS = {"models": "byte", "fit": "step"}


class FitLines:
    """Prints one JSON object per line, at once."""

    def __init__(self, video: Path, out: Path) -> None:
        self._video, self._out = video, out
        self._last_landmarks_s = -1.0

    def report(self) -> FitReport:
        """Callbacks that print the lines of a running fit."""
        from sd2core.body.fit_video import FitReport

        return FitReport(self._progress_of, self._started, self._landmarks)

    def error(self, error: Exception) -> None:
        """Print the reason of a failure."""
        _say("error", text=error_text(error))

    def done(self, made: FittedVideo, seconds: float) -> None:
        """Print the notes, and that the mesh is written."""
        for note in made.notes:
            _say("note", text=note)
        _say(
            "done",
            out=str(self._out),
            frames=made.frames,
            present=made.present,
            seconds=round(seconds, 2),
        )

    def _started(self, video: VideoReader, resumed: bool) -> None:
        from sd2core.body.fit_video import STAGES

        _say(
            "start",
            format=FORMAT,
            version=VERSION,
            video=str(self._video),
            out=str(self._out),
            frames=len(video),
            width=video.width,
            height=video.height,
            frames_per_s=round(video.timebase.frames_per_s, 4),
            stages=STAGES,
            resumed=resumed,
        )

    def _progress_of(self, stage: Stage) -> Progress:
        last_s = -1.0

        def progress(done: int, total: int) -> None:
            nonlocal last_s
            now_s = time.monotonic()
            if now_s - last_s >= _PROGRESS_EVERY_S or done == total:
                last_s = now_s
                unit = _UNITS.get(stage, "frame")
                _say("progress", stage=stage, done=done, total=total, unit=unit)

        return progress

    def _landmarks(
        self,
        stage: Stage,
        frame: int,
        image_px: NDArray[np.float32],
        visibility: NDArray[np.float32],
    ) -> None:
        now_s = time.monotonic()
        if now_s - self._last_landmarks_s < _LANDMARKS_EVERY_S:
            return
        self._last_landmarks_s = now_s
        _say(
            "landmarks",
            stage=stage,
            frame=frame,
            image_px=[[round(float(x), 1), round(float(y), 1)] for x, y in image_px],
            visibility=[round(float(value), 2) for value in visibility],
        )


def _say(event: str, **content: Any) -> None:
    print(json.dumps({"event": event, **content}, ensure_ascii=False), flush=True)
