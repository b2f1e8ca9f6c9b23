"""A batch that simulates a radar at every place."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_spheres import save_spheres
from pools import SerialPool
from swinging_recordings import recording

from sd2core.batch import task_graph as flow
from sd2core.batch.estimate import estimate, pace_kind
from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan_file import plan_from_text, plan_text
from sd2core.batch.run import BatchEnd, run_batch
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.simulating import Simulation, simulated_map
from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh
from sd2core.maps import DopplerMap
from sd2core.radar_config import PAPER_RADAR
from sd2core.radar_profiles import RADARS
from sd2core.runs.pace import keep_pace
from sd2core.sensor import VelocityAxis, VirtualSensor

PLAN = """
out = "made"
[recordings]
files = ["meshes/*"]
[placements]
kind = "positions"
positions_m = [[0, 0, 0], [1, 0, 0]]
[synthesise]
"""
SIMULATED = PLAN + "[simulate]\n"


def run(folder: Path, text: str) -> tuple[BatchEnd, SerialPool]:
    pool = SerialPool(folder / "made")
    return run_batch(plan_from_text(text, folder), pool=nullcontext(pool)), pool


def rows_in(folder: Path) -> list[dict[str, Any]]:
    lines = BatchFolder(folder / "made").results.read_text().splitlines()
    return [json.loads(line) for line in lines]


def test_every_place_gets_its_map(tmp_path: Path) -> None:
    (path,) = save_spheres(tmp_path / "meshes", 1)
    end, _ = run(tmp_path, SIMULATED)
    assert end.facts["done"] == {"inspect": 1, "synthesise": 2, "simulate": 2}
    rows = rows_in(tmp_path)
    assert [row["placement"] for row in rows] == [1, 2]
    for row in rows:
        found = DopplerMap.load(tmp_path / "made" / row["simulated"])
        sensor = VirtualSensor(**row["sensor"])
        expected = simulated_map(load_mesh(path), sensor, Simulation(), VelocityAxis())
        np.testing.assert_allclose(found.values, expected.values, rtol=1e-6, atol=0)
        np.testing.assert_array_equal(found.times_s, expected.times_s)
        assert found.kind == "simulated"


def test_only_what_depends_on_a_change_is_simulated_again(tmp_path: Path) -> None:
    save_spheres(tmp_path / "meshes", 1)
    run(tmp_path, PLAN)
    assert [row["simulated"] for row in rows_in(tmp_path)] == [None, None]
    assert run(tmp_path, SIMULATED)[1].submitted == {"simulate": 2}
    assert not run(tmp_path, SIMULATED)[1].submitted
    # The axis is that of the synthetic maps; how these are counted is nothing to the radar.
    smoother = SIMULATED.replace("[simulate]", "time_sigma_s = 0.1\n[simulate]")
    assert run(tmp_path, smoother)[1].submitted == {"synthesise": 2}
    finer = SIMULATED.replace("[simulate]", "bins = 64\n[simulate]")
    assert run(tmp_path, finer)[1].submitted == {"synthesise": 2, "simulate": 2}
    assert run(tmp_path, SIMULATED + "seed = 3\n")[1].submitted == {"simulate": 2}


@pytest.mark.slow
def test_the_data_set_holds_simulated_maps_of_every_place_and_the_real_radar(
    tmp_path: Path,
) -> None:
    (tmp_path / "meshes").mkdir()
    recording(tmp_path / "meshes" / "anna.sd2", simulated=False)
    recording(tmp_path / "meshes" / "ben.sd2")
    own = SIMULATED.replace('kind = "pos', 'own = true\nkind = "pos')
    end, _ = run(tmp_path, own + "[export]\nsegment_frames = 30\noverlap_frames = 0\n")
    assert end.failed == 0
    rows = rows_in(tmp_path)
    assert len(rows) == 6
    with open_dataset(tmp_path / "made" / "dataset.zarr") as dataset:
        counts = {"synthetic": 24, "simulated": 24, "real": 4}
        sources = list(dataset.sources())
        for kind, count in counts.items():
            assert sum(one["segments_of_kind"].get(kind, 0) for one in sources) == count
        for row in rows:
            (source,) = [
                one
                for one in sources
                if f"{one['recording']}.sd2" == row["recording"]
                and one["placement"] == row["placement"]
            ]
            values = DopplerMap.load(tmp_path / "made" / row["simulated"]).values
            kept = np.delete(np.arange(32), dataset.header.null_bins)
            found = np.concatenate(list(dataset["simulated"][source["start"] : source["stop"]]))
            np.testing.assert_array_equal(found[:, kept], values.T[:, kept])


def test_a_dry_run_says_what_simulating_costs(tmp_path: Path) -> None:
    save_spheres(tmp_path / "meshes", 2)
    plan = plan_from_text(SIMULATED, tmp_path)
    made = estimate(plan, 1)
    one = made.steps["simulate"]
    assert (one.to_do, one.there, one.frames) == (4, 0, 160)
    assert one.seconds is None
    assert one.bytes > 0
    keep_pace(pace_kind(plan, "simulate"), 10.0, one.work)
    assert estimate(plan, 1).steps["simulate"].seconds == pytest.approx(10.0, rel=1e-3)
    assert not (tmp_path / "made").exists()


def test_a_radar_of_ones_own_is_read_and_written_with_the_plan(tmp_path: Path) -> None:
    own = recording(tmp_path / "anna.sd2").folder / "radar" / "config.json"
    text = SIMULATED + f'radar = "{own.relative_to(tmp_path).as_posix()}"\n'
    plan = plan_from_text(text, tmp_path)
    assert plan.simulate is not None
    assert plan.simulate.radar == str(own)
    assert plan_from_text(plan_text(plan, tmp_path), tmp_path) == plan
    assert flow.simulation_of(plan.simulate).radar == PAPER_RADAR
    save_spheres(tmp_path / "meshes", 1)
    with pytest.raises(Sd2Error, match=r"There is no file .*nobody\.json"):
        run(tmp_path, SIMULATED + 'radar = "nobody.json"\n')
    with pytest.raises(Sd2Error, match="synthesise"):
        plan_from_text(PLAN.replace("synthesise", "simulate"), tmp_path)


def test_a_radar_by_its_name_stays_a_name(tmp_path: Path) -> None:
    plan = plan_from_text(SIMULATED + 'radar = "k-band"\n', tmp_path)
    assert plan.simulate is not None
    assert plan.simulate.radar == "k-band"
    assert plan_from_text(plan_text(plan, tmp_path), tmp_path) == plan
    assert flow.simulation_of(plan.simulate).radar == RADARS["k-band"]
