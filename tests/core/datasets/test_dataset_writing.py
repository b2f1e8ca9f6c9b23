"""What is written is read, in every format; a killed writer loses nothing but its last source."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from lazy_sources import lazily, write_dataset
from made_sources import AXIS, CLASSES, LABELS, source

from sd2core.datasets import card, formats, store
from sd2core.datasets.card import card_paths
from sd2core.datasets.forecast import Counting
from sd2core.datasets.layout import SPLITS, row_shapes
from sd2core.datasets.options import dataset_options
from sd2core.datasets.preview import write_preview
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.source import KINDS, LazySource, Source, SourceKey
from sd2core.errors import Sd2Error
from sd2core.io.kinds import kind_of
from sd2core.maps import LimbMaps
from sd2core.mesh.vertex_parts import PARTS
from sd2core.options.exporting import Exporting, SpanOptions
from sd2core.progress import Cancelled, Progress

OPTIONS = Exporting(segment_frames=24, overlap_frames=4)
ENDINGS = (".zarr", ".h5", ".npz")
ONE_OF_ENDINGS = [
    ".zarr",
    *(pytest.param(one, marks=pytest.mark.slow) for one in (".h5", ".npz")),
]


def several() -> list[Source]:
    return [
        source("r1", "anna", kinds=("synthetic", "denoised", "real")),
        source("r1", "anna", placement=1),
        source("r2", "ben", frames=61, kinds=("synthetic", "simulated")),
        source("r1", "carla", frames=20),  # too short for a segment
        source("r1", "dora", frames=75),
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (Exporting(segment_frames=500), "No source has 500 frames on end with a person. Exp"),
        (
            Exporting(segment_frames=24, min_purity=1.0, label_rule="majority"),
            "24 frames on end with a person, of which 100% have one label",
        ),
        (
            Exporting(segment_frames=24, spans=SpanOptions(shortest_s=9.0)),
            "No source has a labelled span of 9 s or more that shows a person.*Label gestures",
        ),
        (
            Exporting(segment_frames=24, spans=SpanOptions()),
            "No source has a labelled span that shows a person",
        ),
    ],
)
def test_why_there_is_no_segment_is_said(tmp_path: Path, options, message: str) -> None:
    one = source("r1", "anna")
    if options.spans is not None and not options.spans.shortest_s:
        one = replace(one, label=np.zeros_like(one.label), spans=())
    with pytest.raises(Sd2Error, match=message):
        write_dataset(tmp_path / "set.zarr", [one], options)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Data set of all sources by the ending of its name, written at once; nobody changes it."""
    folder = tmp_path_factory.mktemp("whole")

    def written(ending: str) -> Path:
        out = folder / f"set{ending}"
        if not out.exists():
            write_dataset(out, several(), OPTIONS)
        return out

    return written


def contents(path: Path) -> dict[str, np.ndarray]:
    with open_dataset(path) as dataset:
        return {name: np.asarray(dataset[name][:]) for name in row_shapes(dataset.header)}


def tree(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_written_is_read(tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"set{ending}"
    sources = several()
    written = write_dataset(out, sources, OPTIONS)
    assert (written.sources, written.added, written.failed) == (5, 5, ())
    assert kind_of(out) == "dataset"
    with open_dataset(out) as dataset:
        header = dataset.header
        assert len(dataset) == written.segments == 17
        assert header.kinds == KINDS
        assert (header.labels, header.classes, header.axis) == (LABELS, CLASSES, AXIS)
        assert header.subjects == ("anna", "ben", "dora")  # carla has no segment
        entries = list(dataset.sources())
        assert [entry["subject"] for entry in entries] == [one.subject for one in sources]
        assert entries[0]["provenance"]["maps"]["synthetic"]["kind"] == "synthetic"
        assert "per_frame" not in entries[0]["provenance"]["maps"]["synthetic"]
        rows = {name: dataset[name][:] for name in row_shapes(header)}
        for row in range(len(dataset)):
            one = sources[rows["source"][row]]
            start = rows["start_frame"][row]
            for number, kind in enumerate(KINDS):
                assert rows["available"][row, number] == (kind in one.maps)
                cut = one.maps[kind].values.T[start : start + 24] if kind in one.maps else 0
                assert np.array_equal(rows[kind][row], np.broadcast_to(cut, (24, AXIS.bins)))
            assert np.array_equal(rows["label"][row], one.label[start : start + 24])
            assert rows["start_s"][row] == one.times_s[start]
            assert header.subjects[rows["subject"][row]] == one.subject
            assert rows["placement"][row] == one.placement
            assert tuple(rows["sensor_position_m"][row]) == one.sensor.position_m
            assert rows["range_m"][row] == np.float32(one.spherical[0])


def test_the_three_formats_hold_the_same(whole: Callable[[str], Path]) -> None:
    found = [contents(whole(ending)) for ending in ENDINGS]
    headers = [open_dataset(whole(ending)).header for ending in ENDINGS]
    lines = [list(open_dataset(whole(ending)).sources()) for ending in ENDINGS]
    assert headers[0] == headers[1] == headers[2]
    assert lines[0] == lines[1] == lines[2]
    for other in found[1:]:
        assert other.keys() == found[0].keys()
        for name, values in other.items():
            assert values.dtype == found[0][name].dtype
            assert np.array_equal(values, found[0][name])


@pytest.mark.one_in(3)
@pytest.mark.parametrize("ending", ENDINGS)
def test_writing_again_adds_only_what_is_new(
    tmp_path: Path, whole: Callable[[str], Path], ending: str
) -> None:
    grown = tmp_path / f"grown{ending}"
    sources = several()
    write_dataset(grown, sources[:2], OPTIONS)
    assert write_dataset(grown, sources[:2], OPTIONS).added == 0
    loaded: list[SourceKey] = []

    def noted(one: Source) -> LazySource:
        def load(progress: Progress) -> Source:
            loaded.append(one.key)
            return one

        return replace(lazily(one), load=load)

    assert write_dataset(grown, [noted(one) for one in sources], OPTIONS).added == 3
    assert loaded == [one.key for one in sources[2:]]
    found = contents(grown)
    for name, values in contents(whole(ending)).items():
        assert np.array_equal(values, found[name]), name
    assert open_dataset(grown).header == open_dataset(whole(ending)).header


KILLED = """
import os, signal, sys
from pathlib import Path
from lazy_sources import write_dataset
from test_dataset_writing import OPTIONS, several
from sd2core.datasets import store

calls = 0
put = store.put_rows

def put_or_die(*arguments):
    global calls
    calls += 1
    if calls == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)
    put(*arguments)

store.put_rows = put_or_die
store.FLUSH_EVERY_S = float(sys.argv[3])
write_dataset(Path(sys.argv[1]), several(), OPTIONS)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize(
    ("ending", "call", "flush_s", "kept"),
    [(".zarr", 3, 0.0, 0), (".zarr", 43, 0.0, 2), (".h5", 25, 0.0, 1), (".zarr", 18, 100.0, 0)],
)
def test_a_killed_writer_goes_on_to_the_same_data_set(
    tmp_path: Path,
    whole: Callable[[str], Path],
    ending: str,
    call: int,
    flush_s: float,
    kept: int,
) -> None:
    out = tmp_path / f"killed{ending}"
    here = Path(__file__).parent
    paths = os.pathsep.join(map(str, [here, here.parents[1], here.parents[2]]))
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(out), str(call), str(flush_s)],
        env={**os.environ, "PYTHONPATH": paths},
        check=False,
    )
    assert ended.returncode == -signal.SIGKILL
    if ending == ".zarr":
        with pytest.raises(Sd2Error, match="not written to its end"):
            open_dataset(out)
    else:
        assert not out.exists()
    assert write_dataset(out, several(), OPTIONS).added == 5 - kept
    if ending == ".zarr":
        assert tree(out) == tree(whole(ending))
    else:
        assert open_dataset(out).header == open_dataset(whole(ending)).header
        found = contents(out)
        for name, values in contents(whole(ending)).items():
            assert np.array_equal(values, found[name])
        assert [path.name for path in tmp_path.glob("*.partial")] == []


def test_a_line_that_was_not_written_to_its_end_does_not_count(
    tmp_path: Path, whole: Callable[[str], Path]
) -> None:
    out = tmp_path / "set.zarr"
    write_dataset(out, several()[:2], OPTIONS)
    index = out / "sources.jsonl"
    index.write_bytes(index.read_bytes()[:-7])
    (out / "synthetic" / "c" / "0.1f.partial").write_bytes(b"torn")
    assert write_dataset(out, several(), OPTIONS).added == 4
    assert tree(out) == tree(whole(".zarr"))


def test_who_cancels_can_go_on(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"

    def until_half(done: int, total: int) -> None:
        if done * 2 > total:
            raise Cancelled

    with pytest.raises(Cancelled):
        write_dataset(out, several(), OPTIONS, until_half)
    assert 0 < write_dataset(out, several(), OPTIONS).added < 5


def test_no_subject_is_in_two_splits(tmp_path: Path) -> None:
    people = [f"s{number}" for number in range(7)]
    sources = [source("r1", name, placement=p) for name in people for p in (0, 1)]
    out = tmp_path / "set.zarr"
    write_dataset(out, sources, OPTIONS)
    with open_dataset(out) as dataset:
        whose = [{*dataset["subject"][:][dataset.of_split(split)].tolist()} for split in SPLITS]
        assert sum(map(len, whose)) == 7 == len(set.union(*whose))
        assert all(whose)
        named = dataset.header.splits
        assert [{people.index(name) for name in named[split]} for split in SPLITS] == whose
    chosen = replace(OPTIONS, validation_subjects=("s2",), test_subjects=("s0", "s5"))
    assert write_dataset(out, sources, chosen).added == 0
    with open_dataset(out) as dataset:
        assert {*dataset["subject"][:][dataset.of_split("test")].tolist()} == {0, 5}
        assert {*dataset["subject"][:][dataset.of_split("validation")].tolist()} == {2}
    with pytest.raises(Sd2Error, match="'nobody' is to be a test subject"):
        write_dataset(out, sources, replace(OPTIONS, test_subjects=("nobody",)))


def test_one_bad_source_does_not_stop_the_others(tmp_path: Path) -> None:
    def broken(progress: Progress) -> Source:
        raise Sd2Error("b.npz is damaged", "a mesh")

    wide = source("r4", rate_hz=200.0)
    sources = [
        source("r1"),
        LazySource(SourceKey("ben", "b", 0), broken, str),
        source("r3", null_bins=(3, 4)),
        wide,
        source("r2"),
    ]
    written = write_dataset(tmp_path / "set.npz", sources, OPTIONS)
    assert (written.sources, written.added) == (2, 2)
    assert [one.key.recording for one in written.failed] == ["b", "r3", "r4"]
    assert ["damaged" in one.reason for one in written.failed] == [True, False, False]
    assert "bins 3, 4" in written.failed[1].reason
    assert "200 frames/s" in written.failed[2].reason
    with pytest.raises(Sd2Error, match="damaged"):
        write_dataset(tmp_path / "none.zarr", [sources[1]], OPTIONS)
    assert not (tmp_path / "none.zarr").exists()


def test_labels_of_all_sources_are_one_list(tmp_path: Path) -> None:
    ours = ("background", "up-to-down", "pause", "left-to-right")
    other = replace(
        source("r2"), labels=ours, label=np.arange(100).astype(np.int16) // 25, classes={}
    )
    sources = [source("r1"), other, replace(other, recording="r3", labels=(*ours[:3], "wave"))]
    out = tmp_path / "set.zarr"
    write_dataset(out, sources, OPTIONS)
    with open_dataset(out) as dataset:
        names = np.array(dataset.header.labels)
        assert names.tolist() == [*LABELS, "pause", "wave"]
        for whose, start, label in zip(
            dataset["source"][:], dataset["start_frame"][:], dataset["label"][:], strict=True
        ):
            one = sources[whose]
            expected = np.array(one.labels)[one.label[start : start + 24]]
            assert names[label].tolist() == expected.tolist()
        assert dataset.header.classes == CLASSES
    clash = replace(source("r4"), classes={"up-to-down": "horizontal"})
    (failed,) = write_dataset(out, [clash], OPTIONS).failed
    assert "'up-to-down' is of class 'horizontal'" in failed.reason


WITH_LIMBS = replace(OPTIONS, limbs=True, null_bins=(3,))


def split_sources() -> list[Source]:
    return [
        source("r1", "anna", limbs=True),
        source("r1", "ben", kinds=("real",)),  # no synthetic map, and nothing to split
        source("r2", "ben", kinds=("synthetic", "real"), limbs=True, frames=61),
    ]


@pytest.mark.parametrize("ending", ONE_OF_ENDINGS)
def test_limb_maps_add_up_to_the_synthetic_map(tmp_path: Path, ending: str) -> None:
    out = tmp_path / f"set{ending}"
    sources = split_sources()
    write_dataset(out, sources[:1], WITH_LIMBS)
    assert write_dataset(out, sources, WITH_LIMBS).added == 2
    with open_dataset(out) as dataset:
        assert dataset.header.parts == PARTS
        assert dataset["limbs"].shape == (len(dataset), 24, 9, AXIS.bins)
    rows = contents(out)
    np.testing.assert_array_equal(rows["limbs"].sum(axis=2), rows["synthetic"])
    assert rows["limbs"].any(axis=(0, 1)).tolist() == [[number != 3 for number in range(8)]] * 9
    there = rows["available"][:, KINDS.index("synthetic")]
    assert rows["limbs"].any(axis=(1, 2, 3)).tolist() == there.tolist() != [True] * len(there)
    for row in np.flatnonzero(there):
        known = sources[rows["source"][row]].maps["synthetic"].limbs
        assert known is not None
        start = rows["start_frame"][row]
        expected = known.values[..., start : start + 24].transpose(2, 0, 1).copy()
        expected[..., 3] = 0.0
        np.testing.assert_array_equal(rows["limbs"][row], expected)
    told = card.describe_dataset(open_dataset(out))
    assert "parts of the body: trunk, upper_arm.L" in card.card_text(told)


@pytest.mark.parametrize("begun_with", [True, False])
def test_a_data_set_has_limb_maps_of_all_or_none(tmp_path: Path, begun_with: bool) -> None:
    options = [replace(WITH_LIMBS, limbs=limbs) for limbs in (begun_with, not begun_with)]
    write_dataset(tmp_path / "set.zarr", split_sources()[:1], options[0])
    with pytest.raises(Sd2Error, match="begun with limb maps"):
        write_dataset(tmp_path / "set.zarr", split_sources(), options[1])


def test_limb_maps_of_a_scene_have_everybody_by_name(tmp_path: Path) -> None:
    def scene(recording: str, *persons: str) -> Source:
        """A map of several, each of whom moves as those of other sources."""
        each = [source(recording, one, limbs=True).maps["synthetic"].limbs for one in persons]
        both = LimbMaps.of_persons([one for one in each if one is not None], persons)
        whole = source(recording)
        made = replace(whole.maps["synthetic"], values=both.values.sum(axis=0), limbs=both)
        return replace(whole, maps={"synthetic": made})

    out = tmp_path / "set.zarr"
    sources = [scene("r1", "anna", "ben"), scene("r2", "anna", "ben")]
    write_dataset(out, sources[:1], WITH_LIMBS)
    assert write_dataset(out, sources, WITH_LIMBS).added == 1
    others = [*sources, scene("r3", "anna", "carla"), source("r4", limbs=True)]
    with open_dataset(out) as dataset:
        assert dataset.header.parts == tuple(
            f"{who}: {one}" for who in ("anna", "ben") for one in PARTS
        )
        assert dataset.header.joints[0] == "anna: trunk"
        known = sources[0].maps["synthetic"].limbs
        assert known is not None
        assert known.kinematics is not None
        expected = known.kinematics[..., :24].transpose(2, 0, 1)
        np.testing.assert_array_equal(dataset["kinematics"][0], expected)
    failed = write_dataset(out, others, WITH_LIMBS).failed
    assert [("carla: trunk" in one.reason, "of anna: trunk" in one.reason) for one in failed] == [
        (True, True), (False, True),
    ]  # fmt: skip


def test_what_is_not_split_is_left_out_of_limb_maps(tmp_path: Path) -> None:
    other = source("r3", "carla", limbs=True)
    two = LimbMaps(("left", "right"), np.zeros((2, *other.maps["synthetic"].values.shape)))
    odd = replace(other, maps={"synthetic": replace(other.maps["synthetic"], limbs=two)})
    sources = [source("r3", "ben"), odd, *split_sources()]
    written = write_dataset(tmp_path / "set.zarr", sources, WITH_LIMBS)
    assert written.added == 3
    assert [one.key for one in written.failed] == [one.key for one in sources[:2]]
    assert "r3 of ben is not split. Expected: limb maps of trunk" in written.failed[0].reason
    assert "carla is split into left, right" in written.failed[1].reason
    with pytest.raises(Sd2Error, match="Limb maps of denoised, real maps"):
        dataset_options(Exporting(kinds=("real", "denoised"), limbs=True))


def without_parts(path: Path) -> None:
    """Take from the description what earlier versions did not write."""
    if path.suffix == ".zarr":
        described = json.loads((path / "zarr.json").read_text())
        del described["attributes"]["parts"]
        (path / "zarr.json").write_text(json.dumps(described))
    elif path.suffix == ".h5":
        with h5py.File(path, "r+") as file:
            described = json.loads(file["meta"][()])
            del described["parts"], file["meta"]
            file["meta"] = json.dumps(described)
    else:
        arrays = dict(np.load(path))
        described = json.loads(str(arrays["meta"]))
        del described["parts"]
        np.savez(path, **arrays | {"meta": np.array(json.dumps(described))})


@pytest.mark.parametrize("ending", ONE_OF_ENDINGS)
def test_data_sets_from_before_limb_maps_open_and_grow(
    tmp_path: Path, whole: Callable[[str], Path], ending: str
) -> None:
    out = tmp_path / f"set{ending}"
    write_dataset(out, several()[:2], OPTIONS)
    without_parts(out)
    with open_dataset(out) as dataset:
        assert dataset.header.parts == ()
    assert write_dataset(out, several(), OPTIONS).added == 3
    found = contents(out)
    assert "limbs" not in found
    for name, values in contents(whole(ending)).items():
        assert np.array_equal(values, found[name]), name


def test_no_card_is_written_over_another_ones(tmp_path: Path) -> None:
    picture = tmp_path / "walk.png"
    picture.write_bytes(b"of a walk")
    for name in ("set.zarr", "set.h5", "walk.npz"):
        for _ in range(2):
            write_dataset(tmp_path / name, [source()], OPTIONS)
            write_preview(tmp_path / name)
    cards = {
        one.name: json.loads(one.read_text())["dataset"] for one in tmp_path.glob("*.card.json")
    }
    assert cards == {
        "set.card.json": "set.zarr", "set.h5.card.json": "set.h5", "walk.npz.card.json": "walk.npz",
    }  # fmt: skip
    assert picture.read_bytes() == b"of a walk"
    assert card_paths(tmp_path / "walk.npz")[2].stat().st_size > 1000


def test_a_wrong_name_of_a_person_is_refused_before_the_work(tmp_path: Path) -> None:
    options = replace(OPTIONS, validation_subjects=("bob",))
    for name in ("set.zarr", "set.h5"):
        with pytest.raises(Sd2Error, match="'bob' is to be a validation subject"):
            write_dataset(tmp_path / name, several(), options)
    assert not [*tmp_path.iterdir()]


def test_null_bins_are_empty_in_all_kinds(tmp_path: Path) -> None:
    out = tmp_path / "set.zarr"
    options = replace(OPTIONS, null_bins=(2, 3))
    write_dataset(out, [source(kinds=("synthetic", "real"))], options)
    with open_dataset(out) as dataset:
        for kind in ("synthetic", "real"):
            values = dataset[kind][:]
            assert not values[..., 2:4].any()
            assert values[..., [0, 1, 4, 5, 6, 7]].all()


@pytest.mark.slow
def test_what_cannot_be_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "set.zarr"
    write_dataset(out, several()[:1], OPTIONS)
    for change, message in (
        ({"segment_frames": 30}, "begun with segments of 24"),
        ({"overlap_frames": 3}, "an overlap of 4"),
        ({"kinds": ("real",)}, "begun with kinds"),
        ({"label_rule": "majority"}, "label rule foreground"),
    ):
        with pytest.raises(Sd2Error, match=message):
            write_dataset(out, several(), replace(OPTIONS, **change))  # type: ignore[arg-type]
    changed = replace(several()[0], label=np.zeros(100, np.int16))
    with pytest.raises(Sd2Error, match="made of something else"):
        write_dataset(out, [changed], OPTIONS)
    with pytest.raises(Sd2Error, match=r"Two sources are r1 of anna\. "):
        write_dataset(tmp_path / "twice.zarr", [source(), source()], OPTIONS)
    assert not (tmp_path / "twice.zarr").exists()
    with pytest.raises(Sd2Error, match=r"Two sources are r1 of anna\. .*--subjects"):
        Counting.of([lazily(source()), lazily(source())])
    renamed = replace(several()[0], subject="anne")
    with pytest.raises(Sd2Error, match=r"r1 of anne is in .*set.zarr already, as r1 of anna"):
        write_dataset(out, [renamed], OPTIONS)
    with pytest.raises(Sd2Error, match="no sources"):
        write_dataset(tmp_path / "empty.zarr", [], OPTIONS)
    with pytest.raises(Sd2Error, match="No source has 24 frames"):
        write_dataset(tmp_path / "short.h5", [source(frames=20)], OPTIONS)
    for ending in (".zarr", ".h5"):
        with pytest.raises(Sd2Error, match="No source has 24 frames"):
            write_dataset(tmp_path / f"tiny{ending}", [source(frames=20)], OPTIONS)
        shorter = replace(OPTIONS, segment_frames=20)
        assert write_dataset(tmp_path / f"tiny{ending}", [source(frames=20)], shorter).segments == 1
    with pytest.raises(Sd2Error, match=r"ending in \.zarr, \.h5"):
        write_dataset(tmp_path / "set.csv", several(), OPTIONS)
    (tmp_path / "mine.zarr").mkdir()
    (tmp_path / "mine.zarr" / "notes.txt").write_text("mine")
    with pytest.raises(Sd2Error, match="holds no data set"):
        write_dataset(tmp_path / "mine.zarr", several(), OPTIONS)
    (tmp_path / "mine.npz").write_bytes(b"mine")
    with pytest.raises(Sd2Error, match="cannot be read"):
        write_dataset(tmp_path / "mine.npz", several(), OPTIONS)
    assert (tmp_path / "mine.npz").read_bytes() == b"mine"
    monkeypatch.setattr(formats, "NPZ_LIMIT_BYTES", 50_000)
    with pytest.raises(Sd2Error, match=r"Write it as \.zarr or \.h5"):
        write_dataset(tmp_path / "large.npz", several(), OPTIONS)


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "FLUSH_EVERY_S", 1e9)  # a slow machine writes as a fast one
    monkeypatch.setattr(store, "_TOGETHER", 64)
    monkeypatch.setattr(card, "_ROWS", 256)  # fewer than any of these data sets has

    def many(count: int) -> Iterator[LazySource]:
        for number in range(count):
            name, who = f"r{number}", f"s{number % 4}"
            made = partial(source, name, who, frames=1500)
            yield LazySource(SourceKey(who, name, 0), lambda _, made=made: made(), str)

    def peak(count: int, ending: str) -> int:
        tracemalloc.start()
        write_dataset(tmp_path / f"{count}{ending}", many(count), OPTIONS)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(2, ".zarr")  # what is imported counts no more
    # More than is written together; so many that what threads hold at once on a busy machine,
    # which differs by some chunks from one time to the next, is little beside them.
    few, lots = peak(4, ".zarr"), peak(28, ".zarr")
    segments = (28 - 4) * 75 * 24 * AXIS.bins * 4 * 2
    assert lots - few < segments / 10
