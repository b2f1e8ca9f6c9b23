"""Where tracks, lanes and marks stand."""

from __future__ import annotations

from sd2app.labels.model import Mark, SpanArrays
from sd2app.labels.painting import ROW_PX, LabelRows
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
