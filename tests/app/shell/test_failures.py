"""Failures of models reach the user."""

from __future__ import annotations

from PySide6.QtCore import SIGNAL, QObject
from window_models import build_models

from sd2app.settings import Settings


def test_every_failure_is_told(qapp) -> None:
    parent = QObject()
    models = build_models(parent, Settings.forgetful())
    failing = {name: model for name, model in vars(models).items() if hasattr(model, "failed")}
    assert len(failing) > 10
    assert not [
        name for name, model in failing.items() if not model.receivers(SIGNAL("failed(QString)"))
    ]
    models.close()
