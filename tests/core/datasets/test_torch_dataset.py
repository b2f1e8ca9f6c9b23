"""Torch sees every segment once, whoever reads it."""

from __future__ import annotations

import multiprocessing
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch
from lazy_sources import write_dataset
from made_sources import LABELS, source
from torch.utils.data import DataLoader

from sd2core.datasets.reading import open_dataset
from sd2core.datasets.torch_dataset import NOT_LEARNT, SegmentDataset
from sd2core.errors import Sd2Error
from sd2core.options.exporting import Exporting


@pytest.fixture(scope="module")
def stores(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("sets")
    sources = [
        source(f"r{number}", f"s{number % 3}", frames=200 + number,
               kinds=("synthetic", "real") if number % 2 else ("synthetic", "denoised"))
        for number in range(6)
    ]  # fmt: skip
    options = Exporting(segment_frames=24, overlap_frames=4)
    for ending in (".zarr", ".h5", ".npz"):
        write_dataset(folder / f"set{ending}", sources, options)
    return {ending: folder / f"set{ending}" for ending in (".zarr", ".h5", ".npz")}


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize(
    ("ending", "started"), [(".zarr", "fork"), pytest.param(".h5", "spawn", marks=pytest.mark.slow)]
)
def test_two_workers_see_each_segment_once(
    stores: dict[str, Path], ending: str, started: str
) -> None:
    if started not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {started} here")
    data = SegmentDataset(stores[ending], "synthetic", "label", "train")
    # Opened here already: the workers must not use this very file.
    assert data[0][0].shape == (24, 8)
    loader = DataLoader(
        data, 7, shuffle=True, num_workers=2, multiprocessing_context=started,
        generator=torch.Generator().manual_seed(1),
    )  # fmt: skip
    seen = torch.cat([energies for energies, _ in loader]).numpy()
    with open_dataset(stores[ending]) as dataset:
        rows = dataset.of_split("train")
        there = np.asarray(dataset["synthetic"][:])[rows]
    assert len(seen) == len(there) == len(data)
    in_order = [sorted(values.reshape(len(values), -1).tolist()) for values in (seen, there)]
    assert in_order[0] == in_order[1]


def test_items_are_what_was_asked_for(stores: dict[str, Path]) -> None:
    with open_dataset(stores[".zarr"]) as dataset:
        arrays = {name: np.asarray(dataset[name][:]) for name in dataset.arrays}
    data = SegmentDataset(stores[".zarr"], "synthetic", "real")
    assert len(data) == arrays["available"][:, 3].sum() < len(arrays["real"])
    for number in (0, len(data) - 1):
        row = data.indices[number]
        assert np.array_equal(data[number][0], arrays["synthetic"][row])
        assert np.array_equal(data[number][1], arrays["real"][row])
    classes = SegmentDataset(stores[".zarr"], "denoised", "class")
    assert classes.names == ("horizontal", "vertical")
    labels = arrays["segment_label"][arrays["available"][:, 1]]
    assert len(classes) == (labels != 0).sum()  # the background here has no class
    for number in range(len(classes)):
        label = LABELS[arrays["segment_label"][classes.indices[number]]]
        name = {"left-to-right": "horizontal", "up-to-down": "vertical"}[label]
        assert classes.names[classes[number][1]] == name
    frames = SegmentDataset(stores[".zarr"], "denoised", "frame class")
    numbers = frames[0][1].numpy()
    expected = np.array([NOT_LEARNT, 0, 1])[arrays["label"][frames.indices[0]]]
    assert numbers.dtype == np.int64
    assert np.array_equal(numbers, expected)


def test_gains_are_drawn_anew_in_every_epoch_and_are_the_same_for_both(
    stores: dict[str, Path],
) -> None:
    plain = SegmentDataset(stores[".zarr"], "synthetic", "real")
    louder = SegmentDataset(stores[".zarr"], "synthetic", "real", gain_db=6.0)
    found = []
    for epoch in (0, 1, 0):
        louder.set_epoch(epoch)
        ratios = [(louder[k][0] / plain[k][0]).numpy() for k in range(5)]
        targets = [(louder[k][1] / plain[k][1]).numpy() for k in range(5)]
        gains = np.array([np.median(one) for one in ratios])
        for gain, one, other in zip(gains, ratios, targets, strict=True):
            np.testing.assert_allclose([one, other], gain, rtol=1e-5)
        assert (np.abs(10 * np.log10(gains)) <= 6.0 + 1e-5).all()
        found.append(gains.tolist())
    assert found[0] == found[2] != found[1]
    assert len(set(found[0])) == 5


def test_limb_maps_are_items_where_there_is_a_synthetic_map(tmp_path: Path) -> None:
    sources = [
        source("r1", "s1", kinds=("synthetic", "real"), limbs=True),
        source("r2", "s1", kinds=("real",)),
    ]
    options = Exporting(segment_frames=24, overlap_frames=4, limbs=True)
    write_dataset(tmp_path / "set.zarr", sources, options)
    data = SegmentDataset(tmp_path / "set.zarr", "limbs", "synthetic", gain_db=3)
    assert 0 < len(data) == len(SegmentDataset(tmp_path / "set.zarr", "synthetic", "limbs"))
    assert len(data) < len(SegmentDataset(tmp_path / "set.zarr", "real", "label"))
    for limbs, whole in data:
        assert limbs.shape == (24, 9, 8)
        torch.testing.assert_close(limbs.sum(dim=1), whole)
    for louder, plain in (("limbs", "kinematics"), ("kinematics", "limbs")):  # m/s have no gain
        one = SegmentDataset(tmp_path / "set.zarr", louder, plain, gain_db=3)[0]
        moves = SegmentDataset(tmp_path / "set.zarr", "kinematics", "label")[0][0]
        assert torch.equal(one[(louder, plain).index("kinematics")], moves)


def test_it_can_be_pickled_while_open(stores: dict[str, Path]) -> None:
    data = SegmentDataset(stores[".h5"], "synthetic", "label")
    first = data[0]
    again = pickle.loads(pickle.dumps(data))
    assert torch.equal(again[0][0], first[0])
    assert len(pickle.dumps(data)) < 10_000


def test_what_is_not_there_is_named(stores: dict[str, Path]) -> None:
    with pytest.raises(Sd2Error, match="has no simulated maps"):
        SegmentDataset(stores[".zarr"], "simulated")
    with pytest.raises(Sd2Error, match="has no limbs"):
        SegmentDataset(stores[".zarr"], "limbs")
    with pytest.raises(Sd2Error, match=r"No segment in .* has denoised and real"):
        SegmentDataset(stores[".zarr"], "denoised", "real")
    with pytest.raises(Sd2Error, match="one of train, validation, test"):
        SegmentDataset(stores[".zarr"], "denoised", split="all")
