"""Doppler maps on screen: synthesis, difference, uncertainty, spectrum."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QAction, QColor, QGuiApplication, QIcon, QPixmap, QResizeEvent
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from sd2app.accuracy.model import AccuracyModel
from sd2app.feature import Action, Feature, Shell
from sd2app.manual.help import with_help
from sd2app.maps.difference import DifferenceModel
from sd2app.maps.heatmap import HeatmapView
from sd2app.maps.level_bar import LevelBar, MapEdge
from sd2app.maps.limbs import LimbsModel
from sd2app.maps.model import SynthesisModel
from sd2app.maps.readout import reading_lines
from sd2app.maps.spectrum import SpectrumView
from sd2app.maps.stack import MapStack
from sd2app.maps.uncertainty import UncertaintyModel
from sd2app.session.maps import colours_of, part_words
from sd2app.session.session import Session
from sd2app.widgets.canvas import Overlay
from sd2app.widgets.dialogs import Dialog, ExportButtons, accepted, ask_new
from sd2app.widgets.layouts import column_of, pane
from sd2app.widgets.panel import copy_button, sentence
from sd2core.files.tables import capitalised

_ABOUT = "The map on screen as .npz with all that it was made from and with."


class MapExportDialog(Dialog):
    """Dialog that exports the map of a model, with a copy of the command that makes it.

    ``model`` gives the command for a file of a name (``line``) and writes one (``export``).
    """

    def __init__(self, kind: str, name: str, model: Any, shell: Shell) -> None:
        super().__init__(f"Export {kind} map", shell.dialog_parent)
        self._name, self._model, self._shell = name, model, shell
        copy = copy_button(lambda: model.line(name), self)
        foot = with_help("Export map", ExportButtons(self, self._ask), copy)
        self.setLayout(column_of(sentence(_ABOUT), foot, spacing_px=16, margins_px=16))
        self.setMinimumWidth(440)

    def _ask(self) -> None:
        if path := ask_new(self, self.windowTitle(), self._name, "Doppler map (*.npz)", ".npz"):
            self.accept()
            self._shell.attempt(lambda: self._model.export(path))


_MIN_M = 0.05
"""A sensor as near as this sees what the radar sees."""


class RadarPlaceBadge(QToolButton):
    """Says how far the virtual sensor is from the radar, which stands at the camera; goes there."""

    def __init__(self, session: Session, go: QAction) -> None:
        super().__init__()
        self._session = session
        self.setObjectName("outlined")
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setToolTip("Put the virtual sensor where the radar stands: at the camera")
        self.clicked.connect(go.trigger)
        self.hide()
        self._words: tuple[str, ...] = ()  # the longest first

    def follow(self) -> bool:
        """Say where the sensor stands; True if that changed."""
        maps = self._session.maps
        away_m = math.hypot(*self._session.sensor.sensor.position_m)
        apart = maps.synthetic.map is not None and maps.real.map is not None and away_m >= _MIN_M
        go = "Go to the radar's place"
        words: tuple[str, ...] = (
            f"Synthetic: seen from {away_m:.1f} m beside the radar · {go}",
            f"Seen from {away_m:.1f} m beside the radar · {go}",
            f"{go}, {away_m:.1f} m away",
            go,
            "To the radar",
        )
        if not apart:
            words = ()
        if words == self._words:
            return False
        self._words = words
        self._choose()
        self.setVisible(apart)
        return True

    def sizeHint(self) -> QSize:
        """Size of the longest words."""
        longest = self._words[0] if self._words else ""
        return super().sizeHint() + QSize(self._advance(longest) - self._advance(self.text()), 0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say as much as there is room for."""
        super().resizeEvent(event)
        self._choose()

    def _choose(self) -> None:
        room_px = self.width() - super().sizeHint().width() + self._advance(self.text())
        fitting = [words for words in self._words if self._advance(words) <= room_px]
        self.setText(next(iter(fitting or self._words[-1:]), ""))
        self.setAccessibleName(self._words[0] if self._words else "")

    def _advance(self, words: str) -> int:
        return self.fontMetrics().horizontalAdvance(words)


class LimbMenu(QMenu):
    """The whole body, or some parts of it; of several people, everybody, or some or their parts."""

    def __init__(self, model: LimbsModel, parent: QWidget) -> None:
        super().__init__("Synthetic map by limb", parent)
        self._model = model
        self.setToolTip("Show the Doppler of some people or parts of the body alone")
        self._offered: tuple[str, ...] = ()
        self.triggered.connect(self._choose)
        self.aboutToShow.connect(self._update)
        self._update()

    def _choose(self, action: QAction) -> None:
        if part := action.data():
            self._model.toggle(part)
        else:
            self._model.show()

    def _update(self) -> None:
        if self._offered != self._model.all_parts:
            self._offer(self._model.all_parts)
        parts = self._model.parts
        colours = colours_of(parts)
        for action in self.actions():
            part = action.data()
            action.setChecked(part in parts or not (parts or part))
            action.setEnabled(self._model.track.map is not None)
            swatch = QPixmap(12, 12)
            swatch.fill(QColor(colours.get(part, "transparent")))
            action.setIcon(QIcon(swatch))

    def _offer(self, parts: tuple[str, ...]) -> None:
        """Offer everything, and each of some people and parts."""
        self._offered, persons = parts, self._model.persons
        self.clear()
        for part in ("", *parts):
            words = capitalised(part_words(part)) if part and part not in persons else part
            action = self.addAction(words or ("Everybody" if persons else "Whole body"))
            action.setData(part)
            action.setCheckable(True)


class MapsFeature(Feature):
    """The synthetic map follows sensor and accuracy; all maps share time axis and levels."""

    def __init__(self, session: Session, shell: Shell, accuracy: AccuracyModel) -> None:
        self._session, self._shell = session, shell
        self.synthesis = SynthesisModel(session, accuracy, session.parent)
        self.uncertainty = UncertaintyModel(session, self.synthesis, accuracy, session.parent)
        self.difference = DifferenceModel(session, session.parent)
        self.limbs = LimbsModel(session, self.synthesis, session.parent)
        session.document.changed.connect(session.follow_capture)
        for model in (self.synthesis, self.uncertainty, self.limbs):
            model.failed.connect(shell.warn)
        shown = self.uncertainty.changed, self.difference.changed
        self.changing = *self.synthesis.completeness, *shown
        self.closing = (self.uncertainty, self.limbs, self.synthesis)
        self.working = (self.synthesis,)

    def actions(self) -> Sequence[Action]:
        """Export, levels, uncertainty, difference."""
        uncertainty, difference = self.uncertainty, self.difference
        edits, maps = self._session.edits, self._session.maps
        return (
            Action(
                "export_map", "File", "Export synthetic map…", ("Ctrl+E",),
                "Write the synthetic Doppler map with its provenance (.npz)",
                self._export, lambda: self.synthesis.complete,
            ),
            Action(
                "reset_reference", "View", "Set 0 dB to what is shown", ("R",),
                "Make the strongest bin of each map 0 dB",
                lambda: edits.set_references(maps.strongest(), by_hand=False),
                self._session.has_content,
            ),
            Action(
                "uncertain", "View", "Show uncertain cells", ("U",),
                "Take the colour from cells of the synthetic map that are known to worse than half"
                " of their value; the pointer reads value ± deviation",
                lambda: uncertainty.set_shown(not uncertainty.shown),
                checked=lambda: uncertainty.shown and not uncertainty.why_not,
                why_not=lambda: uncertainty.why_not,
            ),
            Action(
                "difference", "Model", "Difference to the radar", ("X",),
                "Show denoised minus real, in signed colours, below the maps",
                lambda: difference.set_wanted(not difference.wanted),
                checked=lambda: difference.shown,
                why_not=lambda: difference.why_not,
            ),
        )  # fmt: skip

    def menus(self) -> Mapping[str, Callable[[QMenu], object]]:
        """The parts of the body to choose from."""
        return {"limbs": lambda menu: menu.addMenu(self._limb_menu)}

    @cached_property
    def _limb_menu(self) -> LimbMenu:
        return LimbMenu(self.limbs, self._shell.dialog_parent)

    def _export(self) -> None:
        name = self._session.document.file_name("-synthetic.npz")
        accepted(MapExportDialog("synthetic", name, self.synthesis, self._shell))

    def stack(self, over_maps: Sequence[Overlay], over_all: Sequence[Overlay]) -> MapStack:
        """Maps one above the other, with what other features draw over them and the overview."""
        stack = MapStack(self._session, self.difference, over_maps, over_all)
        self._spectrum.stand_beside(stack)
        badge = RadarPlaceBadge(self._session, self._shell.action("sensor_to_camera"))
        stack.real.set_button(badge)
        maps = self._session.maps
        for signal in (self._session.sensor.changed, maps.synthetic.changed, maps.real.changed):
            signal.connect(lambda: badge.follow() and stack.real.redraw())
        action = self._shell.action
        models = [action(name) for name in ("texture", "compare_models", "export_denoised")]
        limbs = [self._limb_menu.menuAction(), action("export_map")]
        own = {stack.synthetic: limbs, stack.denoised: models}
        for view in stack.views:
            actions = own.get(view, [action("export_maps")])
            view.menu_parts = (partial(self._fill_menu, view, actions), *view.menu_parts)
        return stack

    def _fill_menu(
        self, view: HeatmapView, own: Sequence[QAction], menu: QMenu, place: QPointF
    ) -> None:
        """Fill the menu of a map, and of the cell at a place of it."""
        reading, span, edits = view.reading_at(place), self._session.span, self._session.edits
        copy = menu.addAction("Copy &value")
        copy.setEnabled(reading is not None)
        level = "" if reading is None else f" (now {reading.level})"
        zero = menu.addAction(f"&0 dB here{level}")
        zero.setEnabled(reading is not None and reading.value > 0 and not reading.text)
        if reading is not None:
            words = "\t".join(reading_lines(reading))
            copy.triggered.connect(lambda: QGuiApplication.clipboard().setText(words))
            here = {view.track: reading.value}
            zero.triggered.connect(lambda: edits.set_references(here, by_hand=True))
        play = self._session.playback.play_stretch
        menu.addAction("Play what is in view in a &loop", lambda: play(span.start_s, span.end_s))
        if view.alignable:
            menu.addAction(self._shell.action("align_by_hand"))
        menu.addActions(own)

    def panels(self) -> Mapping[str, QWidget]:
        """The spectra of this frame over the levels of all maps."""
        levels = LevelBar(self._session, self._shell.action("uncertain"))
        self._spectrum = SpectrumView(self._session)
        frame, layouts = pane((self._spectrum, 1), levels), self._session.layouts
        return {"spectrum": MapEdge(self._session, frame, partial(layouts.show, "spectrum"))}

    def attach(self) -> None:
        """Compute the map of the recording that was opened."""
        self._session.follow_capture(new=True)
        self.synthesis.attach()
