"""Page to set up the training and the comparison of classifiers."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLayout,
    QMenu,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.classify.data import DataSource
from sd2app.classify.questions import ClassAsks
from sd2app.classify.setup import FEATURES, MAPS, MODELS
from sd2app.classify.text import FEATURE_WORDS, MODEL_WORDS
from sd2app.classify.training import ClassTraining
from sd2app.training.text import division_text, steps_text
from sd2app.widgets.estimate import EstimateLines
from sd2app.widgets.inputs import Choice, NumberBox, TypedLine
from sd2app.widgets.panel import data_row, outlined, rule, sentence, side_by_side, title
from sd2core.classify.defaults import LONGEST_DELAY_S
from sd2core.train.data import Split

_MAP_TIPS = {
    "radar": "What a radar saw, simulated or real",
    "synthetic": "Counted from the mesh",
    "denoised": "The synthetic ones, as the bundled denoiser makes them a radar's",
}
_COMPARISON = (
    "Trains again and again on the radar's maps alone and with synthetic ones added, and with less"
    " and less of the radar's; judged on people who were not learnt from."
)


class ClassSetupView(QWidget):
    """A form over :class:`ClassSetup`."""

    def __init__(
        self, training: ClassTraining, asks: ClassAsks, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._training, self._setup, self._asks = training, training.setup, asks
        self._shown_data: tuple[DataSource, ...] | None = None
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        self._add_data(layout)
        self._add_network(layout)
        self._add_start(layout)
        layout.addWidget(rule())
        self._add_comparison(layout)
        training.changed.connect(self._refresh)
        self._refresh()

    # --- building -------------------------------------------------------------------------

    def _add_data(self, layout: QVBoxLayout) -> None:
        add = outlined("Add data", "Choose labelled data to learn from", None, self)
        add.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(add)
        menu.setToolTipsVisible(True)
        folder = menu.addAction("Folder…")
        folder.setToolTip("A campaign or pairs, a data set (.zarr), a recording, or several")
        folder.triggered.connect(self._asks.add_folder)
        file = menu.addAction("File…")
        file.setToolTip("A data set (.h5, .npz), or a labelled radar file (.h5)")
        file.triggered.connect(self._asks.add_file)
        self._this = menu.addAction("This recording")
        self._this.triggered.connect(self._asks.add_this)
        menu.aboutToShow.connect(lambda: self._this.setEnabled(self._asks.has_this()))
        add.setMenu(menu)
        head = QHBoxLayout()
        head.addWidget(title("Labelled data"))
        head.addStretch(1)
        head.addWidget(add)
        layout.addLayout(head)
        self._nothing = sentence(
            "A classifier learns from labelled maps: of a simulated campaign, of an exported data"
            " set, or of recordings and radar files in which gestures are labelled."
        )
        layout.addWidget(self._nothing)
        self._rows = QVBoxLayout()
        self._rows.setSpacing(8)
        layout.addLayout(self._rows)
        self._division = sentence("")
        layout.addWidget(self._division)

    def _add_network(self, layout: QVBoxLayout) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(4)
        grid.setColumnStretch(1, 1)
        self._boxes: dict[str, QCheckBox] = {}
        boxes = QHBoxLayout()
        boxes.setSpacing(8)
        for name in MAPS:
            box = QCheckBox(name, self)
            box.setToolTip(_MAP_TIPS[name])
            box.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            box.toggled.connect(lambda on, name=name: self._setup.set_map(name, on))
            boxes.addWidget(box)
            self._boxes[name] = box
        boxes.addStretch(1)
        self._choices = {
            "model": self._choice("model", "Kind of network", MODELS, MODEL_WORDS),
            "features": self._choice(
                "features", "What it is shown of each frame", FEATURES, FEATURE_WORDS
            ),
        }
        self._numbers = {
            "width": self._number("width", 1, 512, 8, "Units of every layer; the paper's: 16"),
            "delay_s": self._number(
                "delay_s",
                0,
                LONGEST_DELAY_S,
                0.1,
                "A frame is answered so much later, when what follows it has been seen; the"
                " paper's: 0, at once",
                " s late",
                2,
            ),
            "steps": self._number("steps", 1, 100_000, 50, "Batches that are learnt from"),
            "seed": self._number("seed", 0, 2**31 - 1, 1, "Of weights, order and dropout"),
        }
        for row, (text, part) in enumerate(
            (
                ("Maps", boxes),
                ("Network", self._choices["model"]),
                ("Shown", self._choices["features"]),
                ("Answers", self._beside("delay_s", "Width", "width")),
                ("Steps", self._beside("steps", "Seed", "seed")),
            )
        ):
            grid.addWidget(QLabel(text, self), row, 0)
            if isinstance(part, QLayout):
                grid.addLayout(part, row, 1)
            elif isinstance(part, QWidget):
                grid.addWidget(part, row, 1)
        layout.addLayout(grid)

    def _choice(self, name: str, tip: str, known: tuple[str, ...], words: dict[str, str]) -> Choice:
        choice = Choice(tip, self)
        for one in known:
            choice.addItem(words[one], one)
        choice.activated.connect(lambda at: self._setup.set_value(name, known[at]))
        return choice

    def _number(
        self,
        name: str,
        low: float,
        high: float,
        step: float,
        tip: str,
        suffix: str = "",
        decimals: int = 0,
    ) -> NumberBox:
        box = NumberBox(low, high, suffix, tip, decimals=decimals, step=step, parent=self)
        box.setMinimumWidth(56)
        box.valueChanged.connect(lambda value: self._setup.set_value(name, value))
        return box

    def _beside(self, left: str, text: str, right: str) -> QHBoxLayout:
        """Two numbers in a row, the second one with its name."""
        row = QHBoxLayout()
        row.setSpacing(8)
        row.addWidget(self._numbers[left], 1)
        row.addWidget(QLabel(text, self))
        row.addWidget(self._numbers[right], 1)
        return row

    def _add_start(self, layout: QVBoxLayout) -> None:
        asks = self._asks
        self._problem = sentence("", "warning")
        self._start = outlined("Start training", "Train in the background", asks.train, self)
        self._start.setObjectName("primary")
        self._copy = outlined(
            "Copy command", "The same as a command for a terminal", asks.copy_command, self
        )
        self._estimate = EstimateLines(self)
        layout.addWidget(self._estimate)
        layout.addWidget(self._problem)
        layout.addLayout(side_by_side(self._start, self._copy, spacing_px=6))

    def _add_comparison(self, layout: QVBoxLayout) -> None:
        layout.addWidget(title("Does synthetic data help?"))
        layout.addWidget(sentence(_COMPARISON))
        self._quick = QCheckBox("Quick: fewer trainings, to see how it looks", self)
        self._quick.setToolTip("Two seeds instead of five, and fewer shares of the radar's data")
        self._quick.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._quick.toggled.connect(
            lambda on: self._setup.set_value("quick", "yes" if on else "no")
        )
        self._compare = outlined(
            "Compare", "Train and compare in the background", self._asks.compare, self
        )
        show = outlined(
            "Open a result…",
            "Show a table of sd2 classify table, or a matrix of sd2 classify eval",
            self._asks.open_result,
            self,
        )
        layout.addWidget(self._quick)
        layout.addLayout(side_by_side(self._compare, show, spacing_px=6))

    # --- showing --------------------------------------------------------------------------

    def _refresh(self) -> None:
        training, setup = self._training, self._setup
        if training.run is not None:
            return
        if setup.data != self._shown_data:
            self._list_data()
        self._nothing.setVisible(not setup.data)
        division = setup.division
        self._division.setText("" if division is None else _division_text(division))
        self._division.setVisible(division is not None)
        for name, box in self._boxes.items():
            with QSignalBlocker(box):
                box.setChecked(name in setup.maps)
        for name, choice in self._choices.items():
            with QSignalBlocker(choice):
                choice.setCurrentIndex(choice.findData(setup.value(name)))
        for name, number in self._numbers.items():
            number.show_value(setup.value(name))
        with QSignalBlocker(self._quick):
            self._quick.setChecked(setup.value("quick") == "yes")
        self._estimate.setVisible(not setup.problem)
        steps = setup.value("steps")
        count = f"The data is read first; then {steps_text(steps)}"
        self._estimate.show_estimate(count, steps, setup.step_s)
        why_not = training.why_not_train
        # What is wrong with the data, or that there is none, is said above.
        said = not setup.data or any(one.problem for one in setup.data)
        self._problem.setText("" if said else why_not)
        self._problem.setVisible(bool(self._problem.text()))
        self._start.setEnabled(not why_not)
        self._copy.setEnabled(not setup.train_problem)
        self._compare.setEnabled(not training.why_not_compare)
        self._compare.setToolTip(training.why_not_compare or "Train and compare in the background")

    def _list_data(self) -> None:
        self._shown_data = self._setup.data
        while (item := self._rows.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        for one in self._setup.data:
            row = self._data_row(one)
            self._rows.addWidget(row)
            row.show()

    def _data_row(self, one: DataSource) -> QWidget:
        path = one.path
        return data_row(
            path.name, str(path), one.text, one.problem,
            lambda: self._setup.remove(path), self, self._person(one) if one.nameable else None,
        )  # fmt: skip

    def _person(self, one: DataSource) -> QWidget:
        """Field for the name of the person."""
        line = TypedLine(
            f"Who {one.path.name} is of",
            "Who it is of: whoever is learnt from is neither chosen by nor judged on.\nThe same"
            " name for everything of one person.",
        )
        line.setText(one.person)
        itself = one.people[0] if len(one.people) == 1 else "each a different person"
        line.setPlaceholderText("" if one.person else itself)
        line.ended.connect(lambda: self._setup.name_person(one.path, line.text()))
        field = QWidget(self)
        row = QHBoxLayout(field)
        row.setContentsMargins(0, 2, 0, 2)
        row.setSpacing(8)
        row.addWidget(QLabel("Person", field))
        row.addWidget(line, 1)
        return field


def _division_text(division: Split) -> str:
    return division_text(division, "judging, with sd2 classify eval", "some of the movements")
