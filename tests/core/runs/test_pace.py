"""A pace is that of the items after the first, and is kept for the next run of the kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from sd2core.options.training import DataConfig, MachineConfig, ModelConfig, TrainConfig
from sd2core.runs import pace as module
from sd2core.runs.pace import Throughput, keep_pace, known_pace_s

KIND = ("fit", "medium")


def test_the_first_item_warms_up() -> None:
    pace = Throughput()
    assert (pace.each_s, pace.left_s(10)) == (None, None)
    pace.take(3, 60.0)  # a resumed run, and long preparations
    assert pace.each_s is None
    pace.take(5, 64.0)
    pace.take(7, 68.0)
    assert pace.each_s == pytest.approx(2.0)
    assert pace.left_s(10) == pytest.approx(20.0)
    pace.keep(KIND)
    assert known_pace_s(KIND) == pytest.approx(2.0)


def test_paces_are_kept_by_kind() -> None:
    assert known_pace_s(KIND) is None
    keep_pace(KIND, 50.0, 0)
    keep_pace(KIND, 0.0, 50)
    assert known_pace_s(KIND) is None
    keep_pace(KIND, 1.0, 2)
    assert known_pace_s(KIND) == 0.5
    keep_pace(KIND, 20.0, 200)
    keep_pace(KIND, 1.0, 2)  # mostly overhead
    keep_pace(("fit", "high"), 50.0, 100)
    assert (known_pace_s(KIND), known_pace_s(("fit", "high"))) == (0.1, 0.5)
    keep_pace(KIND, 40.0, 200)
    assert known_pace_s(KIND) == 0.2


def test_the_kinds_of_long_ago_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MAX_KINDS", 2)
    for number in (1, 2, 1, 3):
        keep_pace(("kind", number), 10.0, 10)
    assert [known_pace_s(("kind", number)) for number in (1, 2, 3)] == [1.0, None, 1.0]


@pytest.mark.parametrize("damaged", ["", "[1]", '{"fit medium": "fast"}', '{"fit medium": 0.1}'])
def test_a_damaged_file_is_an_empty_one(damaged: str) -> None:
    keep_pace(KIND, 20.0, 200)
    module._path().write_text(damaged)
    assert known_pace_s(KIND) is None
    keep_pace(KIND, 20.0, 200)
    assert known_pace_s(KIND) == 0.1


def test_a_cache_that_cannot_be_written_is_no_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(module, "_path", lambda: tmp_path / "file" / "pace.json")
    keep_pace(KIND, 20.0, 200)
    assert known_pace_s(KIND) is None


def test_what_the_time_of_a_training_step_depends_on_is_in_its_kind() -> None:
    data = DataConfig(pairs=(Path(),))
    kinds = {
        TrainConfig(
            data,
            ModelConfig(name=name, options=options, inputs=inputs),
            machine=MachineConfig(threads=threads),
        ).pace_kind
        for name, options in (("s4", {}), ("s4", {"channels": 64}), ("gru", {}))
        for inputs in ("map", "limbs")
        for threads in (None, 1)
    }
    assert len(kinds) == 12
