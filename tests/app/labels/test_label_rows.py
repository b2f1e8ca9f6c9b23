"""Where tracks, lanes and marks stand."""

from __future__ import annotations

from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QImage, QPainter

from sd2app.labels.model import LabelsModel, Mark, SpanArrays
from sd2app.labels.painting import ROW_PX, LabelRows, paint_tracks, strip_overlay
from sd2app.palette import palette_for
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale
from sd2core.labels.spans import Labels, LabelTrack, Span

TRACKS = (LabelTrack("One"), LabelTrack("Many", "free"), LabelTrack("Last"))


def rows_of(labels: Labels, *marks: Mark) -> LabelRows:
    return LabelRows.of(labels.tracks, SpanArrays.of(labels), marks)


def test_tracks_stand_one_below_the_other_as_high_as_their_lanes_need() -> None:
    spans = tuple(Span(k, "Many", 0.1 * k, 5.0, "x") for k in range(1, 4))
    rows = rows_of(Labels(TRACKS, spans))
    assert [row.lanes for row in rows.tracks] == [1, 3, 1]
    assert rows.tracks[1].height_px > ROW_PX
    assert rows.tracks[2].top_px == ROW_PX + rows.tracks[1].height_px
    assert rows.height_px == rows.tracks[2].top_px + ROW_PX
    for row in rows.tracks:
        for lane in range(row.lanes):
            top_px, height_px = row.lane_px(lane)
            assert rows.row_at(top_px + height_px / 2) is row
            assert row.lane_at(top_px + height_px / 2) == lane
    assert rows.row_at(rows.height_px) is None
    many = tuple(Span(k, "Many", 0.1 * k, 50.0, "x") for k in range(1, 41))
    assert rows_of(Labels(TRACKS, many)).tracks[1].height_px < 4 * ROW_PX


def test_a_mark_takes_a_lane_that_is_free_from_its_start_on() -> None:
    labels = Labels(TRACKS, (Span(1, "Many", 0.0, 1.0, "x"), Span(2, "Many", 2.0, 3.0, "x")))
    after = Mark("Many", "a", 3.0), Mark("Many", "b", 3.5)
    assert rows_of(labels, *after).mark_lanes == (0, 1)
    assert rows_of(labels, Mark("Many", "a", 0.5)).mark_lanes == (1,)
    assert rows_of(labels, Mark("One", "a", 0.5)).mark_lanes == (0,)
    assert rows_of(labels, Mark("Many", "a", 0.5)).tracks[1].lanes == 2


def test_without_tracks_there_is_room_for_one() -> None:
    rows = rows_of(Labels(()))
    assert (rows.tracks, rows.height_px) == ((), ROW_PX)


def test_a_span_too_narrow_for_a_box_is_a_line_in_its_colour(qapp) -> None:
    spans = (
        Span(1, "One", 2.0, 2.001, "left-to-right"),
        Span(2, "One", 5.0, 5.02, "up-to-down"),
        Span(3, "Many", 5.0, 5.01, "x"),
    )
    model, scale = LabelsModel(), TimeScale(0.0, 10.0, GUTTER_PX + 500 + MARGIN_PX)
    model.open(Labels(TRACKS, spans))
    model.select([2])
    rows = LabelRows.of(TRACKS, model.arrays, ())
    seen, palette = QImage(620, 80, QImage.Format.Format_ARGB32), palette_for(False)
    with QPainter(seen) as painter:
        plot = QRectF(GUTTER_PX, 0, 500, 76)
        paint_tracks(painter, plot, scale, model, rows.tracks, palette)
        strip_overlay(model).paint(painter, QRectF(GUTTER_PX, 77, 500, 3), scale)
    colour_of, middle = model.labels.label_set.colour_of, int(ROW_PX / 2)
    tops = {one.name: int(one.top_px) for one in rows.tracks}
    for span in spans:
        x = GUTTER_PX + round(50 * span.start_s)
        assert seen.pixelColor(x, tops[span.track] + middle) == QColor(colour_of(span.label))
        assert seen.pixelColor(x - 2, tops[span.track] + middle) == QColor(palette.well)
    # What is selected is marked at both ends of its height.
    x = GUTTER_PX + 250
    assert seen.pixelColor(x, 2) == seen.pixelColor(x, int(ROW_PX) - 3) == QColor(palette.text)
    assert seen.pixelColor(GUTTER_PX + 100, 2) != QColor(palette.text)
    assert seen.pixelColor(GUTTER_PX + 100, 78) == QColor(colour_of("left-to-right"))
