"""``sd2 placements``: places of sensors, what they see, and what they cost."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_outcome import Sd2
from scenes_of_people import scene

from sd2core.placements.placements import PlacementCloud, PlacementGrid, read_placements
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import Beam, VirtualSensor


def test_a_grid_is_listed_with_what_it_costs(sd2: Sd2, plate: Path) -> None:
    outcome = sd2(
        "placements", plate, "--ranges", "0.1,1:2:0.5,20", "--azimuths", "-60:60:60", "--json"
    )
    assert outcome.code == 0, outcome.err
    content = json.loads(outcome.out)
    places, cost = content["places"], content["cost"]
    assert len(places) == cost["maps"] == 5 * 3
    # The plate of 0.2 m moves from z = 3 m to z = 3 - 1.3 * 11 / 30 m.
    middle = 3.0 - 1.3 * 11 / 60
    assert content["target_m"] == pytest.approx((0.0, 0.0, middle), abs=1e-3)
    front = next(one for one in places if (one["range_m"], one["azimuth_deg"]) == (2.0, 0.0))
    assert front["position_m"] == pytest.approx((0.0, 0.0, middle - 2.0), abs=1e-3)
    assert front["fastest_mps"] == pytest.approx(1.3, rel=0.01)
    beyond = {one["range_m"] for one in places if one["out_of_range"]}
    assert beyond == {20.0}
    assert not any(one["aliasing"] for one in places)
    assert cost["frames"] == 12
    assert cost["total_s"] == pytest.approx(15 * 12 * 1e-3 * cost["frame_ms"])
    # 32 values of 4 bytes and a time of 8 per frame.
    assert cost["total_bytes"] == 15 * 12 * (32 * 4 + 8)


def test_words_say_what_is_beyond_the_radar(sd2: Sd2, plate: Path) -> None:
    outcome = sd2("placements", plate, "--ranges", "1,20", "--tolerance", "5%")
    assert outcome.code == 0, outcome.err
    assert outcome.out.startswith("2 placements around the body")
    assert "1 see it beyond the radar's range" in outcome.out
    assert "2 maps of 12 frames" in outcome.out
    rows = outcome.out.splitlines()[-2:]
    assert ["beyond" in row for row in rows] == [False, True]


@pytest.mark.slow
def test_what_is_written_is_read_and_what_a_recording_plans_is_listed(
    sd2: Sd2, plate: Path, tmp_path: Path
) -> None:
    spec = tmp_path / "cloud.json"
    cloud = ("--cloud", 4, "--ranges", "1:3", "--azimuths", "-30:30", "--seed", 7)
    assert sd2("placements", plate, *cloud, "--out", spec).code == 0
    planned = PlacementCloud(4, (1.0, 3.0), (-30.0, 30.0), seed=7)
    assert read_placements(spec) == planned
    recording = Recording.create(tmp_path / "plate", mesh=plate)
    recording.placements = planned
    recording.save()
    assert open_recording(recording.folder).placements == planned
    listed = [
        json.loads(sd2("placements", *words, "--json").out)["places"]
        for words in ((recording.folder,), (plate, "--placements", spec))
    ]
    assert listed[0] == listed[1]
    assert len(listed[0]) == 4


def test_the_cost_is_that_of_maps_through_the_recordings_beam(
    sd2: Sd2, plate: Path, tmp_path: Path
) -> None:
    recording = Recording.create(tmp_path / "plate", mesh=plate)
    recording.sensor = VirtualSensor(beam=Beam(20.0, 20.0))
    recording.save()
    words = ("--ranges", "2", "--json")
    weighed = [
        any(reason["rung"] == "beam" for reason in json.loads(outcome.out)["choice"]["reasons"])
        for outcome in (sd2("placements", path, *words) for path in (recording.folder, plate))
    ]
    assert weighed == [True, False]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "plans no placements"),
        (("--azimuths", "0"), "--azimuths is given without --ranges"),
        (("--ranges", "1:2"), "'1:2' is not a number"),
        (("--ranges", "0"), "range 0 m"),
        (("--ranges", "1", "--seed", "3"), "--seed is given without --cloud"),
        (("--cloud", "3", "--ranges", "1,2"), "is not an interval"),
        (("--ranges", "1", "--placements", "x.json"), "--placements is given with --ranges"),
        (("--placements", "nowhere.json"), "nowhere.json does not exist"),
        (("--ranges", "1", "--out", "x.txt"), "ends in .json"),
    ],
)
def test_what_is_wrong_is_said(sd2: Sd2, plate: Path, words: tuple, said: str) -> None:
    outcome = sd2("placements", plate, *words)
    assert outcome.code == 1
    assert said in outcome.err
    assert "Traceback" not in outcome.err


def test_places_are_those_of_the_library(sd2: Sd2, plate: Path) -> None:
    outcome = sd2("placements", plate, "--ranges", "1,2", "--elevations", "0,90", "--json")
    listed = {
        (one["range_m"], one["azimuth_deg"], one["elevation_deg"])
        for one in json.loads(outcome.out)["places"]
    }
    grid = PlacementGrid((1.0, 2.0), (0.0,), (0.0, 90.0)).places()
    assert listed == {(one.range_m, one.azimuth_deg, one.elevation_deg) for one in grid}


def test_they_are_around_the_person_who_is_named(sd2: Sd2, tmp_path: Path) -> None:
    scene(tmp_path / "two.sd2")
    targets_m = {}
    for name in ("anna", "bert"):
        outcome = sd2("placements", tmp_path / "two.sd2", "--ranges", 2, "--person", name, "--json")
        targets_m[name] = json.loads(outcome.out)["target_m"]
    # Bert is 1 m to the right.
    assert targets_m["bert"][0] - targets_m["anna"][0] == pytest.approx(1.0, abs=0.05)
    for command in (
        ("placements", "--ranges", 2),
        ("info",),
        ("strip", "--out", tmp_path / "a.png"),
    ):
        refused = sd2(command[0], tmp_path / "two.sd2", "--person", "carl", *command[1:])
        assert refused.code == 1
        assert "shows anna and bert, not carl" in refused.err
