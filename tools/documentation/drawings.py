"""Draw the figures of the concept pages: `python -m tools.documentation.drawings`.

Writes docs/images/concepts/NAME.svg. What they show is computed by the library, from the
bundled sample (simulated) or from a plate that moves as stated. `uncertainty` fits a body to
the sample's video, for which the landmark models are needed. The background is white, so that
drawings read alike on light and dark pages.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

import sd2core as sd2
from sd2core.compare.measures import line_of_sight_velocity
from sd2core.figures.colours import velocity_colours
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.fmcw.options import SignalOptions
from sd2core.fmcw.simulation import simulate_radar
from tools.documentation.measured import IMAGES, REPOSITORY, SAMPLE
from tools.documentation.runs import run
from tools.fitting.clip_score import speed_mps

CONCEPTS = IMAGES / "concepts"
SWIPE_S = (1.4, 3.0)
"""A swipe of the sample, with what lies around it."""

Array = NDArray[Any]
INK, RED, BLUE, GREY, AMBER = "#222222", "#b3321b", "#1f5fae", "#8a8a8a", "#d08a00"


def what_doppler_shows() -> Figure:
    """A swipe as sensors in front of the body and beside it see it."""
    mesh = _swipe()
    sensors = {
        "A, in front": sd2.VirtualSensor(),
        "B, to the side": sd2.VirtualSensor(position_m=(2.0, 0.0, 1.6)),
    }
    speeds_mps = speed_mps(np.asarray(mesh.vertices[:], float), mesh.times_s)
    frame = int(speeds_mps[1:-1].max(axis=1).argmax()) + 1
    before, now, after = mesh.vertices[frame - 1 : frame + 2].astype(float)
    velocity_mps = (after - before) / (mesh.times_s[frame + 1] - mesh.times_s[frame - 1])
    hand = np.argsort(np.linalg.norm(velocity_mps, axis=1))[-60:]
    at_m, moving_mps = now[hand].mean(0), velocity_mps[hand].mean(0)

    figure = Figure(figsize=(9.2, 4.6), layout="constrained")
    grid = figure.add_gridspec(2, 3, width_ratios=(1.25, 0.8, 1.1))
    plan = figure.add_subplot(grid[:, 0])
    towards_a = _towards_camera(mesh)[frame]
    plan.scatter(
        now[:, 0], now[:, 2], s=2, c=velocity_colours(towards_a, 1.0) / 255, rasterized=True
    )
    _arrow(plan, at_m, moving_mps, INK, "velocity of the hand")
    for colour, (name, sensor) in zip((RED, BLUE), sensors.items(), strict=True):
        place_m = np.array(sensor.position_m)
        sight = (place_m - at_m) / np.linalg.norm(place_m - at_m)
        plan.plot(*np.stack([place_m, at_m])[:, [0, 2]].T, ":", color=GREY, lw=1)
        plan.plot(place_m[0], place_m[2], "s", color=colour, ms=8)
        plan.annotate(
            name, place_m[[0, 2]], (0, -16), textcoords="offset points", ha="center", fontsize=8
        )
        part_mps = float(moving_mps @ sight)
        _arrow(plan, at_m, part_mps * sight, colour, f"seen by {name[0]}: {part_mps:+.2f} m/s")
    plan.set(aspect="equal", xlim=(-0.9, 2.7), ylim=(-0.45, 2.6))
    plan.set(xlabel="x, to the camera's right (m)", ylabel="z, away from the camera (m)")
    plan.set_title(f"From above, at {mesh.times_s[frame]:.2f} s", fontsize=9, loc="left")
    plan.legend(fontsize=7, loc="lower right", bbox_to_anchor=(1.0, 0.14))

    synthesizer = sd2.Synthesizer(mesh, replace(sd2.PRESETS["paper"], null_bins=()))
    for row, (colour, (name, sensor)) in enumerate(zip((RED, BLUE), sensors.items(), strict=True)):
        seen = synthesizer.map(sensor)
        spectrum, over_time = (figure.add_subplot(grid[row, column]) for column in (1, 2))
        spectrum.barh(
            seen.axis.centres_mps, seen.values[:, frame], seen.axis.bin_width_mps * 0.85,
            color=colour,
        )  # fmt: skip
        spectrum.set(ylim=(-2, 2), xlabel="energy", ylabel="velocity (m/s)", xscale="log")
        spectrum.set_xlim(1e-4, 2)
        spectrum.set_title(f"Frame, seen by {name}", fontsize=9, loc="left")
        _map(over_time, seen)
        over_time.axvline(mesh.times_s[frame], color="white", lw=1, ls="--")
        over_time.set_title("Map of the swipe", fontsize=9, loc="left")
        if row:
            over_time.set_xlabel("time (s)")
    return figure


def aliasing() -> Figure:
    """Two velocities with the same samples, and a fast plate folded by a simulated radar."""
    radar = sd2.PAPER_RADAR
    figure = Figure(figsize=(9.2, 3.3), layout="constrained")
    phases, folded = figure.subplots(1, 2, width_ratios=(1.0, 1.35))

    slow_mps = 1.2
    fast_mps = slow_mps - 2 * radar.v_max_mps
    chirps = np.arange(9)
    time_s = np.linspace(0, chirps[-1] * radar.chirp_repetition_s, 600)
    for velocity_mps, colour in ((slow_mps, BLUE), (fast_mps, RED)):
        frequency_hz = 2 * velocity_mps / radar.wavelength_m
        phases.plot(
            1e3 * time_s, np.cos(2 * np.pi * frequency_hz * time_s), color=colour, lw=1,
            label=f"{velocity_mps:+.1f} m/s",
        )  # fmt: skip
    sampled_s = chirps * radar.chirp_repetition_s
    sampled = np.cos(4 * np.pi * slow_mps / radar.wavelength_m * sampled_s)
    phases.plot(1e3 * sampled_s, sampled, "o", color=INK, ms=5, label="one sample per chirp")
    phases.set(xlabel="time (ms)", ylabel="real part of the echo", ylim=(-1.2, 1.75))
    phases.legend(fontsize=7, ncols=3, loc="upper center")
    phases.set_title(
        f"Chirps every {1e3 * radar.chirp_repetition_s:.2f} ms: the samples are the same",
        fontsize=9, loc="left",
    )  # fmt: skip

    plate, true_mps = _swinging_plate(5.0)
    capture = simulate_radar(plate, radar, options=SignalOptions(snr_db=30.0))
    _map(folded, sd2.doppler_map(capture))
    folded.plot(plate.times_s, true_mps, color=RED, lw=1.2, label="true velocity")
    for sign in (-1, 1):
        folded.axhline(sign * radar.v_max_mps, color=AMBER, lw=1, ls="--")
    folded.text(0.02, radar.v_max_mps + 0.15, f"v_max = {radar.v_max_mps:.2f} m/s", fontsize=8)
    folded.set(ylim=(-5.5, 5.5), xlabel="time (s)", ylabel="velocity (m/s)", facecolor="white")
    folded.legend(fontsize=7, loc="lower left")
    folded.set_title("A plate that swings, before a simulated radar", fontsize=9, loc="left")
    return figure


def emptied_bins() -> Figure:
    """Mean spectra of the sample: standing echoes, and what is left around zero without them."""
    capture, mesh = sd2.load_capture(SAMPLE / "radar"), sd2.load_mesh(SAMPLE / "mesh.zarr")
    axis = sd2.VelocityAxis()
    counting = sd2.Synthesizer(mesh, replace(sd2.PRESETS["paper"], null_bins=()))
    maps = {
        "radar (simulated)": sd2.doppler_map(capture, axis=axis),
        "radar, standing echoes filtered out": sd2.doppler_map(
            capture, axis=axis, clutter="regression"
        ),
        "vertices counted": counting.map(sd2.VirtualSensor()),
    }
    figure = Figure(figsize=(9.2, 3.3), layout="constrained")
    axes = figure.subplots()
    for colour, style, (name, doppler) in zip(
        (RED, AMBER, BLUE), ("-", "-", "--"), maps.items(), strict=True
    ):
        mean = doppler.values.mean(axis=1)
        moving = np.abs(axis.centres_mps) > 0.25
        level = 10 * np.log10(np.maximum(mean, 1e-12) / mean[moving].max())
        axes.step(axis.centres_mps, level, where="mid", color=colour, ls=style, label=name)
    nulled = sd2.PRESETS["paper"].null_bins
    low, high = axis.edges_mps[nulled[0]], axis.edges_mps[nulled[-1] + 1]
    axes.axvspan(low, high, color=GREY, alpha=0.3, lw=0)
    axes.annotate(
        f"bins {nulled[0]} to {nulled[-1]}:\n{low:+.3f} to {high:+.3f} m/s",
        (high, 0.85), (30, 0), xycoords=("data", "axes fraction"), textcoords="offset points",
        fontsize=8,
    )  # fmt: skip
    axes.set(
        xlim=(-2, 2), ylim=(-35, None), xlabel="velocity (m/s)",
        ylabel="mean level over the clip\n(dB, 0: strongest moving bin)",
    )  # fmt: skip
    axes.legend(fontsize=8, loc="upper left")
    return figure


def tolerance() -> Figure:
    """A map, a cheaper one, and the difference that a tolerance is about."""
    mesh = _swipe()
    paper = sd2.PRESETS["paper"]
    exact, cheap = (
        sd2.Synthesizer(mesh, options).map(sd2.VirtualSensor())
        for options in (replace(paper, oversampling=8), replace(paper, visibility="facing"))
    )
    difference = np.abs(cheap.values - exact.values)
    error = difference.sum() / exact.values.sum()
    figure = Figure(figsize=(9.2, 2.9), layout="constrained")
    panels = figure.subplots(1, 3, sharey=True)
    top = float(exact.values.max())
    for axes, values, title in zip(
        panels,
        (exact.values, cheap.values, difference),
        (
            f"As exact as can be: adds up to {exact.values.sum():.2f}",
            "What faces the sensor counts",
            f"Difference: adds up to {difference.sum():.2f}",
        ),
        strict=True,
    ):
        shown = _map(axes, replace(exact, values=values), top)
        axes.set_title(title, fontsize=9, loc="left")
        axes.set_xlabel("time (s)")
    panels[0].set_ylabel("velocity (m/s)")
    figure.colorbar(shown, ax=list(panels), pad=0.01, label="level (dB)")
    figure.suptitle(
        f"Error: {difference.sum():.2f} / {exact.values.sum():.2f} = {100 * error:.0f} %",
        x=0.01, ha="left", fontsize=10,
    )  # fmt: skip
    return figure


def uncertainty() -> Figure:
    """A hand's velocity by a fit with its σ, beside the truth, and a frame's cells with theirs."""
    truth = sd2.load_mesh(SAMPLE / "mesh.zarr")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fit.zarr"
        run("sd2core.cli", "fit", SAMPLE / "video.mp4", "--out", path)
        fitted = sd2.load_mesh(path)
        fitted = replace(fitted, vertices=np.asarray(fitted.vertices[:]))
    assert fitted.uncertainty is not None
    stretch = slice(*np.searchsorted(truth.times_s, SWIPE_S))
    speeds = np.abs(_towards_camera(truth)[stretch])
    hand = np.argsort(speeds.max(axis=0))[-60:]
    limb = int(np.bincount(fitted.uncertainty.vertex_limb[hand]).argmax())
    of_limb = fitted.uncertainty.vertex_limb == limb
    time_s = truth.times_s[stretch]
    mean_mps, sd_mps, true_mps = (
        _towards_camera(fitted)[stretch][:, of_limb].mean(axis=1),
        fitted.uncertainty.along_mps[stretch, limb],
        _towards_camera(truth)[stretch][:, of_limb].mean(axis=1),
    )
    figure = Figure(figsize=(9.2, 3.2), layout="constrained")
    course, cells = figure.subplots(1, 2)
    course.fill_between(
        time_s, mean_mps - sd_mps, mean_mps + sd_mps, color=BLUE, alpha=0.25, lw=0, label="± σ"
    )
    course.plot(time_s, mean_mps, color=BLUE, label="fitted")
    course.plot(time_s, true_mps, color=INK, ls="--", label="true (the sample is simulated)")
    course.set(xlabel="time (s)", ylabel="towards the sensor (m/s)")
    course.set_title("Velocity of the limb that swipes", fontsize=9, loc="left")
    course.legend(fontsize=7)

    maps = sd2.Synthesizer(fitted, replace(sd2.PRESETS["paper"], count="plain"))
    doppler = maps.map(sd2.VirtualSensor())
    frame = stretch.start + int(np.abs(mean_mps).argmax())
    known = maps.uncertainty(sd2.VirtualSensor(), frames=(frame, frame + 1))
    value = doppler.values[:, frame]
    axis = doppler.axis
    cells.bar(
        axis.centres_mps, value, 0.85 * axis.bin_width_mps, color=BLUE, alpha=0.45, label="map"
    )
    cells.errorbar(
        axis.centres_mps, known.expected[:, 0], known.sd[:, 0], fmt=".", color=INK, ms=3, lw=0.9,
        label="expected ± σ",
    )  # fmt: skip
    cells.set(xlabel="velocity (m/s)", ylabel="energy", ylim=(0, None))
    cells.set_title(f"Cells of the frame at {truth.times_s[frame]:.2f} s", fontsize=9, loc="left")
    cells.legend(fontsize=7)
    return figure


def simulated() -> Figure:
    """Ways from a movement to a map, and what each map is called."""
    capture = sd2.load_capture(SAMPLE / "radar")
    synthetic = sd2.Synthesizer(sd2.load_mesh(SAMPLE / "mesh.zarr")).map(sd2.VirtualSensor())
    figure = Figure(figsize=(9.2, 3.9))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 9.2), ylim=(0, 3.9))
    axes.axis("off")

    def box(x: float, row: int, words: str, *, computed: bool = False, name: bool = False) -> Text:
        edge, face = (AMBER, "#fdeccd") if computed else (GREY, "white")
        return axes.text(
            x, 3.4 - row, words, ha="center", va="center", fontsize=9, color=INK,
            weight="bold" if name else "normal",
            bbox={"boxstyle": "round,pad=0.4", "fc": face, "ec": "white" if name else edge},
        )  # fmt: skip

    person, radar, samples = box(0.8, 0, "person"), box(2.7, 0, "radar"), box(4.6, 0, "samples")
    echoes = box(2.7, 1, "echoes of all\ntriangles", computed=True)
    computed = box(4.6, 1, "computed\nsamples", computed=True)
    video, mesh, count = box(0.8, 2, "video"), box(2.7, 2, "mesh"), box(4.6, 2, "vertices counted")
    denoiser = box(4.6, 3, "denoiser")
    words = ("real map", "simulated map", "synthetic map", "denoised map")
    names = [box(6.5, row, name, name=True) for row, name in enumerate(words)]
    for one, other in (
        (person, radar), (radar, samples), (samples, names[0]),
        (echoes, computed), (computed, names[1]),
        (person, video), (video, mesh), (mesh, echoes), (mesh, count), (count, names[2]),
        (names[2], denoiser), (denoiser, names[3]),
    ):  # fmt: skip
        axes.annotate(
            "", other.get_position(), one.get_position(),
            arrowprops={"arrowstyle": "->", "color": GREY, "patchA": one.get_bbox_patch(),
                        "patchB": other.get_bbox_patch(), "shrinkA": 2, "shrinkB": 2},
        )  # fmt: skip
    maps = {
        1: sd2.doppler_map(capture, axis=synthetic.axis, clutter="regression"),
        2: synthetic,
        3: sd2.load_model(resource_path("denoiser.safetensors")).denoise(synthetic),
    }
    for row in range(len(words)):
        picture = figure.add_axes((7.4 / 9.2, (3.4 - row - 0.4) / 3.9, 1.7 / 9.2, 0.8 / 3.9))
        picture.set(xticks=[], yticks=[])
        if row in maps:
            _map(picture, maps[row])
        else:
            picture.text(0.5, 0.5, "needs a radar", ha="center", va="center", fontsize=8)
    return figure


def _arrow(axes: Axes, at_m: Array, moving_mps: Array, colour: str, words: str) -> None:
    """Velocity as an arrow from above, half a metre for 1 m/s."""
    end_m = at_m + 0.5 * moving_mps
    axes.annotate(
        "", end_m[[0, 2]], at_m[[0, 2]],
        arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    axes.plot([], [], color=colour, lw=2, label=words)


def _map(axes: Axes, doppler: sd2.DopplerMap, top: float | None = None) -> Any:
    """Levels of a map down to -30 dB, on its own axis."""
    top = top or float(doppler.values.max())
    level = 10 * np.log10(np.maximum(doppler.values, 1e-9 * top) / top)
    times_s = doppler.times_s
    return axes.imshow(
        level, origin="lower", aspect="auto", vmin=-30, vmax=0, cmap="viridis",
        interpolation="nearest",
        extent=(times_s[0], times_s[-1], doppler.axis.edges_mps[0], doppler.axis.edges_mps[-1]),
    )  # fmt: skip


def _swipe() -> sd2.MeshSequence:
    mesh = sd2.load_mesh(SAMPLE / "mesh.zarr")
    return mesh.between(*np.searchsorted(mesh.times_s, SWIPE_S).tolist())


def _towards_camera(mesh: sd2.MeshSequence) -> Array:
    """Velocity of every vertex towards the camera, (T, V)."""
    return line_of_sight_velocity(np.asarray(mesh.vertices[:], float), mesh.times_s)


def _swinging_plate(peak_mps: float) -> tuple[sd2.MeshSequence, Array]:
    """A small plate that swings along the line of sight, and its velocity."""
    times = sd2.Timebase.regular(frames=90, frames_per_s=60)
    swing_rad = 2 * np.pi * 0.75 * times.times_s
    velocity_mps = peak_mps * np.sin(swing_rad)
    way_m = peak_mps / (2 * np.pi * 0.75) * (1 - np.cos(swing_rad))
    half_m = 0.02
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half_m
    vertices_m = corners + np.stack([0 * way_m, 0 * way_m, 4.0 - way_m], 1)[:, None]
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    return sd2.MeshSequence(vertices_m, faces, times), velocity_mps


def main() -> None:
    """Draw them all."""
    CONCEPTS.mkdir(exist_ok=True)
    for drawn in (what_doppler_shows, aliasing, emptied_bins, tolerance, uncertainty, simulated):
        path = CONCEPTS / f"{drawn.__name__.replace('_', '-')}.svg"
        save_figure(drawn(), path, {"made by": "tools.documentation.drawings"})
        print(path.relative_to(REPOSITORY))


if __name__ == "__main__":
    main()
