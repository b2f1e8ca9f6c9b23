"""A body fitted from the window, by mouse and keys; the fit itself is pretended."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from answering import answer, once_asked
from copied import copied_record
from fake_denoisers import FakeDenoisers
from finding import button_of, named, words_in
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QLabel,
    QListWidget,
    QMessageBox,
    QPushButton,
    QStyle,
    QStyleOptionViewItem,
    QToolButton,
)
from window_models import models_of

from sd2app.fit.dialog import NewFromVideoDialog
from sd2app.fit.feature import FitBar, FitOffer
from sd2app.fit.request import FitRequest, Person
from sd2app.fit.setup import PICTURE_PX, FitSetupModel, Portrait
from sd2app.settings import Settings
from sd2app.shell.parts import Parts
from sd2app.shell.window import MainWindow
from sd2app.video.feature import VideoView, bones
from sd2core.body.shape import DEFAULT_STATURE_M
from sd2core.body.track import LANDMARKS, MIRRORED
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VirtualSensor

FAKE = Path(__file__).resolve().parents[2] / "fake_fit.py"


@pytest.fixture
def video(small_recording, tmp_path) -> Path:
    return Path(shutil.copy(small_recording / "video.mp4", tmp_path / "walk.mp4"))


@pytest.fixture
def made(qtbot, compiled_kernels, fake):
    """Makes windows whose fit is pretended; options are those of ``fake_fit.py``."""
    windows: list[MainWindow] = []

    def make(*options: object, settings: Settings | None = None) -> MainWindow:
        command = [sys.executable, "-u", str(FAKE), *map(str, options)]
        window = MainWindow(
            settings or Settings.forgetful(),
            Parts(accuracy=fake.library, fit_command=command, denoisers=FakeDenoisers().library),
        )
        windows.append(window)
        window.resize(1280, 800)
        window.show()
        window.populate()
        qtbot.waitUntil(lambda: window.settled, timeout=20_000)
        return window

    yield make
    for window in windows:
        if window.ready:
            models_of(window).fit.close()
            models_of(window).fit.state = "idle"
            models_of(window).document.undo_stack.clear()
        window.close()
        window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def show(window, qtbot, path: Path) -> None:
    with qtbot.waitSignal(models_of(window).document.opened, timeout=20_000):
        window.open_paths([path])
    qtbot.waitUntil(lambda: window.settled, timeout=20_000)


def click(window, qtbot, text: str) -> None:
    parts = window.findChild(FitBar), window.findChild(FitOffer)
    buttons = [button for part in parts for button in part.findChildren(QToolButton)]
    (button,) = (one for one in buttons if one.text() == text and one.isVisible())
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)


def test_from_the_offer_to_the_recording(made, qtbot, video) -> None:
    window = made("--body")
    show(window, qtbot, video)
    bar, hinting = window.findChild(FitBar), window.maps.synthetic
    assert not bar.isVisible()
    assert window.findChild(FitOffer).isVisible()
    assert "Add a mesh" in hinting.hint
    asked: list[FitRequest] = []

    def fill(dialog: NewFromVideoDialog) -> None:
        qtbot.waitUntil(lambda: dialog.picker.setup.picture is not None, timeout=10_000)
        picker = dialog.picker
        box = picker.box

        def at(x: float, y: float) -> QPoint:
            scale = box.width() / 160
            return QPoint(round(box.x() + x * scale), round(box.y() + y * scale))

        qtbot.mousePress(picker, Qt.MouseButton.LeftButton, pos=at(120, 100))
        qtbot.mouseMove(picker, at(60, 60))
        qtbot.mouseRelease(picker, Qt.MouseButton.LeftButton, pos=at(40, 20))
        known = dialog.findChild(QCheckBox)
        qtbot.mouseClick(known, Qt.MouseButton.LeftButton, pos=QPoint(8, known.height() // 2))
        fit = next(b for b in dialog.findChildren(QPushButton) if b.text() == "Fit")
        asked.append(dialog.picker.setup.request())
        qtbot.mouseClick(fit, Qt.MouseButton.LeftButton)

    once_asked(NewFromVideoDialog, fill)
    click(window, qtbot, "Fit a body…")
    fit = models_of(window).fit
    person = asked[0].person
    assert isinstance(person, Person)
    assert (person.x, person.y) == pytest.approx((40, 20), abs=1)
    assert (person.width, person.height) == pytest.approx((80, 80), abs=1)
    assert asked[0].stature_m == DEFAULT_STATURE_M
    assert fit.request == asked[0]
    assert ("being fitted" in hinting.hint, "Add a mesh" in hinting.hint) == (True, False)
    with qtbot.waitSignal(models_of(window).document.opened, timeout=30_000):
        pass
    made_of = open_recording(video.with_name("walk.sd2"))
    assert made_of.video == video
    assert models_of(window).document.recording.folder == made_of.folder
    assert models_of(window).document.mesh.frame_count == 60
    qtbot.waitUntil(lambda: window.messages.text == "This was no fit.")
    assert fit.state == "idle"
    assert not bar.isVisible()


def test_a_fit_is_copied_for_a_terminal(made, qtbot, video) -> None:
    window = made()
    show(window, qtbot, video)
    asked: list[FitRequest] = []

    def copy(dialog: NewFromVideoDialog) -> None:
        setup = dialog.setup
        qtbot.waitUntil(lambda: setup.ready, timeout=10_000)
        setup.change(stature_m=1.655, camera="angle", angle_deg=61.0)
        setup.set_person(40, 20, 120, 100)
        button = next(b for b in dialog.findChildren(QToolButton) if b.text() == "Copy command")
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        asked.append(setup.request())
        dialog.reject()

    once_asked(NewFromVideoDialog, copy)
    click(window, qtbot, "Fit a body…")
    mesh = video.with_name("walk.zarr")
    assert copied_record() == asked[0].command(mesh)
    assert (copied_record().stature_m, copied_record().person_box) == (1.655, (40, 20, 80, 80))


def press_tick(qtbot, people: QListWidget, row: int) -> None:
    """Click the box of a row."""
    people.scrollToItem(people.item(row))
    option = QStyleOptionViewItem()
    people.initViewItemOption(option)
    option.rect = people.visualItemRect(people.item(row))
    option.features |= QStyleOptionViewItem.ViewItemFeature.HasCheckIndicator
    part = QStyle.SubElement.SE_ItemViewItemCheckIndicator
    box = people.style().subElementRect(part, option, people)
    qtbot.mouseClick(people.viewport(), Qt.MouseButton.LeftButton, pos=box.center())


@pytest.fixture
def three_people(monkeypatch) -> list[Portrait]:
    """Three people of a video, found as soon as somebody looks for them."""
    pictures = [np.full((PICTURE_PX, PICTURE_PX, 3), 60 * n, np.uint8) for n in (1, 2, 3)]
    people = [
        Portrait(1, "Person 1\n0.0 to 0.9 s\n100 % certain", 11, pictures[0]),
        Portrait(2, "Person 2\n0.2 to 2.0 s\n93 % certain", 30, pictures[1]),
        Portrait(3, "Person 3\n1.4 to 2.0 s\n100 % certain\nmay be person 1", 52, pictures[2]),
    ]
    monkeypatch.setattr("sd2app.fit.setup.portraits_of", lambda path, emit: emit(0.5) or people)
    return people


@pytest.mark.slow
def test_who_is_ticked_makes_a_scene(made, qtbot, video, three_people) -> None:
    window = made("--body")
    show(window, qtbot, video)

    def choose(dialog: NewFromVideoDialog) -> None:
        people, setup = named(dialog, "People to fit", QListWidget), dialog.setup
        qtbot.waitUntil(lambda: setup.picture is not None, timeout=10_000)
        assert not people.isVisible()
        qtbot.mouseClick(button_of(dialog, "Who is there?"), Qt.MouseButton.LeftButton)
        qtbot.waitUntil(people.isVisible, timeout=10_000)
        rows = [people.item(row) for row in range(people.count())]
        assert [row.text() for row in rows] == [each.words for each in three_people]
        assert "may be person 1" in rows[2].text()
        for row, each in zip(rows, three_people, strict=True):
            shown = row.icon().pixmap(PICTURE_PX, PICTURE_PX).toImage().pixelColor(40, 40)
            assert shown.red() == each.picture[0, 0, 0]
        for row in (2, 0, 1, 0):  # the first one is ticked by mistake
            press_tick(qtbot, people, row)
        assert setup.choices.people == (2, 3)
        assert "people 2, 3" in [each.text() for each in dialog.findChildren(QLabel)]
        place = people.visualItemRect(people.item(1)).center()
        qtbot.mouseClick(people.viewport(), Qt.MouseButton.LeftButton, pos=place)
        assert setup.frame == 30
        assert setup.choices.people == (2, 3)
        qtbot.mouseClick(button_of(dialog, "Fit"), Qt.MouseButton.LeftButton)

    once_asked(NewFromVideoDialog, choose)
    document = models_of(window).document
    click(window, qtbot, "Fit a body…")
    with qtbot.waitSignal(document.opened, timeout=30_000):
        pass
    made_of = open_recording(video.with_name("walk.sd2"))
    assert made_of.mesh == made_of.folder / "mesh-2.zarr"
    assert [Path(each.path).name for each in made_of.bodies] == ["mesh-3.zarr"]
    assert document.recording.folder == made_of.folder
    # Numbers as in the list, not by their order here.
    assert document.mesh.persons == ("person 2 of walk", "person 3 of walk")


@pytest.mark.slow
def test_landmarks_are_drawn_and_the_clock_goes_along_until_it_is_moved(made, qtbot, video) -> None:
    window = made("--pause-s", 0.01, "--stop-at", 30)
    show(window, qtbot, video)
    c = models_of(window)
    c.fit.start(FitRequest(video, video.with_name("walk.sd2")))
    qtbot.waitUntil(lambda: c.video.shown_frame == 30 == c.playback.frame, timeout=20_000)
    view = window.findChild(VideoView)

    def blue_and_orange() -> tuple[int, int]:
        image = view.grab().toImage().convertToFormat(image_format())
        pixels = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
        blue, red = (pixels[..., k].astype(int) for k in (0, 2))
        return int((blue - red > 60).sum()), int((red - blue > 60).sum())

    left, right = blue_and_orange()
    assert left > 50
    assert right > 50
    qtbot.keyClick(window, Qt.Key.Key_Left)
    assert not c.fit_on_screen.following
    qtbot.wait(200)
    assert c.playback.frame == 29
    click(window, qtbot, "Follow")
    assert c.fit_on_screen.following
    bar = window.findChild(FitBar)
    before = [one.geometry() for one in bar.findChildren(QToolButton) if one.isVisible()]
    click(window, qtbot, "Cancel")
    assert c.fit.state == "cancelling"
    qtbot.waitUntil(lambda: c.fit.state == "stopped", timeout=10_000)
    qtbot.waitUntil(lambda: not button_of(bar, "Follow").isVisible())
    QCoreApplication.processEvents()
    discard = button_of(bar, "Discard…").geometry()
    assert not any(discard.intersects(one) for one in before), "it came to where one was"
    # What is lost is said, and nothing is deleted unless that is wanted.
    asked: list[str] = []
    for name in ("Cancel", "Discard"):
        assert video.with_name("walk.sd2").exists()
        answer(qtbot, name, asked)
        click(window, qtbot, "Discard…")
    assert video.name in asked[0]
    assert blue_and_orange() == (0, 0)
    assert not video.with_name("walk.sd2").exists()


def image_format():
    from PySide6.QtGui import QImage

    return QImage.Format.Format_RGB32


@pytest.mark.slow
def test_a_failure_is_shown_and_put_away(made, qtbot, video) -> None:
    window = made("--refuse", "There is nobody in walk.mp4. Film a person.")
    show(window, qtbot, video)
    models_of(window).fit.start(FitRequest(video, video.with_name("walk.sd2")))
    qtbot.waitUntil(lambda: models_of(window).fit.state == "failed", timeout=20_000)
    bar = window.findChild(FitBar)
    assert words_in(bar, "warning") == ["There is nobody in walk.mp4. Film a person."]
    asked: list[Path | None] = []

    def look(dialog: NewFromVideoDialog) -> None:
        asked.append(dialog.picker.setup.video)
        dialog.reject()

    once_asked(NewFromVideoDialog, look)
    click(window, qtbot, "Change…")
    assert asked == [video]
    click(window, qtbot, "✕")
    assert models_of(window).fit.state == "idle"


@pytest.mark.slow
def test_closing_asks_and_the_next_start_continues(made, qtbot, video) -> None:
    settings = Settings.forgetful()
    window = made("--stop-at", 10, settings=settings)
    show(window, qtbot, video)
    models_of(window).fit.start(FitRequest(video, video.with_name("walk.sd2")))
    qtbot.waitUntil(lambda: models_of(window).fit.landmarks_at(10) is not None, timeout=20_000)
    once_asked(QMessageBox, lambda box: box.button(QMessageBox.StandardButton.Cancel).click())
    window.close()
    assert window.isVisible()
    assert models_of(window).fit.state == "running"
    once_asked(QMessageBox, lambda box: box.button(QMessageBox.StandardButton.Ok).click())
    window.close()
    assert not window.isVisible()
    again = made("--body", settings=settings)
    assert models_of(again).fit.state == "stopped"
    click(again, qtbot, "Resume")
    # Nothing else is open: the video is shown, and then the recording.
    made_of = video.with_name("walk.sd2")
    document = models_of(again).document
    qtbot.waitUntil(
        lambda: document.content and document.recording.folder == made_of, timeout=30_000
    )


def test_a_folder_in_which_a_fit_was_stopped_can_be_opened(made, qtbot, video) -> None:
    request = FitRequest(video, video.with_name("walk.sd2"))
    request.save()
    window = made()
    show(window, qtbot, request.folder)
    assert models_of(window).document.recording.video == video
    assert models_of(window).fit.state == "stopped"


@pytest.mark.slow
def test_what_is_open_meanwhile_stays_open(made, qtbot, video, small_recording) -> None:
    window = made("--body", "--pause-s", 0.02)
    show(window, qtbot, small_recording)
    c = models_of(window)
    c.fit.start(FitRequest(video, video.with_name("walk.sd2")))
    qtbot.waitUntil(lambda: c.fit.state == "finished", timeout=30_000)
    assert c.document.recording.folder == small_recording
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        click(window, qtbot, "Open")
    assert c.document.recording.folder == video.with_name("walk.sd2")


@pytest.mark.slow
def test_a_recording_that_is_open_keeps_its_edits_and_gets_the_mesh(made, qtbot, video) -> None:
    saved = Recording.create(video.with_name("mine.sd2"), video=video, title="Mine")
    window = made("--body", "--pause-s", 0.02)
    show(window, qtbot, saved.folder)
    c = models_of(window)
    setup = FitSetupModel()
    setup.choose_video(c.fit_on_screen.offered, c.document.recording)
    qtbot.waitUntil(lambda: setup.ready, timeout=10_000)
    assert setup.completes
    c.fit.start(setup.request())
    setup.close()
    sensor = VirtualSensor(position_m=(0.5, 0.0, 0.0))
    c.edits.place_sensor(sensor)
    # There is an edit that is not saved: nothing is opened over it.
    qtbot.waitUntil(lambda: c.fit.state == "finished", timeout=30_000)
    assert window.save()
    kept = open_recording(saved.folder)
    assert kept.mesh == saved.folder / "mesh.zarr"
    assert (kept.sensor, kept.title) == (sensor, "Mine")
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        click(window, qtbot, "Open")
    assert c.document.mesh is not None


def test_the_key_asks_for_a_video(made, qtbot, monkeypatch) -> None:
    window = made()
    asked = []
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *a, **k: asked.append(a) or ("", ""))
    qtbot.keyClick(window, Qt.Key.Key_N, Qt.KeyboardModifier.ControlModifier)
    assert len(asked) == 1
    assert not models_of(window).fit.busy


@pytest.mark.slow
def test_no_offer_where_there_is_a_mesh_or_it_was_declined(made, qtbot, video, small_recording):
    window = made()
    offer = window.findChild(FitOffer)
    assert not offer.isVisible()
    show(window, qtbot, small_recording)
    assert not offer.isVisible()
    show(window, qtbot, video)
    assert offer.isVisible()
    click(window, qtbot, "✕")
    assert not offer.isVisible()


def test_the_skeleton_has_two_equal_sides() -> None:
    lines = {(a, b): colour for a, b, colour in bones()}
    for (a, b), colour in lines.items():
        mirrored = lines.get((MIRRORED[a], MIRRORED[b])) or lines[(MIRRORED[b], MIRRORED[a])]
        across = LANDMARKS[a].split(".")[0] == LANDMARKS[b].split(".")[0]
        assert (mirrored == colour) == across
