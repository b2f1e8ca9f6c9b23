"""``sd2 ladder`` and ``sd2 synth --tolerance``: the trade on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_outcome import Sd2

from sd2core.accuracy import AccuracyPlan
from sd2core.maps import DopplerMap


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(folder))
    return folder


def test_the_plan_its_error_and_the_reasons_are_printed(sd2: Sd2, plate: Path) -> None:
    outcome = sd2("ladder", plate, "--quick", "--tolerance", "5%")
    assert outcome.code == 0, outcome.err
    lines = outcome.out.splitlines()
    assert lines[0].startswith("counted by vertex · ")
    assert "ms per frame" in lines[0]
    assert any(line.startswith("  - no velocity passes 2 m/s") for line in lines)
    assert any("aliasing" in line for line in lines)


@pytest.mark.slow
def test_the_table_is_kept_and_reused(sd2: Sd2, plate: Path, own_cache: Path) -> None:
    first = sd2("ladder", plate, "--repeats", 1, "--json")
    assert first.code == 0, first.err
    measured = json.loads(first.out)["measurement"]
    assert len(list(own_cache.rglob("*.json"))) == 1
    again = json.loads(sd2("ladder", plate, "--json").out)["measurement"]
    assert again == measured
    fresh = json.loads(sd2("ladder", plate, "--repeats", 1, "--fresh", "--json").out)
    times = [result["cost"]["all_cores_ms"] for result in measured["results"]]
    assert [r["cost"]["all_cores_ms"] for r in fresh["measurement"]["results"]] != times


@pytest.mark.slow
def test_the_table_names_what_it_was_measured_against(sd2: Sd2, plate: Path) -> None:
    outcome = sd2("ladder", plate, "--repeats", 1)
    assert "plate.npz on " in outcome.out
    assert "against counted by vertex · visibility exact" in outcome.out
    assert "* counted" in outcome.out


@pytest.mark.slow
def test_the_picture(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    picture = tmp_path / "trade.png"
    assert sd2("ladder", plate, "--repeats", 1, "--figure", picture).code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_what_cannot_be_held_is_said(sd2: Sd2, plate: Path) -> None:
    outcome = sd2("ladder", plate, "--quick", "--tolerance", "1e-12")
    assert outcome.code == 1
    assert "No plan holds" in outcome.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--quick", "--figure", "x.png"), "--figure"),
        (("--figure", "x.gif"), ".png"),
        (("--quick", "--method", "fmcw"), "--quick"),
    ],
)
def test_what_does_not_go_together(
    sd2: Sd2, plate: Path, arguments: tuple[str, ...], message: str
) -> None:
    outcome = sd2("ladder", plate, *arguments)
    assert outcome.code == 1
    assert message in outcome.err


@pytest.mark.parametrize("wrong", ["0", "-1%", "lots", "nan", "%", "200%", "1.01"])
@pytest.mark.parametrize("command", ["ladder", "synth", "placements", "export"])
def test_a_tolerance_is_a_share(sd2: Sd2, plate: Path, command: str, wrong: str) -> None:
    outcome = sd2(command, plate, f"--tolerance={wrong}", *(["--out", "x"] * (command != "ladder")))
    assert outcome.code == 2
    assert f"{wrong!r} is not a share above 0 and up to 100%, e.g. 2% or 0.02" in outcome.err
    assert f"`sd2 {command} --help`" in outcome.err


def test_synth_carries_the_plan_out(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    outcome = sd2("synth", plate, "--out", out, "--tolerance", "5%")
    assert outcome.code == 0, outcome.err
    made = DopplerMap.load(out)
    plan = AccuracyPlan.from_json({k: v for k, v in made.meta["plan"].items() if k != "text"})
    assert made.meta["plan"]["text"] == str(plan)
    assert made.meta["options"]["visibility"] == plan.visibility
    assert made.meta["plan_error_l1"] <= 0.05
    assert made.meta["plan_reasons"]


def test_synth_refuses_what_cannot_be_held(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    outcome = sd2("synth", plate, "--out", out, "--tolerance", "1e-12")
    assert outcome.code == 1
    assert "the best is" in outcome.err
    assert not out.exists()


def test_synth_takes_a_plan_or_its_settings(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    outcome = sd2("synth", plate, "--out", out, "--tolerance", "5%", "--visibility", "facing")
    assert outcome.code == 1
    assert "--visibility" in outcome.err


def test_synth_says_which_plan_it_took(sd2: Sd2, plate: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.npz"
    outcome = sd2("synth", plate, "--out", out, "--tolerance", "5%")
    assert outcome.code == 0, outcome.err
    shown = next(line for line in outcome.out.splitlines() if line.startswith("  plan "))
    assert DopplerMap.load(out).meta["plan"]["text"] in shown
    assert shown in sd2("info", out).out
