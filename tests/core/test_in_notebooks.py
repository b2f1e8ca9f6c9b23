"""A map in a notebook: an array, a picture, an xarray, one line; and errors that say what to do."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

import sd2core as sd2
from sd2core.labels.spans import Labels, Span
from sd2core.maps import CellUncertainty, LimbMaps
from sd2core.mesh.vertex_parts import JOINTS, PARTS, QUANTITIES


def made(frames: int = 60, bins: int = 16, start_s: float = 0.0) -> sd2.DopplerMap:
    rng = np.random.default_rng(bins)
    values = rng.random((bins, frames)).astype(np.float32)
    values[bins // 2] = 0.0
    return sd2.DopplerMap(
        values,
        sd2.VelocityAxis(bins, 2.0),
        sd2.Timebase.regular(frames, 30.0, start_s),
        "synthetic",
        unit="share of vertices",
        null_bins=(bins // 2,),
        present=np.arange(frames) % 7 != 3,
        uncertainty=CellUncertainty(values + 1, values + 2),
        limbs=LimbMaps(
            PARTS,
            rng.random((len(PARTS), bins, frames), np.float32),
            np.zeros((len(JOINTS), len(QUANTITIES), frames), np.float32),
        ),
    )


def test_numpy_takes_a_map_as_its_values() -> None:
    doppler = made()
    assert doppler.shape == np.shape(doppler) == (16, 60)
    assert np.array_equal(np.asarray(doppler), doppler.values)
    assert np.asarray(doppler, np.float64).dtype == np.float64
    assert np.asarray(doppler) is doppler.values
    assert np.array(doppler) is not doppler.values
    assert np.sqrt(doppler).shape == (16, 60)


@given(st.integers(2, 12), st.floats(0.05, 3.0))
def test_narrower_maps_keep_their_velocities(half: int, v_mps: float) -> None:
    doppler = made(bins=2 * half)
    inside = np.abs(doppler.axis.centres_mps) + doppler.axis.bin_width_mps / 2 <= v_mps + 1e-9
    if inside.sum() < 2:
        with pytest.raises(sd2.Sd2Error, match="2 or more"):
            doppler.within(v_mps)
        return
    found = doppler.within(v_mps)
    np.testing.assert_allclose(found.axis.centres_mps, doppler.axis.centres_mps[inside], atol=1e-9)
    assert np.array_equal(found.values, doppler.values[inside])
    assert found.uncertainty is not None
    assert np.array_equal(found.uncertainty.sd, found.values + 2)
    assert found.limbs is not None
    assert doppler.limbs is not None
    assert np.array_equal(found.limbs.values, doppler.limbs.values[:, inside])
    for number in found.null_bins:
        assert found.axis.centres_mps[number] == pytest.approx(doppler.axis.centres_mps[half])


def test_a_narrower_map_does_not_say_what_is_beyond_the_wider_axis() -> None:
    doppler = made()
    doppler.meta["beyond_share"] = [0.0] * 60
    doppler.meta["visible_share"] = [0.5] * 60
    assert doppler.within(1.0).meta == {"visible_share": [0.5] * 60}


def test_velocities_and_bins_that_are_no_numbers_of_these_are_refused() -> None:
    with pytest.raises(sd2.Sd2Error, match=r"within ±nan m/s"):
        made().within(float("nan"))
    with pytest.raises(sd2.Sd2Error, match="whole, 2 to"):
        sd2.VelocityAxis(32.0)  # type: ignore[arg-type]


@given(st.floats(-1, 4), st.floats(-1, 4))
def test_a_part_of_the_time(start_s: float, end_s: float) -> None:
    doppler = made(start_s=0.5)
    inside = (doppler.times_s >= start_s - 1e-6) & (doppler.times_s < end_s - 1e-6)
    if not inside.any():
        with pytest.raises(sd2.Sd2Error, match="no frame"):
            doppler.during(start_s, end_s)
        return
    found = doppler.during(start_s, end_s)
    assert np.array_equal(found.times_s, doppler.times_s[inside])
    assert np.array_equal(found.values, doppler.values[:, inside])


def test_typed_times_are_those_of_frames_whatever_the_offset() -> None:
    for offset_s in np.round(np.arange(-1.0, 1.0, 0.05), 2):
        doppler = made(start_s=0.0).shifted(offset_s)
        times_s = doppler.during(round(0.3 + offset_s, 3), round(0.6 + offset_s, 3)).times_s
        np.testing.assert_allclose(times_s, doppler.times_s[9:18])


def test_levels_are_below_the_strongest_cell() -> None:
    doppler = made()
    level = doppler.db()
    assert np.nanmax(level) == 0.0
    assert np.isnan(level[8]).all()
    np.testing.assert_allclose(doppler.db(2.0)[0], 10 * np.log10(doppler.values[0] / 2), atol=1e-5)
    with pytest.raises(sd2.Sd2Error, match="above 0"):
        doppler.db(0.0)


def test_a_picture_has_the_axes_of_the_map() -> None:
    doppler = made(start_s=1.0)
    axes = doppler.plot(Figure().subplots())
    low, high = axes.get_xlim()
    assert (low, high) == pytest.approx((1.0, doppler.timebase.end_s))
    assert axes.get_ylim() == pytest.approx((-2.0, 2.0))
    assert "m/s" in axes.get_ylabel()
    (cells, *_) = axes.collections
    assert cells.get_array().shape == (16, 60)
    assert cells.get_clim() == (-30.0, 0.0)
    assert axes.get_title() == "synthetic"


def test_xarray_slices_by_both_axes() -> None:
    doppler = made()
    array = doppler.to_xarray()
    part = array.sel(time_s=slice(0.5, 1.0), velocity_mps=slice(0, None))
    times = (doppler.times_s >= 0.5) & (doppler.times_s <= 1.0)
    assert np.array_equal(part.values, doppler.values[doppler.axis.centres_mps >= 0][:, times])
    assert (array.name, array.attrs["units"]) == ("synthetic", "share of vertices")
    assert array.time_s.attrs["units"] == "s"


def test_without_xarray_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(sd2.Sd2Error, match="pip install"):
        made().to_xarray()


def test_one_line_says_what_is_held() -> None:
    mesh = sd2.MeshSequence(np.ones((4, 5, 3)), None, sd2.Timebase.regular(4, 10), "walk.npz")
    capture = sd2.open_sample().load_capture()
    labels = Labels(
        spans=tuple(Span(n + 1, "Gestures", n, n + 0.5, f"g{n % 9}") for n in range(20))
    )
    for held, words in (
        (made(), ("synthetic, 16 bins over ±2 m/s", "60 frames", "1 bins emptied", "by parts")),
        (mesh, ("5 vertices, no triangles", "4 frames", "walk.npz")),
        (capture, ("simulated", "60 GHz", "450 frames")),
        (labels, ("20 spans on Gestures", "g0 3", "3 other labels")),
        (made().timebase, ("60 frames, 2.000 s, 30.00 frames/s",)),
    ):
        shown = repr(held)
        assert "\n" not in shown
        assert len(shown) < 220
        for word in words:
            assert word in shown


def test_a_map_needs_no_sensor() -> None:
    mesh = sd2.open_sample().load_mesh().between(40, 46)
    maps = sd2.Synthesizer(mesh)
    at_camera = maps.map(sd2.VirtualSensor(), visibility="none")
    assert np.array_equal(maps.map(visibility="none"), at_camera)


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda: sd2.load_mesh(None), "a str"),
        (lambda: sd2.open_recording(7), "a str"),
        (lambda: sd2.load_capture([]), "a str"),
        (lambda: sd2.open_video({}), "a str"),
        (lambda: sd2.load_model(made()), "a str"),
        (lambda: sd2.save_mesh(made(), "a.npz"), "a MeshSequence"),
        (lambda: sd2.Synthesizer("walk.npz"), "a MeshSequence"),
        (lambda: sd2.virtual_imu("walk.npz", "head"), "a MeshSequence"),
        (lambda: sd2.doppler_map("recording/"), "a RadarCapture"),
        (
            lambda: sd2.Synthesizer(sd2.open_sample().load_mesh()).map((0, 0, 1)),
            "a VirtualSensor",
        ),
    ],
)
def test_what_is_of_another_type_is_explained(call: Callable[[], object], expected: str) -> None:
    with pytest.raises(sd2.Sd2Error) as refused:
        call()
    assert refused.value.expected == expected
    assert refused.value.remedy


@pytest.mark.slow
def test_the_library_is_typed(tmp_path: Path) -> None:
    """A project of a user's own passes mypy, and a wrong call does not."""
    api = pytest.importorskip("mypy.api")
    good = tmp_path / "good.py"
    good.write_text(
        "import sd2core as sd2\n"
        "mesh = sd2.open_sample().load_mesh()\n"
        "doppler = sd2.Synthesizer(mesh).map(sd2.VirtualSensor((0.5, 0.0, 0.0)))\n"
        "bins: int = doppler.within(1.0).during(1.0, 2.0).shape[0]\n"
        "fastest: float = float(doppler.peak_velocity_mps().max())\n"
    )
    bad = tmp_path / "bad.py"
    bad.write_text("import sd2core as sd2\nsd2.load_mesh(frames_per_s='30', path='a.npz')\n")
    options = ["--strict", "--follow-imports=silent", "--cache-dir", str(tmp_path / "cache")]
    said, errors, code = api.run([*options, str(good)])
    assert code == 0, said + errors
    said, _, code = api.run([*options, str(bad)])
    assert code == 1
    assert "frames_per_s" in said
