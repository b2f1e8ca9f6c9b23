"""Suggested spans, to be accepted or rejected."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import QEvent, QSignalBlocker, Qt
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QInputDialog, QWidget

from sd2app.feature import Action, Feature, Shell
from sd2app.labels.actions import editing
from sd2app.labels.edits import LabelEdits
from sd2app.session.session import Session
from sd2app.suggestions.model import MotionFinder, SpanFinder, SuggestionsModel
from sd2app.widgets.inputs import Choice, NumberBox, action_button
from sd2app.widgets.layouts import STRETCH, row_of
from sd2app.widgets.panel import ElidedLabel, copy_button, outlined
from sd2app.widgets.text import counted

_BUTTONS = (
    ("accept_suggestion", "Accept"),
    ("reject_suggestion", "Reject"),
    ("accept_suggestions", "Accept all"),
    ("reject_suggestions", "Reject all"),
)
_MARGINS_PX = 8, 2, 8, 2


class SuggestionBar(QWidget):
    """View of :class:`SuggestionsModel`; hidden until suggestions are asked for.

    Where one row would cut its words short, what decides stands above what finds; where that is
    not enough, each of them stands in several rows itself.
    """

    def __init__(self, model: SuggestionsModel, action: Callable[[str], QAction]) -> None:
        super().__init__()
        self._model = model
        self._text = ElidedLabel(self)
        self._text.setAccessibleName("Suggestions")
        self._as = ElidedLabel(self, "muted")
        self._source = Choice("The map in which suggestions are looked for", self)
        self._source.activated.connect(lambda at: model.set_source(model.finder.sources[at]))
        self._by = Choice("What suggests spans: motion in a map, or the classifier", self)
        self._by.activated.connect(lambda at: model.set_finder(model.finders[at]))
        for one in (self._by, self._source):  # filled once the bar is shown
            one.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToContents)
        self._threshold = NumberBox(0.0, 100.0, "", "")
        self._threshold.valueChanged.connect(model.set_threshold)
        self._copy = copy_button(lambda: model.line, self)
        buttons = [action_button(action(name), text, outlined=True) for name, text in _BUTTONS]
        ends = row_of(STRETCH, self._copy, spacing_px=6)
        each, all_ = row_of(*buttons[:2], spacing_px=6), row_of(*buttons[2:], STRETCH, spacing_px=6)
        decide = row_of(each, all_, spacing_px=6)
        decide.setAlignment(each, Qt.AlignmentFlag.AlignLeft)  # also above the others
        chosen = row_of(STRETCH, self._by, self._source, spacing_px=6)
        find = row_of(chosen, self._threshold, spacing_px=6)
        say = row_of((self._text, 1), self._as, spacing_px=6)
        above, below = row_of((say, 1), decide, spacing_px=6), row_of(find, ends, spacing_px=6)
        self._rows = all_, decide, chosen, find, above, below
        self._layout = row_of((above, 1), below, spacing_px=6)
        self._layout.setContentsMargins(*_MARGINS_PX)
        self.setLayout(self._layout)
        # The last one for the keyboard too.
        tip, name = "Close; the suggestions stay", "Close the suggestions"
        ends.addWidget(outlined("✕", tip, model.stop, self, name=name, look=""))
        model.changed.connect(self._refresh)
        self._refresh()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Stand in one row or in two."""
        super().resizeEvent(event)
        self._fold()

    def event(self, event: QEvent) -> bool:
        """Stand in one row or in two when words of another length have come."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._fold()
        return super().event(event)

    def _fold(self) -> None:
        left_px, _, right_px, _ = _MARGINS_PX
        room_px, ways = self.contentsRect().width() - left_px - right_px, QBoxLayout.Direction
        # The inner ones first: the outer one asks how wide they are.
        for layout in (*self._rows, self._layout):
            parts = (layout.itemAt(place) for place in range(layout.count()))
            needed_px = layout.spacing() + sum(one.sizeHint().width() for one in parts if one)
            fits = needed_px <= room_px
            layout.setDirection(ways.LeftToRight if fits else ways.TopToBottom)

    def _refresh(self) -> None:
        model = self._model
        self.setVisible(model.active)
        if not model.active:
            return
        self._text.setText(model.text)
        self._as.setText(f"taken as {model.accepted_as}" if model.accepted_as else "")
        self._as.setToolTip(
            "The label that was used last; the key of another label accepts as that"
        )
        sources, source = model.finder.sources, model.finder.source
        place = sources.index(source) if source in sources else -1
        self._source.offer([track.title for track in sources], place)
        self._source.setVisible(len(sources) > 1)
        self._copy.setEnabled(source is not None and not model.finder.why_not)
        finders = [f"by {finder.title}" for finder in model.finders]
        self._by.offer(finders, model.finders.index(model.finder))
        box, limits = self._threshold, model.finder.threshold
        with QSignalBlocker(box):
            box.setRange(limits.low, limits.high)
            box.setDecimals(limits.decimals)
            box.setSingleStep(limits.step)
            box.setSuffix(limits.unit)
        box.setToolTip(limits.tip)
        box.setAccessibleName(limits.tip)
        box.show_value(model.threshold)
        self._fold()


class SuggestionsFeature(Feature):
    """Spans found by motion in a map, or by another finder."""

    def __init__(
        self, session: Session, shell: Shell, edits: LabelEdits, others: Sequence[SpanFinder]
    ) -> None:
        self._shell, self._edits, self._document = shell, edits, session.document
        maps = session.maps
        searched = maps.synthetic, maps.denoised, maps.real
        finders = (MotionFinder(searched), *others)
        self.model = SuggestionsModel(edits, finders, session.parent)
        self.changing = self.model.changed, *(track.came_or_went for track in searched)

    def actions(self) -> Sequence[Action]:
        """Find, accept, reject."""
        model = self.model
        return editing(
            self._edits,
            Action(
                "suggest", "Labels", "Suggest spans", ("F",),
                "Find where something moves in a map; each suggestion is then accepted or rejected",
                lambda: model.start(), lambda: not model.finders[0].why_not,
            ),
            Action(
                "accept_suggestion", "Labels", "Accept suggestion", ("Y",),
                "Take the one that is selected, or the next; a label's own key takes it as that",
                lambda: model.accept(), self._pending,
            ),
            Action(
                "reject_suggestion", "Labels", "Reject suggestion", ("W",),
                "Let the one that is selected go, or the next; it is not suggested again",
                lambda: model.reject(), self._pending,
            ),
            Action(
                "accept_suggestions", "Labels", "Accept all suggestions…", ("Shift+Y",),
                "Take all that there is room for; which label those without a name get is asked",
                self._accept_all, self._pending,
            ),
            Action(
                "reject_suggestions", "Labels", "Reject all suggestions", ("Shift+W",),
                "Let all go; they are not suggested again",
                lambda: model.reject(whole=True), self._pending,
            ),
        )  # fmt: skip

    def _accept_all(self) -> None:
        model, labels = self.model, self._edits.labels
        if not model.unnamed:
            model.accept(whole=True)
            return
        names = [label.name for label in labels.labels.label_set.labels] or [labels.label]
        asked = f"Label of {counted(len(model.unnamed), 'span')} in which something moves:"
        used_last = names.index(labels.label) if labels.label in names else 0
        label, accepted = QInputDialog.getItem(
            self._shell.dialog_parent, "Accept all suggestions", asked, names, used_last, False
        )
        if accepted:
            model.accept(label, whole=True)

    def _pending(self) -> bool:
        return bool(self.model.pending)

    def panels(self) -> Mapping[str, QWidget]:
        """The bar below all panes."""
        return {"suggestions": SuggestionBar(self.model, self._shell.action)}

    def attach(self) -> None:
        """Begin without suggestions."""
        self.model.open(same=self._document.same_recording)
