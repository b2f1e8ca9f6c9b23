"""Agreement of two annotators: the panel, with both on the time axis."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from statistics import median

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QAction, QColor, QMouseEvent, QPainter
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QWidget

from sd2app.agreement.model import AgreementModel
from sd2app.feature import Action, Feature, Shell
from sd2app.labels.import_dialog import label_files
from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import LabelRows, paint_tracks
from sd2app.maps.track_mouse import TimePlot
from sd2app.session.playback import PlaybackModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import clipped
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import action_button
from sd2app.widgets.layouts import STRETCH, column_of, pane, row_of
from sd2app.widgets.panel import (
    ElidedLabel,
    FactRows,
    copy_button,
    rule,
    sentence,
    show_words,
    title,
)
from sd2app.widgets.text import counted
from sd2app.widgets.time_axis import GUTTER_PX, paint_cursor
from sd2core.labels.agreement import kappa_words

_MAX_FACTS, _MAX_LABELS = 10, 12
_NOTHING = (
    "Choose the file of another person who labelled this recording. Agreement is measured frame by"
    " frame and span by span, and their labels are shown below yours."
)
_MEANING = "1 is agreement in every frame, 0 what chance alone would give (Cohen's kappa)."


class AgreementPanel(QWidget):
    """A view of :class:`AgreementModel`."""

    def __init__(
        self, model: AgreementModel, playback: PlaybackModel, action: Callable[[str], QAction]
    ) -> None:
        super().__init__()
        self.setObjectName("page")
        self._model = model
        self._name = ElidedLabel(self, "title")
        self._verdict, self._where = sentence("", "plain"), sentence("", "plain")
        self._facts = FactRows(_MAX_FACTS, at_the_edge=True, parent=self)
        self._labels = FactRows(_MAX_LABELS, at_the_edge=True, parent=self)
        self._nothing, self._of_file = sentence(_NOTHING), sentence("")
        self._result = self._lay_out_result(action)
        file = "compare_labels", "File…"
        top = _row(self._name, action, file, ("end_comparison", "End"))
        parts = top, self._nothing, self._of_file, self._result, STRETCH
        self.setLayout(column_of(*parts, spacing_px=8, margins_px=(8, 6, 8, 6)))
        model.changed.connect(self._refresh)
        playback.frame_changed.connect(self._follow_cursor)
        self._refresh()

    def _lay_out_result(self, action: Callable[[str], QAction]) -> QWidget:
        buttons = (("previous_disagreement", "Previous"), ("next_disagreement", "Next"))
        copy = copy_button(lambda: self._model.line, self)
        parts = (
            *(self._verdict, sentence(_MEANING), row_of(copy, STRETCH), rule()),
            *(_row(title("Disagreements"), action, *buttons), self._where, rule()),
            *(self._facts, rule(), title("Kappa of each label"), self._labels),
        )
        return pane(*parts, spacing_px=8)

    def _refresh(self) -> None:
        model = self._model
        self._name.setText(f"With {model.name}" if model.active else "No comparison")
        self._name.setToolTip(str(model.path or ""))
        self._nothing.setVisible(not model.active)
        show_words(self._of_file, model.sentence)
        self._result.setVisible(model.active)
        if model.active:
            self._verdict.setText(verdict(model))
            self._facts.show_facts(facts(model))
            self._labels.show_facts(label_facts(model)[:_MAX_LABELS])
            self._follow_cursor()

    def _follow_cursor(self) -> None:
        if self._model.active:
            self._where.setText(where(self._model))


def _row(
    heading: QWidget, action: Callable[[str], QAction], *buttons: tuple[str, str]
) -> QHBoxLayout:
    made = [action_button(action(name), text, outlined=True) for name, text in buttons]
    return row_of((heading, 1), *made, spacing_px=6)


def verdict(model: AgreementModel) -> str:
    """Return the kappa of all frames, and the customary word for it."""
    if model.measures is None:
        return "Comparing…"
    kappa = model.measures.frames.overall.value
    return f"Kappa {'–' if kappa is None else f'{kappa:.2f}'}: {kappa_words(kappa)}"


def facts(model: AgreementModel) -> list[tuple[str, str]]:
    """Return names and values of the measures of agreement."""
    measures = model.measures
    if measures is None:
        return []
    frames, spans = measures.frames, measures.spans
    same = sum(match.same_label for match in spans.matches)
    rows = [
        ("Frames the same", _share(frames.overall.observed)),
        ("By chance alone", _share(frames.overall.expected)),
        ("Spans matched", str(len(spans.matches))),
        ("of these with the same label", str(same)),
        ("Only yours", str(len(spans.only_a))),
        (f"Only {model.name}'s", str(len(spans.only_b))),
    ]
    if spans.mean_iou is not None:
        rows.append(("Overlap of matches", _share(spans.mean_iou)))
        starts = _median([one.start_difference_s for one in spans.matches])
        ends = _median([one.end_difference_s for one in spans.matches])
        rows.append(("Median difference of starts", starts))
        rows.append(("Median difference of ends", ends))
    if model.left_out:
        rows.append(("Left out, outside the recording", str(model.left_out)))
    return rows


def label_facts(model: AgreementModel) -> list[tuple[str, str]]:
    """Return every label that either used, with its kappa."""
    measures = model.measures
    if measures is None:
        return []
    return [
        (label, "–" if kappa.value is None else f"{kappa.value:.2f}")
        for label, kappa in measures.frames.of_label.items()
    ]


def where(model: AgreementModel) -> str:
    """Describe the disagreement at the present frame, or all of them."""
    stretches, number = model.disagreements, model.current
    if model.measures is None:
        return "Comparing…"
    if not stretches:
        return "No frame is labelled differently."
    total_s = sum(one.end_s - one.start_s for one in stretches)
    if number is None:
        return f"{counted(len(stretches), 'disagreement')}, {total_s:.2f} s in all."
    one = stretches[number]
    return (
        f"{number + 1} of {len(stretches)}, {one.start_s:.2f} to {one.end_s:.2f} s.\n"
        f"You: {_answer_text(one.a)}.\n{model.name}: {_answer_text(one.b)}."
    )


def _answer_text(answer: Sequence[str]) -> str:
    return " and ".join(answer) or "nothing"


def _share(value: float) -> str:
    return f"{100 * value:.1f} %"


def _median(differences_s: Sequence[float]) -> str:
    return f"{median(abs(value) for value in differences_s):.2f} s"


_MARKS_PX = 7.0


class OtherTimeline(TimePlot):
    """Hatched rows, as they cannot be edited; a line over them marks differences.

    A click goes to that time.
    """

    def __init__(self, session: Session, model: AgreementModel) -> None:
        super().__init__(session)
        self._model = model
        self._rows = LabelRows((), ())
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        model.changed.connect(self._follow)
        self.follow(session.span.changed)
        self._follow()

    def sizeHint(self) -> QSize:
        """Return the height of the tracks and the marks over them."""
        return QSize(640, round(_MARKS_PX + self._rows.height_px))

    def _follow(self) -> None:
        model, other = self._model, self._model.other
        self._rows = LabelRows.of(other.labels.tracks, other.arrays, ())
        self.setVisible(model.active)
        self.setFixedHeight(self.sizeHint().height())
        self.setAccessibleName(f"Labels of {model.name}, read-only")
        self.setToolTip(f"Labels of {model.name}; the line over them marks what differs")
        self.update()

    def paint(self, painter: QPainter) -> None:
        """Paint marks, names, spans and the cursor."""
        palette, scale, whole = self._session.display.palette, self.scale, self.plot_rect()
        painter.fillRect(self.rect(), QColor(palette.panel))
        with clipped(painter, whole):
            for one in self._model.disagreements:
                if one.end_s > scale.start_s and one.start_s < scale.end_s:
                    left, right = scale.x_of(one.start_s), scale.x_of(one.end_s)
                    mark = QRectF(left, 2.0, max(right - left, 2.0), _MARKS_PX - 3.0)
                    painter.fillRect(mark, QColor(palette.warning))
        painter.translate(0.0, _MARKS_PX)
        plot = QRectF(GUTTER_PX, 0, whole.width(), self._rows.height_px)
        other, rows = self._model.other, self._rows.tracks
        paint_tracks(painter, plot, scale, other, rows, palette, foreign=self._model.name)
        painter.translate(0.0, -_MARKS_PX)
        paint_cursor(painter, whole, scale.x_of(self._session.playback.time_s))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go to a time."""
        if event.button() == Qt.MouseButton.LeftButton and event.position().x() >= GUTTER_PX:
            self._session.playback.seek(self.scale.time_of(event.position().x()))


class AgreementFeature(Feature):
    """Another person's labels below these, and how far the two agree."""

    def __init__(self, session: Session, shell: Shell, labels: LabelsModel) -> None:
        self._session, self._shell = session, shell
        self.model = AgreementModel(session, labels, session.parent)
        self.changing = (self.model.changed,)
        self.closing = (self.model,)
        self.model.failed.connect(shell.warn)

    def actions(self) -> Sequence[Action]:
        """Comparison of labels."""
        model = self.model
        return (
            Action(
                "show_agree", "View", "Agreement panel", ("Shift+A",),
                "How far another person's labels agree with these",
                lambda: self._shell.bring_up("Agreement"),
            ),
            Action(
                "compare_labels", "Labels", "Compare with another's labels…", ("Ctrl+Shift+K",),
                "Show how far another person's labels agree with these, and where they do not",
                self._compare, self._session.has_content,
            ),
            Action(
                "next_disagreement", "Labels", "Next disagreement", ("Shift+N",),
                "Go to where the labels differ next", lambda: model.step(1), self._disagree,
            ),
            Action(
                "previous_disagreement", "Labels", "Previous disagreement", ("Shift+P",),
                "Go to where the labels differ before", lambda: model.step(-1), self._disagree,
            ),
            Action(
                "end_comparison", "Labels", "End the comparison of labels", (),
                "Take the other's labels away", model.clear, lambda: model.active,
            ),
        )  # fmt: skip

    def _disagree(self) -> bool:
        return bool(self.model.disagreements)

    def _compare(self) -> None:
        parent = self._shell.dialog_parent
        if path := ask_file(parent, "Compare with another's labels", label_files()):
            self._shell.attempt(lambda: self.model.open(path))
            self._shell.bring_up("Agreement")

    def panels(self) -> Mapping[str, QWidget]:
        """The panel at the side, and the other person's labels below these."""
        s = self._session
        return {
            "Agreement": AgreementPanel(self.model, s.playback, self._shell.action),
            "other labels": OtherTimeline(s, self.model),
        }

    def attach(self) -> None:
        """Compare anew, or forget the comparison of the recording before."""
        path = self.model.path
        if self._session.document.same_recording and path is not None:
            self._shell.attempt(lambda: self.model.open(path))
        else:
            self.model.clear()
