"""``sd2 simulate campaign`` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.pairs.store import read_pairs
from sd2core.radar_profiles import RADARS
from sd2core.simulate.campaign import radar as campaign_radar

SHORT = ("--people", 1, "--minutes", 0.03, "--take-seconds", 2, "--workers", 1)


def test_a_campaign_is_made_and_told(sd2: Sd2, tmp_path: Path) -> None:
    out = tmp_path / "small.zarr"
    outcome = sd2("simulate", "campaign", "--out", out, *SHORT, "--json")
    assert outcome.code == 0, outcome.err
    said = json.loads(outcome.out)
    assert (said["takes"], said["made"], said["frames"]) == (1, 1, 60)
    assert said["simulated"] is True
    assert said["labels"] == list(read_pairs(out).labels)
    assert json.loads(sd2("info", out, "--json").out)["protocol"].startswith("varied")
    again = sd2("simulate", "campaign", "--out", out, *SHORT)
    assert again.code == 0
    assert "Made 0 takes" in again.out
    assert "1 simulated take of 1 person" in again.out


@pytest.mark.parametrize(
    "options", [["--seed", "-1"], ["--minutes", "0"], ["--people", "none"], ["--sensors", "0"]]
)
def test_numbers_that_make_no_sense_are_usage(sd2: Sd2, tmp_path: Path, options: list[str]) -> None:
    assert sd2("simulate", "campaign", "--out", tmp_path / "x.zarr", *options).code == 2
    assert not (tmp_path / "x.zarr").exists()


def test_other_things_are_not_written_over(sd2: Sd2, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    outcome = sd2("simulate", "campaign", "--out", tmp_path, "--minutes", 0.03, "--take-seconds", 2)
    assert outcome.code == 1
    assert "holds no pairs" in outcome.err


@pytest.mark.slow
def test_info_says_the_protocol_and_no_other_goes_on(sd2: Sd2, tmp_path: Path) -> None:
    out = tmp_path / "one.zarr"
    made = sd2("simulate", "campaign", "--out", out, *SHORT, "--protocol", "paper", "--json")
    assert json.loads(made.out)["protocol"] == "paper"
    words = "paper, swipes to-and-fro"
    assert json.loads(sd2("info", out, "--json").out)["protocol"] == words
    assert words in sd2("info", out).out
    for other in (["--protocol", "paper", "--order", "random"], []):
        outcome = sd2("simulate", "campaign", "--out", out, *SHORT, *other)
        assert outcome.code == 1
        assert "same settings" in outcome.err


def test_varied_takes_have_no_order(sd2: Sd2, tmp_path: Path) -> None:
    outcome = sd2("simulate", "campaign", "--out", tmp_path / "x.zarr", "--order", "to-and-fro")
    assert outcome.code == 1
    assert "Add --protocol paper" in outcome.err
    assert not (tmp_path / "x.zarr").exists()


@pytest.mark.slow
def test_a_radar_by_its_name_has_its_own_sweep_and_rate(
    sd2: Sd2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(campaign_radar, "_EMPTY_FRAMES", 8)  # how well noise is known is not asked
    for options, rate in (([], 20.0), (["--rate", 24], 24.0)):
        out = tmp_path / f"{rate:g}.zarr"
        command = ("simulate", "campaign", "--out", out, *SHORT, "--radar", "iwr6843", *options)
        assert sd2(*command).code == 0
        pairs = read_pairs(out)
        assert pairs.frame_rate_hz == pytest.approx(rate)
        radar = pairs.provenance["radar"]
        assert radar["start_frequency_hz"] == RADARS["iwr6843"].start_frequency_hz
        assert radar["chirps_per_frame"] == 64


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--radar", "wifi-2.4ghz"], "10 to 120 frames/s"),
        (["--radar", "a121"], "--rate 24"),
        (["--radar", "bgt60", "--protocol", "paper"], "the paper's"),
    ],
)
def test_a_radar_that_makes_no_campaign_is_refused(
    sd2: Sd2, tmp_path: Path, options: list[str], words: str
) -> None:
    outcome = sd2("simulate", "campaign", "--out", tmp_path / "x.zarr", *SHORT, *options)
    assert outcome.code == 1
    assert words in outcome.err
