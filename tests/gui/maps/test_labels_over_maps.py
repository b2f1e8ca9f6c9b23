"""Labels over a map follow every edit and selection, and the map beneath stays as it was."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QCoreApplication
from PySide6.QtGui import QImage
from window_models import models_of

from sd2app.maps.heatmap import HeatmapView


def picture(view: HeatmapView) -> np.ndarray:
    """Pixels of a map with all that lies over it, (H, W)."""
    QCoreApplication.processEvents()
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    return np.frombuffer(image.constBits(), np.uint32).reshape(image.height(), -1).copy()


def test_a_span_comes_and_goes_and_the_rest_stays(labelled) -> None:
    c = models_of(labelled)
    view = next(one for one in labelled.findChildren(HeatmapView) if one.track is c.synthetic)
    c.playback.seek(2.3)  # the cursor is beside the spans
    before = picture(view)
    c.labels.select([1])
    chosen = picture(view)
    c.label_edits.delete()
    without = picture(view)
    span_px = [round(view.scale.x_of(time_s)) for time_s in (0.2, 0.8)]
    for changed in (before != chosen, before != without):
        columns = np.flatnonzero(changed.any(axis=0))
        assert columns.size
        assert span_px[0] - 2 <= columns[0] <= columns[-1] <= span_px[1] + 2
    c.document.undo_stack.undo()
    c.labels.select(())
    np.testing.assert_array_equal(picture(view), before)


def test_labels_never_change_the_colours_of_a_map(labelled) -> None:
    c = models_of(labelled)
    view = next(one for one in labelled.findChildren(HeatmapView) if one.track is c.synthetic)
    c.playback.seek(2.3)
    c.labels.select([1])
    plot = view.plot_rect().toRect()
    rows = slice(plot.top() + 1, plot.bottom())
    chosen = picture(view)
    c.label_edits.delete()
    without = picture(view)
    columns = np.flatnonzero((chosen != without)[rows].any(axis=0))
    edges_px = np.array([view.scale.x_of(time_s) for time_s in (0.2, 0.8)])
    assert columns.size
    assert (np.abs(columns[:, None] - edges_px) <= 1.5).any(axis=1).all(), "edges alone"
    below = (chosen != without)[plot.bottom() + 1 : view.height()]
    middle_px = round(edges_px.mean())
    assert below[:, middle_px].any(), "the span is seen below the map"


def test_a_map_that_changes_keeps_its_labels(labelled) -> None:
    c = models_of(labelled)
    view = next(one for one in labelled.findChildren(HeatmapView) if one.track is c.synthetic)
    c.playback.seek(2.3)
    reference, before = c.synthetic.reference, picture(view)
    c.synthetic.set_reference(100.0 * reference)
    fainter = picture(view)
    assert (fainter != before).any()
    c.labels.select([1])
    assert (picture(view) != fainter).any()
    c.synthetic.set_reference(reference)
    c.labels.select(())
    np.testing.assert_array_equal(picture(view), before)
