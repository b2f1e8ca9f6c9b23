"""Actions are enabled and checked as their features say, whatever happens, and no others asked."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QCoreApplication
from window_models import models_of

from sd2app.shell.menus import menus_in
from sd2core.labels.field_edits import add_track

SECONDS = 1000


def stale(window) -> list[str]:
    """Actions that are not as the models stand now, once all events are dealt with."""
    QCoreApplication.processEvents()
    rows = [row for feature in window.features for row in feature.actions()]
    return [
        row.id
        for row in rows
        if window.action(row.id).isEnabled()
        != (row.enabled() and not (row.why_not is not None and row.why_not()))
        or (row.checked is not None and window.action(row.id).isChecked() != row.checked())
    ]


def test_every_action_follows_what_it_depends_on(labelled, fake_models, qtbot) -> None:
    c = models_of(labelled)
    near = {"position_m": (0.2, 0.1, 0.1)}
    steps: dict[str, Callable[[], object]] = {
        "select": c.labels.select_all,
        "deselect": lambda: c.labels.select(()),
        "delete": lambda: (c.labels.select([1]), c.label_edits.delete()),
        "undo": c.document.undo_stack.undo,
        "redo": c.document.undo_stack.redo,
        "a track": lambda: c.label_edits.apply(lambda now: add_track(now.labels, "More")),
        "play": c.playback.play,
        "pause": c.playback.pause,
        "loop": lambda: c.playback.set_loop(not c.playback.loop),
        "place": c.placing.toggle,
        "placed": c.placing.end,
        "colour": lambda: c.display.set_mesh_colour("range"),
        "dots": lambda: c.display.set_as_dots(True),
        "surface": lambda: c.display.set_as_dots(False),
        "fold": lambda: labelled.fold_side(True),
        "unfold": lambda: labelled.fold_side(False),
        "drag": lambda: (c.edits.begin_sensor_drag(), c.edits.drag_sensor(near["position_m"])),
        "drop": c.edits.end_drag,
        "no real map": lambda: c.real.set_map(None),
        "another count": lambda: c.edits.choose_count("plain"),
        "difference": lambda: c.session.maps.denoised.set_map(c.synthetic.map),
        "nothing denoised": lambda: c.session.maps.denoised.set_map(None),
    }
    assert not stale(labelled)
    for name, step in steps.items():
        step()
        assert not stale(labelled), name
    qtbot.waitUntil(lambda: labelled.settled and c.synthesis.complete, timeout=30 * SECONDS)
    assert not stale(labelled), "complete again"


def test_a_menu_that_opens_asks_every_action(window) -> None:
    c = models_of(window)
    c.playback.loop = not c.playback.loop  # nobody was told
    assert "loop" in stale(window)
    next(menus_in(window.menuBar())).aboutToShow.emit()
    assert not stale(window)


def test_a_label_asks_nothing_of_the_sensor(labelled, monkeypatch) -> None:
    asked = []
    model = type(models_of(labelled).alignment)
    monkeypatch.setattr(model, "why_not", property(lambda self: asked.append(1) or ""))
    c = models_of(labelled)
    QCoreApplication.processEvents()
    asked.clear()
    c.labels.select([1])
    c.label_edits.delete()
    QCoreApplication.processEvents()
    assert labelled.action("undo").isEnabled()
    assert not asked
