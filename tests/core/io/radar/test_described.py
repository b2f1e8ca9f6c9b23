"""Samples of one's own with a description: what is written reads back, and what does not fit."""

from __future__ import annotations

import json
import os
import resource
from itertools import count
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.io import savemat

from sd2core.errors import Sd2Error
from sd2core.fmcw import doppler_map, range_doppler
from sd2core.io.kinds import kind_of
from sd2core.io.radar import companions, holds_map, load_capture, load_recorded_map
from sd2core.io.radar.described import (
    RadarDescription,
    capture_of,
    description_of,
    plain_axes,
    read_description,
    write_description,
)

C_MPS = 299_792_458.0
FRAMES, TRANSMITTERS, RECEIVERS, CHIRPS, SAMPLES = 3, 2, 2, 24, 20
CARRIER_HZ, BANDWIDTH_HZ, RATE_HZ, CHIRP_S, FRAME_S = 24e9, 200e6, 1e6, 5e-4, 0.02
FMCW: dict[str, Any] = {
    "carrier_hz": CARRIER_HZ,
    "bandwidth_hz": BANDWIDTH_HZ,
    "sample_rate_hz": RATE_HZ,
    "chirp_repetition_s": CHIRP_S,
    "frame_repetition_s": FRAME_S,
}
NAMES = ("frame", "transmitter", "receiver", "chirp", "sample")
_numbers = count()


def beat(range_m: float, velocity_mps: float, falling: bool = False) -> np.ndarray:
    """A target's beat in the order of NAMES; its phase grows with the distance."""
    frame, turn, receiver, chirp, sample = np.ogrid[
        :FRAMES, :TRANSMITTERS, :RECEIVERS, :CHIRPS, :SAMPLES
    ]
    at_s = frame * FRAME_S + chirp * CHIRP_S
    delay_s = 2.0 * (range_m - velocity_mps * at_s) / C_MPS
    slope = BANDWIDTH_HZ * RATE_HZ / SAMPLES * (-1.0 if falling else 1.0)
    phase = (CARRIER_HZ + slope * (sample - 0.5 * SAMPLES) / RATE_HZ) * delay_s
    return np.exp(2j * np.pi * (phase + 0.2 * receiver + 0.4 * turn))


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    order=st.permutations(NAMES),
    stored=st.sampled_from(["complex64", "complex128", "int16", "float32", "iq"]),
    where=st.sampled_from(["npy", "h5"]),
    sign=st.sampled_from([1, -1]),
    falling=st.booleans(),
    range_m=st.floats(2.5, 5.0),
    velocity_mps=st.floats(0.5, 5.5).flatmap(lambda v: st.sampled_from([v, -v])),
)
def test_a_target_is_found_whatever_the_axes_and_the_sign(
    tmp_path: Path,
    order: list[str],
    stored: str,
    where: str,
    sign: int,
    falling: bool,
    range_m: float,
    velocity_mps: float,
) -> None:
    signal = beat(range_m, velocity_mps, falling)
    real = stored in ("int16", "float32")
    # Real samples have no sign of their own, but for the direction of the chirps.
    if real:
        sign = 1
    signal = signal.conj() if sign < 0 else signal
    array = signal.transpose([NAMES.index(name) for name in order])
    axes = list(order)
    told = dict(FMCW)
    if stored == "int16":
        array = np.rint(2000.0 * array.real + 2048.0).astype(np.int16)
        told |= {"zero": 2048.0, "full_scale": 2048.0}
    elif stored == "iq":
        array, axes = np.stack([array.real, array.imag], axis=-1), [*axes, "iq"]
    else:
        array = (array.real if real else array).astype(stored)
    if falling:
        del told["bandwidth_hz"]
        told["slope_hz_per_s"] = -BANDWIDTH_HZ * RATE_HZ / SAMPLES
    path = tmp_path / f"{next(_numbers)}.{where}"
    if where == "npy":
        np.save(path, array)
    else:
        with h5py.File(path, "w") as file:
            file["adc"] = array
    write_description(RadarDescription(axes=tuple(axes), sign=sign, **told), path)
    assert kind_of(path) == "radar"
    assert not holds_map(path)
    assert companions(path) == [description_of(path)]
    capture = load_capture(path)
    config = capture.config
    assert (config.transmitters, config.receivers) == (TRANSMITTERS, RECEIVERS)
    assert config.v_max_mps == pytest.approx(C_MPS / CARRIER_HZ / 4.0 / CHIRP_S)
    assert capture.full_scale_known == (stored == "int16")
    found = range_doppler(capture, 1)
    gate, bin_ = np.unravel_index(found.values.argmax(), found.values.shape)
    there_m = range_m - velocity_mps * (FRAME_S + 0.5 * CHIRPS * CHIRP_S)
    assert abs(found.range_m[gate] - there_m) < 0.75 * config.range_resolution_m
    assert abs(found.axis.centres_mps[bin_] - velocity_mps) < 1.1 * config.velocity_resolution_mps


descriptions = st.builds(
    RadarDescription,
    name=st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=30),
    simulated=st.booleans(),
    dataset=st.none() | st.text("abc/", min_size=1, max_size=8),
    axes=st.permutations(NAMES).map(tuple),
    carrier_hz=st.floats(1e8, 1e11),
    bandwidth_hz=st.none() | st.floats(0.0, 1e10),
    slope_hz_per_s=st.none() | st.floats(-1e14, 1e14),
    sample_rate_hz=st.none() | st.floats(1.0, 1e9),
    chirp_repetition_s=st.none() | st.floats(1e-9, 10.0),
    frame_repetition_s=st.none() | st.floats(1e-9, 10.0),
    samples_per_chirp=st.none() | st.integers(1, 10**6),
    chirps_per_frame=st.none() | st.integers(2, 10**6),
    sign=st.sampled_from([1, -1]),
    zero=st.floats(-1e12, 1e12),
    full_scale=st.none() | st.floats(1e-12, 1e12),
    range_start_m=st.none() | st.floats(-10.0, 10.0),
    range_step_m=st.none() | st.floats(1e-6, 10.0),
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(description=descriptions)
def test_a_description_reads_back_as_it_was_written(
    tmp_path: Path, description: RadarDescription
) -> None:
    path = write_description(description, tmp_path / "radar.npy")
    assert read_description(path) == description


def _mostly(usual: float | None, *others: float) -> st.SearchStrategy[float | None]:
    return st.sampled_from([usual] * (2 * len(others)) + list(others))


extreme = st.fixed_dictionaries(
    {
        "axes": st.sampled_from([("frame", "chirp", "sample"), ("frame", "sample", "chirp")]),
        "carrier_hz": _mostly(60e9, 1e-300, 1e8, 1e12, 1e15),
        "sample_rate_hz": _mostly(1e6, 1e-9, 1.0, 1e15),
        "chirp_repetition_s": _mostly(1e-4, 1e-15, 1e-9, 1.0, 1e9),
        "frame_repetition_s": _mostly(0.1, 1e-9, 1e3, 1e9),
        "sign": st.sampled_from([1, -1]),
        "zero": _mostly(0.0, -1e12, 1e12, 1e-300),
        "full_scale": _mostly(None, 1e-12, 1.0, 1e12),
    }
)
sweeps = st.one_of(
    st.fixed_dictionaries({"bandwidth_hz": _mostly(1e9, 0.0, 1e-9, 1e8, 1e11, 1e15)}),
    st.fixed_dictionaries({"slope_hz_per_s": _mostly(-1e14, 0.0, 1e-9, -1e24, 1e24)}),
)
places = st.just({}) | st.fixed_dictionaries(
    {"range_start_m": _mostly(0.3, -1e9, 1e9), "range_step_m": _mostly(0.1, 1e-9, 1e9)}
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    told=st.tuples(extreme, sweeps, places).map(lambda parts: parts[0] | parts[1] | parts[2]),
    stored=st.sampled_from(["<f4", "<c8", "<i2", ">f8", "<u2"]),
)
def test_extreme_descriptions_are_read_or_refused(
    tmp_path: Path, told: dict[str, Any], stored: str
) -> None:
    path = tmp_path / f"{next(_numbers)}.npy"
    np.save(path, np.arange(2 * 8 * 8).reshape(2, 8, 8).astype(stored))
    try:
        doppler = doppler_map(capture_of(path, RadarDescription(**told)))
    except (Sd2Error, ValidationError):
        return
    assert np.isfinite(doppler.values).all()


@given(velocity_mps=st.floats(-4.0, 4.0))
@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_points_at_distances_need_no_range_to_be_formed(
    tmp_path: Path, velocity_mps: float
) -> None:
    frame, chirp, _ = np.ogrid[:2, :32, :6]
    distance_m = 1.5 - velocity_mps * (frame * FRAME_S + chirp * CHIRP_S)
    array = np.where(
        np.arange(6) == 4, np.exp(4j * np.pi * CARRIER_HZ / C_MPS * distance_m), 0.0
    ).astype(np.complex64)
    path = tmp_path / "points.npy"
    np.save(path, array)
    told = {name: FMCW[name] for name in FMCW if name != "sample_rate_hz"}
    write_description(
        RadarDescription(
            axes=("frame", "chirp", "sample"), range_start_m=0.5, range_step_m=0.25, **told
        ),
        path,
    )
    capture = load_capture(path)
    found = range_doppler(capture, 1)
    assert found.range_m[found.range_profile.argmax()] == 1.5
    off = doppler_map(capture).peak_velocity_mps() - velocity_mps
    assert np.abs(off).max() <= 0.51 * capture.config.velocity_resolution_mps


@pytest.mark.parametrize("datatype", ["ci16_le", "cf32_be", "ci8"])
def test_a_sigmf_stream_is_the_doppler_of_its_carrier(tmp_path: Path, datatype: str) -> None:
    """Two receivers of a continuous wave at 5.8 GHz; 50 samples make one, 40 of these a frame."""
    rate_hz, carrier_hz, velocity_mps = 20_000.0, 5.8e9, -3.1
    at_s = np.arange(7 * 2000 + 13) / rate_hz
    wave = np.exp(-4j * np.pi * carrier_hz / C_MPS * velocity_mps * at_s)
    both = np.stack([100.0 * wave, 100j * wave], axis=1)
    parts = np.stack([both.real, both.imag], axis=-1)
    word = {"ci16_le": "<i2", "cf32_be": ">f4", "ci8": "i1"}[datatype]
    (parts if "f" in datatype else np.rint(parts)).astype(word).tofile(tmp_path / "a.sigmf-data")
    meta = {
        "global": {
            "core:datatype": datatype,
            "core:sample_rate": rate_hz,
            "core:num_channels": 2,
            "core:version": "1.0.0",
        },
        "captures": [{"core:sample_start": 0, "core:frequency": carrier_hz}],
        "annotations": [],
    }
    path = tmp_path / "a.sigmf-meta"
    path.write_text(json.dumps(meta))
    assert plain_axes(path, None)[0] == ("stream", "receiver")
    description = RadarDescription(
        axes=("stream", "receiver"),
        carrier_hz=carrier_hz,
        bandwidth_hz=0.0,
        sample_rate_hz=rate_hz,
        samples_per_chirp=50,
        chirps_per_frame=40,
        full_scale=127.0,
    )
    write_description(description, path)
    for one in (path, path.with_suffix(".sigmf-data")):
        capture = load_capture(one)
        assert capture.samples.shape == (7, 2, 40, 1)
        assert capture.config.is_continuous
        doppler = doppler_map(capture)
        off = np.abs(doppler.peak_velocity_mps() - velocity_mps)
        assert off.max() <= 0.51 * capture.config.velocity_resolution_mps
        assert "range_max_m" not in doppler.meta["radar"]
        assert doppler.meta["range_gates_m"] == []
    with pytest.raises(Sd2Error, match="a continuous wave, which tells no ranges apart"):
        doppler_map(capture, range_m=(0.5, 2.0))
    with pytest.raises(Sd2Error, match="a continuous wave, which tells no ranges apart"):
        range_doppler(capture, 0)
    with (tmp_path / "a.sigmf-data").open("ab") as stream:
        stream.write(b"x")
    with pytest.raises(Sd2Error, match=r"a\.sigmf-data has .* bytes\. Expected: a multiple of"):
        load_capture(path)


def _described(path: Path, array: np.ndarray, **changes: Any) -> Path:
    np.save(path, array)
    content = {"axes": ("frame", "chirp", "sample"), **FMCW} | changes
    write_description(RadarDescription(**{k: v for k, v in content.items() if v is not None}), path)
    return path


CUBE = np.zeros((2, 8, 8), np.float32)
FAULTS: dict[str, tuple[np.ndarray, dict[str, Any], str]] = {
    "too few axes": (CUBE, {"axes": ("frame", "chirp")}, "axes are frame, chirp, for an array"),
    "an axis twice": (CUBE, {"axes": ("frame", "chirp", "chirp")}, "one different name"),
    "no frames": (CUBE, {"axes": ("receiver", "chirp", "sample")}, "have no frames of their own"),
    "neither slope nor bandwidth": (CUBE, {"bandwidth_hz": None}, "bandwidth_hz is None"),
    "no rate": (CUBE, {"sample_rate_hz": None}, "It states no sample_rate_hz"),
    "no times": (CUBE, {"chirp_repetition_s": None}, "It states no times"),
    "half a range": (CUBE, {"range_step_m": 0.1}, "One of range_start_m and range_step_m"),
    "distances of real samples": (
        CUBE,
        {"range_step_m": 0.1, "range_start_m": 0.0},
        "real .float32., at distances",
    ),
    "a continuous wave of real samples": (CUBE, {"bandwidth_hz": 0.0}, "with 1 real samples"),
    "megahertz": (CUBE, {"carrier_hz": 24000.0}, "carrier_hz is 24000. Expected: Hz: 60 GHz is"),
    "a bandwidth in GHz": (CUBE, {"bandwidth_hz": 1.0}, "bandwidth_hz is 1. Expected: Hz: 1 GHz"),
    "a rate in MHz": (CUBE, {"sample_rate_hz": 2.0}, "8 samples at 2 Hz last longer than a chirp"),
    "frames too short": (CUBE, {"frame_repetition_s": 1e-3}, "do not fit into"),
    "no numbers": (np.zeros((2, 8, 8), "U3"), {}, "The array is of <U3"),
    "a stream without chirps": (
        CUBE[:, 0, 0],
        {"axes": ("stream",), "chirp_repetition_s": None, "frame_repetition_s": None},
        "A stream has no frames of its own",
    ),
    "a stream with times": (
        CUBE.ravel(),
        {"axes": ("stream",), "samples_per_chirp": 4, "chirps_per_frame": 4},
        "Chirps and frames of a stream follow one another",
    ),
    "three parts": (
        np.zeros((2, 8, 8, 3), np.float32),
        {"axes": ("frame", "chirp", "sample", "iq")},
        "The axis iq has 3 entries",
    ),
    "no frame at all": (np.zeros((2, 8, 0), np.float32), {}, "whole \\.npy|at least one whole"),
    "a dataset of a .npy": (CUBE, {"dataset": "adc"}, "given with the dataset 'adc'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_does_not_fit_is_refused_in_a_sentence(tmp_path: Path, fault: str) -> None:
    array, changes, sentence = FAULTS[fault]
    path = _described(tmp_path / "mine.npy", array, **changes)
    with pytest.raises(Sd2Error, match=f"(?s)mine.*({sentence})"):
        load_capture(path)


def test_a_sample_that_is_no_number_is_refused_when_it_is_read(tmp_path: Path) -> None:
    cube = np.zeros((2, 8, 8), np.float32)
    cube[1, 2, 3] = np.inf
    capture = load_capture(_described(tmp_path / "a.npy", cube))
    assert not capture.read(0, 1).any()
    with pytest.raises(Sd2Error, match=r"a\.npy holds a sample that is no finite number"):
        doppler_map(capture)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("axes", ["frame chirp sample", "sample frame chirp"])
def test_a_npy_that_is_cut_off_while_it_is_open_is_refused(
    tmp_path: Path, order: str, axes: str
) -> None:
    """It was mapped, and the program ended by a bus error."""
    names = axes.split()
    cube = np.arange(3 * 64 * 128, dtype=np.float32).reshape(3, 64, 128)
    turned = cube.transpose([PLAIN.index(name) for name in names])
    path = _described(
        tmp_path / "a.npy", np.array(turned, order=order), axes=tuple(names), frame_repetition_s=1.0
    )
    capture = load_capture(path)
    np.testing.assert_array_equal(capture.read(1, 3)[:, 0], cube[1:3])
    os.truncate(path, 300)
    with pytest.raises(Sd2Error, match=r"a\.npy has become shorter"):
        capture.read(1, 2)


def test_what_has_no_description_is_told_how_to_get_one(tmp_path: Path) -> None:
    np.save(tmp_path / "mine.npy", CUBE)
    with pytest.raises(Sd2Error, match=r"sd2 radar describe mine\.npy"):
        load_capture(tmp_path / "mine.npy")
    with h5py.File(tmp_path / "mine.h5", "w") as file:
        file["adc"] = CUBE
    with pytest.raises(Sd2Error, match=r"has no DS1; it holds adc.*sd2 radar describe mine\.h5"):
        load_recorded_map(tmp_path / "mine.h5")
    (tmp_path / "mine.toml").write_text("[project]\n")
    with pytest.raises(Sd2Error, match=r"mine\.toml is there, and is no description"):
        _described(tmp_path / "mine.npy", CUBE)


def test_gigabytes_open_at_once_and_are_read_by_frames(tmp_path: Path) -> None:
    path = tmp_path / "long.npy"
    frames = 300_000
    with path.open("wb") as stream:  # sparse
        header = {"descr": "<i2", "fortran_order": False, "shape": (frames, 64, 128)}
        np.lib.format.write_array_header_1_0(stream, header)
        start = stream.tell()
        stream.write(b"\1")
    os.truncate(path, start + frames * 64 * 128 * 2)
    assert path.stat().st_size > 4e9
    told = FMCW | {"frame_repetition_s": 0.05}
    write_description(RadarDescription(axes=("frame", "chirp", "sample"), **told), path)
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    capture = load_capture(path)
    assert capture.frame_count == frames
    assert not capture.read(frames - 3, frames).any()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb < 300_000


def _chirps(velocity_mps: float, chirps: int = 256) -> np.ndarray:
    """Beat of a target at 1.5 m, complex64 (chirps, samples), without gaps."""
    at_s = np.arange(chirps)[:, None] * CHIRP_S
    delay_s = 2.0 * (1.5 - velocity_mps * at_s) / C_MPS
    slope = BANDWIDTH_HZ * RATE_HZ / SAMPLES
    turns = (CARRIER_HZ + slope * np.arange(SAMPLES) / RATE_HZ) * delay_s
    return np.exp(2j * np.pi * turns).astype(np.complex64)


PLAIN = ("frame", "chirp", "sample")
GAPLESS = {name: value for name, value in FMCW.items() if name != "frame_repetition_s"}


@pytest.mark.parametrize("by_samples", [False, True])
def test_chirps_without_gaps_are_cut_into_frames(tmp_path: Path, by_samples: bool) -> None:
    path, chirps = tmp_path / "a.npy", _chirps(1.0)
    np.save(path, chirps.T if by_samples else chirps)
    assert plain_axes(path, None)[0] == ("chirp", "sample")
    axes = ("sample", "chirp") if by_samples else ("chirp", "sample")
    write_description(RadarDescription(axes=axes, chirps_per_frame=48, **GAPLESS), path)
    capture = load_capture(path)
    assert capture.frame_count == 256 // 48
    np.testing.assert_allclose(capture.timebase.times_s, np.arange(5) * 48 * CHIRP_S)
    np.testing.assert_array_equal(capture.read(1, 3).reshape(-1, SAMPLES), chirps[48:144])


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_samples_of_matlab_are_those_in_the_order_of_matlab(tmp_path: Path, version: str) -> None:
    path = tmp_path / "a.mat"
    cube = _chirps(1.0).reshape(4, 64, SAMPLES).transpose(2, 1, 0)  # samples, chirps, frames
    if version == "5":
        savemat(path, {"adc": cube, "note": "a text", "about": {"fs": 2e6}})
    else:
        with h5py.File(path, "w", userblock_size=512) as file:
            pairs = np.zeros(cube.T.shape, [("real", "<f4"), ("imag", "<f4")])
            pairs["real"], pairs["imag"] = cube.T.real, cube.T.imag
            file["adc"] = pairs
    assert kind_of(path) == "radar"
    with pytest.raises(Sd2Error, match=r"a\.mat does not say what radar.*it holds adc"):
        load_capture(path)
    assert plain_axes(path, None) == (None, (SAMPLES, 64, 4))
    told = FMCW | {"frame_repetition_s": 0.1}
    write_description(RadarDescription(axes=("sample", "chirp", "frame"), **told), path)
    capture = load_capture(path)
    np.testing.assert_allclose(capture.read(0, 4)[:, 0], cube.transpose(2, 1, 0), rtol=1e-6)
    np.testing.assert_array_equal(capture.read(2, 3), capture.read(0, 4)[2:3])


def test_the_zero_of_complex_samples_is_that_of_both_their_parts(tmp_path: Path) -> None:
    counts = np.random.default_rng(1).integers(0, 256, (2, 8, SAMPLES, 2)).astype(np.uint8)
    together = counts[..., 0] + 1j * counts[..., 1]
    told = FMCW | {"zero": 127.5, "full_scale": 128.0}
    for name, array, axes in (
        ("apart", counts, (*PLAIN, "iq")),
        ("together", together.astype(np.complex64), PLAIN),
    ):
        path = tmp_path / f"{name}.npy"
        np.save(path, array)
        write_description(RadarDescription(axes=axes, **told), path)
        read = load_capture(path).read(0, 2)[:, 0]
        np.testing.assert_allclose(read, (together - (127.5 + 127.5j)) / 128.0, atol=1e-6)


def test_a_damaged_file_of_matlab_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    savemat(path, {"adc": _chirps(1.0)})
    path.write_bytes(path.read_bytes()[:300])
    told = RadarDescription(axes=("chirp", "sample"), chirps_per_frame=8, **GAPLESS)
    write_description(told, path)
    with pytest.raises(Sd2Error, match=r"a\.mat"):
        load_capture(path)
