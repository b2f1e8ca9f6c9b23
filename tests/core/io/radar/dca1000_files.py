"""Recordings of a DCA1000 in the published order of the words, with a configuration beside them.

The words are laid out one after the other by loops over chirps, receivers and samples, as TI's
*Mmwave Radar Device ADC Raw Data Capture* (SWRA581B) draws them, and not by the reader's own
reshaping. The target is a closed form.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

C_MPS = 299_792_458.0
START_HZ, SLOPE_HZ_PER_S, RATE_HZ, IDLE_S, RAMP_S, ADC_START_S = (
    60e9,
    60e12,
    4e6,
    20e-6,
    30e-6,
    5e-6,
)


@dataclass(frozen=True)
class TiRecording:
    """Radar and target of a recording."""

    samples: int = 32
    loops: int = 16
    receivers: int = 2
    transmitters: int = 1
    frames: int = 3
    lanes: int = 2
    output: int = 1  # 0: real, 1: complex, 2: complex with image band
    q_first: bool = False
    falling: bool = False
    range_m: float = 1.6
    velocity_mps: float = 1.5  # approaching
    frame_s: float = 20e-3

    @property
    def chirp_s(self) -> float:
        """Time between chirps of any transmitter."""
        return IDLE_S + RAMP_S

    @property
    def slope_hz_per_s(self) -> float:
        """Slope of the chirps."""
        return -SLOPE_HZ_PER_S if self.falling else SLOPE_HZ_PER_S

    def beat(self) -> NDArray[np.complex128]:
        """Beat of the target, (frames, loops, transmitters, receivers, samples).

        Phase 2 pi (f tau + S tau t) of the distance at every chirp. The phase of a channel is its
        own, so that only powers add up.
        """
        frame, loop, turn, receiver, sample = np.ogrid[
            : self.frames, : self.loops, : self.transmitters, : self.receivers, : self.samples
        ]
        at_s = frame * self.frame_s + (loop * self.transmitters + turn) * self.chirp_s
        delay_s = 2.0 * (self.range_m - self.velocity_mps * at_s) / C_MPS
        frequency_hz = START_HZ + self.slope_hz_per_s * (ADC_START_S + sample / RATE_HZ)
        return np.exp(2j * np.pi * (frequency_hz * delay_s + 0.17 * receiver + 0.31 * turn))


def words_of(recording: TiRecording, beat: NDArray[np.complex128]) -> NDArray[np.int16]:
    """Samples, up to 1 in size, as words in the order of the file."""
    counts = np.rint(8000.0 * beat)
    words: list[NDArray[np.float64]] = []
    for chirp in counts.reshape(-1, recording.receivers, recording.samples):
        # Two lanes: one receiver after the other; four: all receivers of a sample.
        flat = chirp.ravel() if recording.lanes == 2 else chirp.T.ravel()
        if recording.output == 0:
            words.append(flat.real)
            continue
        for start in range(0, len(flat), recording.lanes):
            together = flat[start : start + recording.lanes]
            parts = (together.real, together.imag)
            words += reversed(parts) if recording.q_first else parts
    return np.concatenate(words).astype("<i2")


def cfg_of(recording: TiRecording, **changes: str) -> str:
    """Configuration of the SDK; ``changes`` are whole lines by command, empty ones leave it out."""
    platform = "xWR14xx" if recording.lanes == 4 else "xWR68xx"
    receivers, transmitters = 2**recording.receivers - 1, 2**recording.transmitters - 1
    slope = recording.slope_hz_per_s / 1e12
    lines = {
        "comment": f"% Platform:{platform}",
        "channelCfg": f"channelCfg {receivers} {transmitters} 0",
        "adcCfg": f"adcCfg 2 {recording.output}",
        "adcbufCfg": f"adcbufCfg -1 {int(recording.output == 0)} {int(recording.q_first)}"
        f" {int(recording.lanes == 2)} 1",
        "profileCfg": f"profileCfg 0 60 20 5 30 0 0 {slope:g} 1 {recording.samples} 4000 0 0 30",
    }
    for turn in range(recording.transmitters):
        lines[f"chirpCfg{turn}"] = f"chirpCfg {turn} {turn} 0 0 0 0 0 {2**turn}"
    lines["frameCfg"] = (
        f"frameCfg 0 {recording.transmitters - 1} {recording.loops} {recording.frames}"
        f" {1e3 * recording.frame_s:g} 1 0"
    )
    lines["lvdsStreamCfg"] = "lvdsStreamCfg -1 0 1 0"
    return "\n".join((lines | changes).values()) + "\n"


_NULLS = {
    "channelCfg": ["rxMask", "txMask", "cascading"],
    "adcCfg": ["adcBits"],
    "adcbufCfg": ["subFrameIndex"],
    "lvdsStreamCfg": ["subFrameIndex"],
}


def pymmw_of(recording: TiRecording, **settings: object) -> str:
    """Profile of pymmw: every command a table, nulls where it fills in, chirps under one name."""
    commands = ['"_settings_": ' + json.dumps({"rxAntennas": recording.receivers} | settings)]
    for line in cfg_of(recording, comment="").strip().splitlines():
        name, *words = line.split()
        entries = {f"value{place}": json.loads(word) for place, word in enumerate(words)}
        nulls = dict.fromkeys(_NULLS.get(name, []))
        entries = nulls | dict(list(entries.items())[len(nulls) :])
        if name == "chirpCfg":
            mask = entries.popitem()
            variation = dict(entries.popitem() for _ in range(4))
            entries |= {"variation": variation, mask[0]: mask[1]}
        commands.append(f"{json.dumps(name)}: {json.dumps(entries)}")
    return "{" + ", ".join(commands) + "}"


def json_of(recording: TiRecording) -> dict[str, Any]:
    """Configuration of mmWave Studio."""
    profile = {
        "profileId": 0,
        "startFreqConst_GHz": 60.0,
        "idleTimeConst_usec": 20.0,
        "adcStartTimeConst_usec": 5.0,
        "rampEndTime_usec": 30.0,
        "freqSlopeConst_MHz_usec": recording.slope_hz_per_s / 1e12,
        "numAdcSamples": recording.samples,
        "digOutSampleRate": 4000,
    }
    chirps = [
        {
            "rlChirpCfg_t": {
                "chirpStartIdx": turn,
                "chirpEndIdx": turn,
                "profileId": 0,
                "txEnable": hex(2**turn),
            }
        }
        for turn in range(recording.transmitters)
    ]
    device = {
        "mmWaveDeviceId": 0,
        "rfConfig": {
            "rlChanCfg_t": {"rxChannelEn": hex(2**recording.receivers - 1), "txChannelEn": "0x7"},
            "rlAdcOutCfg_t": {"fmt": {"b2AdcBits": 2, "b2AdcOutFmt": recording.output}},
            "rlProfiles": [{"rlProfileCfg_t": profile}],
            "rlChirps": chirps,
            "rlFrameCfg_t": {
                "chirpStartIdx": 0,
                "chirpEndIdx": recording.transmitters - 1,
                "numLoops": recording.loops,
                "numFrames": recording.frames,
                "framePeriodicity_msec": 1e3 * recording.frame_s,
            },
        },
        "rawDataCaptureConfig": {
            "rlDevDataFmtCfg_t": {
                "iqSwapSel": int(recording.q_first),
                "chInterleave": int(recording.lanes == 2),
            },
            "rlDevLaneEnable_t": {"laneEn": "0x3" if recording.lanes == 2 else "0xF"},
        },
    }
    return {"mmWaveDevices": [device]}


def write_ti(folder: Path, recording: TiRecording, *, parts: int = 1, studio: bool = False) -> Path:
    """Write a recording, in so many parts, and its configuration; returns the first file."""
    folder.mkdir(parents=True, exist_ok=True)
    words = words_of(recording, recording.beat()).tobytes()
    # Parts end within a frame, but not within a word.
    size = 2 * -(-len(words) // (2 * parts))
    names = [f"walk_Raw_{k}.bin" for k in range(parts)] if parts > 1 else ["walk.bin"]
    for number, name in enumerate(names):
        (folder / name).write_bytes(words[number * size : (number + 1) * size])
    if studio:
        (folder / "walk.mmwave.json").write_text(json.dumps(json_of(recording)))
    else:
        (folder / "walk.cfg").write_text(cfg_of(recording))
    return folder / names[0]
