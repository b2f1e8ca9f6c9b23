"""The receiver and transmitter that a recording chooses hold wherever its capture is used."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from swinging_recordings import recording

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import Origin, inspect, known_inspection
from sd2core.cli.recording_maps import maps_of
from sd2core.datasets.recording_sources import Making, radar_map, recording_sources
from sd2core.errors import Sd2Error
from sd2core.fmcw import doppler_map
from sd2core.io.radar import load_capture
from sd2core.mocap.recording_pairs import make_recording_pairs
from sd2core.pairs.store import read_pairs
from sd2core.progress import silent
from sd2core.recording.recording import Recording, open_recording
from sd2core.sensor import VelocityAxis
from tests.core.io.radar.dca1000_files import TiRecording, write_ti


def silent_second(folder: Path) -> Recording:
    """Recording of a radar with two receivers, the second of which receives nothing."""
    return recording(folder, silent_receivers=1)


def by_radar_map(one: Recording, _: Path) -> NDArray[np.float32]:
    return radar_map(one, VelocityAxis()).values


def by_commands(one: Recording, _: Path) -> NDArray[np.float32]:
    return maps_of(one, ("radar",))["radar"].values


def by_sources(one: Recording, _: Path) -> NDArray[np.float32]:
    (source,) = recording_sources([one.folder], ["anna"], Making(kinds=("simulated",)))
    return source.load(silent).maps["simulated"].values


def by_pairs(one: Recording, folder: Path) -> NDArray[np.float32]:
    folder.mkdir()
    make_recording_pairs([one.folder], folder / "pairs.zarr")
    return np.concatenate([take.radar for take in read_pairs(folder / "pairs.zarr").takes])


@pytest.mark.parametrize("user", [by_radar_map, by_commands, by_sources, by_pairs])
def test_every_user_takes_the_channel_that_is_chosen(
    tmp_path: Path, user: Callable[[Recording, Path], NDArray[np.float32]]
) -> None:
    one = silent_second(tmp_path / "anna.sd2")
    both = user(one, tmp_path / "both")
    one.radar_receiver = 1
    one.save()
    # The mean power of both is half of that of the one that receives something.
    assert both.max() > 0
    np.testing.assert_allclose(user(one, tmp_path / "first"), 2.0 * both, rtol=1e-5)
    one.radar_receiver = 2
    one.save()
    assert not user(one, tmp_path / "second").any()


def test_what_is_made_of_it_says_so(tmp_path: Path) -> None:
    one = silent_second(tmp_path / "anna.sd2")
    by_pairs(one, tmp_path / "all")
    one.radar_receiver = 1
    one.save()
    by_pairs(one, tmp_path / "one")
    told = [read_pairs(tmp_path / name / "pairs.zarr").provenance for name in ("all", "one")]
    assert [one.get("radar_channels") for one in told] == [None, ["receiver 1"]]
    with pytest.raises(Sd2Error, match=r"pairs\.zarr"):  # pairs of both channels do not mix
        make_recording_pairs([one.folder], tmp_path / "all" / "pairs.zarr")
    (source,) = recording_sources([one.folder], ["anna"], Making(kinds=("simulated",)))
    assert source.load(silent).made_of()["radar_channel"] == "receiver 1"


def test_it_is_stored_and_absent_in_older_files(tmp_path: Path) -> None:
    one = silent_second(tmp_path / "anna.sd2")
    one.radar_receiver, one.radar_transmitter = 2, 1
    one.save()
    read = open_recording(one.folder)
    assert (read.radar_receiver, read.radar_transmitter) == (2, 1)
    assert read.channel_in_words == "receiver 2, transmitter 1"
    file = one.folder / "recording.json"
    content = json.loads(file.read_text())
    del content["radar_receiver"], content["radar_transmitter"]
    file.write_text(json.dumps(content))
    assert open_recording(one.folder).channel_in_words == ""
    for wrong in (0, -1, "left"):
        file.write_text(json.dumps(content | {"radar_receiver": wrong}))
        with pytest.raises(Sd2Error, match="radar_receiver"):
            open_recording(one.folder)


def test_a_channel_that_is_not_there_is_refused(tmp_path: Path) -> None:
    one = silent_second(tmp_path / "anna.sd2")
    one.radar_receiver = 3
    with pytest.raises(Sd2Error, match=r"Receiver 3 .*\n?.*1 to 2"):
        one.load_capture()
    assert one.load_every_channel().config.receivers == 2
    assert one.load_capture(receiver=2).config.receivers == 1  # in place of the choice


@pytest.mark.parametrize(("receiver", "transmitter"), [(2, None), (None, 2), (1, 2)])
def test_it_is_the_channel_of_the_capture(
    tmp_path: Path, receiver: int | None, transmitter: int | None
) -> None:
    path = write_ti(tmp_path / "ti", TiRecording(transmitters=2))
    one = Recording(
        tmp_path / "a.sd2", radar=path, radar_receiver=receiver, radar_transmitter=transmitter
    )
    expected = doppler_map(load_capture(path).channel(receiver, transmitter))
    found = doppler_map(one.save_as(one.folder).load_capture())
    assert np.array_equal(found.values, expected.values)
    assert not np.array_equal(found.values, doppler_map(load_capture(path)).values)


def test_what_was_made_of_another_channel_is_made_again(tmp_path: Path) -> None:
    one = silent_second(tmp_path / "anna.sd2")

    batch, origin = BatchFolder(tmp_path / "made"), Origin(str(one.folder), "anna.sd2", "anna")

    def identities() -> tuple[str, str]:
        (source,) = recording_sources([one.folder], ["anna"], Making())
        return source.fingerprint(), inspect(batch, origin).about

    before = identities()
    assert identities() == before
    one.radar_receiver = 1
    one.save()
    assert known_inspection(batch, origin) is None
    assert all(now != then for now, then in zip(identities(), before, strict=True))
