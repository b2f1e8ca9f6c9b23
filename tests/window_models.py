"""All models of a window under short names, for tests that look at many of them."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QMenu

from sd2app.feature import Action
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2app.shell.menus import in_order
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2app.shell.wiring import Features


def models_of(window: MainWindow) -> SimpleNamespace:
    """Models of a window that stands."""
    return _named(window.session, window.features, keys=window.keys)


def build_models(parent: QObject, settings: Settings, parts: Parts | None = None) -> Any:
    """Models without a window."""
    session, shell = Session(parent, settings), NoShell()
    parts = replace(parts or Parts(), pictures=Path(os.devnull))  # keeps none
    features = Features(session, shell, parts)
    return _named(session, features, shell=shell)


def all_actions() -> tuple[Action, ...]:
    """Actions of all features in the order of the menus; they belong to nothing that is open."""
    parent = QObject()
    session = Session(parent, Settings.forgetful())
    features = Features(session, NoShell(), Parts())
    return in_order(action for feature in features for action in feature.actions())


def menu_of(window: MainWindow, title: str) -> QMenu:
    """Menu of a window or of a place in it by its title, whichever letter of it is underlined."""
    menus = window.findChildren(QMenu)
    return next(one for one in menus if one.title().replace("&", "") == title.replace("&", ""))


class NoShell:
    """Stands in for the window where nothing asks the user.

    A warning fails the test, unless it collects them in ``warned``.
    """

    dialog_parent = None
    warned: list[str] | None = None

    def warn(self, text: str) -> None:
        if self.warned is None:
            raise AssertionError(text)
        self.warned.append(text)

    def note(self, text: str) -> None:
        pass

    def attempt(self, work: Callable[[], object]) -> object:
        return work()

    def open_paths(self, paths: list[Path]) -> None:
        raise AssertionError(paths)


def _named(session: Session, features: Features, **others: object) -> SimpleNamespace:
    s, f = session, features

    def close() -> None:
        s.playback.pause()
        f.close()

    return SimpleNamespace(
        session=s,
        settings=s.settings,
        jobs=s.jobs,
        document=s.document,
        playback=s.playback,
        video=s.video,
        sensor=s.sensor,
        display=s.display,
        span=s.span,
        pointer=s.pointer,
        synthetic=s.maps.synthetic,
        denoised=s.maps.denoised,
        before=s.maps.before,
        real=s.maps.real,
        edits=s.edits,
        overlay=f.video.overlay,
        trade=f.accuracy.model,
        synthesis=f.maps.synthesis,
        uncertainty=f.maps.uncertainty,
        limbs=f.maps.limbs,
        placements=f.sensor.placements,
        alignment=f.sensor.alignment,
        denoise=f.denoise.model,
        classify=f.classify.model,
        class_training=f.classify.training,
        labels=f.labels.model,
        label_session=f.labels.autosave,
        label_edits=f.labels.edits,
        label_dragging=f.labels.dragging,
        label_tracks=f.labels.tracks,
        cut_out=f.labels.cut_out,
        suggestions=f.suggestions.model,
        agreement=f.agreement.model,
        fit=f.fit.model,
        fit_on_screen=f.fit.on_screen,
        batch=f.batch.model,
        training=f.training.model,
        training_use=f.training.adoption,
        export=f.dataset_export.model,
        imu=f.imu.model,
        placing=s.placing,
        close=close,
        **others,
    )
