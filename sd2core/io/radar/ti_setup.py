"""Configuration of TI's mmWave radars: ``.cfg`` of the mmWave SDK, ``.json`` of mmWave Studio.

Commands and their fields after TI's *mmWave SDK User Guide* (section "Configuration (.cfg) File
Format"), JSON after the files that mmWave Studio 2.x and 3.x write (``*.mmwave.json``).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import AliasGenerator, AliasPath, BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in, faults_in, read_json, read_text
from sd2core.radar_config import RadarConfig, Sampling

_SAMPLINGS: dict[int, Sampling] = {0: "real", 1: "complex", 2: "complex with image band"}
"""By ``adcOutputFmt``, the same in both kinds of file."""
_BITS_16 = 2
_MOST = 2**20
_CFG = "a .cfg of the mmWave SDK"
_JSON = "the .mmwave.json of mmWave Studio"


class Chirp(NamedTuple):
    """Chirps of a frame with these numbers, of one profile and a mask of transmitters."""

    start: int
    end: int
    profile: int
    transmitters: int
    idle_s: float = 0.0  # beyond that of the profile


class Profile(NamedTuple):
    """One kind of chirp; times and frequencies in SI units."""

    start_hz: float
    idle_s: float
    adc_start_s: float
    ramp_end_s: float
    slope_hz_per_s: float
    samples: int
    sample_rate_hz: float


@dataclass(frozen=True)
class TiSetup:
    """What a configuration says of the samples of a capture."""

    config: RadarConfig
    frames: int  # 0: without end
    lanes: int  # of LVDS
    q_first: bool  # Q comes before I
    falling: bool  # chirps fall in frequency
    notes: tuple[str, ...]


def read_setup(path: Path) -> TiSetup:
    """Read a configuration; Sd2Error if it is damaged, or of a kind that cannot be read."""
    with errors_in(path):
        return _of_cfg(path) if path.suffix.lower() == ".cfg" else _of_json(path)


def is_studio_json(path: Path) -> bool:
    """True if a file is a configuration of mmWave Studio, by its content."""
    try:
        content = read_json(path, _JSON)
    except Sd2Error:
        return False
    return isinstance(content, dict) and "mmWaveDevices" in content


# --- mmWave SDK ------------------------------------------------------------------------------


def _of_cfg(path: Path) -> TiSetup:
    text = read_text(path, _CFG)
    commands: dict[str, list[list[str]]] = {}
    for line in text.splitlines():
        words = line.split("%")[0].split()
        if words:
            commands.setdefault(words[0], []).append(words[1:])
    for name in ("advFrameCfg", "subFrameCfg"):
        if name in commands:
            raise Sd2Error(f"{name} makes frames of several kinds", "frameCfg")
    channels = _numbers(commands, "channelCfg", 2)
    adc = _numbers(commands, "adcCfg", 2)
    buffer = _numbers(commands, "adcbufCfg", 4)
    frame = _numbers(commands, "frameCfg", 5)
    for words in commands.get("lvdsStreamCfg", ()):
        if len(words) > 1 and words[1] != "0":
            raise Sd2Error(
                "lvdsStreamCfg sends a header with every chirp",
                "samples only, enableHeader 0",
                "Record again without the header",
            )
    platform = re.search(r"xWR(\d\d)", text)
    notes = []
    if platform is None:
        notes.append(
            "The .cfg does not say its platform; two lanes of LVDS are assumed, those of all"
            " devices but xWR12xx and xWR14xx. A line '% Platform:xWR14xx' says otherwise."
        )
    lanes = 4 if platform is not None and platform[1] in ("12", "14", "22") else 2
    profiles = {
        int(one[0]): Profile(
            one[1] * 1e9, one[2] * 1e-6, one[3] * 1e-6, one[4] * 1e-6, one[7] * 1e12,
            int(one[9]), one[10] * 1e3,
        )
        for one in _all_numbers(commands, "profileCfg", 11)
    }  # fmt: skip
    chirps = [
        Chirp(int(one[0]), int(one[1]), int(one[2]), int(one[7]), one[5] * 1e-6)
        for one in _all_numbers(commands, "chirpCfg", 8)
    ]
    return _setup(
        profiles,
        chirps,
        span=(int(frame[0]), int(frame[1])),
        loops=int(frame[2]),
        frames=int(frame[3]),
        frame_s=frame[4] * 1e-3,
        receivers=int(channels[0]),
        output=int(adc[1]),
        bits=int(adc[0]),
        lanes=lanes,
        q_first=int(buffer[2]) == 1,
        interleaved=int(buffer[3]) == 0,
        notes=notes,
    )


def _numbers(commands: dict[str, list[list[str]]], name: str, least: int) -> list[float]:
    return _all_numbers(commands, name, least)[-1]  # the last one holds


def _all_numbers(commands: dict[str, list[list[str]]], name: str, least: int) -> list[list[float]]:
    if name not in commands:
        raise Sd2Error(f"There is no {name}", f"{_CFG} as it was sent to the radar")
    found = []
    for words in commands[name]:
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) < least or not all(abs(one) < 1e9 for one in numbers):
            raise Sd2Error(f"{name} is {' '.join(words)[:80]!r}", f"{least} numbers or more")
        found.append(numbers)
    return found


# --- mmWave Studio ---------------------------------------------------------------------------


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)


def _inside(name: str) -> ConfigDict:
    """Configuration of a part that is alone in a table, under this name."""
    generator = AliasGenerator(validation_alias=lambda entry: AliasPath(name, entry))
    return ConfigDict(alias_generator=generator)


def _at(*names: str, **how: Any) -> Any:
    """Entry deeper within a part, in tables of these names."""
    return Field(validation_alias=AliasPath(*names), **how)


class _Profile(_Part):
    model_config = _inside("rlProfileCfg_t")

    profileId: int
    startFreqConst_GHz: float
    idleTimeConst_usec: float
    adcStartTimeConst_usec: float
    rampEndTime_usec: float
    freqSlopeConst_MHz_usec: float
    numAdcSamples: int
    digOutSampleRate: float


class _Chirp(_Part):
    model_config = _inside("rlChirpCfg_t")

    chirpStartIdx: int
    chirpEndIdx: int
    profileId: int
    idleTimeVar_usec: float = 0.0
    txEnable: str


class _Frame(_Part):
    chirpStartIdx: int
    chirpEndIdx: int
    numLoops: int
    numFrames: int
    framePeriodicity_msec: float


class _Device(_Part):
    receivers: str = _at("rfConfig", "rlChanCfg_t", "rxChannelEn")
    bits: int = _at("rfConfig", "rlAdcOutCfg_t", "fmt", "b2AdcBits")
    output: int = _at("rfConfig", "rlAdcOutCfg_t", "fmt", "b2AdcOutFmt")
    profiles: list[_Profile] = _at("rfConfig", "rlProfiles", min_length=1)
    chirps: list[_Chirp] = _at("rfConfig", "rlChirps", min_length=1)
    frame: _Frame = _at("rfConfig", "rlFrameCfg_t")
    swapped: int = _at("rawDataCaptureConfig", "rlDevDataFmtCfg_t", "iqSwapSel", default=0)
    interleaved: int = _at("rawDataCaptureConfig", "rlDevDataFmtCfg_t", "chInterleave")
    lanes: str = _at("rawDataCaptureConfig", "rlDevLaneEnable_t", "laneEn")


class _Studio(_Part):
    mmWaveDevices: list[_Device] | _Device


def _of_json(path: Path) -> TiSetup:
    with faults_in(path, _JSON):
        devices = _Studio.model_validate(read_json(path, _JSON)).mmWaveDevices
    devices = devices if isinstance(devices, list) else [devices]
    if len(devices) != 1:
        raise Sd2Error(f"It configures {len(devices)} devices", "one")
    device, frame = devices[0], devices[0].frame
    lanes = _mask(device.lanes, "laneEn").bit_count()
    if lanes not in (2, 4):
        raise Sd2Error(f"laneEn enables {lanes} lanes of LVDS", "2 or 4")
    profiles = {
        one.profileId: Profile(
            one.startFreqConst_GHz * 1e9,
            one.idleTimeConst_usec * 1e-6,
            one.adcStartTimeConst_usec * 1e-6,
            one.rampEndTime_usec * 1e-6,
            one.freqSlopeConst_MHz_usec * 1e12,
            one.numAdcSamples,
            one.digOutSampleRate * 1e3,
        )
        for one in device.profiles
    }
    chirps = [
        Chirp(
            one.chirpStartIdx,
            one.chirpEndIdx,
            one.profileId,
            _mask(one.txEnable, "txEnable"),
            one.idleTimeVar_usec * 1e-6,
        )
        for one in device.chirps
    ]
    return _setup(
        profiles,
        chirps,
        span=(frame.chirpStartIdx, frame.chirpEndIdx),
        loops=frame.numLoops,
        frames=frame.numFrames,
        frame_s=frame.framePeriodicity_msec * 1e-3,
        receivers=_mask(device.receivers, "rxChannelEn"),
        output=device.output,
        bits=device.bits,
        lanes=lanes,
        q_first=device.swapped == 1,
        interleaved=device.interleaved == 0,
        notes=[],
    )


def _mask(text: str, name: str) -> int:
    if not re.fullmatch(r"0[xX][0-9a-fA-F]{1,4}", text):
        raise Sd2Error(f"{name} is {text!r:.40}", "a mask such as 0xF")
    return int(text, 16)


# --- both ------------------------------------------------------------------------------------


def _setup(
    profiles: dict[int, Profile],
    chirps: list[Chirp],
    *,
    span: tuple[int, int],
    loops: int,
    frames: int,
    frame_s: float,
    receivers: int,
    output: int,
    bits: int,
    lanes: int,
    q_first: bool,
    interleaved: bool,
    notes: list[str],
) -> TiSetup:
    if output not in _SAMPLINGS:
        raise Sd2Error(f"The output format of the converter is {output}", "0, 1 or 2")
    if bits != _BITS_16:
        raise Sd2Error(f"The number of bits of the converter is {bits}", "2: 16 bits")
    if interleaved != (lanes == 4):
        raise Sd2Error(
            f"Receivers are {'' if interleaved else 'not '}interleaved over {lanes} lanes of LVDS",
            "interleaved over four lanes (xWR12xx, xWR14xx), one after the other over two",
        )
    antennas = (receivers & 0xF).bit_count()
    if antennas < 1:
        raise Sd2Error("No receiver is enabled", "a mask of one to four")
    if not (0 < loops < _MOST and 0 <= frames < 2**31):
        raise Sd2Error(f"A recording of {frames} frames of {loops} loops", "some of both")
    turns = _turns(chirps, span)
    profile = profiles.get(turns[0].profile)
    if profile is None:
        raise Sd2Error(f"Chirps are of profile {turns[0].profile}", "a profile that is configured")
    masks = [one.transmitters for one in turns]
    same = len(set(masks)) == 1
    if (
        len(turns) > 1
        and not same
        and (len(set(masks)) < len(masks) or any(one.bit_count() != 1 for one in masks))
    ):
        told = ", ".join(map(hex, masks))
        raise Sd2Error(
            f"Chirps of a loop are sent by the transmitters {told}",
            "one transmitter each, in turns, or the same ones for all",
            "Record with transmitters that take turns (TDM)",
        )
    transmitters = 1 if same else len(turns)
    chirp_s = profile.idle_s + profile.ramp_end_s + turns[0].idle_s
    if transmitters > 1:
        notes.append(
            f"{transmitters} transmitters take turns: each sends every"
            f" {1e6 * chirp_s * transmitters:.1f} µs, which divides v_max by {transmitters}. No"
            " angles are formed, so that their phases need no compensation."
        )
    if masks[0].bit_count() > 1:
        notes.append(f"{masks[0].bit_count()} transmitters send together.")
    if _SAMPLINGS[output] == "complex with image band":
        notes.append("Complex 2x samples: the half with the image band is left out.")
    if profile.slope_hz_per_s < 0:
        notes.append("Chirps fall in frequency; samples are turned round.")
    if not 1 < profile.samples < _MOST or not profile.sample_rate_hz > 0:
        raise Sd2Error(
            f"A chirp has {profile.samples} samples at {profile.sample_rate_hz:g} Hz",
            "two samples or more, at a rate",
        )
    first_hz = profile.start_hz + profile.slope_hz_per_s * profile.adc_start_s
    last_hz = first_hz + profile.slope_hz_per_s * profile.samples / profile.sample_rate_hz
    config = RadarConfig(
        start_frequency_hz=min(first_hz, last_hz),
        end_frequency_hz=max(first_hz, last_hz),
        samples_per_chirp=profile.samples,
        chirps_per_frame=loops * (len(turns) if same else 1),
        chirp_repetition_s=chirp_s * transmitters,
        frame_repetition_s=frame_s,
        sample_rate_hz=profile.sample_rate_hz,
        receivers=antennas,
        adc_bits=16,
        name=f"TI mmWave, {0.5e-9 * (first_hz + last_hz):.4g} GHz",
        sampling=_SAMPLINGS[output],
        transmitters=transmitters,
    )
    return TiSetup(config, frames, lanes, q_first, profile.slope_hz_per_s < 0, tuple(notes))


def _turns(chirps: list[Chirp], span: tuple[int, int]) -> list[Chirp]:
    """Chirps of one loop, each by itself; Sd2Error if one is missing, or of another profile."""
    if not 0 <= span[0] <= span[1] < 512:
        raise Sd2Error(f"A loop goes from chirp {span[0]} to {span[1]}", "numbers from 0 to 511")
    found = []
    for number in range(span[0], span[1] + 1):
        fitting = [one for one in chirps if one.start <= number <= one.end]
        if not fitting:
            raise Sd2Error(f"Chirp {number} of a loop is not configured", "every chirp of it")
        found.append(fitting[-1])
    if len({(one.profile, one.idle_s) for one in found}) > 1:
        raise Sd2Error("Chirps of a loop differ in profile or idle time", "chirps of one kind")
    return found
