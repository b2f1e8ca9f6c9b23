"""Two people's labels compared as they change; no window."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from sd2app.agreement.feature import facts, label_facts, verdict, where
from sd2app.agreement.model import AgreementModel
from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.time_window import TimeWindow
from sd2core.errors import Sd2Error
from sd2core.labels.formats import write_labels
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)


def of(*spans: tuple[float, float, str], track: str = "Gestures") -> Labels:
    made = [Span(k, track, *span) for k, span in enumerate(spans, start=1)]
    return Labels((LabelTrack(track),), tuple(made))


MINE = of((1.0, 2.0, "wave"), (4.0, 5.0, "up-to-down"))


class Compared:
    """A model on ten seconds, with ways to wait for it."""

    def __init__(self, qtbot) -> None:
        self._qtbot = qtbot
        self.labels, self.playback, self.span = LabelsModel(), PlaybackModel(), TimeWindow()
        session = SimpleNamespace(document=None, playback=self.playback, span=self.span)
        self.playback.set_timebase(FRAMES)
        self.span.set_extent(0.0, 10.0)
        self.labels.open(MINE)
        self.model = AgreementModel(session, self.labels, self.labels)

    def wait(self) -> None:
        self._qtbot.waitUntil(lambda: not self.model.busy, timeout=10_000)

    def with_file(self, path: Path, labels: Labels) -> AgreementModel:
        write_labels(path, labels, FRAMES)
        self.model.open(path)
        self.wait()
        return self.model


@pytest.fixture
def compared(qtbot):
    made = Compared(qtbot)
    yield made
    made.model.close()


def test_who_says_the_same_agrees_wholly(compared, tmp_path) -> None:
    model = compared.with_file(tmp_path / "ben.eaf", MINE)
    assert model.name == "ben"
    assert verdict(model) == "Kappa 1.00: almost perfect"
    assert ("Frames the same", "100.0 %") in facts(model)
    assert label_facts(model) == [("up-to-down", "1.00"), ("wave", "1.00")]
    assert where(model) == "No frame is labelled differently."
    # Nothing of the other's can be edited: it is a model of its own.
    assert model.other is not compared.labels


def test_from_one_disagreement_to_the_next(compared, tmp_path) -> None:
    theirs = of((1.0, 2.3, "wave"), (4.0, 5.0, "push"), (12.0, 13.0, "wave"), track="Ben")
    model = compared.with_file(tmp_path / "ben.csv", theirs)
    assert model.left_out == 1
    assert where(model) == "2 disagreements, 1.30 s in all."
    compared.span.set_span(6.0, 8.0)
    model.step(1)
    assert compared.playback.time_s == pytest.approx(2.0)
    assert compared.span.start_s == pytest.approx(2.0)
    assert where(model) == "1 of 2, 2.00 to 2.30 s.\nYou: nothing.\nben: wave."
    model.step(1)
    assert where(model) == "2 of 2, 4.00 to 5.00 s.\nYou: up-to-down.\nben: push."
    model.step(1)
    assert compared.playback.time_s == pytest.approx(4.0)
    model.step(-1)
    assert compared.playback.time_s == pytest.approx(2.0)
    said = dict(facts(model))
    assert (said["Spans matched"], said["of these with the same label"]) == ("2", "1")
    assert said["Median difference of starts"] == "0.00 s"
    assert said["Median difference of ends"] == "0.15 s"


def test_it_follows_what_is_edited_and_leaves_suggestions_out(compared, tmp_path) -> None:
    model = compared.with_file(tmp_path / "ben.json", MINE)
    offered = Span(9, "Gestures", 7.0, 8.0, "gesture", origin="suggestion")
    compared.labels.set_labels(MINE.with_spans([offered]))
    compared.wait()
    assert not model.disagreements
    compared.labels.set_labels(MINE.with_spans(without=[1]))
    compared.wait()
    assert [(one.start_s, one.b) for one in model.disagreements] == [(1.0, ("wave",))]
    model.clear()
    assert not model.active
    assert not model.disagreements
    assert not model.other.labels.spans
    assert facts(model) == []


def test_a_bad_file_changes_nothing(compared, tmp_path) -> None:
    model = compared.with_file(tmp_path / "ben.eaf", MINE)
    bad = tmp_path / "worse.eaf"
    bad.write_text("<no")
    with pytest.raises(Sd2Error, match=re.escape(str(bad))):
        model.open(bad)
    assert model.name == "ben"
