"""The table of spans with 10,000 of them: opened, sorted, filtered, and following an edit.

``pytest tests/benchmarks/test_span_table_speed.py --benchmark-only --capture=no``
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from label_edits import label_edits
from labelled import even, many_spans
from PySide6.QtCore import QItemSelectionModel, Qt
from PySide6.QtWidgets import QTableView

from sd2app.labels.table_model import COLUMNS, SpanFilter, SpanTableModel
from sd2core.labels.edits import Edits
from sd2core.labels.field_edits import delete
from sd2core.labels.spans import Labels

SPANS = 10_000
FRAMES = even(30 * SPANS)
LABEL = next(place for place, column in enumerate(COLUMNS) if column.id == "label")


@pytest.fixture
def shown(qtbot):
    """The view on the model, as it is in the panel."""
    edits = label_edits(FRAMES)
    labels, model = edits.labels, SpanTableModel(edits)
    view = QTableView()
    qtbot.addWidget(view)
    view.setModel(model)
    view.resize(560, 400)
    view.show()
    model.set_watched(True)
    labels.open(many_spans(SPANS))
    view.grab()
    return labels, model, view


def run(benchmark: Any, view: QTableView, *steps: Callable[[], Any]) -> None:
    """The steps in turn, each drawn."""
    turn = [0]

    def step() -> None:
        steps[turn[0] % len(steps)]()
        turn[0] += 1
        view.grab()

    benchmark.pedantic(step, rounds=20, warmup_rounds=2)


@pytest.mark.benchmark(group="span table")
def test_opening(benchmark: Any, shown) -> None:
    labels, model, view = shown
    full, empty = labels.labels, Labels()
    run(benchmark, view, lambda: labels.open(empty), lambda: labels.open(full))
    assert model.rowCount() in (0, SPANS)


@pytest.mark.benchmark(group="span table")
def test_sorting_by_label(benchmark: Any, shown) -> None:
    _, model, view = shown
    falling, rising = Qt.SortOrder.DescendingOrder, Qt.SortOrder.AscendingOrder
    run(benchmark, view, lambda: model.sort(LABEL, falling), lambda: model.sort(LABEL, rising))
    assert [span.label for span in model.rows] == sorted(span.label for span in model.rows)


@pytest.mark.benchmark(group="span table")
def test_filtering(benchmark: Any, shown) -> None:
    _, model, view = shown
    run(
        benchmark,
        view,
        lambda: model.set_filter(SpanFilter(text="up")),
        lambda: model.set_filter(SpanFilter()),
    )
    assert model.rowCount() in (SPANS, sum("up" in one.label for one in model.rows))


@pytest.mark.benchmark(group="span table")
def test_following_an_edit_of_one_span(benchmark: Any, shown) -> None:
    labels, model, view = shown
    before = labels.labels
    span = before.spans[SPANS // 2]
    longer = Edits(before, FRAMES).resize(span.id, "end", span.end_s + 0.1).labels
    gone = delete(before, [span.id]).labels
    view.selectionModel().select(
        model.index(SPANS // 2, 0), QItemSelectionModel.SelectionFlag.SelectCurrent
    )
    run(
        benchmark,
        view,
        lambda: labels.set_labels(longer),
        lambda: labels.set_labels(gone),
        lambda: labels.set_labels(before),
    )
    assert len(model.rows) >= SPANS - 1
