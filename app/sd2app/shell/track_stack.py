"""The maps one above the other, what was labelled, and the time below them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QVBoxLayout, QWidget

from sd2app.agreement.timeline import OtherTimeline
from sd2app.classify.chooser import ClassifierChooser
from sd2app.classify.strip import ClassStrip
from sd2app.denoise.chooser import DenoiserChooser
from sd2app.labels.map_dragging import SpanDragger
from sd2app.labels.painting import map_overlay, strip_overlay
from sd2app.labels.timeline import LabelTimeline
from sd2app.labels.timeline_area import LabelArea
from sd2app.maps.difference_view import DifferenceView
from sd2app.maps.heatmap import HeatmapView
from sd2app.maps.overview import Overview
from sd2app.playback.timeline import TimeRuler
from sd2app.suggestions.bar import SuggestionBar
from sd2app.widgets.model_menu import ModelButton, ModelMenu

if TYPE_CHECKING:
    from sd2app.shell.menus import ActionSet
    from sd2app.shell.wiring import Context

_LOWEST_PX = {1: 96, 2: 96, 3: 72, 4: 54}
"""Of one map, by how many there are."""


class Tracks(QWidget):
    """A track that has nothing to show is not drawn."""

    def __init__(
        self,
        context: Context,
        models: ModelMenu,
        classifiers: ModelMenu,
        actions: ActionSet,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._context = c = context
        common = c.span, c.playback, c.display, c.pointer, (map_overlay(c.labels),)
        self.synthetic = HeatmapView(c.synthetic, *common)
        self.denoised = HeatmapView(c.denoised, *common)
        self.before = HeatmapView(c.before, *common)
        self.real = HeatmapView(c.real, *common, alignable=True)
        self.difference = DifferenceView(c.difference, *common)
        self.real.setToolTip("Drag the title to align the capture in time")
        self.real.offset_grabbed.connect(c.edits.begin_offset_drag)
        self.real.offset_dragged.connect(c.edits.drag_offset)
        self.real.offset_released.connect(c.edits.end_offset_drag)
        # Beside the map it makes, or beside the one it could be made of.
        denoisers = DenoiserChooser(c.denoise)
        self._offer = ModelButton(denoisers, models)
        self.synthetic.set_button(self._offer)
        self.denoised.set_button(ModelButton(denoisers, models))
        hand = c.labels, c.label_dragging, c.span_loop
        for view in (self.synthetic, self.denoised, self.before, self.real, self.difference):
            SpanDragger(view, *hand)
        self.labels = LabelTimeline(
            c.labels,
            c.label_edits,
            c.label_dragging,
            c.span_loop,
            c.span,
            c.playback,
            c.display,
        )
        self.overview = Overview(
            c.synthetic, c.span, c.playback, c.display, (strip_overlay(c.labels),)
        )
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        for view in (self.synthetic, self.denoised, self.before, self.real, self.difference):
            column.addWidget(view, 1)
        button = ModelButton(ClassifierChooser(c.classify), classifiers)
        self.classes = ClassStrip(c.classify, c.labels, c.span, c.playback, c.display, button)
        bar = SuggestionBar(c.suggestions, actions)
        other = OtherTimeline(c.agreement, c.span, c.playback, c.display)
        for below in (
            self.classes,
            bar,
            LabelArea(self.labels, c.labels),
            other,
            TimeRuler(c.span, c.playback, c.display),
            self.overview,
        ):
            column.addWidget(below)
        self._shown: object = None
        for track in c.tracks:
            track.changed.connect(self._follow)
        c.difference.state_changed.connect(self._follow)
        self._follow()

    def show_document(self) -> None:
        """Another recording is open."""
        self._follow()

    def _follow(self) -> None:
        c = self._context
        has_any = c.synthetic.map is not None or c.real.map is not None
        shown = {
            self.synthetic: c.synthetic.map is not None or not has_any,
            self.denoised: c.denoised.map is not None,
            self.before: c.before.map is not None,
            self.real: c.real.map is not None,
            self.difference: c.difference.shown,
        }
        state = *shown.values(), c.synthetic.map is None, c.document.content is None
        if state == self._shown:
            return  # maps change many times a second
        self._shown = state
        lowest_px = _LOWEST_PX.get(sum(shown.values()), 44)
        for view, there in shown.items():
            view.setMinimumHeight(lowest_px)
            view.setVisible(there)
        self._offer.setVisible(c.synthetic.map is not None and c.denoised.map is None)
        self.overview.set_track(c.synthetic if c.synthetic.map is not None else c.real)
        self.synthetic.set_hint(
            "Add a mesh to see its synthetic Doppler: File → Add to this recording…\n\n"
            "From a video alone: File → New from video… fits a body to the person in it."
            if c.document.content is not None
            else "Drop a recording, video, mesh or radar capture here, or choose File → Open….\n\n"
            "Help → Open the sample recording shows what it looks like."
        )
