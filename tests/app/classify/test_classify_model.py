"""The classifier in use and the map that it looks at; no window."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from fake_classifiers import FakeClassifiers, expected
from PySide6.QtCore import QObject, Signal

from sd2app.classify.model import ClassifyModel, classifier_page, reading_text
from sd2app.labels.model import LabelsModel
from sd2app.session.session import Session
from sd2app.settings import Settings
from sd2core.errors import Sd2Error
from sd2core.labels.label_set import Label, LabelSet
from sd2core.labels.spans import Labels, LabelTrack
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


class Denoise(QObject):
    """Tells which maps are of the sensor's place, as the test says."""

    current_changed = Signal()

    def __init__(self):
        super().__init__()
        self.others = []

    def is_current(self, track):
        return track not in self.others


def a_map(kind, seed=0):
    values = np.random.default_rng(seed).exponential(size=(32, 60)).astype(np.float32)
    return DopplerMap(values, VelocityAxis(32, 2.0), Timebase.regular(60, 30.0), kind)


@pytest.fixture
def set_up(qtbot):
    fake, labels, denoise = FakeClassifiers("a"), LabelsModel(), Denoise()
    session = Session(owner := QObject(), Settings.forgetful())
    tracks = [session.maps.synthetic, session.maps.denoised, session.maps.real]
    tracks[2].title = "Radar (simulated)"
    playback = session.playback
    playback.set_timebase(Timebase.regular(60, 30.0))
    made = []

    def model():
        made.append(ClassifyModel(session, denoise, labels, fake.library, owner))
        return made[-1]

    def settle():
        qtbot.waitUntil(lambda: not made[-1].busy, timeout=10_000)

    (path,) = fake.cards
    yield SimpleNamespace(
        model=model, fake=fake, tracks=tracks, playback=playback, denoise=denoise,
        labels=labels, settle=settle, path=path,
    )  # fmt: skip
    fake.gate.set()
    for one in made:
        one.close()


def test_the_frame_on_screen_is_followed(set_up):
    model, doppler = set_up.model(), a_map("denoised")
    set_up.tracks[1].set_map(doppler)
    model.use(set_up.path)
    set_up.settle()
    told = expected(doppler.values.T)
    for frame in (0, 17, 59):
        set_up.playback.seek_frame(frame)
        assert model.reading.shares == pytest.approx(told[frame])
    set_up.denoise.others = [set_up.tracks[1]]
    assert not model.reading.current
    # What the sensor does is nothing to the radar's own map.
    set_up.tracks[2].set_map(doppler)
    model.set_source(set_up.tracks[2])
    set_up.settle()
    assert model.reading.current


def test_it_looks_at_a_map_of_a_kind_that_it_has_learned_from(set_up):
    model = set_up.model()
    synthetic, denoised, radar = set_up.tracks
    synthetic.set_map(a_map("synthetic"))
    model.use(set_up.fake.add("/classifiers/radar.safetensors", kinds=("real",)))
    assert model.source is synthetic
    assert not model.knows_source
    radar.set_map(a_map("simulated"))
    denoised.set_map(a_map("denoised"))
    assert model.source is radar
    assert model.knows_source
    model.use(set_up.path)
    assert model.source is denoised
    model.set_source(synthetic)
    assert model.source is synthetic
    synthetic.set_map(None)
    assert model.source is denoised
    assert model.track.source is denoised


@pytest.mark.slow
def test_the_choice_is_remembered_and_loaded_again(set_up, qtbot):
    first = set_up.model()
    first.use(set_up.path)
    assert set_up.fake.loaded == []  # there is nothing to look at yet
    again = set_up.model()
    assert again.path == set_up.path
    set_up.tracks[0].set_map(a_map("synthetic"))
    qtbot.waitUntil(lambda: again.track.complete, timeout=10_000)
    again.use(None)
    assert again.reading is None
    assert not again.visible
    assert set_up.model().path is None


def test_what_is_no_classifier_is_refused_and_the_choice_stays(set_up):
    model = set_up.model()
    model.use(set_up.path)
    with pytest.raises(Sd2Error, match=r"other.safetensors is no classifier"):
        model.use(set_up.path.with_name("other.safetensors"))
    assert model.path == set_up.path


def test_one_that_cannot_be_loaded_says_why(set_up, qtbot):
    model = set_up.model()
    set_up.fake.failure = Sd2Error("The process has ended")
    set_up.tracks[0].set_map(a_map("synthetic"))
    with qtbot.waitSignal(model.failed):
        model.use(set_up.path)
    assert model.problem == "The process has ended."
    set_up.fake.failure = None
    model.use(set_up.path)
    qtbot.waitUntil(lambda: model.track.complete, timeout=10_000)
    assert model.problem == ""


def test_a_class_is_called_by_its_label_where_there_is_one(set_up):
    model = set_up.model()
    offered = LabelSet(
        "own",
        (
            Label("wave", "#112233", "", "horizontal"),
            Label("up", "#112233", "", "vertical"),
            Label("down", "#112233", "", "vertical"),
        ),
    )
    set_up.labels.open(Labels((LabelTrack("Gestures"),), (), offered))
    assert model.label_of("horizontal") == "wave"
    assert model.label_of("vertical") == "vertical"
    assert model.label_of("background") == "background"


def test_simulated_is_called_so(set_up):
    card = set_up.fake.cards[set_up.path]
    assert classifier_page(card).simulated
    assert dict(classifier_page(card).rows)["Learned from"] == (
        "simulated radar and denoised synthetic maps"
    )
    real = set_up.fake.cards[set_up.fake.add("/r.safetensors", kinds=("real", "synthetic"))]
    assert not classifier_page(real).simulated


def test_words_of_a_reading(set_up):
    model = set_up.model()
    assert reading_text(model.reading) == ""
    doppler = a_map("denoised")
    doppler.values[:] = 0.0
    set_up.tracks[1].set_map(doppler)
    model.use(set_up.path)
    set_up.settle()
    assert reading_text(model.reading) == "background 100 %"


def test_the_bundled_one_is_there_from_the_start_and_loaded_when_it_is_asked_for(set_up, qtbot):
    usual = set_up.fake.add("/bundled/gestures.safetensors", kinds=("synthetic",))
    model = set_up.model()
    set_up.tracks[0].set_map(a_map("synthetic"))
    assert model.path == usual
    assert model.why_not == ""
    assert not model.visible
    qtbot.wait(1700)  # longer than a chosen one waits
    assert set_up.fake.loaded == []

    model.wake()

    qtbot.waitUntil(lambda: model.ready, timeout=10_000)
    assert set_up.fake.loaded == [usual]


def test_whoever_wants_none_or_another_has_it_the_next_time(set_up):
    usual = set_up.fake.add("/bundled/gestures.safetensors")
    first = set_up.model()
    first.use(None)
    assert set_up.model().path is None
    first.use(set_up.path)
    assert set_up.model().path == set_up.path
    first.use(usual)
    first.set_shown(True)
    assert set_up.model().path == usual
