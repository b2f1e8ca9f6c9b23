"""Makes ``paper.md`` and its pictures: ``make paper``, half an hour after ``make classifier``.

The SD² paper's figures and tables, and its sentences with their places in the program. Runs and
campaigns stay in ``build/paper``, the study of classifiers where ``make classifier`` keeps it; what
is there is not made again.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sd2core.accuracy.cache import this_machine
from sd2core.classify.metrics import mean_recall, shares
from sd2core.denoise.files import load_model
from sd2core.denoise.metrics import VelocityError, peak_error, stands_out
from sd2core.doppler import PRESETS, Synthesizer
from sd2core.figures.maps import Levels, MapRow, draw_maps
from sd2core.figures.strip import plot_strip
from sd2core.figures.strip_source import StripOptions, StripSource
from sd2core.figures.surface import Frame, find_visible_triangles, project_vertices
from sd2core.files.figure_files import save_figure
from sd2core.maps import DopplerMap, MapKind
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from tools.documentation.measured import (
    BUILD,
    DOCS,
    IMAGES,
    REPOSITORY,
    SAMPLE,
    filled,
    spread,
    spread_of,
    table,
    write_page,
)
from tools.documentation.runs import Job, campaign_of, epochs_in, evaluated, settings, train

FOLDER, STUDY = BUILD / "paper", BUILD / "classifier" / "to-and-fro"
DROPOUT = 0.1
SEEDS, MINUTES, CAMPAIGN_MINUTES = 3, 2.0, 18.0
"""Trainings of each denoiser, minutes of each, and minutes of all people."""

TITLES = {"s4": "S4", "swin": "Swin transformer", "unet": "U-Net"}
PRINTED = {"s4": (1.0126, 1.6329), "swin": (1.1640, 1.8734), "unet": (1.5835, 2.6549)}
"""The paper's Table 1: MAE and σ in m/s."""
PIXELS_PER_INCH = 110
SEED = 5
CLASSES = ("horizontal", "vertical", "background")
ADDED = {"radar only": "radar alone", "+ denoised": "+ denoised"}
"""The paper's training data, and ours in a study."""
GIVEN = {
    "radar only": [[87.3, 5.3, 7.4], [6.8, 89.1, 4.1], [3.8, 4.1, 92.1]],
    "+ denoised": [[91.6, 4.0, 4.5], [4.1, 92.2, 3.7], [2.5, 3.2, 94.3]],
}
"""The paper's Tables 2 and 3, in per cent; rows are true classes."""
PAPER_NETWORK = "LSTM 16, strongest bin, at once"
SHOWN_MINUTES = 3.0
"""Of a campaign, for two takes of everybody; a longer one begins with the same ones."""


def main() -> None:
    """Measure and write the page."""
    values = {**_pictures(), **_denoisers(), **_classifiers()}
    write_page("paper.md", linked(filled("paper.md", machine=this_machine(), **values)))


def linked(text: str) -> str:
    """Replace ``[[file.py:name]]`` and ``[[number]]`` by links to code and decisions.

    Files are below sd2core. ValueError for a name or a decision that is not there.
    """
    return re.sub(r"\[\[(.+?)\]\]", _link, text)


def _link(match: re.Match[str]) -> str:
    path, _, name = match[1].partition(":")
    if path.isdecimal():
        pages = list((DOCS / "decisions").glob(f"{int(path):04d}-*.md"))
        if len(pages) != 1:
            raise ValueError(f"there is no decision {path}")
        return f"[decision {path}](decisions/{pages[0].name})"
    code = (REPOSITORY / "sd2core" / path).read_text("utf-8")
    known = rf"^( *(class|def) {name.rpartition('.')[2]}\b|{name}\b.*=)"
    if name and not re.search(known, code, re.MULTILINE):
        raise ValueError(f"{path} has no {name}")
    return f"[`{name or path}`](../sd2core/{path})"


def _pictures() -> dict[str, float]:
    """Figures 2, 4 and 7."""
    bodies = draw_bodies(IMAGES / "paper-mesh.png", IMAGES / "paper-range.png")
    pairs = read_pairs(_campaign("to-and-fro", SHOWN_MINUTES))
    takes = {
        "Horizontal": _first(pairs, ("left-to-right", "right-to-left")),
        "Vertical": _first(pairs, ("up-to-down", "down-to-up")),
    }
    rows = [
        _row(pairs, take, values, kind, f"{name} swipes, {title}")
        for name, take in takes.items()
        for title, values, kind in (
            ("radar (simulated)", take.radar, "simulated"),
            ("synthetic", take.synthetic, "synthetic"),
        )
    ]
    _save_maps("paper-swipes.png", rows, "Figure 7 on simulated people before a simulated radar")
    return bodies


def _campaign(order: str, minutes: float) -> Path:
    """A campaign of the paper's protocol; what is there of it is not made again."""
    how = ("--protocol", "paper", "--order", order, "--seed", SEED)
    return campaign_of(FOLDER / "protocols" / order, minutes, *how)


def _first(pairs: PairSet, swipes: Sequence[str]) -> Take:
    """The first take with such swipes only."""
    wanted = {pairs.labels.index(name) for name in swipes}
    return next(take for take in pairs.takes if set(np.unique(take.label)) - {0} == wanted)


def _row(pairs: PairSet, take: Take, values: np.ndarray, kind: MapKind, title: str) -> MapRow:
    doppler = DopplerMap(
        values.T, pairs.axis, Timebase(take.times_s), kind, null_bins=pairs.null_bins
    )
    return MapRow(doppler, title, float(values.max()))


def _save_maps(name: str, rows: Sequence[MapRow], heading: str) -> None:
    end_s = rows[0].doppler.timebase.end_s
    figure = draw_maps(rows, Levels(), start_s=0.0, end_s=end_s, heading=heading)
    save_figure(figure, IMAGES / name, pixels_per_inch=PIXELS_PER_INCH)


def _denoisers() -> dict[str, Any]:
    """Figure 6 and Table 1."""
    campaign = _campaign("random", CAMPAIGN_MINUTES)
    how = settings({"dropout": DROPOUT})
    runs, epochs = [], {}
    for name, title in TITLES.items():
        job = Job(name, campaign, ("--model", name, *how))
        epochs[title] = epochs_in(FOLDER, job, MINUTES)
        runs += job.seeds(SEEDS, epochs[title])
    evaluation = evaluated(train(FOLDER, runs), campaign)
    judged = read_pairs(campaign).of(evaluation["subjects"])
    _compare(judged, {name: FOLDER / f"{name}-0" for name in PRINTED})
    return {
        "seed": SEED,
        "campaign_minutes": CAMPAIGN_MINUTES,
        "seeds": SEEDS,
        "minutes": MINUTES,
        "dropout": DROPOUT,
        "epochs": ", ".join(f"{title} {count} epochs" for title, count in epochs.items()),
        "frames": evaluation["frames"],
        "moving": evaluation["moving_frames"],
        "table_1": table_1(evaluation, _nothing_moves(judged)),
        "findings": findings(evaluation, judged.axis.bin_width_mps),
    }


def _compare(judged: PairSet, runs: Mapping[str, Path]) -> None:
    """Draw the take with most gestures as every model has it."""
    take = max(judged.takes, key=lambda take: int((take.label > 0).sum()))
    rows = [_row(judged, take, take.synthetic, "synthetic", "Synthetic")]
    for name, run in runs.items():
        values = load_model(run / "best.safetensors").denoise_values(take.synthetic)
        rows.append(_row(judged, take, values, "denoised", f"Denoised by {TITLES[name]}"))
    rows.append(_row(judged, take, take.radar, "simulated", "Radar (simulated)"))
    _save_maps("paper-denoised.png", rows, "Figure 6 on a simulated person, simulated radar")


def _nothing_moves(judged: PairSet) -> VelocityError:
    """Error of answering 0 m/s everywhere."""
    radar = np.concatenate([take.radar for take in judged.takes])
    moving = np.concatenate([stands_out(take.radar, judged.null_bins) for take in judged.takes])
    return peak_error(np.zeros_like(radar), radar, judged.axis, moving)


def table_1(evaluation: Mapping[str, Any], nothing: VelocityError) -> str:
    """The paper's Table 1 beside that of ``sd2 eval``, in Markdown."""
    groups = {group["model"]: group for group in evaluation["groups"]}
    ours = {name: groups[name]["peak_mae_mps"]["mean"] for name in (*PRINTED, "none")}
    head = ["", "paper, real radar: MAE", "σ", "S4 to it"]
    rows = [[*head, "ours, simulated radar: MAE", "σ", "S4 to it", "to none"]]
    for name, of_paper in PRINTED.items():
        rows.append(
            [
                TITLES[name],
                *(f"{value:.4f}" for value in of_paper),
                _change(PRINTED["s4"][0], of_paper[0]),
                *(spread(groups[name][key]) for key in ("peak_mae_mps", "peak_sd_mps")),
                _change(ours["s4"], ours[name]),
                _change(ours[name], ours["none"]),
            ]
        )
    none = (spread(groups["none"][key]) for key in ("peak_mae_mps", "peak_sd_mps"))
    rows.append(["none", "", "", "", *none, _change(ours["s4"], ours["none"]), ""])
    still = (f"{nothing.mae_mps:.3f}", f"{nothing.sd_mps:.3f}")
    rows.append(["nothing moves", "", "", "", *still, _change(ours["s4"], nothing.mae_mps)])
    rows[-1].append(_change(nothing.mae_mps, ours["none"]))
    return table(rows) + "\n"


def findings(evaluation: Mapping[str, Any], bin_mps: float) -> str:
    """Sentences from the numbers of Table 1."""
    ours = {group["model"]: group["peak_mae_mps"]["mean"] for group in evaluation["groups"]}
    ratios = "; ".join(
        f"against the {TITLES[name]} {_change(ours['s4'], ours[name])} here and"
        f" {_change(PRINTED['s4'][0], PRINTED[name][0])} in the paper"
        for name in ("swin", "unet")
    )
    theirs_bins = [mae_mps / bin_mps for mae_mps, _ in PRINTED.values()]
    ours_bins = [ours[name] / bin_mps for name in PRINTED]
    return (
        f"S4's MAE {ratios}. In bins of {bin_mps:g} m/s, as they are here, the paper's errors are"
        f" {min(theirs_bins):.1f} to {max(theirs_bins):.1f}, ours {min(ours_bins):.1f} to"
        f" {max(ours_bins):.1f}."
    )


def _change(value: float, reference: float) -> str:
    return "" if value == reference else f"{100 * (value / reference - 1):+.0f} %".replace("-", "−")


def _classifiers() -> dict[str, Any]:
    """Tables 2 and 3."""
    study = json.loads((STUDY / "study.json").read_text("utf-8"))
    totals = {one["title"]: one["seeds"] for one in study["totals"]}
    tables = tables_2_and_3(study["classes"], totals)
    return {"classifier_seeds": study["plan"]["seeds"], "tables_2_and_3": tables}


def tables_2_and_3(classes: Sequence[str], totals: Mapping[str, Any]) -> str:
    """The paper's Tables 2 and 3 beside ours, in Markdown; only means over the classes have a ±."""
    at = [classes.index(name) for name in CLASSES]

    def confusions(title: str) -> np.ndarray:
        return np.array([np.array(seed["frames"])[np.ix_(at, at)] for seed in totals[title]])

    def mean(title: str) -> str:
        return spread_of([100.0 * mean_recall(one) for one in confusions(title)], 1)

    rows = [["true"], *([name] for name in CLASSES), ["mean"], ["the paper's network, mean"]]
    for words, title in ADDED.items():
        rows[0] += [f"the paper, {words}", f"ours, {words}"]
        ours = 100.0 * np.mean([shares(one) for one in confusions(title)], axis=0)
        for row, given, own in zip(rows[1:], GIVEN[words], ours, strict=False):
            row += [" / ".join(f"{value:.1f}" for value in values) for values in (given, own)]
        rows[-2] += [f"{np.diagonal(GIVEN[words]).mean():.1f}", mean(title)]
        rows[-1] += ["", mean(PAPER_NETWORK) if title == "radar alone" else ""]
    return table(rows)


FRAMES = range(100, 141, 10)
FRAME = 120
NEAR_M, FAR_M = 2.2, 6.0
"""Ranges of Figure 4; the sample's person is at the nearer one from the camera."""
_HEIGHT_PX, _PIXELS_PER_INCH = 560, 150


def draw_bodies(mesh_figure: Path, range_figure: Path) -> dict[str, float]:
    """Draw both figures, and return the numbers that are told of the second."""
    recording = open_recording(SAMPLE)
    mesh = recording.load_mesh()
    with recording.open_video() as video:
        source = StripSource.of(recording, video, mesh, recording.title)
        strip = plot_strip(source, FRAMES, StripOptions(as_dots=True, v_max_mps=1.5))
        save_figure(strip, mesh_figure, pixels_per_inch=_PIXELS_PER_INCH)
    _draw_ranges(mesh, source, range_figure)
    maps = Synthesizer(mesh, replace(PRESETS["paper"], count="plain"))
    near, far = (maps.map(_sensor(range_m)).values.sum() for range_m in (NEAR_M, FAR_M))
    shares = {"share": 100 * float(far / near), "law": 100 * (NEAR_M / FAR_M) ** 4}
    return {"frame": FRAME, "near": NEAR_M, "far": FAR_M, **shares}


def _sensor(range_m: float) -> VirtualSensor:
    return VirtualSensor((0.0, 0.0, round(NEAR_M - range_m, 3)))


def _draw_ranges(mesh: MeshSequence, source: StripSource, path: Path) -> None:
    figure = Figure(figsize=(7.2, 4.4), dpi=110, layout="constrained")
    for axes, range_m in zip(figure.subplots(1, 2), (NEAR_M, FAR_M), strict=True):
        seen = np.asarray(mesh.frame(FRAME), np.float64) - _sensor(range_m).position_m
        assert mesh.faces is not None  # The sample's mesh has them.
        picture = axes.imshow(_distances_m(seen, mesh.faces, source), cmap="viridis")
        axes.set_axis_off()
        axes.set_title(f"simulated body, from {range_m:g} m", fontsize=9)
        figure.colorbar(picture, ax=axes, label="distance from the sensor (m)", shrink=0.85)
    save_figure(figure, path)


def _distances_m(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], source: StripSource
) -> NDArray[np.float64]:
    """Distance of what each pixel shows, NaN beside the body."""
    pixels, _ = project_vertices(vertices_m, source.camera)
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    zoom = _HEIGHT_PX / float((high - low).max())
    width, height = np.ceil(zoom * (high - low)).astype(int)
    frame = Frame(float(low[0]), float(low[1]), int(width), int(height), zoom)
    view = find_visible_triangles(vertices_m, faces, source.camera, frame)
    distances_m = np.full(view.owner.shape, np.nan)
    ranges_m = np.linalg.norm(vertices_m, axis=1)
    distances_m[view.shown] = view.interpolated(ranges_m[:, None])[:, 0]
    return distances_m


if __name__ == "__main__":
    main()
