"""Labels in a figure of maps: names, hatches and edges, and only what is in view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.figures.maps import Levels, MapRow, draw_maps, lanes_of, save_maps
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

LABELS = Labels(
    (LabelTrack("Hands"), LabelTrack("Both & one", "free"), LabelTrack("Empty")),
    (
        Span(1, "Hands", 1.0, 4.0, "up-to-down"),
        Span(2, "Both & one", 2.0, 3.0, "a $\\odd name$"),
        Span(3, "Both & one", 2.5, 6.0, "down-to-up"),
        Span(4, "Hands", 5.0, 6.0, "gesture", origin="suggestion"),
        Span(5, "Hands", 8.0, 9.0, "background"),
    ),
)


@pytest.fixture
def row() -> MapRow:
    values = np.ones((8, 100), np.float32)
    doppler = DopplerMap(values, VelocityAxis(8, 2.0), Timebase.regular(100, 10.0), "synthetic")
    return MapRow(doppler, "Synthetic", 1.0)


def test_lanes_hold_what_is_in_view_and_decided() -> None:
    lanes = lanes_of(LABELS, 0.0, 7.0)
    assert [(name, [span.id for span in spans]) for name, spans in lanes] == [
        ("Hands", [1]),
        ("Both & one", [2]),
        ("", [3]),
    ]
    assert lanes_of(LABELS, 6.5, 7.5) == []


def test_every_label_in_view_has_a_name_and_a_hatch_of_its_own(row) -> None:
    figure = draw_maps(
        [row], Levels(), start_s=0.0, end_s=7.0, labels=LABELS, heading="x (simulated)"
    )
    (key,) = figure.legends
    assert [text.get_text() for text in key.get_texts()] == [
        "up-to-down",
        "down-to-up",
        "a $\\odd name$",
    ]
    hatches = [patch.get_hatch() for patch in key.get_patches()]
    assert len(set(hatches)) == len(hatches)
    assert figure.get_suptitle() == "x (simulated)"
    maps, lanes = figure.axes[:2]
    assert [tick.get_text() for tick in lanes.get_yticklabels()] == ["Hands", "Both & one"]
    starts, ends = maps.collections[-2:]
    assert [line[0][0] for line in starts.get_segments()] == [1.0, 2.0, 2.5]
    assert [line[0][0] for line in ends.get_segments()] == [4.0, 3.0, 6.0]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_every_kind_of_file_is_written_and_the_svg_holds_words(row, tmp_path, suffix) -> None:
    path = tmp_path / f"figure{suffix}"
    figure = draw_maps([row], Levels(), start_s=0.0, end_s=9.0, labels=LABELS, heading="walk")
    save_maps(figure, path, [row], {"recording": "walk"})
    assert path.stat().st_size > 1000
    if suffix == ".svg":
        text = path.read_text("utf-8")
        for words in (
            "walk",
            "Hands",
            "up-to-down",
            "odd name",
            "time (s)",
            "velocity (m/s",
            "level (dB)",
        ):
            assert words in text, words


def test_only_what_is_in_view_is_drawn(row) -> None:
    figure = draw_maps([row], Levels(), start_s=2.0, end_s=3.0, labels=None)
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().shape[1] <= 12
    assert not figure.legends
    with pytest.raises(Sd2Error, match="start before the end"):
        draw_maps([row], Levels(), start_s=3.0, end_s=3.0)


@pytest.mark.slow
def test_spans_too_narrow_to_tell_apart_are_plain_and_leave_the_maps_alone(row) -> None:
    crowd = tuple(
        Span(k + 1, "Hands", k * 0.01, k * 0.01 + 0.005, "up-to-down") for k in range(900)
    )
    labels = Labels((LabelTrack("Hands"),), (*crowd, Span(999, "Hands", 9.2, 9.8, "down-to-up")))
    figure = draw_maps([row], Levels(), start_s=0.0, end_s=10.0, labels=labels)
    maps, lanes = figure.axes[:2]
    assert [len(one.get_segments()) for one in maps.collections[-2:]] == [1, 1]
    assert [one.get_hatch() for one in lanes.collections] == [None, "...."]


def test_a_radar_s_map_says_its_carrier(row) -> None:
    """The title on the right; a map that was counted from a mesh has none."""

    def title_of(one: MapRow) -> str:
        figure = draw_maps([one], Levels(), start_s=0.0, end_s=3.0)
        return figure.axes[0].get_title(loc="right")

    assert "GHz" not in title_of(row)
    swept = {"start_frequency_hz": 77.0e9, "end_frequency_hz": 81.0e9}
    seen = replace(row.doppler, meta={"radar": swept})
    assert title_of(replace(row, doppler=seen)).startswith("79 GHz · 0 dB: ")
