"""Configuration of TI's mmWave radars: ``.cfg`` of the mmWave SDK, ``.json`` of mmWave Studio.

Commands and their fields after TI's *mmWave SDK User Guide* (section "Configuration (.cfg) File
Format"), JSON after the files that mmWave Studio 2.x and 3.x write (``*.mmwave.json``). pymmw
keeps the commands as JSON, in a ``.cfg`` as well: the values of each stand in the order in which
they are sent, under names of its own.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import (
    AliasGenerator,
    AliasPath,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
)

from sd2core.errors import Sd2Error
from sd2core.files.texts import errors_in, faults_in, parse_json, read_json, read_text
from sd2core.radar_config import RadarConfig, Sampling

_SAMPLINGS: dict[int, Sampling] = {0: "real", 1: "complex", 2: "complex with image band"}
"""By ``adcOutputFmt``, the same in both kinds of file."""
_BITS_16 = 2
_MAX = 2**20
_LATEST = 2.0
"""Of the length of a chirp: samples that end later have a rate or times in another unit."""
_CFG = "a .cfg of the mmWave SDK, or JSON of pymmw,"
_JSON = "the .mmwave.json of mmWave Studio"


@dataclass(frozen=True)
class TiSetup:
    """Layout of a capture's samples by a configuration."""

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


# --- what both say, under the names and in the units of mmWave Studio -----------------------


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)


Part = TypeVar("Part", bound=_Part)


def _inside(name: str) -> ConfigDict:
    """Configuration of a part that is alone in a table, under this name."""
    generator = AliasGenerator(validation_alias=lambda entry: AliasPath(name, entry))
    return ConfigDict(alias_generator=generator)


def _at(*names: str, **how: Any) -> Any:
    """Entry deeper within a part, in tables of these names."""
    return Field(validation_alias=AliasPath(*names), **how)


def _mask(text: Any, info: ValidationInfo) -> int:
    if not isinstance(text, str) or not re.fullmatch(r"0[xX][0-9a-fA-F]{1,4}", text):
        raise Sd2Error(f"{info.field_name} is {text!r:.40}", "a mask such as 0xF")
    return int(text, 16)


Mask = Annotated[int, BeforeValidator(_mask)]
"""One bit for each antenna or lane."""


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
    startFreqVar_MHz: float = 0.0
    freqSlopeVar_KHz_usec: float = 0.0
    idleTimeVar_usec: float = 0.0
    adcStartTimeVar_usec: float = 0.0
    txEnable: Mask

    @property
    def kind(self) -> tuple[float, ...]:
        """All but its numbers and transmitters; in a .cfg in units of its own."""
        return (
            self.profileId,
            self.startFreqVar_MHz,
            self.freqSlopeVar_KHz_usec,
            self.idleTimeVar_usec,
            self.adcStartTimeVar_usec,
        )


class _Code(_Part):
    """Phases that transmitters have in some chirps, whatever their names."""

    model_config = ConfigDict(extra="allow")

    chirpStartIdx: int
    chirpEndIdx: int

    def phases(self) -> tuple[str, ...]:
        """Phases by name; those that are not 0."""
        extra = (self.model_extra or {}).items()
        return tuple(f"{name} {value}" for name, value in extra if _number(value) != 0)


class _Frame(_Part):
    chirpStartIdx: int
    chirpEndIdx: int
    numLoops: int
    numFrames: int
    framePeriodicity_msec: float


class _Device(_Part):
    rxChannelEn: Mask = _at("rfConfig", "rlChanCfg_t", "rxChannelEn")
    bits: int = _at("rfConfig", "rlAdcOutCfg_t", "fmt", "b2AdcBits")
    output: int = _at("rfConfig", "rlAdcOutCfg_t", "fmt", "b2AdcOutFmt")
    profiles: list[_Profile] = _at("rfConfig", "rlProfiles", min_length=1)
    chirps: list[_Chirp] = _at("rfConfig", "rlChirps", min_length=1)
    frame: _Frame = _at("rfConfig", "rlFrameCfg_t")
    signs: list[dict[str, _Code]] = _at("rfConfig", "rlBpmChirps", default_factory=list)
    shifts: list[dict[str, _Code]] = _at("rfConfig", "rlRfPhaseShiftCfgs", default_factory=list)
    swapped: int = _at("rawDataCaptureConfig", "rlDevDataFmtCfg_t", "iqSwapSel", default=0)
    interleaved: int = _at("rawDataCaptureConfig", "rlDevDataFmtCfg_t", "chInterleave")
    laneEn: Mask = _at("rawDataCaptureConfig", "rlDevLaneEnable_t", "laneEn")


# --- mmWave SDK ------------------------------------------------------------------------------


def _of_cfg(path: Path) -> TiSetup:
    text = read_text(path, _CFG, errors="replace")  # comments are in any encoding
    if text.lstrip().startswith("{"):
        if "mmWaveDevices" in text:
            return _of_json(path)
        commands = _commands_of_pymmw(text, path)
    else:
        commands = {}
        for line in text.splitlines():
            sent = re.sub(r"^\s*\w+:/>", "", line)  # the prompt, in the log of a terminal
            words = re.split("%|#|//", sent, maxsplit=1)[0].split()
            if words:
                commands.setdefault(words[0], []).append(words[1:])
    for name in ("advFrameCfg", "subFrameCfg"):
        if name in commands:
            raise Sd2Error(f"{name} makes frames of several kinds", "frameCfg")
    # bpmCfg <subFrameIdx> <enabled> <chirp0Idx> <chirp1Idx>; the first SDK had no subframes.
    if any(words[-3] != 0 for words in _all_numbers(commands, "bpmCfg", 3, needed=False)):
        raise _coded("bpmCfg reverses a transmitter in some chirps of a loop (BPM)")
    channels = _numbers(commands, "channelCfg", 2)
    adc = _numbers(commands, "adcCfg", 2)
    swapped, interleaved = _buffer(_numbers(commands, "adcbufCfg", 4))
    frame = _numbers(commands, "frameCfg", 5)
    for words in commands.get("lvdsStreamCfg", ()):
        header, kind = [*words[1:3], "0", "0"][:2]
        if header != "0" or kind == "4":  # CP_ADC_CQ
            raise Sd2Error(
                f"lvdsStreamCfg sends {'a header' if header != '0' else 'other data'} with every"
                " chirp",
                "samples only: enableHeader 0, dataFmt 1",
                "Record again without",
            )
    named = (re.search(r"[xIA]WR(\d\d)", one, re.IGNORECASE) for one in (text, path.name))
    platform = next(filter(None, named), None)
    notes = []
    if platform is not None:
        lanes = 4 if platform[1] in ("12", "14", "22") else 2
    else:
        lanes = 4 if interleaved == 0 else 2
        notes.append(
            f"The .cfg does not say its platform; {lanes} lanes of LVDS are assumed, as receivers"
            f" {'are' if interleaved == 0 else 'are not'} interleaved. A line '% Platform:xWR14xx',"
            " or xWR14xx in the file's name, says otherwise."
        )
    profiles = _all_numbers(commands, "profileCfg", 11)
    chirps = _all_numbers(commands, "chirpCfg", 8)
    device = _Device.model_construct(
        rxChannelEn=_whole(channels[0]),
        bits=_whole(adc[0]),
        output=_whole(adc[1]),
        profiles=[_sent(_Profile, one, (0, 1, 2, 3, 4, 7, 9, 10)) for one in profiles],
        chirps=[_sent(_Chirp, one, range(8)) for one in chirps],
        frame=_sent(_Frame, frame, range(5)),
        swapped=swapped,
        interleaved=interleaved,
        signs=[],
        shifts=[],
    )
    return _setup(device, lanes, notes)


def _sent(part: type[Part], numbers: Sequence[float], places: Sequence[int]) -> Part:
    """Part of a configuration whose fields, in their order, a command has at some places."""
    values: dict[str, Any] = {
        name: _whole(numbers[place]) if field.annotation is int else numbers[place]
        for (name, field), place in zip(part.model_fields.items(), places, strict=True)
    }
    return part.model_construct(**values)


def _commands_of_pymmw(text: str, path: Path) -> dict[str, list[list[str]]]:
    """Commands that pymmw sends: values in order, with what it puts in place of nulls."""
    settings = parse_json(text, path, _CFG).get("_settings_")
    antennas = settings.get("rxAntennas") if isinstance(settings, dict) else None
    channels = {"txMask": 1, "cascading": 0}
    if antennas is not None:
        if antennas not in (1, 2, 3, 4):
            raise Sd2Error(f"rxAntennas is {antennas!r:.40}", "1 to 4")
        channels["rxMask"] = 2 ** int(antennas) - 1
    filled = {"channelCfg": channels, "adcCfg": {"adcBits": _BITS_16}}
    commands: dict[str, list[list[str]]] = {}
    # Pairs in place of tables: a command may be there several times.
    for name, values in json.loads(text, object_pairs_hook=list):
        known = {"subFrameIndex": -1} | filled.get(name, {})
        commands.setdefault(name, []).append(_words_of_pymmw(values, known))
    return commands


def _words_of_pymmw(value: Any, filled: dict[str, int]) -> list[str]:
    """Words of a command: values in lists and in pairs with their names."""
    if isinstance(value, list):
        return [word for one in value for word in _words_of_pymmw(one, filled)]
    if isinstance(value, tuple):
        name, value = value
        return _words_of_pymmw(filled.get(name) if value is None else value, filled)
    return ["null" if value is None else str(value)]


def _buffer(numbers: list[float]) -> tuple[int, int]:
    """SampleSwap and ChanInterleave of ``adcbufCfg``.

    ``[<subFrameIdx>] <adcOutputFmt> <SampleSwap> <ChanInterleave> <ChirpThreshold>``: four values
    on xWR14xx and in the first SDK, which knew no subframes, five since.
    """
    values = numbers if len(numbers) == 4 else numbers[1:]
    if any(one not in (0, 1) for one in values[:3]):
        raise Sd2Error(
            f"adcbufCfg is {' '.join(f'{one:g}' for one in numbers)}",
            "format, swap and interleave of 0 or 1, before them -1 where there are five values",
        )
    return int(values[1]), int(values[2])


def _numbers(commands: dict[str, list[list[str]]], name: str, least: int) -> list[float]:
    return _all_numbers(commands, name, least)[-1]  # the last one holds


def _all_numbers(
    commands: dict[str, list[list[str]]], name: str, least: int, *, needed: bool = True
) -> list[list[float]]:
    if needed and name not in commands:
        raise Sd2Error(f"There is no {name}", f"{_CFG} as it was sent to the radar")
    rows = []
    for words in commands.get(name, ()):
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            numbers = []
        if len(numbers) < least or not all(abs(one) < 1e9 for one in numbers):
            raise Sd2Error(
                f"{name} is {' '.join(words)[:80]!r}",
                f"{least} numbers or more, in the units of the SDK (GHz, µs, ms)",
            )
        rows.append(numbers)
    return rows


def _whole(number: float) -> int:
    if number % 1:
        raise Sd2Error(f"A count, a mask or the number of a chirp is {number:g}", "a whole number")
    return int(number)


# --- mmWave Studio ---------------------------------------------------------------------------


class _Studio(_Part):
    mmWaveDevices: list[_Device] | _Device


def _of_json(path: Path) -> TiSetup:
    with faults_in(path, _JSON):
        devices = _Studio.model_validate(read_json(path, _JSON)).mmWaveDevices
    devices = devices if isinstance(devices, list) else [devices]
    if len(devices) != 1:
        raise Sd2Error(f"It configures {len(devices)} devices", "one")
    lanes = devices[0].laneEn.bit_count()
    if lanes not in (2, 4):
        raise Sd2Error(f"laneEn enables {lanes} lanes of LVDS", "2 or 4")
    return _setup(devices[0], lanes, [])


# --- both ------------------------------------------------------------------------------------


def _setup(device: _Device, lanes: int, notes: list[str]) -> TiSetup:
    if device.output not in _SAMPLINGS:
        raise Sd2Error(f"The output format of the converter is {device.output}", "0, 1 or 2")
    if device.bits != _BITS_16:
        raise Sd2Error(f"The number of bits of the converter is {device.bits}", "2: 16 bits")
    interleaved = device.interleaved == 0
    if interleaved != (lanes == 4):
        raise Sd2Error(
            f"Receivers are {'' if interleaved else 'not '}interleaved over {lanes} lanes of LVDS",
            "interleaved over four lanes (xWR12xx, xWR14xx), one after the other over two",
        )
    antennas = (device.rxChannelEn & 0xF).bit_count()
    if antennas < 1:
        raise Sd2Error("No receiver is enabled", "a mask of one to four")
    frame = device.frame
    loops, frames = frame.numLoops, frame.numFrames
    if not (0 < loops < _MAX and 0 <= frames < 2**31):
        raise Sd2Error(f"A recording of {frames} frames of {loops} loops", "some of both")
    turns = _turns(device.chirps, frame.chirpStartIdx, frame.chirpEndIdx)
    number = turns[0].profileId
    profile = next((one for one in reversed(device.profiles) if one.profileId == number), None)
    if profile is None:
        raise Sd2Error(f"Chirps are of profile {number}", "a profile that is configured")
    masks = [one.txEnable for one in turns]
    same = len(set(masks)) == 1
    if (
        len(turns) > 1
        and not same
        and (len(set(masks)) < len(masks) or any(one.bit_count() != 1 for one in masks))
    ):
        hex_masks = ", ".join(map(hex, masks))
        raise Sd2Error(
            f"Chirps of a loop are sent by the transmitters {hex_masks}",
            "one transmitter each, in turns, or the same ones for all",
            "Record with transmitters that take turns (TDM)",
        )
    if same:
        _refuse_codes(device, frame.chirpStartIdx, frame.chirpEndIdx)
    transmitters = 1 if same else len(turns)
    chirp_s = (
        profile.idleTimeConst_usec * 1e-6
        + profile.rampEndTime_usec * 1e-6
        + turns[0].idleTimeVar_usec * 1e-6
    )
    if transmitters > 1:
        notes.append(
            f"{transmitters} transmitters take turns: each sends every"
            f" {1e6 * chirp_s * transmitters:.1f} µs, which divides v_max by {transmitters}. No"
            " angles are formed, so that their phases need no compensation."
        )
    if masks[0].bit_count() > 1:
        notes.append(f"{masks[0].bit_count()} transmitters send together.")
    if _SAMPLINGS[device.output] == "complex with image band":
        notes.append("Complex 2x samples: the half with the image band is left out.")
    slope_hz_per_s = profile.freqSlopeConst_MHz_usec * 1e12
    if slope_hz_per_s < 0:
        notes.append("Chirps fall in frequency; samples are turned round.")
    samples, rate_hz = profile.numAdcSamples, profile.digOutSampleRate * 1e3
    if not 1 < samples < _MAX or not rate_hz > 0:
        raise Sd2Error(
            f"A chirp has {samples} samples at {rate_hz:g} Hz", "two samples or more, at a rate"
        )
    adc_start_s = profile.adcStartTimeConst_usec * 1e-6
    ramp_s = profile.rampEndTime_usec * 1e-6
    if adc_start_s + samples / rate_hz > _LATEST * ramp_s:
        raise Sd2Error(
            f"{samples} samples at {rate_hz:g} Hz from {1e6 * adc_start_s:g} µs on end long after"
            f" the chirp, which lasts {1e6 * ramp_s:g} µs",
            "samples within the chirp (their rate is in ksps, times are in µs)",
        )
    first_hz = profile.startFreqConst_GHz * 1e9 + slope_hz_per_s * adc_start_s
    last_hz = first_hz + slope_hz_per_s * samples / rate_hz
    config = RadarConfig(
        start_frequency_hz=min(first_hz, last_hz),
        end_frequency_hz=max(first_hz, last_hz),
        samples_per_chirp=samples,
        chirps_per_frame=loops * (len(turns) if same else 1),
        chirp_repetition_s=chirp_s * transmitters,
        frame_repetition_s=frame.framePeriodicity_msec * 1e-3,
        sample_rate_hz=rate_hz,
        receivers=antennas,
        adc_bits=16,
        name=f"TI mmWave, {0.5e-9 * (first_hz + last_hz):.4g} GHz",
        sampling=_SAMPLINGS[device.output],
        transmitters=transmitters,
    )
    return TiSetup(config, frames, lanes, device.swapped == 1, slope_hz_per_s < 0, tuple(notes))


def _turns(chirps: list[_Chirp], first: int, last: int) -> list[_Chirp]:
    """Chirps of one loop, each by itself; Sd2Error if one is missing, or of another profile."""
    if not 0 <= first <= last < 512:
        raise Sd2Error(f"A loop goes from chirp {first} to {last}", "numbers from 0 to 511")
    turns = []
    for number in range(first, last + 1):
        fitting = [one for one in chirps if one.chirpStartIdx <= number <= one.chirpEndIdx]
        if not fitting:
            raise Sd2Error(f"Chirp {number} of a loop is not configured", "every chirp of it")
        turns.append(fitting[-1])
    if len({one.kind for one in turns}) > 1:
        raise Sd2Error(
            "Chirps of a loop differ in profile, frequency, slope or times", "chirps of one kind"
        )
    return turns


def _refuse_codes(device: _Device, first: int, last: int) -> None:
    """Raise Sd2Error if phases of the transmitters differ between chirps of a loop."""
    for name, entries in (("rlBpmChirps", device.signs), ("rlRfPhaseShiftCfgs", device.shifts)):
        codes = [code for entry in entries for code in entry.values()]
        phases = set()
        for number in range(first, last + 1):
            fitting = [one for one in codes if one.chirpStartIdx <= number <= one.chirpEndIdx]
            phases.add(fitting[-1].phases() if fitting else ())
        if len(phases) > 1:
            raise _coded(f"{name} gives transmitters other phases from chirp to chirp")


def _coded(found: str) -> Sd2Error:
    return Sd2Error(
        found,
        "transmitters in turns (TDM), or alike in all chirps: what is sent together in turning"
        " phases would be taken for motion",
        "Record with transmitters that take turns (TDM)",
    )


def _number(value: Any) -> float:
    """Value of a number, or of a text such as "0x20"; 0 for anything else."""
    try:
        return float(int(value, 0)) if isinstance(value, str) else float(value)
    except (TypeError, ValueError):
        return 0.0
