"""What a batch does and does not do again, and what it makes of things that go wrong."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from moving_spheres import maps_in, save_spheres, swinging_sphere
from numbered_videos import write_video
from pools import SerialPool

from sd2core.accuracy.plans import reference_plan
from sd2core.batch.driver import AHEAD
from sd2core.batch.fitting import facts_path
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import mesh_input_of
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.run import BatchEnd, run_batch
from sd2core.batch.tasks import Task
from sd2core.denoise.files import LIMBS_MODEL, find_model
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.maps import DopplerMap
from sd2core.recording.recording import Recording, Span
from sd2core.sensor import VirtualSensor

PLAN = """
out = "made"
[recordings]
files = ["meshes/*"]
[placements]
kind = "positions"
positions_m = [[0, 0, 0], [1, 0, 0]]
"""
MAPS = PLAN + "[synthesise]\n"
BOTH = MAPS + "[denoise]\n"


class Runs:
    """Runs plans in one folder, in this process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.out = folder / "made"
        self.pool = SerialPool(self.out)

    def __call__(
        self, text: str, workers: int = 1, dies: Callable[[Task], bool] | None = None, **more: Any
    ) -> BatchEnd:
        self.pool = SerialPool(self.out, workers, dies)
        plan = plan_from_text(text, self.folder)
        return run_batch(plan, pool=nullcontext(self.pool), **more)

    @property
    def report(self) -> dict[str, Any]:
        content: dict[str, Any] = json.loads(BatchFolder(self.out).report.read_text())
        return content


@pytest.fixture
def run(tmp_path: Path) -> Runs:
    return Runs(tmp_path)


def test_maps_are_those_of_synth_and_denoise(run: Runs) -> None:
    from sd2core.denoise.files import load_model

    paths = save_spheres(run.folder / "meshes", 2)
    end = run(BOTH)
    assert (end.outcome, end.failed) == ("finished", 0)
    assert end.facts["done"] == {"inspect": 2, "synthesise": 4, "denoise": 4}
    rows = [json.loads(line) for line in BatchFolder(run.out).results.read_text().splitlines()]
    assert [(row["recording"], row["placement"]) for row in rows] == [
        ("m0.npz", 1), ("m0.npz", 2), ("m1.npz", 1), ("m1.npz", 2)
    ]  # fmt: skip
    model = load_model(find_model("denoiser"))
    for row in rows:
        mesh = load_mesh(paths[int(row["recording"][1])])
        expected = Synthesizer(mesh).map(VirtualSensor(**row["sensor"]))
        made = DopplerMap.load(run.out / row["synthetic"])
        np.testing.assert_array_equal(made.values, expected.values)
        assert made.meta["sensor"] == expected.meta["sensor"] | {
            "position_m": list(expected.meta["sensor"]["position_m"])
        }
        denoised = DopplerMap.load(run.out / row["denoised"])
        np.testing.assert_allclose(
            denoised.values, model.denoise(made).values, rtol=1e-5, atol=1e-7
        )


@pytest.mark.slow
def test_a_tolerance_is_one_plan_per_mesh_for_all_its_places(
    run: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sd2core.accuracy.places._MIN_FRAMES", 1)
    paths = save_spheres(run.folder / "meshes", 2)
    end = run(MAPS + "tolerance = 0.1\n")
    assert (end.outcome, end.failed) == ("finished", 0)
    plans = {path.name: json.loads(path.read_text()) for path in run.out.glob("plans/*/*.json")}
    assert len(plans) == len(paths)
    told = {plan["provenance"]["plan"]["text"] for plan in plans.values()}
    rows = [json.loads(line) for line in BatchFolder(run.out).results.read_text().splitlines()]
    for row in rows:
        made = DopplerMap.load(run.out / row["synthetic"])
        assert made.meta["plan"]["text"] in told
        assert 0 <= made.meta["plan_error_l1"] <= 0.1
        best = Synthesizer(
            load_mesh(paths[int(row["recording"][1])]),
            reference_plan("histogram").options(PRESETS["paper"]),
        ).map(VirtualSensor(**row["sensor"]))
        assert np.abs(made.values - best.values).sum() <= 0.15 * best.values.sum()
    run(MAPS + "tolerance = 0.1\n")
    assert not run.pool.submitted


def test_the_same_again_does_nothing(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 2)
    run(MAPS)
    results = BatchFolder(run.out).results.read_bytes()
    end = run(MAPS)
    assert not run.pool.submitted
    assert end.facts["there"] == {"inspect": 2, "synthesise": 4}
    assert end.facts["done"] == {"inspect": 0, "synthesise": 0}
    assert BatchFolder(run.out).results.read_bytes() == results


def test_an_option_redoes_what_depends_on_it(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 1)
    run(BOTH)
    run(BOTH + "texture = 1\n")
    assert run.pool.submitted == {"denoise": 2}
    run(BOTH.replace("[denoise]\n", "time_sigma_s = 0.1\n[denoise]\n"))
    assert run.pool.submitted == {"synthesise": 2, "denoise": 2}
    # What a preset has already, said aloud, changes nothing.
    run(BOTH.replace("[denoise]\n", "visibility = 'exact'\n[denoise]\n"))
    assert not run.pool.submitted


def test_another_place_is_one_more_map(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 1)
    run(BOTH)
    run(BOTH.replace("[1, 0, 0]]", "[1, 0, 0], [0, -1, 0]]"))
    assert run.pool.submitted == {"synthesise": 1, "denoise": 1}


def test_a_changed_recording_redoes_its_own_maps(run: Runs) -> None:
    paths = save_spheres(run.folder / "meshes", 2)
    run(MAPS)
    save_mesh(swinging_sphere(44), paths[1])
    run(MAPS)
    assert run.pool.submitted == {"inspect": 1, "synthesise": 2}
    # Written anew with the same content, it is looked at and nothing more.
    content = paths[1].read_bytes()
    paths[1].unlink()
    paths[1].write_bytes(content)
    run(MAPS)
    assert run.pool.submitted == {"inspect": 1}


def test_recordings_of_the_same_content_share_their_maps(run: Runs) -> None:
    paths = save_spheres(run.folder / "meshes", 1)
    (run.folder / "meshes" / "twin.npz").write_bytes(paths[0].read_bytes())
    end = run(MAPS)
    assert run.pool.submitted == {"inspect": 2, "synthesise": 2}
    assert end.facts["total"]["synthesise"] == 4
    assert len(BatchFolder(run.out).results.read_text().splitlines()) == 4
    assert len(maps_in(run.out)) == 2


def test_what_cannot_be_read_is_reported_and_stops_nothing(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 2)
    (run.folder / "meshes" / "broken.npz").write_bytes(b"PK\x03\x04 and no more")
    (run.folder / "meshes" / "film.mp4").write_bytes(b"no film")
    said: list[dict[str, Any]] = []
    end = run(BOTH, watch=said.append)
    assert (end.outcome, end.failed) == ("finished", 2)
    assert end.facts["done"] == {"inspect": 2, "synthesise": 4, "denoise": 4}
    # Two recordings from two places, synthetic and denoised.
    assert end.facts["waiting"] == 8
    failures = run.report["failures"]
    assert sorted(one["recording"] for one in failures) == ["broken.npz", "film.mp4"]
    for one in failures:
        assert one["step"] == "inspect"
        assert one["recording"] in one["error"]["found"]
    assert sum(one["event"] == "failed" for one in said) == 2
    assert run.report["failed"] == 2
    status = BatchFolder(run.out).status()
    assert (status.state, status.failed, status.waiting) == ("finished", 2, 8)
    # Mended, it is done; nothing else is.
    save_mesh(swinging_sphere(40, 1.1), run.folder / "meshes" / "broken.npz")
    assert run(BOTH).failed == 1
    assert run.pool.submitted == {"inspect": 2, "synthesise": 2, "denoise": 2}


def test_a_video_needs_a_fit(run: Runs, tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    write_video(tmp_path / "meshes" / "film.mp4", frames=8)
    end = run(MAPS)
    assert end.failed == 1
    assert "[fit]" in run.report["failures"][0]["error"]["expected"]


def test_a_plan_may_only_fit(run: Runs, monkeypatch: pytest.MonkeyPatch) -> None:
    save_spheres(run.folder / "meshes", 1)
    write_video(run.folder / "meshes" / "film.mp4", frames=8)

    def fitted(out: str, **_: object) -> None:
        mesh = Path(out)
        mesh.parent.mkdir(parents=True, exist_ok=True)
        save_mesh(swinging_sphere(8, 1.1), mesh)
        facts_path(mesh).write_text(json.dumps(asdict(mesh_input_of(mesh, mesh.stem))))

    monkeypatch.setattr("sd2core.batch.fitting.fit_to_video", fitted)
    for state in ("done", "there"):
        end = run(PLAN + "[fit]\n")
        assert (end.outcome, end.failed) == ("finished", 0)
        assert end.facts[state] == {"inspect": 2, "fit": 1}
    assert not BatchFolder(run.out).results.read_bytes()


def test_a_lost_process_costs_its_current_task_only(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 2)
    died: list[str] = []

    def dies(task: Task) -> bool:
        if task.step == "synthesise" and task.placement == 2 and not died:
            died.append(task.key)
            return True
        return False

    said: list[dict[str, Any]] = []
    end = run(MAPS, dies=dies, watch=said.append)
    assert (end.outcome, end.failed) == ("finished", 0)
    assert [one["text"] for one in said if one["event"] == "note"] == [
        "A worker died during synthesise of m0.npz from place 2"
    ]
    assert len(maps_in(run.out)) == 4


def test_what_ends_its_process_every_time_is_given_up(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 2)
    guilty: list[str] = []

    def dies(task: Task) -> bool:
        if task.step == "synthesise" and (not guilty or task.key == guilty[0]):
            guilty[:1] = [task.key]
            return True
        return False

    end = run(MAPS, dies=dies)
    assert (end.outcome, end.failed) == ("finished", 1)
    assert end.facts["done"]["synthesise"] == 3
    (failure,) = run.report["failures"]
    assert failure["worker_died"]
    assert "died 2 times" in failure["error"]["found"]


def test_few_tasks_are_given_out_at_once(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 3)
    many = ", ".join(f"[{0.05 * number}, 0, 0]" for number in range(40))
    text = MAPS.replace("[0, 0, 0], [1, 0, 0]", many).replace("[synthesise]", _CHEAP)
    end = run(text, workers=2)
    assert end.facts["done"]["synthesise"] == 120
    assert run.pool.most_waiting <= 2 * AHEAD
    # What takes little is given out together.
    assert run.pool.largest > 1


_CHEAP = "[synthesise]\nvisibility = 'none'"


def test_maps_of_one_recording_are_made_by_few_processes(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 6)
    many = ", ".join(f"[{0.05 * number}, 0, 0]" for number in range(4))
    run(MAPS.replace("[0, 0, 0], [1, 0, 0]", many).replace("[synthesise]", _CHEAP), workers=3)
    changes = 0
    for tasks in run.pool.by_worker.values():
        names = [task.origin.name for task in tasks if task.step == "synthesise"]
        changes += sum(a != b for a, b in pairwise(names))
    assert changes <= 12


def test_frames_of_a_damaged_mesh_are_said_to_be_lost(run: Runs) -> None:
    (run.folder / "meshes").mkdir()
    mesh = run.folder / "meshes" / "long.zarr"
    save_mesh(swinging_sphere(4_000, 0.4), mesh)
    chunks = sorted(one for one in (mesh / "vertices" / "c").rglob("*") if one.is_file())
    assert len(chunks) > 1
    chunks[0].unlink()
    events: list[dict[str, Any]] = []
    end = run(MAPS.replace(".npz", ".zarr"), watch=events.append)
    assert end.outcome == "finished"
    (note,) = (one["text"] for one in events if one["event"] == "note")
    assert re.fullmatch(r"long\.zarr: lost [\d,]+ frames of its mesh, which is damaged", note)


def test_stopped_it_goes_on(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 2)
    folder = BatchFolder(run.out)

    def watch(event: dict[str, Any]) -> None:
        if event["event"] == "workers":
            folder.tell("stop")

    end = run(MAPS, watch=watch)
    assert end.outcome == "stopped"
    assert folder.status().state == "stopped"
    before = maps_in(run.out)
    assert len(before) < 4
    end = run(MAPS)
    assert end.outcome == "finished"
    assert end.facts["there"]["synthesise"] == len(before)
    assert len(maps_in(run.out)) == 4


@pytest.mark.slow
def test_two_batches_in_one_folder_are_refused(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 1)
    run(MAPS)
    lock = BatchFolder(run.out).lock()
    try:
        with pytest.raises(Sd2Error, match="at work"):
            run(MAPS)
    finally:
        lock.release()
    run(MAPS)


def test_another_folder_is_not_taken_over(run: Runs) -> None:
    save_spheres(run.folder / "meshes", 1)
    run.out.mkdir()
    (run.out / "thesis.tex").write_text("mine")
    with pytest.raises(Sd2Error, match="not the folder of a batch"):
        run(MAPS)
    assert [one.name for one in run.out.iterdir()] == ["thesis.tex"]


def test_a_pattern_that_matches_nothing_is_refused(run: Runs) -> None:
    with pytest.raises(Sd2Error, match="matches nothing"):
        run(MAPS)


def test_recordings_become_a_data_set(run: Runs) -> None:
    from sd2core.datasets.reading import open_dataset
    from sd2core.files.recording_json import Span

    folder = run.folder / "meshes"
    folder.mkdir()
    for number in range(3):
        mesh = run.folder / f"mesh{number}.npz"
        save_mesh(swinging_sphere(150, 0.5 + 0.2 * number), mesh)
        Recording.create(
            folder / f"take{number}",
            mesh=mesh,
            spans=(Span(start_s=1.0, end_s=3.0, label="left-right"),),
        )
    text = BOTH + "[export]\n"
    end = run(text)
    assert end.failed == 0, run.report["failures"]
    with open_dataset(Path(end.facts["dataset"])) as dataset:
        assert {one["recording"] for one in dataset.sources()} == {"take0", "take1", "take2"}
        assert {one["placement"] for one in dataset.sources()} == {1, 2}
        assert set(dataset.header.labels) >= {"background", "left-right"}
        count = len(dataset)
    run(text)
    assert not run.pool.submitted
    # Of one recording more, only what is new.
    save_mesh(swinging_sphere(150, 1.3), run.folder / "mesh3.npz")
    Recording.create(folder / "take3", mesh=run.folder / "mesh3.npz")
    end = run(text)
    assert run.pool.submitted == {"inspect": 1, "synthesise": 2, "denoise": 2, "export": 1}
    with open_dataset(Path(end.facts["dataset"])) as dataset:
        assert len(dataset) == count * 4 // 3
    # Other labels: its maps stay, the data set is written anew.
    recording = folder / "take3.sd2" / "recording.json"
    recording.write_text(recording.read_text().replace('"title": "take3"', '"title": "other"'))
    run(text)
    assert run.pool.submitted == {"inspect": 1, "export": 1}


@pytest.mark.slow
def test_limb_maps_are_exported_where_the_plan_says_so(run: Runs) -> None:
    from sd2core.datasets.reading import open_dataset

    (run.folder / "meshes").mkdir()
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 50)
    save_mesh(mesh, run.folder / "meshes" / "anna.npz")
    split = MAPS + "limbs = true\nvisibility = 'none'\n[denoise]\n[export]\nsegment_frames = 20\n"
    whole = run(split)
    with open_dataset(Path(whole.facts["dataset"])) as dataset:
        assert dataset.header.parts == ()
    end = run(split + "limbs = true\n")
    assert run.pool.submitted == {"export": 1}
    rows = [json.loads(line) for line in BatchFolder(run.out).results.read_text().splitlines()]
    with open_dataset(Path(end.facts["dataset"])) as dataset:
        assert len(dataset) == len(rows) == 2
        for row, found in zip(rows, dataset["limbs"][:], strict=True):
            known = DopplerMap.load(run.out / row["synthetic"]).limbs
            assert known is not None
            np.testing.assert_array_equal(found, known.values.transpose(2, 0, 1))
            # No model is named, so it is the one that takes them.
            denoised = DopplerMap.load(run.out / row["denoised"])
            assert denoised.meta["denoiser"]["name"] == LIMBS_MODEL


@pytest.mark.slow
def test_a_plan_exports_what_the_command_can(run: Runs) -> None:
    from sd2core.datasets.reading import open_dataset
    from sd2core.imu.virtual import imu_at_frames

    (run.folder / "meshes").mkdir()
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr").between(30, 70)
    save_mesh(mesh, run.folder / "mesh.npz")
    spans = (Span(start_s=mesh.times_s[0], end_s=mesh.times_s[4], label="left"),)
    place = run.folder / "meshes" / "anna.sd2"
    anna = Recording.create(place, mesh=run.folder / "mesh.npz", spans=spans)
    text = MAPS + "visibility = 'none'\n[export]\nsegment_frames = 10\noverlap_frames = 0\n"

    def exported(more: str) -> tuple[list[str], Any, Any]:
        end = run(text + more)
        assert run.pool.submitted["export"] == 1
        with open_dataset(Path(end.facts["dataset"])) as dataset:
            names = [dataset.header.labels[one] for one in dataset["segment_label"][:]]
            imu = dataset["imu"][:] if dataset.header.imu else None
            return names, dataset["synthetic"][:], imu

    names, maps, _ = exported("")
    assert sorted(names) == ["background"] * 6 + ["left"] * 2
    assert "left" not in exported("min_share = 0.5\n")[0]
    assert "left" not in exported('label_rule = "majority"\n')[0]
    emptied = exported("null_bins = [14, 15, 16, 20]\n")[1]
    assert maps[..., 20].any()
    assert not emptied[..., 20].any()
    _, _, imu = exported('imu = ["left-wrist", "head"]\n')
    for number, name in enumerate(("left-wrist", "head")):
        expected = imu_at_frames(anna.load_mesh(), name).channels.reshape(4, 10, 6)
        np.testing.assert_array_equal(imu[:, :, number], np.concatenate([expected, expected]))
    with pytest.raises(Sd2Error, match="left-ear"):
        run(text + 'imu = ["left-ear"]\n')


def test_what_would_be_done_is_what_is_done(run: Runs) -> None:
    from sd2core.batch.estimate import estimate

    save_spheres(run.folder / "meshes", 3)
    (run.folder / "meshes" / "broken.npz").write_bytes(b"nothing")
    plan = plan_from_text(BOTH + "[export]\n", run.folder)
    before = estimate(plan, 2)
    assert not run.out.exists()
    assert {step: one.to_do for step, one in before.steps.items()} == {
        "inspect": 4, "synthesise": 6, "denoise": 6, "export": 1
    }  # fmt: skip
    assert before.steps["synthesise"].frames == 6 * 40
    assert len(before.unusable) == 1
    assert before.seconds is None
    run(BOTH)
    after = estimate(plan, 2)
    assert {step: one.there for step, one in after.steps.items()} == {
        "inspect": 3, "synthesise": 6, "denoise": 6, "export": 0
    }  # fmt: skip
    assert after.steps["synthesise"].seconds == after.steps["synthesise"].to_do == 0
    # The files are no larger than the arrays in them, but for their headings.
    maps = list(run.out.glob("synthetic/*/*.npz"))
    written = sum(path.stat().st_size for path in maps)
    assert written < before.steps["synthesise"].bytes + 4096 * len(maps)
