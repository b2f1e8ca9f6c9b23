"""Texts, recordings, captures and videos, read as the commands do that a user runs on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan_file import read_plan
from sd2core.errors import Sd2Error
from sd2core.files.recording_json import CameraEntry
from sd2core.imu.files import read_signals, write_signals
from sd2core.imu.signals import InertialSignals
from sd2core.io.radar import load_recorded_map
from sd2core.io.radar.infineon import write_capture
from sd2core.io.radar.mars import mars_parts, read_mars
from sd2core.io.video import open_video
from sd2core.labels import files
from sd2core.labels.formats import read_labels, write_labels
from sd2core.labels.journal import Kept, packed
from sd2core.labels.label_set import GESTURES
from sd2core.labels.recovery import search
from sd2core.labels.spans import Labels
from sd2core.pairs.labelling import read_take_labels
from sd2core.placements.placements import PlacementCloud, read_placements, write_placements
from sd2core.radar_config import PAPER_RADAR
from sd2core.recording.recording import Recording
from sd2core.runs.progress import ProgressWriter
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.timebase import Timebase
from sd2core.train.config import read_config
from sd2core.train.folder import TrainingFolder
from tests.core.io.radar.point_files import walk, write_csv
from tests.core.mocap.mars_files import approaching, write_part
from tests.earlier_journals import change, record
from tests.labelled import imported
from tests.mutants.target import Target
from tests.mutants.telling import sd2, tell
from tests.numbered_videos import write_video

_CLOCK = Timebase.regular(120, 30.0)
_LABELS = imported(_CLOCK, 1)
_CLOUD = PlacementCloud(5, (1.0, 2.0), (0.0, 10.0), (0.0, 0.0), 1)
_PLAN = """\
format = "sd2-batch-plan"
version = 1
out = "out"

[recordings]
files = ["walk.sd2", "runs/*.sd2"]
subjects = "folder"
subject_of = {walk = "Ada"}

[placements]
kind = "grid"
ranges_m = [1.0, 2.5]
azimuths_deg = [-30, 0, 30]

[synthesise]
preset = "paper"
tolerance = 0.1
null_bins = [15, 16]

[export]
format = "zarr"
segment_frames = 72
test_subjects = ["Ada"]
"""
_CUES = """\
WEBVTT

1
00:00:00.500 --> 00:00:01.500
<v Ada>wave

00:02.000 --> 00:03.000
tap
"""
_STUDIO = """[{"id": 1, "data": {"video": "/data/a.mp4"}, "annotations": [{
  "completed_by": 3, "result": [
    {"type": "timelinelabels", "from_name": "hand",
     "value": {"ranges": [{"start": 15, "end": 45}], "timelinelabels": ["wave"]}},
    {"type": "timeserieslabels",
     "value": {"start": 2.0, "end": 3.0, "timeserieslabels": ["tap"]}}
  ]}]}]
"""
_SETTINGS = """\
[data]
pairs = ["campaign.zarr"]
validation_subjects = ["Ada"]

[model]
name = "s4"

[training]
epochs = 20
learning_rate = 1e-3
"""
_PLACEMENTS = """\
kind = "cloud"
count = 20
seed = 7
range_m = [1.0, 4.0]
azimuth_deg = [-60.0, 60.0]
elevation_deg = [0.0, 10.0]
"""


def _labels(name: str, format: str) -> Target:
    def write(path: Path) -> None:
        write_labels(path, _LABELS, _CLOCK, format)

    def read(path: Path) -> None:
        read_labels(path, _CLOCK, format)
        sd2("labels", "show", path, "--format", format)

    return Target(name, write, read)


def _text(name: str, text: str, read: Callable[[Path], object]) -> Target:
    return Target(name, lambda path: path.write_text(text), read)


def _write_recording(path: Path) -> None:
    video = write_video(path.with_suffix(".mp4"), 5)
    camera = CameraEntry(focal_px=500.0)
    made = Recording.create(path, video=video, title="Walk", camera=camera, copy=True)
    replace(made, labels=_LABELS, placements=_CLOUD).save(_CLOCK)


def _journal() -> bytes:
    before, after = Labels(), replace(_LABELS, label_set=GESTURES)
    return packed(Kept(Path("/walk.sd2"), before, time_unix_s=1.0)) + record(
        {"name": "Add", "time_unix_s": 2.0, **change(before, after), "others": {"title": "x"}}
    )


def _read_journal(path: Path) -> None:
    for note in search(path.parent).notes:
        raise Sd2Error(note)


def _write_run(path: Path) -> None:
    run = TrainingFolder(path)
    run.create("s4")
    with ProgressWriter(run.progress) as lines:
        lines.say("start", epochs=2, minutes=None, resumed=False, steps_done=0)
        lines.say("step", step=3, loss=0.5, elapsed_s=1.5, left_s=8.0)
        lines.say("epoch", epoch=1, step=9, validation_rmse=0.3, validation_mae_mps=0.1, best=True)
        lines.say("end", error={"found": "x", "expected": "y", "remedy": ""})
    run.set_state("finished")


def _write_batch(path: Path) -> None:
    batch = BatchFolder(path)
    batch.prepare()
    counts = {"synthesise": 4}
    with ProgressWriter(batch.progress) as lines:
        lines.say("start")
        lines.say("progress", total=counts, done=counts, there={}, failed=0, elapsed_s=2.0)
    batch.set_state("stopped", started_unix_s=5.0)


def _write_capture(path: Path) -> None:
    config = replace(PAPER_RADAR, receivers=1, chirps_per_frame=4, samples_per_chirp=8)
    counts = np.random.default_rng(1).integers(0, 4096, (9, 1, 4, 8), dtype=np.uint16)
    times_s = np.arange(9) * config.frame_repetition_s
    write_capture(path, counts, config, times_s, simulated=True, start_unix_s=1.6e9)


def _write_mars(path: Path) -> None:
    points = [(frame, 0.5, 10.0) for frame in range(12)]
    write_part(path, "test", approaching(12, 0.5), np.arange(12), points)


def _read_mars(path: Path) -> None:
    for part in mars_parts(path):
        read_mars(path, part)


def _write_imu(path: Path) -> None:
    values = np.random.default_rng(2).normal(size=(2, 50, 3))
    meta = {"at": "left-wrist", "axes": "x along the bone", "simulated": True}
    write_signals(path, InertialSignals(np.arange(50) / 100.0, *values, meta))


_TAKES = "subject,take,label,start_s,end_s\n1,walk-*,squat,,\n2,*,lunge,1.5,2\n"
_REAL_IMU = "time (ms);acc_x [g];acc_y [g];acc_z [g];gx_dps;gy_dps;gz_dps\n" + "".join(
    f"{10 * row};0.1;0.2;1.0;1.5;;-3e1\n" for row in range(20)
)


def _read_imu(path: Path) -> None:
    sd2("info", path)
    read_signals(path)


def _read_video(path: Path) -> None:
    sd2("info", path)
    with open_video(path) as video:
        for frame in (0, len(video) // 2, len(video) - 1):
            video.read(frame)


TARGETS = [
    Target("recording.sd2", _write_recording, tell),
    Target("labels.json", lambda path: files.write_labels(path, _LABELS), files.read_labels),
    Target(
        "label-set.json", lambda path: files.write_label_set(path, GESTURES), files.read_label_set
    ),
    _labels("labels.csv", "csv"),
    _labels("audacity.txt", "audacity"),
    _labels("labels.eaf", "elan"),
    _labels("labels.TextGrid", "textgrid"),
    _labels("labels.boris", "boris"),
    _labels("mne.txt", "mne"),
    _text(
        "table.tsv",
        "track\tlabel\tfirst_frame\tlast_frame\nleft\twave\t3\t9\nleft\ttap\t20\t40\n",
        lambda path: read_labels(path, _CLOCK),
    ),
    _text("cues.vtt", _CUES, lambda path: read_labels(path, _CLOCK)),
    _text("studio.json", _STUDIO, lambda path: read_labels(path, _CLOCK, "label-studio")),
    Target("000001-000001.journal", lambda path: path.write_bytes(_journal()), _read_journal),
    _text("plan.toml", _PLAN, read_plan),
    _text("training.toml", _SETTINGS, read_config),
    _text("placements.toml", _PLACEMENTS, read_placements),
    Target(
        "placements.json",
        lambda path: write_placements(path, _CLOUD),
        read_placements,
    ),
    Target("errors.json", lambda path: FitErrors.load().save(path), FitErrors.load),
    Target("run", _write_run, lambda path: TrainingFolder(path).status()),
    Target("batch", _write_batch, lambda path: BatchFolder(path).status()),
    Target("infineon", _write_capture, tell),
    Target("mars", _write_mars, _read_mars),
    Target("imu.csv", _write_imu, _read_imu),
    Target("imu.sto", _write_imu, _read_imu),
    Target("points.csv", lambda path: write_csv(path, walk()[:600]), load_recorded_map),
    _text("takes.csv", _TAKES, read_take_labels),
    _text("real.csv", _REAL_IMU, _read_imu),
    Target("video.mp4", write_video, _read_video),
    Target("video.mkv", write_video, _read_video),
    Target("video.avi", lambda path: write_video(path, codec="mpeg4"), _read_video),
]
