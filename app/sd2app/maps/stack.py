"""The Doppler maps one above the other."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import QWidget

from sd2app.maps.difference import DifferenceModel
from sd2app.maps.difference_view import DifferenceView
from sd2app.maps.heatmap import HeatmapView
from sd2app.maps.overview import Overview
from sd2app.session.session import Session
from sd2app.widgets.canvas import Overlay
from sd2app.widgets.layouts import column_of

_LOWEST_PX = {1: 96, 2: 96, 3: 72, 4: 54}
"""Least height of a map, by the number of maps."""


class MapStack(QWidget):
    """One view per map; views without content are hidden."""

    def __init__(
        self,
        session: Session,
        difference: DifferenceModel,
        over_maps: Sequence[Overlay],
        over_all: Sequence[Overlay],
    ) -> None:
        super().__init__()
        self._session, self._difference, maps = session, difference, session.maps
        self.synthetic = HeatmapView(maps.synthetic, session, over_maps)
        self.denoised = HeatmapView(maps.denoised, session, over_maps)
        self.before = HeatmapView(maps.before, session, over_maps)
        self.real = HeatmapView(maps.real, session, over_maps, alignable=True)
        self.difference = DifferenceView(difference, session, over_maps)
        self.overview = Overview(session, over_all)
        self._offer: QWidget | None = None
        views = [(view, 1) for view in self.views]
        self.setLayout(column_of(*views, spacing_px=0, margins_px=0))
        self._shown: object = None
        for track in maps.all:
            track.changed.connect(self.refresh)
        difference.state_changed.connect(self.refresh)
        self.refresh()

    @property
    def views(self) -> tuple[HeatmapView, ...]:
        """All views from top to bottom, hidden ones included."""
        return (self.synthetic, self.denoised, self.before, self.real, self.difference)

    def set_denoiser_buttons(self, offer: QWidget, chosen: QWidget) -> None:
        """Put the choice of the denoiser beside the map it makes, or the one it could use."""
        self._offer = offer
        self.synthetic.set_button(offer)
        self.denoised.set_button(chosen)
        self._shown = None
        self.refresh()

    def refresh(self) -> None:
        """Show the views that have content."""
        document, maps = self._session.document, self._session.maps
        has_any = maps.synthetic.map is not None or maps.real.map is not None
        shown = {
            self.synthetic: maps.synthetic.map is not None or not has_any,
            self.denoised: maps.denoised.map is not None,
            self.before: maps.before.map is not None,
            self.real: maps.real.map is not None,
            self.difference: self._difference.shown,
        }
        state = *shown.values(), maps.synthetic.map is None, document.content is None
        if state == self._shown:
            return  # maps change many times a second
        self._shown = state
        lowest_px = _LOWEST_PX.get(sum(shown.values()), 44)
        for view, there in shown.items():
            view.setMinimumHeight(lowest_px)
            view.setVisible(there)
        if self._offer is not None:
            self._offer.setVisible(maps.synthetic.map is not None and maps.denoised.map is None)
        self.overview.set_track(maps.synthetic if maps.synthetic.map is not None else maps.real)
        self.synthetic.set_hint(
            "Add a mesh to see its synthetic Doppler: File → Add to this recording…\n\n"
            "From a video alone: File → New from video… fits a body to the person in it."
            if document.content is not None
            else "Drop a recording, video, mesh or radar capture here, or choose File → Open….\n\n"
            "Help → Open the sample recording shows what it looks like."
        )
