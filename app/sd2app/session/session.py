"""State that every feature of the window shares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QObject, Signal

from sd2app.session.content import reference_of
from sd2app.session.display import DisplayModel, Layouts
from sd2app.session.document import DocumentModel
from sd2app.session.maps import MapModel, PointerModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.sensor import SensorModel
from sd2app.session.tasks import TaskList
from sd2app.session.time_window import GROWING_S, TimeWindow
from sd2app.session.undo import Edits
from sd2app.session.video_frames import VideoModel
from sd2app.settings import Settings
from sd2core.numerics.byte_budget import ByteBudget


class Mode(QObject):
    """On from the user's request until what was asked for is done, or is given up."""

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.active = False

    def end(self) -> None:
        """Switch it off."""
        if self.active:
            self.toggle()

    def toggle(self) -> None:
        """Switch it on or off."""
        self.active = not self.active
        self.changed.emit()


_RESULTS_BYTES = 256 << 20
"""For maps of places that were left: some hundred minutes."""


@dataclass(frozen=True)
class Maps:
    """The Doppler maps on screen."""

    synthetic: MapModel
    denoised: MapModel
    before: MapModel
    real: MapModel

    @property
    def all(self) -> tuple[MapModel, ...]:
        """The maps from top to bottom."""
        return (self.synthetic, self.denoised, self.before, self.real)

    def strongest(self) -> dict[MapModel, float]:
        """Strongest bin of each map on screen."""
        return {
            track: reference_of(track.map.values, track.map.null_bins)
            for track in self.all
            if track.map is not None
        }


class Session:
    """One recording at work: document, clock, sensor, display, maps and undoable edits.

    At first nothing is open.
    """

    def __init__(self, parent: QObject, settings: Settings) -> None:
        self.parent, self.settings = parent, settings  # parent of all models
        self.jobs = TaskList(parent)
        self.document = DocumentModel(self.jobs, parent)
        self.playback = PlaybackModel(parent)
        self.video = VideoModel(self.playback, parent)
        self.sensor = SensorModel(parent)
        self.display = DisplayModel(parent)
        self.span = TimeWindow(parent)
        self.pointer = PointerModel(parent)
        self.maps = Maps(
            MapModel("Synthetic", parent, "synthetic"),
            MapModel("Denoised", parent, "denoised"),
            MapModel("Denoised before", parent),
            MapModel("Real", parent, "radar"),
        )
        self.placing = Mode(parent)  # a click on the body places an inertial sensor
        self.aligning = Mode(parent)  # grips on what was measured move it in time
        self.edits = Edits(self.document, self.sensor)
        self.layouts = Layouts(settings, parent)
        self.results = ByteBudget(_RESULTS_BYTES)
        """Of places and models that were left, by :attr:`MapModel.key`."""
        self.document.grown.connect(self.extend)
        self.document.opened.connect(self.aligning.end)
        self.playback.frame_changed.connect(self._turn_page)

    def _turn_page(self) -> None:
        if self.playback.playing:
            self.span.reveal(self.playback.time_s)

    def has_content(self) -> bool:
        """True while something is open."""
        return self.document.content is not None

    def has_mesh(self) -> bool:
        """True while a mesh is open."""
        return self.document.mesh is not None

    def attach(self) -> None:
        """Put clock, time window, video and sensor on the recording that was opened."""
        content = self.document.content
        assert content is not None
        # With another mesh in it, a recording stays where it is looked at.
        same, timebase = self.document.same_recording, content.timebase
        if not (same and np.array_equal(timebase.times_s, self.playback.timebase.times_s)):
            self.playback.set_timebase(timebase)
            self.span.set_extent(timebase.start_s, timebase.end_s)
        if self.document.growing:
            self.span.extend(content.timebase.end_s, GROWING_S)
        if not (same and content.video is self.video.reader):
            self.video.set_reader(content.video)
        self.sensor.set_sensor(content.recording.sensor)

    def extend(self) -> None:
        """Follow a recording that has grown, or ends its growth."""
        content = self.document.content
        assert content is not None
        self.playback.extend(content.timebase)
        room_s = GROWING_S if self.document.growing else 0.0
        self.span.extend(content.timebase.end_s, room_s)
        self.follow_capture()

    def follow_capture(self, new: bool = False) -> None:
        """Show the radar's map as the document has it; of a new document at its own 0 dB."""
        real, radar_map = self.maps.real, self.document.radar_map
        real.growing = self.document.growing
        if self.document.recording is not None:
            real.set_offset(self.document.recording.radar_offset_s)
        if radar_map is real.map and not new:
            return
        capture = self.document.capture
        simulated = capture is not None and capture.simulated
        if radar_map is not None:
            simulated = radar_map.kind == "simulated"
        real.title = "Radar (simulated)" if simulated else "Real"
        if capture is not None and (recording := self.document.recording) is not None:
            real.title = ", ".join(filter(None, (real.title, recording.channel_in_words)))
        # A map of another channel, or with its clutter removed in another manner, is compared at
        # the same 0 dB.
        chosen = self.document.same_recording and real.by_hand
        if radar_map is not None and (new or real.map is None) and not chosen:
            real.set_reference(reference_of(radar_map.values, radar_map.null_bins))
        real.set_map(radar_map)
