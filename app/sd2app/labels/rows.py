"""Geometry of tracks, lanes and marks on the label timeline, in pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sd2app.labels.arrays import SpanArrays
from sd2app.labels.model import Mark
from sd2core.labels.spans import LabelTrack

ROW_PX = 24.0
"""Height of a track whose spans do not overlap."""
_LANE_PX, _HIGHEST_PX = 17.0, 72.0
_GAP_PX = 1.0


@dataclass(frozen=True)
class TrackRow:
    """Row of one track; its lanes share the height."""

    name: str
    top_px: float
    height_px: float
    lanes: int

    def lane_px(self, lane: int) -> tuple[float, float]:
        """Return top and height of a lane."""
        height_px = (self.height_px - 2 * _GAP_PX) / self.lanes
        return self.top_px + _GAP_PX + lane * height_px, height_px

    def lane_at(self, y_px: float) -> int:
        """Return the lane at a height."""
        lane = int((y_px - self.top_px - _GAP_PX) * self.lanes / (self.height_px - 2 * _GAP_PX))
        return min(max(lane, 0), self.lanes - 1)


@dataclass(frozen=True)
class LabelRows:
    """Rows of all tracks, from top to bottom, and the lane of each mark."""

    tracks: tuple[TrackRow, ...]
    mark_lanes: tuple[int, ...]

    @classmethod
    def of(
        cls, tracks: Sequence[LabelTrack], arrays: SpanArrays, marks: Sequence[Mark]
    ) -> LabelRows:
        """Lay out tracks, each as high as its lanes need, up to a limit."""
        counts = list(arrays.lanes_of_track)
        numbers = {track.name: number for number, track in enumerate(tracks)}
        mark_lanes: list[int] = []
        taken: set[tuple[int, int]] = set()
        for mark in marks:
            number = numbers[mark.track]
            lane = 0
            if tracks[number].overlap == "free":
                later = (arrays.tracks == number) & (arrays.ends_s > mark.start_s)
                busy = {*arrays.lanes[later].tolist()}
                while lane in busy or (number, lane) in taken:
                    lane += 1
            taken.add((number, lane))
            counts[number] = max(counts[number], lane + 1)
            mark_lanes.append(lane)
        rows, top_px = [], 0.0
        for track, lanes in zip(tracks, counts, strict=True):
            height_px = ROW_PX if lanes == 1 else min(lanes * _LANE_PX, _HIGHEST_PX)
            rows.append(TrackRow(track.name, top_px, height_px, lanes))
            top_px += height_px
        return cls(tuple(rows), tuple(mark_lanes))

    @property
    def height_px(self) -> float:
        """Height of all tracks, of one at least."""
        last = self.tracks[-1] if self.tracks else TrackRow("", 0.0, ROW_PX, 1)
        return last.top_px + last.height_px

    def row_at(self, y_px: float) -> TrackRow | None:
        """Return the row at a height."""
        for row in self.tracks:
            if row.top_px <= y_px < row.top_px + row.height_px:
                return row
        return None

    def row_of(self, track: str) -> TrackRow:
        """Return the row of a track; it must exist."""
        return next(row for row in self.tracks if row.name == track)
