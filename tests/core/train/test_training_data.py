"""Who is learnt from, what segments hold, in which order they come."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from small_pairs import write_pairs

from sd2core.denoise.registry import MODELS, build
from sd2core.errors import Sd2Error
from sd2core.options.training import DataConfig, TrainingConfig
from sd2core.pairs.store import read_pairs
from sd2core.sensor import VelocityAxis
from sd2core.train.data import (
    Windows,
    frame_weights,
    prepare,
    read_mixed,
    segments_of,
    split_subjects,
    windows_of,
)
from sd2core.train.steps import Batches, optimiser_of, rate_factor, set_rate


class TestSplit:
    @pytest.mark.parametrize(
        ("subjects", "expected"),
        [
            ("abcdef", ("abcd", "e", "f")),
            ("abc", ("a", "b", "c")),
            ("ab", ("a", "b", "")),
            ("a", ("a", "", "")),
            ("abcdefghijkl", ("abcdefgh", "ij", "kl")),
        ],
    )
    def test_by_default(self, subjects: str, expected: tuple[str, str, str]) -> None:
        split = split_subjects(subjects)
        assert tuple(map("".join, (split.training, split.validation, split.test))) == expected
        assert split.by_take is (len(subjects) == 1)

    def test_as_told(self) -> None:
        split = split_subjects("abcd", ["a"], [])
        assert (split.training, split.validation, split.test) == (("b", "c", "d"), ("a",), ())
        assert split_subjects("abcd", None, ["c"]).validation == ("d",)
        assert split_subjects("abcd", ["d"], None).test == ("c",)

    @given(
        st.lists(st.text("abc", min_size=1), unique=True, min_size=1, max_size=30),
        st.data(),
    )
    def test_nobody_is_in_two_parts(self, subjects: list[str], data: st.DataObject) -> None:
        test = data.draw(st.none() | st.lists(st.sampled_from(subjects), unique=True))
        if test is not None and len(test) == len(subjects):
            return
        split = split_subjects(subjects, None, test)
        parts = [*split.training, *split.validation, *split.test]
        assert sorted(parts) == sorted(subjects)
        assert split.training

    @pytest.mark.parametrize(
        ("validation", "test", "said"),
        [
            (["x"], None, "'x' is to be a validation subject and has no takes"),
            (["a"], ["a"], "a is to validate and to test"),
            (["a"], ["b"], "none is left"),
        ],
    )
    def test_refused(self, validation: Any, test: Any, said: str) -> None:
        with pytest.raises(Sd2Error, match=said):
            split_subjects("ab", validation, test)


class TestMixed:
    def test_namesakes_of_different_stores_are_different_people(self, tmp_path: Path) -> None:
        one = write_pairs(tmp_path / "one.zarr", ("s1", "s2"), kind="real")
        labels = ("background", "wave", "swipe")
        two = write_pairs(tmp_path / "two.zarr", ("s2", "s3"), labels=labels)
        mixed = read_mixed([one, two])
        assert mixed.subjects == ("s1", "one:s2", "two:s2", "s3")
        assert mixed.kind == "simulated"
        assert mixed.labels == ("background", "swipe", "wave")
        # The second store calls wave what the first calls swipe.
        before = read_pairs(two).takes[0].label
        after = mixed.of(["two:s2"]).takes[0].label
        assert np.array_equal(after == 2, before == 1)
        assert (after == 2).any()

    @pytest.mark.parametrize(
        ("other", "said"),
        [
            ({"rate_hz": 10.0}, r"frame rate of .*one\.zarr is 30 Hz, that of .* is 10 Hz"),
            ({"null_bins": (3,)}, r"null bins of .* is \[\], that of .* is \[3\]"),
            ({"axis": VelocityAxis(8, 3.0)}, r"velocity axis .* is 8 bins over ±2 m/s, that"),
        ],
    )
    def test_what_does_not_fit_is_not_mixed(
        self, tmp_path: Path, other: dict[str, Any], said: str
    ) -> None:
        one = write_pairs(tmp_path / "one.zarr")
        two = write_pairs(tmp_path / "two.zarr", **other)
        with pytest.raises(Sd2Error, match=said):
            read_mixed([one, two])

    def test_a_cameras_30_frames_a_second_are_those_of_a_simulation(self, tmp_path: Path) -> None:
        one = write_pairs(tmp_path / "one.zarr")
        two = write_pairs(tmp_path / "two.zarr", ("t1",), rate_hz=29.97)
        assert read_mixed([one, two]).subjects == ("s1", "s2", "s3", "t1")


class TestSegments:
    def test_range_synthesis_by_placements(self, tmp_path: Path) -> None:
        path = write_pairs(tmp_path / "p.zarr", placements=3)
        counts = {}
        for placements in ("all", "first"):
            config = DataConfig(
                pairs=(path,), segment_frames=30, overlap_frames=0, placements=placements
            )
            data = prepare(read_pairs(path), config)
            counts[placements] = len(data.training), len(data.validation)
        # 2 takes of 150 frames; models are chosen by what the takes' own sensors saw.
        assert counts == {"all": (30, 10), "first": (10, 10)}

    def test_one_subject_is_split_by_motions(self, tmp_path: Path) -> None:
        path = write_pairs(tmp_path / "p.zarr", ("s1",), takes=5, placements=2)
        data = prepare(read_pairs(path), DataConfig(pairs=(path,)))
        assert data.split.by_take
        assert {take.name for take in data.training_takes} == {"t0", "t1", "t2", "t3"}
        several = write_pairs(tmp_path / "several.zarr", ("s1", "s2"), takes=3)
        data = prepare(
            read_pairs(several),
            DataConfig(pairs=(several,), validation_subjects=(), test_subjects=()),
        )
        assert [take.title for take in data.training_takes] == ["s1/t0", "s1/t1", "s2/t0", "s2/t1"]

    def test_a_lone_take_is_split_by_time(self, tmp_path: Path) -> None:
        lone = write_pairs(tmp_path / "lone.zarr", ("s1",), takes=1, frames=400)
        pairs = read_pairs(lone)
        data = prepare(pairs, DataConfig(pairs=(lone,)))
        assert data.split.by_take
        (whole,), (learnt,) = pairs.takes, data.training_takes
        np.testing.assert_array_equal(learnt.radar, whole.radar[:320])
        assert len(data.validation) == 2  # of 72 frames, overlapping: the last 80
        np.testing.assert_array_equal(data.validation.targets[-1], whole.radar[-72:])

    def test_inputs_and_targets_are_of_the_same_frames(self, tmp_path: Path) -> None:
        pairs = read_pairs(write_pairs(tmp_path / "p.zarr", ("s1",), takes=1))
        segments = segments_of(pairs.takes, 40)
        take = pairs.takes[0]
        assert [len(segments), *segments.inputs.shape[1:]] == [4, 40, 8]
        for number, start in enumerate((0, 40, 80, 110)):
            assert np.array_equal(segments.inputs[number], take.synthetic[start : start + 40])
            assert np.array_equal(segments.targets[number], take.radar[start : start + 40])

    def test_takes_that_are_too_short(self, tmp_path: Path) -> None:
        pairs = read_pairs(write_pairs(tmp_path / "p.zarr", ("s1",), frames=50))
        with pytest.raises(Sd2Error, match="72 frames long, and the longest of 2 takes has 50"):
            segments_of(pairs.takes, 72)

    def test_other_pairs_have_another_digest(self, tmp_path: Path) -> None:
        one = write_pairs(tmp_path / "a.zarr")
        two = write_pairs(tmp_path / "b.zarr", takes=3)
        digests = {
            prepare(read_pairs(path), DataConfig(pairs=(path,))).digest for path in (one, two, one)
        }
        assert len(digests) == 2

    @pytest.mark.parametrize("segments", ["shifted", "fixed"])
    def test_segments_to_learn_from_stay_within_their_takes(
        self, tmp_path: Path, segments: str
    ) -> None:
        pairs = read_pairs(write_pairs(tmp_path / "p.zarr", ("s1",), takes=3))
        config = DataConfig(
            pairs=(tmp_path,), segment_frames=40, overlap_frames=10, segments=segments
        )
        cut = windows_of(pairs.takes, config)
        assert np.array_equal(cut.inputs, np.concatenate([take.synthetic for take in pairs.takes]))
        assert np.array_equal(cut.targets, np.concatenate([take.radar for take in pairs.takes]))
        own = np.array([0, 30, 60, 90, 110])
        everywhere = np.arange(len(cut)), 150 * np.repeat(np.arange(3), 5)
        rng = np.random.default_rng(0)
        places = np.array(
            [cut.places(everywhere[0], rng.uniform(0, 1, len(cut))) for _ in range(200)]
        )
        shifts = places - everywhere[1] - np.tile(own, 3)
        if segments == "fixed":
            assert (shifts == 0).all()
        else:
            # 15 frames are half a step; a take of 150 frames ends 40 after 110.
            assert shifts.reshape(-1, 5).min(axis=0).tolist() == [0, -15, -15, -15, -15]
            assert shifts.reshape(-1, 5).max(axis=0).tolist() == [15, 15, 15, 15, 0]

    def test_takes_too_short_to_learn_from(self, tmp_path: Path) -> None:
        pairs = read_pairs(write_pairs(tmp_path / "p.zarr", ("s1",), frames=50))
        with pytest.raises(Sd2Error, match="72 frames long, and the longest of 2 takes has 50"):
            windows_of(pairs.takes, DataConfig(pairs=(tmp_path,)))


def windows(segments: int) -> Windows:
    """Segments of four frames, each of which may be shifted by one."""
    starts = 6 * np.arange(segments) + 1
    frames = np.zeros((6 * segments, 8), np.float32)
    return Windows(frames, frames, starts - 1, starts + 1, 4, np.ones(len(frames)))


class TestFrameWeights:
    AXIS = VelocityAxis(8, 2.0)

    def frames(self, peaks: list[int | None], levels: float | np.ndarray = 1.0) -> Windows:
        """Frames with one full bin each, or empty."""
        energies = np.zeros((len(peaks), self.AXIS.bins), np.float32)
        for row, peak in enumerate(peaks):
            if peak is not None:
                energies[row, peak] = 1.0
        none = np.zeros(0, np.int64)
        return Windows(energies, energies, none, none, 1, np.broadcast_to(levels, len(peaks)))

    @given(st.lists(st.none() | st.integers(0, 7), min_size=1, max_size=300))
    def test_rarer_speeds_weigh_more_and_both_directions_alike(
        self, peaks: list[int | None]
    ) -> None:
        weights = frame_weights(self.frames(peaks), self.AXIS)
        turned = [None if peak is None else 7 - peak for peak in peaks]
        mirrored = frame_weights(self.frames(turned), self.AXIS)
        np.testing.assert_array_equal(weights, mirrored)
        assert weights.min() > 0.0
        assert weights.max() <= 8.0
        assert weights.mean() == pytest.approx(1.0) or weights.max() == 8.0

    def test_the_root_of_how_rare(self) -> None:
        # 90 frames without motion and 10 at bins far from one another: 90 and 10 · 1/2.
        weights = frame_weights(self.frames([None] * 90 + [0] * 10), self.AXIS)
        assert weights[-1] / weights[0] == pytest.approx(np.sqrt(90 / (0.75 * 10)), rel=1e-5)

    def test_weak_takes_count_as_shares_of_their_energy(self) -> None:
        levels = np.repeat([4.0, 1.0], 50)
        weights = frame_weights(self.frames([3] * 100, levels), self.AXIS)
        assert weights[-1] == pytest.approx(4 * weights[0], rel=1e-5)
        assert np.isfinite(frame_weights(self.frames([None] * 9, 0.0), self.AXIS)).all()

    def test_what_is_rare_is_kept_in_a_weighted_mean(self) -> None:
        """Which is what a model answers that cannot tell frames apart."""
        shown = self.frames([4] * 95 + [7] * 5)
        energies = shown.targets
        weights = frame_weights(shown, self.AXIS)[:, None]
        even, balanced = energies.mean(axis=0), (weights * energies).sum(axis=0) / weights.sum()
        assert balanced[7] > 3 * even[7]


class TestOrder:
    @given(st.integers(1, 60), st.integers(1, 20), st.integers(0, 5), st.integers(0, 1000))
    def test_every_segment_once(self, segments: int, size: int, seed: int, epoch: int) -> None:
        order = Batches(windows(segments), size, seed)
        batches = [order.at(epoch, step) for step in range(order.steps)]
        starts = np.concatenate([batch.start for batch in batches])
        assert sorted(starts // 6) == list(range(segments))
        assert set(starts % 6) <= {0, 1, 2}
        assert all(len(batch.start) for batch in batches)
        assert all((batch.gain == 1.0).all() for batch in batches)

    def test_it_depends_on_seed_and_epoch_alone(self) -> None:
        def starts(seed: int, epoch: int) -> list[int]:
            return Batches(windows(50), 50, seed, 2.0).at(epoch, 0).start.tolist()

        assert starts(7, 3) == starts(7, 3)
        assert starts(7, 3) != starts(8, 3)
        assert starts(7, 3) != starts(7, 4)

    def test_gains_follow_the_range_law(self) -> None:
        gains = Batches(windows(20_000), 20_000, 0, range_factor=1.5).at(0, 0).gain.numpy()
        # Half again as near or as far: 1.5⁴ in power. Logarithms are spread evenly.
        assert 1.5**-4 <= gains.min() < 1.02 * 1.5**-4
        assert 0.98 * 1.5**4 < gains.max() <= 1.5**4 * (1 + 1e-6)
        assert abs(np.log(gains).mean()) < 0.05

    def test_a_batch_depends_on_its_place_alone(self) -> None:
        batches = Batches(windows(10), 4, 1, 2.0)
        places = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]
        taken = {place: batches.at(*place) for place in places}
        assert [len(batch.start) for batch in taken.values()] == [4, 4, 2, 4, 4, 2]
        for place in reversed(places):
            found = Batches(windows(10), 4, 1, 2.0).at(*place)
            assert torch.equal(found.start, taken[place].start)
            assert torch.equal(found.gain, taken[place].gain)

    @pytest.mark.parametrize("ranks", [2, 3])
    def test_processes_share_a_batch(self, ranks: int) -> None:
        alone = Batches(windows(11), 6, 1)
        parts = [Batches(windows(11), 6, 1, 1.0, rank, ranks) for rank in range(ranks)]
        for step in range(alone.steps):
            batches = [part.at(0, step) for part in parts]
            assert len({len(batch.start) for batch in batches}) == 1
            found = torch.cat([batch.start for batch in batches])
            assert set(found.tolist()) == set(alone.at(0, step).start.tolist())


class TestOptimiser:
    @pytest.mark.slow
    @pytest.mark.parametrize("name", [name for name in MODELS if name != "s4-serial"])
    def test_every_parameter_once_and_state_spaces_apart(self, name: str) -> None:
        model = build(name, 32)
        config = TrainingConfig(learning_rate=0.5, ssm_learning_rate=0.25, weight_decay=0.125)
        groups = optimiser_of(model, config).param_groups
        grouped = [id(parameter) for group in groups for parameter in group["params"]]
        assert sorted(grouped) == sorted(map(id, model.parameters()))
        spaces = {id(parameter) for parameter in model.ssm_parameters()}
        assert bool(spaces) is name.startswith("s4")
        for group in groups:
            for parameter in group["params"]:
                if id(parameter) in spaces:
                    assert (group["lr"], group["weight_decay"]) == (0.25, 0.0)
                else:
                    decay = 0.125 if parameter.ndim > 1 else 0.0
                    assert (group["lr"], group["weight_decay"]) == (0.5, decay)

    def test_the_rate_rises_and_falls(self) -> None:
        factors = [rate_factor(done, 0.1, 0.01) for done in np.linspace(0, 1, 101)]
        assert factors[0] == 0.0
        assert factors[5] == pytest.approx(0.5)
        assert factors[10] == pytest.approx(1.0)
        assert factors[55] == pytest.approx((1 + 0.01) / 2)
        assert factors[100] == pytest.approx(0.01)
        assert np.all(np.diff(factors[10:]) < 0)
        assert rate_factor(0.0, 0.0, 0.5) == 1.0
        assert rate_factor(1.7, 0.0, 0.5) == 0.5

    @pytest.mark.slow
    def test_all_groups_keep_their_ratio(self) -> None:
        optimiser = optimiser_of(build("s4", 32), TrainingConfig())
        assert set_rate(optimiser, 0.5) == pytest.approx(0.5 * TrainingConfig().learning_rate)
        rates = {group["lr"] for group in optimiser.param_groups}
        config = TrainingConfig()
        assert rates == {0.5 * config.learning_rate, 0.5 * config.ssm_learning_rate}
