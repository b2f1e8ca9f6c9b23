"""Inertial sensors: placed on the body, shown below the maps, written to files."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject, QPointF
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QMenu

from sd2app.feature import Action, Feature, Shell, report
from sd2app.imu.model import ImuModel, place_words
from sd2app.imu.text import reading_lines
from sd2app.imu.track import InertialTrack
from sd2app.manual.help import show_help
from sd2app.session.session import Session
from sd2app.widgets.canvas import Overlay
from sd2app.widgets.dialogs import ask_new
from sd2core.imu.files import SUFFIXES

_FILES = "Table (*.csv);;OpenSim (*.sto);;NumPy (*.npz)"


class ImuFeature(Feature):
    """Virtual sensors on the body, of which one is shown, and a real one's samples."""

    def __init__(self, session: Session, shell: Shell, parent: QObject) -> None:
        self._session, self._shell = session, shell
        self.model = ImuModel(session, parent)
        report(shell, self.model)
        self.changing = (self.model.changed, session.placing.changed)
        self.closing = self.working = (self.model,)

    def actions(self) -> Sequence[Action]:
        """Place a sensor, and write what it feels."""
        model, placing = self.model, self._session.placing
        return (
            Action(
                "place_inertial", "Edit", "Place inertial sensor…", ("I",),
                "The next click on the body in the scene fixes a virtual accelerometer and"
                " gyroscope there; Esc cancels",
                placing.toggle, checked=lambda: placing.active, why_not=lambda: model.why_not,
            ),
            Action(
                "export_inertial", "File", "Export inertial signals…", (),
                "Write acceleration and turn rate of the sensor that is shown (.csv, .sto, .npz)",
                self._save, lambda: model.signals is not None,
            ),
        )  # fmt: skip

    def _save(self) -> None:
        window, name = self._shell.dialog_parent, self.model.file_name
        if path := ask_new(window, "Save inertial signals", name, _FILES, ".csv", SUFFIXES):
            self.model.save(path)

    def track(self, overlays: Sequence[Overlay]) -> InertialTrack:
        """The track below the maps, with what other features draw over it."""
        track = InertialTrack(self._session, self.model, overlays)

        def fill(menu: QMenu, place: QPointF) -> None:
            inside = not self.model.folded and track.plot_rect().contains(place)
            self._fill_menu(menu, track.scale.time_of(place.x()) if inside else None)

        track.menu_parts = (fill,)
        return track

    def _fill_menu(self, menu: QMenu, time_s: float | None) -> None:
        """Fill the menu of the sensors, and of the values at a time."""
        model = self.model
        words = "" if time_s is None else "\t".join(reading_lines(model, time_s))
        copy = menu.addAction("Copy &value", lambda: QGuiApplication.clipboard().setText(words))
        copy.setEnabled(bool(words))
        folded = model.folded
        menu.addAction("&Unfold" if folded else "&Fold", lambda: model.set_folded(not folded))
        menu.addAction("Save signals &as…", self._save).setEnabled(model.signals is not None)
        menu.addSeparator()
        menu.addAction(self._shell.action("place_inertial"))
        menu.addAction(self._shell.action("align_by_hand"))
        for place in model.places:
            if place != model.current or model.signals is None:
                show = menu.addAction(f"Show sensor at {place_words(place)}")
                show.triggered.connect(lambda _, place=place: model.show(place))
        current = model.current
        if current is not None:
            menu.addAction(
                f"&Remove sensor at {place_words(current)}", lambda: model.remove(current)
            )
        if model.file is not None:
            menu.addAction(f"Remove {model.file.name}", model.remove_file)
        menu.addSeparator()
        menu.addAction("&Help on this track", lambda: show_help("Inertial sensor"))
