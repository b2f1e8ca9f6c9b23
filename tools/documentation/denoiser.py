"""Makes ``denoiser.md`` and its picture: ``make denoiser``, half an hour for the campaign.

Every figure is measured when this runs. The campaign stays in ``build/denoiser`` (or
``--folder``); what is there is not made again.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sd2core.accuracy.cache import this_machine
from sd2core.body.parts import synthetic_map
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL, load_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.metrics import mean_velocity_error, peak_error, stands_out
from sd2core.doppler import Synthesizer
from sd2core.files.atomic import atomic_write_text
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.files.tables import markdown_table
from sd2core.fmcw import doppler_map
from sd2core.io.mesh import load_mesh
from sd2core.maps import DopplerMap, peak_velocity_mps
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.radar_config import CLUTTER, Clutter
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.simulate.campaign.takes import OPTIONS, Campaign, TakeMaker
from tools.documentation.places import BUILD, DOCS, IMAGES
from tools.documentation.runs import campaign_of, sd2, tables

SHOWN_FRAMES = 450
_FILTERS: tuple[Clutter, ...] = ("mean", CLUTTER)
LIMIT_TAKES = 16
_SIZES = (0.0, 0.5, 1.0, 1.5)
_FAST_MPS = 0.6
_ERROR_COLUMNS = ("peak MAE m/s", "in gestures", "fast: too slow by", "mean MAE m/s")

PAGE = """\
# The denoiser

What it makes of synthetic Doppler, measured. Made by

```
make denoiser
```

here with `--minutes {minutes}`, on {machine}. Models beside each other, and real radar, are in
[denoiser-comparison.md](denoiser-comparison.md).
The people that are judged were seen neither in training nor in choosing the best epoch. What the
errors are is written in `sd2core/denoise/metrics.py`; models and scaling are [decision
24](decisions/0024-scaling-and-models.md), the S4 itself [decision 23](decisions/0023-s4.md),
training [decision 25](decisions/0025-training-runs.md).

## The simulated campaign

`sd2 simulate campaign --people 6 --minutes 90 --seed N --limbs --fit-error-sizes 0,1.5
--out OUT` makes
pairs without a radar:
what a **simulated** 60 GHz radar shows of people's true motion (the target), and the synthetic
Doppler of bodies that err as fits of videos were measured to err (the input). People of random
shape swipe to the right, left, down and up in random order, rest, do other things, or step to and
fro, in takes of 15 s; each take has its own distance (1.5 to 4 m), heading, height of the camera,
and errors of its fit. With `--placements N` each take is also seen from N - 1 other ranges and
angles (range synthesis). Takes depend on seed, subject and number alone: a campaign that was
stopped goes on and comes out the same, and `--minutes` may be raised later. Split it by subject.

The input: a true motion with drawn errors of a fit, 5,000 vertices, counted as the paper's preset
counts them (exact visibility, smoothed), as a share of vertices × (2.2 m / R)⁴. The target: FMCW
samples of the true motion of a rough surface (1,229 vertices) with noise, rounding and static
clutter, through the chain of real captures, 12 looks averaged; a power of 1 is 1 m² rough surface
square on at 2.2 m; the mean noise is taken off, and what does not rise above it is zero. Bins 14 to
16 are empty in both.

The errors are not invented: `python -m tools.fitting errors` measured them on the sixteen clips of
[fitting.md](fitting.md) that show gestures and simple walks. How like those fits bodies are that
are disturbed by them, and what is simulated and what is not (reflections in the room, glints,
clothes, other people, fits that lose the person), is
[decision 26](decisions/0026-the-simulated-campaign.md). Here each take's errors are those times a
factor drawn between 0 and 1.5: some bodies are known well, as from motion capture, others badly
([decision 58](decisions/0058-bodies-known-well-and-badly.md)).

## The bundled models

`resources/denoiser.safetensors` takes the map, `resources/denoiser-limbs.safetensors` the maps of
five parts of the body ([decision 52](decisions/0052-limb-maps.md)); it is taken where no model is
named and the parts are known. Both are an S4, learnt with `--balanced`; their cards (`sd2 info`)
have command, data and limits. Judged on the last person of {minutes} minutes of the campaign (seed
1), whom they have not seen:

{bundled}
One take of that person, denoised from the maps of its parts; the radar is simulated:

![Synthetic, denoised and radar's map of one take](images/denoiser-triple.png)

How well the body is known decides what they do, in {limit_takes} takes of that person: errors of
the fit as measured (1 ×), larger, smaller, or none (0 ×). *Fast*: frames whose peak in the radar's
map is above {fast:g} m/s. *The radar again* saw the same motion with other noise and another rough
surface: nothing that knows only the motion can be expected to do better.

{limits}

## On the sample

The bundled recording's radar, **simulated** as well, saw the finest surface at one look, with other
noise, and its person is none of the campaign's. Peak velocity in the frames in which its map stands
out of the noise, mean absolute error in m/s. *Own mesh* is the true one; *fit of the video* is what
`sd2 fit` makes of the sample's video. Static echoes are taken off by the mean over the chirps, as
the program did before [decision 53](decisions/0053-what-stands-still.md), or by regression, as it
does now:

{sample}

{quiet}
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=BUILD / "denoiser")
    parser.add_argument("--minutes", type=float, default=168, help="of all people")
    options = parser.parse_args()
    campaign = campaign_of(
        options.folder, options.minutes, "--seed", 1, "--limbs", "--fit-error-sizes", "0,1.5"
    )
    pairs = read_pairs(campaign)
    models = [resource_path(f"{name}.safetensors") for name in (MAP_MODEL, LIMBS_MODEL)]
    _triple(models[-1], pairs)
    sample, quiet = _on_the_sample(options.folder, models)
    page = PAGE.format(
        limits=_limits(models, pairs),
        sample=sample,
        quiet=f"{quiet}\n{_campaign_quiet(pairs)}",
        limit_takes=LIMIT_TAKES,
        fast=_FAST_MPS,
        machine=this_machine(),
        minutes=f"{options.minutes:g}",
        bundled=tables(options.folder, models, campaign),
    )
    atomic_write_text(DOCS / "denoiser.md", page)


def _limits(paths: Sequence[Path], pairs: PairSet) -> str:
    """Errors by how well the body is known, and of what a denoiser could know, as a table."""
    models = [load_model(path) for path in paths]
    given = pairs.provenance
    campaign = Campaign(given["seed"], given["take_seconds"], limbs=True)
    judged = range(LIMIT_TAKES)
    person = len(pairs.subjects) - 1
    again = np.concatenate(
        [TakeMaker(campaign).make(person, number, look=1)[0].radar for number in judged]
    )
    rows = [["errors of the fit", "map", *_ERROR_COLUMNS]]
    for size in _SIZES:
        maker = TakeMaker(replace(campaign, error_sizes=(size, size)), FitErrors.load())
        takes = [maker.make(person, number)[0] for number in judged]
        shown = {"synthetic": np.concatenate([take.synthetic for take in takes])}
        for model in models:
            name = f"denoised ({model.card.inputs})"
            shown[name] = np.concatenate([_denoised(model, take) for take in takes])
        rows += [[f"{size:g} ×", name, *_errors(takes, one)] for name, one in shown.items()]
    return "\n".join(markdown_table([*rows, ["", "the radar again", *_errors(takes, again)]]))


def _errors(takes: Sequence[Take], values: NDArray[np.float32]) -> list[str]:
    """Cells of the columns :data:`_ERROR_COLUMNS`."""
    axis, nulled = OPTIONS.axis, OPTIONS.null_bins
    radar = np.concatenate([take.radar for take in takes])
    moving = np.concatenate([stands_out(take.radar, nulled) for take in takes])
    gesture = moving & np.concatenate([take.label > 0 for take in takes])
    found, seen = (np.nan_to_num(peak_velocity_mps(one, axis)) for one in (values, radar))
    fast = moving & (np.abs(seen) > _FAST_MPS)
    slower = (np.sign(seen) * (seen - found))[fast].mean()
    numbers = (
        peak_error(values[moving], radar[moving], axis).mae_mps,
        peak_error(values[gesture], radar[gesture], axis).mae_mps,
        slower,
        mean_velocity_error(values[moving], radar[moving], axis).mae_mps,
    )
    return [f"{number:.3f}" for number in numbers]


def _denoised(model: TrainedDenoiser, take: Take) -> NDArray[np.float32]:
    """What a model makes of a take, (frames, bins)."""
    return model.denoise_values(take.inputs(model.card.parts))


def _on_the_sample(folder: Path, paths: Sequence[Path]) -> tuple[str, str]:
    """Errors on the bundled recording, as a table, and what is shown where nothing moves."""
    recording = open_recording(resource_path("swipes.sd2"))
    fitted = folder / "sample-fit.zarr"
    if not fitted.exists():
        assert recording.video is not None
        sd2("fit", recording.video, "--out", fitted)
    meshes = {"own mesh": recording.load_mesh(), "fit of the video": load_mesh(fitted)}
    models = [load_model(path) for path in paths]
    found = {name: _maps_of(mesh, recording.sensor, models) for name, mesh in meshes.items()}
    rows = [["radar's filter", "mesh", "frames", *next(iter(found.values()))]]
    for clutter in _FILTERS:
        radar = doppler_map(recording.load_capture(), axis=OPTIONS.axis, clutter=clutter)
        seen = radar.values.T.copy()
        seen[:, list(OPTIONS.null_bins)] = 0.0
        moving = stands_out(seen, OPTIONS.null_bins)
        for name, maps in found.items():
            errors = [
                peak_error(one.values.T[moving], seen[moving], OPTIONS.axis).mae_mps
                for one in maps.values()
            ]
            shares = ["", *(f" ({one / errors[0] - 1.0:+.0%})" for one in errors[1:])]
            cells = [f"{one:.3f}{share}" for one, share in zip(errors, shares, strict=True)]
            rows.append([clutter, name, str(int(moving.sum())), *cells])
    quiet = [_quiet_words(name, maps) for name, maps in found.items()]
    return "\n".join(markdown_table(rows)), "\n".join(quiet)


def _campaign_quiet(pairs: PairSet) -> str:
    """What the radar shows where the synthetic map is empty, of the last person."""
    takes = pairs.of(pairs.subjects[-1:]).takes
    radar = np.concatenate([take.radar.sum(axis=1) for take in takes])
    empty = ~np.concatenate([take.synthetic.any(axis=1) for take in takes])
    return (
        f"- campaign: of {int(empty.sum())} frames whose synthetic map is empty, the radar's is not"
        f" in {np.count_nonzero(radar[empty]) / empty.sum():.1%}; they hold"
        f" {radar[empty].sum() / radar.sum():.2%} of its energy."
    )


def _maps_of(
    mesh: MeshSequence, sensor: VirtualSensor, models: Sequence[TrainedDenoiser]
) -> dict[str, DopplerMap]:
    """The synthetic map and what models make of it, by what these take."""
    synthetic = synthetic_map(Synthesizer(mesh, OPTIONS), sensor, limbs=True)
    return {"none": synthetic} | {one.card.inputs: one.denoise(synthetic) for one in models}


def _quiet_words(mesh: str, maps: Mapping[str, DopplerMap]) -> str:
    """What models show where the synthetic map is empty."""
    empty = ~maps["none"].values.any(axis=0)
    said = []
    for name, one in maps.items():
        strongest = one.values.max(axis=0)
        shown = strongest[empty]
        level = 10.0 * np.log10(max(float(shown.max(initial=0.0)), 1e-12) / strongest.max())
        if name != "none":
            said.append(f"{int((shown > 0).sum())} ({name}; at most {level:.0f} dB)")
    return (
        f"- {mesh}: of {int(empty.sum())} frames whose synthetic map is empty, denoised are not:"
        f" {', '.join(said)}. Levels are relative to the map's strongest cell."
    )


def _triple(path: Path, pairs: PairSet) -> None:
    """The liveliest take of the last person, whom the model has not seen: in, out, target."""
    model = load_model(path)
    take = max(pairs.of(pairs.subjects[-1:]).takes, key=lambda take: int((take.label > 0).sum()))
    maps = {
        "synthetic": take.synthetic,
        f"denoised ({model.card.model})": _denoised(model, take),
        f"radar ({pairs.kind})": take.radar,
    }
    figure = Figure(figsize=(9.6, 5.2), dpi=110, layout="constrained")
    extent = (0.0, SHOWN_FRAMES / pairs.frame_rate_hz, -pairs.axis.v_max_mps, pairs.axis.v_max_mps)
    for axis, (name, values) in zip(figure.subplots(3, 1, sharex=True), maps.items(), strict=True):
        shown = values[:SHOWN_FRAMES].T
        level_db = 10 * np.log10(np.maximum(shown / shown.max(), 1e-4))
        picture = axis.imshow(
            level_db, origin="lower", aspect="auto", extent=extent, cmap="viridis", vmin=-30, vmax=0
        )
        axis.set_ylabel("m/s")
        axis.set_title(name, fontsize=9, loc="left")
    axis.set_xlabel("s")
    figure.colorbar(picture, ax=figure.axes, label="dB below each map's own strongest cell")
    save_figure(figure, IMAGES / "denoiser-triple.png")


if __name__ == "__main__":
    main()
