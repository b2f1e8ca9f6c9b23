"""Files that lie beside a capture are no captures of their own."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np
from dca1000_files import TiRecording, write_ti

from sd2core.io.radar import companions, without_companions
from sd2core.io.radar.described import RadarDescription, write_description


def test_of_a_dca1000s_files_the_first_part_is_left(tmp_path: Path) -> None:
    whole = write_ti(tmp_path / "ti", TiRecording(transmitters=2))
    first, second = (whole.with_name(f"walk_Raw_{number}.bin") for number in (0, 1))
    second.write_bytes(b"")
    whole.rename(first)
    beside = companions(first)
    assert len(beside) == 2
    video = tmp_path / "walk.mp4"
    for order in permutations([first, *beside, video]):
        left = without_companions(order)
        assert len(left) == 2
        assert video in left
        assert left[1 - left.index(video)].suffix == ".bin"


def test_a_description_belongs_to_its_samples(tmp_path: Path) -> None:
    path = tmp_path / "wave.npy"
    np.save(path, np.ones((3, 20, 1), np.complex64))
    wave = RadarDescription(
        axes=("frame", "chirp", "sample"),
        carrier_hz=5.8e9,
        bandwidth_hz=0.0,
        chirp_repetition_s=1e-3,
        frame_repetition_s=0.05,
    )
    description = write_description(wave, path)
    assert without_companions([description, path]) == [path]
    assert without_companions([path, path.with_name("other.npz")]) == [
        path,
        path.with_name("other.npz"),
    ]
