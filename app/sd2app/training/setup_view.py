"""Page to set up a training: pairs, kind of model, settings, and the estimated time."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QMenu,
    QProgressBar,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.training.model import TrainingModel
from sd2app.training.setup import MODELS, Store
from sd2app.training.text import (
    MODEL_WORDS,
    division_text,
    steps_text,
    store_text,
)
from sd2app.widgets.estimate import EstimateLines
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.panel import ElidedLabel, data_row, outlined, sentence, title

_FIELDS = (
    # name, text, low, high, decimals, step, tip
    ("epochs", "Epochs", 1, 100_000, 0, 50, "Passes over all segments; the paper's is 500"),
    ("batch_size", "Batch", 1, 10_000, 0, 16, "Segments per step; the paper's is 64"),
)
_MORE = (
    (
        "early_stopping_epochs", "Stop early after", 0, 100_000, 0, 10,
        "End when the validation has not become better for so many epochs",
    ),
    ("learning_rate", "Learning rate", 1e-5, 1.0, 5, 5e-4, "At its highest; it warms up and falls"),
    (
        "range_factor", "Range factor", 1.0, 4.0, 1, 0.5,
        "Learn as if the person were up to this many times nearer or farther; 1 is off",
    ),
    ("seed", "Seed", 0, 2**31 - 1, 0, 1, "Of weights, order and dropout"),
)  # fmt: skip


class TrainingSetupView(QWidget):
    """A form over :class:`TrainingSetupModel`.

    ``ask_store`` lets the user choose a store of pairs, ``ask_recordings`` recordings to make
    one from.
    """

    def __init__(
        self,
        training: TrainingModel,
        ask_store: Callable[[], None],
        ask_recordings: Callable[[], None],
        start: Callable[[], None],
        copy_command: Callable[[], None],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._training = training
        self._setup = training.setup
        self._ask_store = ask_store
        self._ask_recordings = ask_recordings
        self._shown_stores: tuple[Store, ...] | None = None
        self._boxes: dict[str, NumberBox] = {}
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        self._add_pairs(layout)
        self._add_model(layout)
        self._add_settings(layout)
        self._add_start(layout, start, copy_command)
        training.changed.connect(self._refresh)
        self._refresh()

    # --- building -------------------------------------------------------------------------

    def _add_pairs(self, layout: QVBoxLayout) -> None:
        self._add = outlined("Add pairs", "Choose pairs of synthetic and radar Doppler", None, self)
        self._add.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(self._add)
        menu.setToolTipsVisible(True)
        menu.aboutToShow.connect(self._list_known)
        self._add.setMenu(menu)
        head = QHBoxLayout()
        head.addWidget(title("Pairs"))
        head.addStretch(1)
        head.addWidget(self._add)
        layout.addLayout(head)
        self._nothing = sentence(
            "A denoiser learns from pairs: a synthetic map, and what a radar saw of the same"
            " movement. Make them of recordings that have a mesh and a radar capture, or with"
            " sd2 simulate campaign, and add their folder."
        )
        layout.addWidget(self._nothing)
        self._rows = QVBoxLayout()
        self._rows.setSpacing(4)
        layout.addLayout(self._rows)
        layout.addWidget(self._making_part())
        self._division = sentence("")
        layout.addWidget(self._division)

    def _making_part(self) -> QWidget:
        maker = self._training.pair_maker
        self._making = QWidget(self)
        self._making_text = ElidedLabel(self)
        self._making_text.setObjectName("muted")
        bar = QProgressBar(self)
        bar.setRange(0, 0)
        bar.setMaximumHeight(14)
        bar.setMaximumWidth(64)
        bar.setAccessibleName("Pairs are being made")
        self._making_cancel = outlined("Cancel", "Make no pairs", maker.cancel, self)
        row = QHBoxLayout(self._making)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self._making_text, 1)
        row.addWidget(bar)
        row.addWidget(self._making_cancel)
        return self._making

    def _add_model(self, layout: QVBoxLayout) -> None:
        self._model = Choice("Kind of model", self)
        for name in MODELS:
            self._model.addItem(MODEL_WORDS[name][0], name)
        self._model.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._model.currentIndexChanged.connect(
            lambda index: self._setup.set_value("model", MODELS[index])
        )
        row = QHBoxLayout()
        row.setSpacing(8)
        row.addWidget(title("Model"))
        row.addWidget(self._model, 1)
        layout.addLayout(row)
        self._about = sentence("")
        layout.addWidget(self._about)

    def _add_settings(self, layout: QVBoxLayout) -> None:
        layout.addWidget(self._form(_FIELDS, columns=2))
        self._more = QToolButton(self)
        self._more.setObjectName("fold")
        self._more.setCheckable(True)
        self._more.setText("More settings")
        self._more.setToolTip("Learning rate, early stopping, range, seed")
        self._more.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._more.setArrowType(Qt.ArrowType.RightArrow)
        self._more.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._more.toggled.connect(self._unfold)
        self._reset = outlined(
            "Reset", "Put all settings back to the paper's", self._setup.reset, self
        )
        row = QHBoxLayout()
        row.addWidget(self._more)
        row.addStretch(1)
        row.addWidget(self._reset)
        layout.addLayout(row)
        self._rest = self._form(_MORE, columns=1)
        self._boxes["early_stopping_epochs"].setSpecialValueText("never")
        self._boxes["range_factor"].setPrefix("× ")
        self._rest.hide()
        layout.addWidget(self._rest)

    def _form(self, fields: tuple[tuple, ...], columns: int) -> QWidget:
        form = QWidget(self)
        grid = QGridLayout(form)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(4)
        # Labels to the left; several boxes share what room there is.
        grid.setColumnStretch(0 if columns == 1 else 1, 1)
        grid.setColumnStretch(3, columns - 1)
        for number, (name, text, low, high, decimals, step, tip) in enumerate(fields):
            row, column = divmod(number, columns)
            suffix = " epochs" if name == "early_stopping_epochs" else ""
            box = NumberBox(low, high, suffix, tip, decimals=decimals, step=step, parent=self)
            box.setMinimumWidth(112 if columns == 1 else 64)
            box.setGroupSeparatorShown(decimals == 0 and name != "seed")
            box.valueChanged.connect(lambda value, name=name: self._setup.set_value(name, value))
            label = QLabel(text, self)
            label.setToolTip(tip)
            grid.addWidget(label, row, 2 * column)
            grid.addWidget(box, row, 2 * column + 1)
            self._boxes[name] = box
        return form

    def _add_start(
        self, layout: QVBoxLayout, start: Callable[[], None], copy_command: Callable[[], None]
    ) -> None:
        self._estimate = EstimateLines(self)
        self._problem = sentence("", "warning")
        self._start = outlined("Start training", "Train in the background", start, self)
        self._start.setObjectName("primary")
        self._copy = outlined(
            "Copy command", "The same as a command for a terminal", copy_command, self
        )
        row = QHBoxLayout()
        row.setSpacing(6)
        row.addWidget(self._start)
        row.addWidget(self._copy)
        row.addStretch(1)
        for widget in (self._estimate, self._problem):
            layout.addWidget(widget)
        layout.addLayout(row)

    # --- showing --------------------------------------------------------------------------

    def _refresh(self) -> None:
        if self._training.run is not None:
            return
        setup = self._setup
        if setup.stores != self._shown_stores:
            self._list_stores()
        maker = self._training.pair_maker
        self._nothing.setVisible(not setup.stores and maker.out is None)
        self._making.setVisible(maker.out is not None)
        if maker.out is not None:
            doing = "Cancelling…" if maker.cancelling else "Making"
            self._making_text.setText(f"{doing} {maker.out.name}")
            self._making_cancel.setEnabled(not maker.cancelling)
        division = setup.division if not setup.problem else None
        self._division.setText(division_text(division) if division is not None else "")
        self._division.setVisible(division is not None)
        with QSignalBlocker(self._model):
            self._model.setCurrentIndex(MODELS.index(setup.value("model")))
        self._about.setText(MODEL_WORDS[setup.value("model")][1])
        for name, box in self._boxes.items():
            box.show_value(setup.value(name))
        self._reset.setVisible(setup.differs)
        self._refresh_start()

    def _refresh_start(self) -> None:
        setup, why_not = self._setup, self._training.why_not_start
        estimate = setup.estimate
        self._estimate.setVisible(bool(estimate.segments))
        count = f"{estimate.segments:,} segments, {steps_text(estimate.steps)}"
        self._estimate.show_estimate(count, estimate.steps, estimate.step_s)
        # That there are no pairs is said above.
        self._problem.setText(why_not if setup.stores else "")
        self._problem.setVisible(bool(setup.stores) and bool(why_not))
        self._problem.setObjectName("muted" if setup.reading else "warning")
        self._start.setEnabled(not why_not)
        self._start.setToolTip(why_not or "Train in a background process")
        self._copy.setEnabled(not setup.problem)

    def _list_stores(self) -> None:
        self._shown_stores = self._setup.stores
        while (item := self._rows.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        for store in self._setup.stores:
            row = self._store_row(store)
            self._rows.addWidget(row)
            row.show()

    def _store_row(self, store: Store) -> QWidget:
        path, about = store.path, store_text(store.facts)
        return data_row(
            path.name, str(path), about, store.problem,
            lambda: self._setup.remove_store(path), self,
        )  # fmt: skip

    def _list_known(self) -> None:
        menu = self._add.menu()
        menu.clear()
        for path in self._setup.known_stores:
            action = menu.addAction(path.name)
            action.setToolTip(str(path))
            action.triggered.connect(lambda _=False, path=path: self._setup.add_store(path))
        if not menu.isEmpty():
            menu.addSeparator()
        menu.addAction("Folder of pairs…").triggered.connect(lambda: self._ask_store())
        make = menu.addAction("Make of recordings…")
        make.setToolTip("Of one recording, or of all in a folder, that have a mesh and a radar")
        make.setEnabled(self._training.pair_maker.out is None)
        make.triggered.connect(lambda: self._ask_recordings())

    def _unfold(self, shown: bool) -> None:
        self._rest.setVisible(shown)
        self._more.setArrowType(Qt.ArrowType.DownArrow if shown else Qt.ArrowType.RightArrow)
