"""TI's radars by a DCA1000: a known target in every layout, and what does not fit."""

from __future__ import annotations

import json
import os
import resource
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.fmcw import doppler_map, range_doppler
from sd2core.io.kinds import kind_of
from sd2core.io.radar import companions, holds_map, load_capture
from sd2core.sensor import VelocityAxis
from tests.core.io.radar.dca1000_files import (
    C_MPS,
    TiRecording,
    cfg_of,
    json_of,
    pymmw_of,
    words_of,
    write_ti,
)

PLAIN = TiRecording()
_numbers = count()

recordings = st.builds(
    TiRecording,
    samples=st.sampled_from([24, 32, 52]),
    loops=st.just(64),  # velocities are several bins: their sign is told apart
    receivers=st.integers(1, 4),
    transmitters=st.integers(1, 3),
    lanes=st.sampled_from([2, 4]),
    output=st.sampled_from([0, 1, 2]),
    q_first=st.booleans(),
    falling=st.booleans(),
    velocity_mps=st.floats(2.0, 7.0).flatmap(lambda v: st.sampled_from([v, -v])),
    range_m=st.floats(1.5, 2.6),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(recording=recordings, parts=st.integers(1, 3), studio=st.booleans())
def test_a_target_is_where_it_is_and_moves_as_it_does(
    tmp_path: Path, recording: TiRecording, parts: int, studio: bool
) -> None:
    path = write_ti(tmp_path / str(next(_numbers)), recording, parts=parts, studio=studio)
    capture = load_capture(path)
    config = capture.config
    assert (config.receivers, config.transmitters) == (recording.receivers, recording.transmitters)
    assert capture.frame_count == recording.frames
    bandwidth_hz = 60e12 * recording.samples / 4e6
    sign = -1.0 if recording.falling else 1.0
    middle_hz = 60e9 + sign * (60e12 * 5e-6 + 0.5 * bandwidth_hz)
    assert config.wavelength_m == pytest.approx(C_MPS / middle_hz)
    assert config.range_resolution_m == pytest.approx(C_MPS / (2.0 * bandwidth_hz))
    assert config.v_max_mps == pytest.approx(
        C_MPS / middle_hz / (4.0 * recording.chirp_s * recording.transmitters)
    )
    found = range_doppler(capture, 1)
    gate, bin_ = np.unravel_index(found.values.argmax(), found.values.shape)
    middle_s = recording.frame_s + 0.5 * 64 * recording.transmitters * recording.chirp_s
    there_m = recording.range_m - recording.velocity_mps * middle_s
    assert abs(found.range_m[gate] - there_m) < 0.75 * config.range_resolution_m
    folded_mps = (recording.velocity_mps + config.v_max_mps) % (
        2.0 * config.v_max_mps
    ) - config.v_max_mps
    off_mps = abs(found.axis.centres_mps[bin_] - folded_mps)
    off_mps = min(off_mps, 2.0 * config.v_max_mps - off_mps)
    assert off_mps < 1.1 * config.velocity_resolution_mps
    # Channels have phases of their own: only a mean of powers keeps the amplitude, 8000 counts.
    # A sine's one-sided power is as much as a phasor's.
    power = float(doppler_map(capture).values[:, 1].sum())
    assert power == pytest.approx((8000 / 32768) ** 2, rel=0.1)


@pytest.mark.parametrize("lanes", [2, 4])
@pytest.mark.parametrize("output", [0, 1])
def test_every_sample_comes_back_in_its_place(tmp_path: Path, lanes: int, output: int) -> None:
    recording = replace(PLAIN, receivers=4, transmitters=3, lanes=lanes, output=output)
    capture = load_capture(write_ti(tmp_path, recording, parts=2))
    beat = np.rint(8000.0 * recording.beat()) / 32768.0
    # (frames, loops, transmitters, receivers, samples) to (frames, channels, chirps, samples)
    expected = beat.transpose(0, 2, 3, 1, 4).reshape(3, 12, 16, 32)
    found = capture.read(0, 3)
    np.testing.assert_array_equal(found, expected.real if output == 0 else expected)
    np.testing.assert_array_equal(capture.read(1, 2), found[1:2])
    one = capture.channel(receiver=2, transmitter=3)
    np.testing.assert_array_equal(one.read(0, 3), found[:, 9:10])
    assert (one.config.receivers, one.config.transmitters) == (1, 1)
    assert one.config.v_max_mps == capture.config.v_max_mps
    assert "Receiver 2 only." in one.notes
    of_one = capture.channel(transmitter=2)
    np.testing.assert_array_equal(of_one.read(0, 3), found[:, 4:8])


@pytest.mark.parametrize("lanes", [2, 4])
def test_a_profile_of_pymmw_opens_as_the_cfg_that_it_sends(tmp_path: Path, lanes: int) -> None:
    recording = replace(PLAIN, receivers=2, transmitters=3, lanes=lanes, loops=8)
    path = write_ti(tmp_path, recording)
    sent = load_capture(path)
    path.with_suffix(".cfg").unlink()
    named = tmp_path / f"mmw-xWR{14 if lanes == 4 else 18}xx.cfg"
    named.write_text(pymmw_of(recording))
    kept = load_capture(path)
    assert kept.config == sent.config
    assert kept.meta["lanes"] == lanes
    np.testing.assert_array_equal(kept.samples[:], sent.samples[:])


def test_a_map_of_all_channels_is_the_mean_of_theirs(tmp_path: Path) -> None:
    capture = load_capture(write_ti(tmp_path, replace(PLAIN, transmitters=2)))
    axis = VelocityAxis(32, 2.0)
    each = [
        doppler_map(capture.channel(receiver, transmitter), axis=axis).values
        for transmitter in (1, 2)
        for receiver in (1, 2)
    ]
    found = doppler_map(capture, axis=axis)
    np.testing.assert_allclose(found.values, np.mean(each, axis=0), rtol=1e-4, atol=1e-9)
    assert found.carrier_hz == capture.config.centre_frequency_hz
    with pytest.raises(
        Sd2Error, match=r"Receiver 3 of .*walk\.bin is asked for\. Expected: 1 to 2"
    ):
        capture.channel(receiver=3)


def test_what_was_assumed_is_said(tmp_path: Path) -> None:
    notes = " ".join(load_capture(write_ti(tmp_path / "a", replace(PLAIN, transmitters=2))).notes)
    assert "2 transmitters take turns" in notes
    assert "divides v_max by 2" in notes
    assert "The file has no times" in notes
    path = write_ti(tmp_path / "b", PLAIN)
    path.with_suffix(".cfg").write_text(cfg_of(PLAIN, comment=""))
    assert any("does not say its platform" in note for note in load_capture(path).notes)


def test_unsigned_words_are_noticed(tmp_path: Path) -> None:
    path = write_ti(tmp_path / "a", PLAIN)
    plain = load_capture(path).read(0, 3)
    words = np.fromfile(path, "<i2")
    (words.view("<u2") + np.uint16(0x8000)).tofile(path)
    capture = load_capture(path)
    assert any("taken for uint16 counts around 32,768" in note for note in capture.notes)
    np.testing.assert_array_equal(capture.read(0, 3), plain)
    (words // 16 + 2048).astype("<i2").tofile(path)  # 12 bits around their own middle
    assert any("look like unsigned counts" in note for note in load_capture(path).notes)
    words.tofile(path)
    assert not any("unsigned" in note or "uint16" in note for note in load_capture(path).notes)


def test_a_folder_and_any_part_open_the_whole(tmp_path: Path) -> None:
    path = write_ti(tmp_path / "walk", PLAIN, parts=3)
    assert kind_of(path) == kind_of(path.parent) == "radar"
    assert not holds_map(path)
    whole = load_capture(path.parent)
    assert whole.frame_count == load_capture(path.with_name("walk_Raw_2.bin")).frame_count == 3
    assert {one.name for one in companions(path)} == {
        "walk_Raw_1.bin",
        "walk_Raw_2.bin",
        "walk.cfg",
    }


def _endless(path: Path) -> None:
    path.with_suffix(".cfg").write_text(cfg_of(replace(PLAIN, frames=0)))
    with path.open("ab") as stream:
        stream.write(bytes(10))


def test_a_recording_that_was_stopped_by_hand_is_read_up_to_its_last_frame(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN)
    _endless(path)
    capture = load_capture(path)
    assert capture.frame_count == 3
    assert any("The last 10 bytes are no whole frame" in note for note in capture.notes)
    path.with_suffix(".cfg").write_text(cfg_of(replace(PLAIN, frames=9)))
    os.truncate(path, path.stat().st_size - 10)
    assert any(
        "There are 3 frames; walk.cfg asks for 9" in note for note in load_capture(path).notes
    )


def _cfg(**changes: str) -> Callable[[Path], object]:
    return lambda path: path.with_suffix(".cfg").write_text(cfg_of(PLAIN, **changes))


def _json(edit: Callable[[dict], object]) -> Callable[[Path], object]:
    def change(path: Path) -> None:
        content = json_of(PLAIN)
        edit(content["mmWaveDevices"][0])
        path.with_suffix(".cfg").unlink()
        path.with_suffix(".mmwave.json").write_text(json.dumps(content))

    return change


def _together(device: dict[str, Any]) -> None:
    """Have two transmitters send together in two chirps of a loop."""
    device["rfConfig"]["rlChirps"] = [
        {
            "rlChirpCfg_t": {
                "chirpStartIdx": 0,
                "chirpEndIdx": 1,
                "profileId": 0,
                "txEnable": "0x3",
            }
        }
    ]
    device["rfConfig"]["rlFrameCfg_t"] |= {"chirpEndIdx": 1, "numLoops": 8}


def _coded(device: dict[str, Any], name: str, **phases: object) -> None:
    """Give the second chirp of a loop phases of its own."""
    inner = {"rlBpmChirps": "rlBpmChirpCfg_t", "rlRfPhaseShiftCfgs": "rlRfPhaseShiftCfg_t"}[name]
    told = {"chirpStartIdx": 1, "chirpEndIdx": 1, **phases}
    device["rfConfig"][name] = [{inner: told}]


MISMATCHES: dict[str, tuple[Callable[[Path], object], str]] = {
    "no configuration": (
        lambda path: path.with_suffix(".cfg").unlink(),
        r"walk\.bin has 0 configurations beside it",
    ),
    "two configurations": (
        lambda path: [
            path.with_suffix(".cfg").rename(path.with_name("a.cfg")),
            path.with_name("b.cfg").write_text(""),
        ],
        r"has 2 configurations beside it: a\.cfg, b\.cfg",
    ),
    "other samples": (
        _cfg(profileCfg="profileCfg 0 60 20 5 30 0 0 60 1 30 4000 0 0 30"),
        r"walk\.bin has 12,288 bytes in 1 parts\. Expected: frames of 3,840 bytes \(16 chirps x"
        r" 2 receivers x 30 complex samples\), as walk\.cfg says",
    ),
    "an odd number of samples": (
        lambda path: path.with_suffix(".cfg").write_text(
            cfg_of(replace(PLAIN, receivers=1, samples=31))
        ),
        r"walk\.cfg: 31 complex samples of 1 receivers do not fill 2 lanes",
    ),
    "fewer receivers": (
        _cfg(channelCfg="channelCfg 1 1 0"),
        r"walk\.bin has 12,288 bytes, 6 frames\. Expected: 3 frames of 2,048 bytes",
    ),
    "no receiver": (_cfg(channelCfg="channelCfg 0 1 0"), r"walk\.cfg: No receiver is enabled"),
    "cut off": (
        lambda path: os.truncate(path, 5000),
        r"walk\.bin has 5,000 bytes in 1 parts\. Expected: frames of 4,096 bytes",
    ),
    "half a word": (lambda path: os.truncate(path, 4097), r"walk\.bin has 4,097 bytes"),
    "empty": (lambda path: os.truncate(path, 0), r"walk\.bin has 0 bytes"),
    "headers": (
        _cfg(lvdsStreamCfg="lvdsStreamCfg -1 1 1 0"),
        r"walk\.cfg: lvdsStreamCfg sends a header",
    ),
    "interleaved over two lanes": (
        _cfg(adcbufCfg="adcbufCfg -1 0 0 0 1"),
        r"walk\.cfg: Receivers are interleaved over 2 lanes",
    ),
    "sends samples with parameters of chirps": (
        _cfg(lvdsStreamCfg="lvdsStreamCfg -1 0 4 0"),
        r"walk\.cfg: lvdsStreamCfg sends other data",
    ),
    "a subframe before too few values": (
        _cfg(adcbufCfg="adcbufCfg -1 0 1 1"),
        r"walk\.cfg: adcbufCfg is -1 0 1 1\. Expected: .* 0 or 1",
    ),
    "transmitters that take turns in pairs": (
        _cfg(bpmCfg="bpmCfg -1 1 0 1"),
        r"walk\.cfg: bpmCfg reverses a transmitter .*TDM",
    ),
    "the same, of the first SDK": (_cfg(bpmCfg="bpmCfg 1 0 1"), r"walk\.cfg: bpmCfg reverses"),
    "the same in mmWave Studio": (
        _json(lambda d: _together(d) or _coded(d, "rlBpmChirps", constBpmVal="0x20")),
        r"walk\.mmwave\.json: rlBpmChirps gives transmitters other phases",
    ),
    "phases shifted from chirp to chirp": (
        _json(lambda d: _together(d) or _coded(d, "rlRfPhaseShiftCfgs", tx1PhaseShift=90.0)),
        r"walk\.mmwave\.json: rlRfPhaseShiftCfgs gives transmitters other phases",
    ),
    "JSON of something else": (
        lambda path: path.with_suffix(".cfg").write_text('{"answer": 42}'),
        r"walk\.cfg: There is no channelCfg\. Expected: a \.cfg .* or JSON of pymmw",
    ),
    "JSON that is torn": (
        lambda path: path.with_suffix(".cfg").write_text('{"channelCfg": {"rxMask": 15'),
        r"walk\.cfg cannot be read as JSON",
    ),
    "more antennas than a radar has": (
        lambda path: path.with_suffix(".cfg").write_text(pymmw_of(PLAIN, rxAntennas=5)),
        r"walk\.cfg: rxAntennas is 5\. Expected: 1 to 4",
    ),
    "masks by a number of antennas that is not there": (
        lambda path: path.with_suffix(".cfg").write_text(pymmw_of(PLAIN, rxAntennas=None)),
        r"walk\.cfg: channelCfg is 'null 1 0'",
    ),
    "12 bits": (_cfg(adcCfg="adcCfg 0 1"), r"walk\.cfg: The number of bits of the converter is 0"),
    "pseudo real": (_cfg(adcCfg="adcCfg 2 3"), r"walk\.cfg: The output format .* is 3"),
    "frames of several kinds": (
        _cfg(extra="advFrameCfg 2 0 1 1 0"),
        r"walk\.cfg: advFrameCfg makes frames of several kinds",
    ),
    "half a receiver": (
        _cfg(channelCfg="channelCfg 1.5 1 0"),
        r"walk\.cfg: .*is 1\.5\. Expected: a whole number",
    ),
    "a rate in Msps": (
        _cfg(profileCfg="profileCfg 0 60 20 5 30 0 0 60 1 32 4 0 0 30"),
        r"walk\.cfg: 32 samples at 4000 Hz .* end long after the chirp",
    ),
    "a frequency in Hz": (
        _cfg(profileCfg="profileCfg 0 60e9 20 5 30 0 0 60 1 32 4000 0 0 30"),
        r"walk\.cfg: profileCfg is .*in the units of the SDK",
    ),
    "no profile": (_cfg(profileCfg=""), r"walk\.cfg: There is no profileCfg"),
    "words for numbers": (_cfg(frameCfg="frameCfg a b"), r"walk\.cfg: frameCfg is 'a b'"),
    "a chirp too few": (
        _cfg(frameCfg="frameCfg 0 1 16 3 20 1 0"),
        r"walk\.cfg: Chirp 1 of a loop is not configured",
    ),
    "both at once, and one": (
        _cfg(
            chirpCfg0="chirpCfg 0 0 0 0 0 0 0 3\nchirpCfg 1 1 0 0 0 0 0 1",
            frameCfg="frameCfg 0 1 8 3 20 1 0",
        ),
        r"walk\.cfg: Chirps of a loop are sent by the transmitters 0x3, 0x1",
    ),
    **{
        f"another {what}": (
            _cfg(
                chirpCfg0=f"chirpCfg 0 0 0 0 0 0 0 1\nchirpCfg 1 1 0 {varied} 1",
                frameCfg="frameCfg 0 1 8 3 20 1 0",
            ),
            r"walk\.cfg: Chirps of a loop differ in profile, frequency, slope or times",
        )
        for what, varied in {
            "frequency": "0.1 0 0 0",
            "slope": "0 1 0 0",
            "idle time": "0 0 5 0",
            "start of samples": "0 0 0 1",
        }.items()
    },
    "a frame too short": (
        _cfg(frameCfg="frameCfg 0 0 16 3 0.5 1 0"),
        r"walk\.cfg: 16 chirps of 5e-05 s do not fit into a frame",
    ),
    "another profile": (
        _cfg(chirpCfg0="chirpCfg 0 0 1 0 0 0 0 1"),
        r"walk\.cfg: Chirps are of profile 1",
    ),
    "three lanes": (
        _json(lambda d: d["rawDataCaptureConfig"]["rlDevLaneEnable_t"].update(laneEn="0x7")),
        r"walk\.mmwave\.json: laneEn enables 3 lanes",
    ),
    "no mask": (
        _json(lambda d: d["rfConfig"]["rlChanCfg_t"].update(rxChannelEn="all")),
        r"walk\.mmwave\.json: rxChannelEn is 'all'",
    ),
    "no frames": (
        _json(lambda d: d["rfConfig"].pop("rlFrameCfg_t")),
        r"walk\.mmwave\.json: .*rlFrameCfg_t is missing",
    ),
}


@pytest.mark.parametrize("mismatch", MISMATCHES)
def test_what_does_not_fit_is_refused_in_a_sentence(tmp_path: Path, mismatch: str) -> None:
    change, sentence = MISMATCHES[mismatch]
    path = write_ti(tmp_path, PLAIN)
    change(path)
    with pytest.raises(Sd2Error, match=f"(?s){sentence}"):
        load_capture(path)


def test_a_missing_part_is_named(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN, parts=3)
    path.with_name("walk_Raw_1.bin").unlink()
    with pytest.raises(Sd2Error, match=r"has no walk_Raw_1\.bin"):
        load_capture(path)
    (tmp_path / "other.bin").touch()
    with pytest.raises(Sd2Error, match=r"holds 2 recordings of a DCA1000 \(other, walk\)"):
        load_capture(tmp_path)


def test_gigabytes_open_at_once_and_are_read_by_frames(tmp_path: Path) -> None:
    recording = replace(PLAIN, frames=0)
    path = write_ti(tmp_path, replace(PLAIN, frames=1))
    path.with_suffix(".cfg").write_text(cfg_of(recording))
    size = 6 * 10**9 // 4096 * 4096
    os.truncate(path, size)  # sparse: zeros after the first frame
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    capture = load_capture(path)
    assert capture.frame_count == size // 4096
    assert np.abs(capture.read(0, 1)).max() > 0.2
    assert not capture.read(capture.frame_count - 2, capture.frame_count).any()
    used_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb
    assert used_kb < 300_000


def test_the_words_of_the_writer_are_those_of_the_data_sheet() -> None:
    """Two lanes, four samples: I0 I1 Q0 Q1 I2 I3 Q2 Q3; four lanes, four receivers: I, then Q."""
    beat = (np.arange(1, 5) + 1j * np.arange(5, 9)) / 8000.0
    two = replace(PLAIN, receivers=1, samples=4)
    assert words_of(two, beat).tolist() == [1, 2, 5, 6, 3, 4, 7, 8]
    assert words_of(replace(two, q_first=True), beat).tolist() == [5, 6, 1, 2, 7, 8, 3, 4]
    four = replace(two, receivers=4, samples=1, lanes=4)
    assert words_of(four, beat).tolist() == [1, 2, 3, 4, 5, 6, 7, 8]


@pytest.mark.parametrize("q_first", [False, True])
@pytest.mark.parametrize("lanes", [2, 4])
def test_adcbuf_of_four_values_says_the_same_as_that_of_five(
    tmp_path: Path, lanes: int, q_first: bool
) -> None:
    recording = replace(PLAIN, lanes=lanes, receivers=4, q_first=q_first)
    path = write_ti(tmp_path, recording)
    five = load_capture(path).read(0, 3)
    four = f"adcbufCfg 0 {int(q_first)} {int(lanes == 2)} 1"
    path.with_suffix(".cfg").write_text(cfg_of(recording, adcbufCfg=four))
    assert (load_capture(path).read(0, 3) == five).all()
    # Interleaving tells the number of lanes where no platform does.
    path.with_suffix(".cfg").write_text(cfg_of(recording, adcbufCfg=four, comment=""))
    capture = load_capture(path)
    assert (capture.read(0, 3) == five).all()
    assert f"{lanes} lanes of LVDS are assumed" in " ".join(capture.notes)


def test_codes_that_are_off_or_the_same_in_all_chirps_are_read(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN)
    plain = load_capture(path).read(0, 3)
    path.with_suffix(".cfg").write_text(cfg_of(PLAIN, bpmCfg="bpmCfg -1 0 0 1"))
    assert (load_capture(path).read(0, 3) == plain).all()
    path.with_suffix(".cfg").unlink()
    content = json_of(PLAIN)
    _together(content["mmWaveDevices"][0])
    _coded(content["mmWaveDevices"][0], "rlBpmChirps", constBpmVal="0x0")
    path.with_suffix(".json").write_text(json.dumps(content))
    assert (load_capture(path).read(0, 3) == plain).all()


@pytest.mark.parametrize("encoding", ["gbk", "shift_jis", "utf-16"])
def test_comments_of_a_cfg_may_be_in_any_encoding(tmp_path: Path, encoding: str) -> None:
    path = write_ti(tmp_path, PLAIN)
    plain = load_capture(path).read(0, 3)
    lines = cfg_of(PLAIN, note="% 实验 一", other="// 帧").replace(" 1 0\n", " 1 0 % 表示\n")
    path.with_suffix(".cfg").write_bytes(lines.encode(encoding, "replace"))
    assert (load_capture(path).read(0, 3) == plain).all()


def test_a_terminals_log_is_read_as_the_commands_in_it(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN)
    lines = (f"mmwDemo:/>{line}\nDone" for line in cfg_of(PLAIN).splitlines())
    sent = load_capture(path)
    path.with_suffix(".cfg").write_text("\n".join(lines))
    assert load_capture(path).config == sent.config


def test_the_configuration_of_mmwave_studio_may_be_called_cfg(tmp_path: Path) -> None:
    path = write_ti(tmp_path, PLAIN, studio=True)
    plain = load_capture(path).read(0, 3)
    (tmp_path / "walk.mmwave.json").rename(tmp_path / "walk.cfg")
    assert (load_capture(path).read(0, 3) == plain).all()
