"""Content of a file before it is imported, and losses before and after an export."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from finding import named

from sd2app.labels.exports import LabelExportDialog
from sd2app.labels.import_dialog import LabelImportDialog, is_label_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2core.labels.formats import read_labels, write_labels
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.recording.recording import Recording
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
HERE = Labels((LabelTrack("Gestures"),), (Span(7, "Gestures", 1.0, 2.0, "up-to-down", note="n"),))


def of(*spans: tuple[float, float, str]) -> Labels:
    made = [Span(k, "Ben", *span) for k, span in enumerate(spans, start=1)]
    return Labels((LabelTrack("Ben"),), tuple(made))


@pytest.fixture
def importing(qtbot):
    def read(path: Path, here: Labels = HERE) -> LabelImportDialog:
        model = LabelImportDialog(path, here, FRAMES)
        qtbot.addWidget(model)
        return model

    return read


def test_the_preview_says_what_becomes_of_everything(importing, tmp_path) -> None:
    path = tmp_path / "ben.eaf"
    spans = of((1.0, 2.0, "wave"), (3.0, 4.0, "wave"), (9.0, 11.0, "up-to-down"), (12.0, 13.0, "b"))
    write_labels(path, spans, Timebase.regular(200, 10.0))
    model = importing(path)
    assert dict(model.facts()) == {
        "Spans": "3, from 1.000 to 10.000 s",
        "Tracks": "1: Ben",
        "Labels": "wave (2), up-to-down (1)",
        "Not in the label set": "wave. It is kept and shown in grey.",
        "Cut": "1 span beyond the recording, cut where it ends or begins",
        "Left out": "1 span outside the recording (0.000 to 10.000 s)",
    }
    assert model.way == "add"
    assert "Nothing that is there changes" in model.consequence()
    way = named(model, "What becomes of the labels", Choice)
    way.setCurrentIndex(way.findData("replace"))
    assert model.consequence().startswith("The 1 span of this recording go")


def test_a_bad_file_is_refused_in_the_cores_words(importing, tmp_path) -> None:
    path = tmp_path / "ben.TextGrid"
    path.write_text("nothing of the kind")
    model = importing(path)
    assert model.incoming is None
    assert str(path) in model.problem
    assert "Expected" in model.problem
    # It is a table after all.
    path.write_text("start_s,end_s,label\n1,2,wave\n")
    (format,) = (one for one in model.findChildren(Choice) if one.findData("csv") >= 0)
    format.setCurrentIndex(format.findData("csv"))
    assert model.problem == ""


def test_a_file_without_spans_is_shown_as_that(importing, tmp_path) -> None:
    path = tmp_path / "empty.json"
    write_labels(path, Labels(), FRAMES)
    model = importing(path)
    assert dict(model.facts()) == {"Spans": "none", "Tracks": "1: Gestures", "Labels": "none"}


def test_of_several_videos_in_a_file_one_is_chosen(importing, tmp_path) -> None:
    path = tmp_path / "project.boris"
    write_labels(path, of((1.0, 2.0, "wave")), FRAMES)
    project = json.loads(path.read_text("utf-8"))
    ((name, first),) = project["observations"].items()
    second = json.loads(json.dumps(first))
    for event in second["events"]:
        event[0] += 1.0
    project["observations"] = {name: first, "later": second}
    path.write_text(json.dumps(project), "utf-8")
    model = importing(path)
    assert model.observations == (name, "later")
    assert model.incoming.labels.spans[0].start_s == 1.0
    named(model, "Which of the videos", Choice).setCurrentText("later")
    assert model.incoming.labels.spans[0].start_s == 2.0


def test_what_is_a_label_file() -> None:
    names = ("a.eaf", "b.TextGrid", "labels.json", "recording.json", "video.mp4", "c.txt")
    assert [is_label_file(Path(name)) for name in names] == [True, True, True, False, False, True]


def test_an_export_says_its_losses_before_and_after(qtbot, tmp_path) -> None:
    model = LabelExportDialog(HERE, FRAMES, Recording(Path("walk.sd2")), "mine")
    qtbot.addWidget(model)
    assert model.losses == ()
    model.findChild(Choice).setCurrentText("Audacity")
    assert "notes" in {loss.what for loss in model.losses}
    assert model.line == "sd2 labels convert walk.sd2 --out mine.txt --to audacity"
    model.export(tmp_path / "no such folder" / "mine.txt")
    assert "No such file" in model.problem
    with qtbot.waitSignal(model.written, timeout=10_000) as said:
        model.export(tmp_path / "mine")
    (text,), path = said.args, tmp_path / "mine.txt"
    assert text.startswith(f"Wrote {path} with ")
    assert "keeps no notes: 1 note left out" in text
    assert len(read_labels(path).spans) == 1
    before = path.read_bytes()
    model.export(tmp_path / "mine")
    assert f"{path} exists" in model.problem
    assert path.read_bytes() == before


def test_what_of_the_file_was_not_read_is_listed_and_marks_get_a_length(
    importing, tmp_path
) -> None:
    path = tmp_path / "ben.csv"
    path.write_text("label,start,end\nwave,1,2\nwave,n/a,3\ntap,5,5\n")
    model = importing(path)
    assert "1 left out (line 3: start_s is 'n/a')" in dict(model.facts())["Of the file"]
    assert model.incoming.labels.spans[-1].duration_s == pytest.approx(0.1)
    named(model, "Length of marks without a duration", NumberBox).setValue(0.5)
    assert model.incoming.labels.spans[-1].duration_s == pytest.approx(0.5)
