"""What is followed through the house in pictures is there, and the pictures show it."""

from __future__ import annotations

import re
from html import unescape

import pytest

from tools.documentation.journeys import JOURNEYS, MAX_STATIONS, path_of

each_journey = pytest.mark.parametrize("name", JOURNEYS)


@each_journey
def test_every_station_is_there_and_in_its_file(name: str) -> None:
    stations = JOURNEYS[name].stations
    assert len(stations) <= MAX_STATIONS
    for station in stations:
        found = station.resolve()
        assert callable(found)
        assert found.__module__.replace(".", "/") + ".py" == station.file


@each_journey
def test_the_picture_shows_the_stations_in_their_order(name: str) -> None:
    words = [
        unescape(found) for found in re.findall(r">([^<>\n]+)</text>", path_of(name).read_text())
    ]
    functions = [station.function for station in JOURNEYS[name].stations]
    assert [word for word in words if word in functions] == functions
    assert set(words) >= {station.words for station in JOURNEYS[name].stations}
