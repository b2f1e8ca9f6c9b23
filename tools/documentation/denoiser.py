"""Makes ``denoiser.md`` and its picture: ``make denoiser``, half an hour for the campaign.

Every figure is measured when this runs. The campaign stays in ``build/denoiser`` (or
``--folder``); what is there is not made again.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sd2core.accuracy.cache import this_machine
from sd2core.body.parts import synthetic_map
from sd2core.denoise.files import LIMBS_MODEL, MAP_MODEL, load_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.metrics import peak_error, stands_out
from sd2core.doppler import Synthesizer
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.files.tables import markdown_table
from sd2core.fmcw import doppler_map
from sd2core.io.mesh import load_mesh
from sd2core.maps import DopplerMap, peak_velocity_mps
from sd2core.mesh.sequence import MeshSequence
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.radar_config import CLUTTER
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.simulate.campaign.fit_errors import FitErrors
from sd2core.simulate.campaign.takes import OPTIONS, Campaign, TakeMaker
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, IMAGES
from tools.documentation.runs import ERRORS, campaign_of, errors_of, evaluated, sd2

SHOWN_FRAMES = 450
LIMIT_TAKES = 16
_SIZES = (0.0, 0.5, 1.0, 1.5)
_FAST_MPS = 0.6

PAGE = """\
# The denoiser

How near do the bundled denoisers bring a synthetic map to a radar's? Measured on a person whom
they have not seen, and on the bundled sample. **Every radar here is simulated**; other models
are in [denoisers compared](denoiser-comparison.md), a real radar in
[denoisers on a real radar](real-denoisers.md). Made by

```sh
make denoiser
```

with `--minutes {minutes}`, on {machine}.

## The simulated campaign

`sd2 simulate campaign --people 6 --minutes {minutes} --seed 1 --limbs --fit-error-sizes 0,1.5
--out campaign.zarr` makes pairs without a radar: takes of 15 s of people of random shape who swipe,
rest and do other things, 1.5 to 4 m away.

- *Target*: what a simulated 60 GHz radar, with noise and clutter, shows of the true motion.
- *Input*: the synthetic map of a body that errs as fits of videos were measured to
  ([fitting](fitting.md)), times a factor between 0 and 1.5, drawn for each take
  ([decision 58](decisions/0058-bodies-known-well-and-badly.md)).

What is simulated and what is not: [decision 26](decisions/0026-the-simulated-campaign.md).

## The bundled models

`resources/denoiser.safetensors` takes the map, `resources/denoiser-limbs.safetensors` the maps of
five parts of the body (*limbs*, [decision 52](decisions/0052-limb-maps.md)). Both are an S4
([decision 23](decisions/0023-s4.md)); `sd2 info` tells how they were trained. *None* is the
synthetic map; *median*, *wiener* and *ridge* are filters. *Peak*: velocity of the strongest bin,
*mean*: of the whole column, both in the {moving:,} of {frames:,} frames in which the radar of the
one person judged shows movement. *Map*: all cells.

{bundled}

![Synthetic, denoised and radar's map of one take](images/denoiser-triple.png)

How well the body is known decides what they do. {limit_takes} takes of the same person, with errors
of the fit as measured (1 ×), larger, smaller, or none (0 ×), in m/s. *Too slow by*: in frames whose
peak in the radar's map is above {fast:g} m/s. In the mean peaks come nearer; fast movements come
out slower than in the synthetic map.

{limits}

A second look of the radar, with other noise and another rough surface, errs by {again_mae:.3f} m/s
and is {again_slower:.3f} m/s too slow: nothing that knows only the motion can be expected to do
better.

## On the sample

The bundled recording's radar, **simulated** as well, has more noise, and its person is none of the
campaign's. **The denoiser makes the peak velocity {verdict} there.** Mean error of the peak in the
{sample_frames} frames that stand out of the noise, m/s. *Own mesh* is the true one; *fit of the
video* is what `sd2 fit` makes of the sample's video.

{sample}

## What this cannot say

- Nothing about a real radar: reflections in the room, clothes, other people and lost fits are
  missing.
- One person is judged, by one training of either model: there is no spread to hold differences
  against.
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
    evaluation = evaluated(models, campaign)
    page = PAGE.format(
        **_limits(models, pairs),
        **_on_the_sample(options.folder, models),
        limit_takes=LIMIT_TAKES,
        fast=_FAST_MPS,
        machine=this_machine(),
        minutes=f"{options.minutes:g}",
        frames=evaluation["frames"],
        moving=evaluation["moving_frames"],
        bundled=_bundled(evaluation),
    )
    write_page("denoiser.md", page)


def _bundled(evaluation: Mapping[str, Any]) -> str:
    """Errors of the filters and the bundled models, as a table."""
    rows = [[group["name"], *errors_of(group)] for group in evaluation["groups"]]
    return "\n".join(markdown_table([["model", *ERRORS.values()], *rows]))


def _limits(paths: Sequence[Path], pairs: PairSet) -> dict[str, Any]:
    """Errors by how well the body is known, as a table, and those of what could be known."""
    models = [load_model(path) for path in paths]
    given = pairs.provenance
    campaign = Campaign(given["seed"], given["take_seconds"], limbs=True)
    judged = range(LIMIT_TAKES)
    person = len(pairs.subjects) - 1
    again = np.concatenate(
        [TakeMaker(campaign).make(person, number, look=1)[0].radar for number in judged]
    )
    errors = {}
    for size in _SIZES:
        maker = TakeMaker(replace(campaign, error_sizes=(size, size)), FitErrors.load())
        takes = [maker.make(person, number)[0] for number in judged]
        shown = [np.concatenate([take.synthetic for take in takes])]
        shown += [np.concatenate([_denoised(model, take) for take in takes]) for model in models]
        errors[size] = [_errors(takes, one) for one in shown]
    again_mae, again_slower = _errors(takes, again)
    return {
        "limits": _limits_table(errors),
        "again_mae": again_mae,
        "again_slower": again_slower,
    }


def _limits_table(errors: Mapping[float, Sequence[tuple[float, float]]]) -> str:
    """Errors of the synthetic map and of what models make of it, by size of the fit's."""
    maps = ("map", "limbs")
    head = ["errors of the fit", "peak MAE: none", *maps, "too slow by: none", *maps]
    rows = [
        [f"{size:g} ×", *(f"{one:.3f}" for column in zip(*found, strict=True) for one in column)]
        for size, found in errors.items()
    ]
    return "\n".join(markdown_table([head, *rows]))


def _errors(takes: Sequence[Take], values: NDArray[np.float32]) -> tuple[float, float]:
    """Error of the peak velocity, and how much too slow it is in fast frames, m/s."""
    axis, nulled = OPTIONS.axis, OPTIONS.null_bins
    radar = np.concatenate([take.radar for take in takes])
    moving = np.concatenate([stands_out(take.radar, nulled) for take in takes])
    found, seen = (np.nan_to_num(peak_velocity_mps(one, axis)) for one in (values, radar))
    fast = moving & (np.abs(seen) > _FAST_MPS)
    slower = float((np.sign(seen) * (seen - found))[fast].mean())
    return peak_error(values[moving], radar[moving], axis).mae_mps, slower


def _denoised(model: TrainedDenoiser, take: Take) -> NDArray[np.float32]:
    """What a model makes of a take, (frames, bins)."""
    return model.denoise_values(take.inputs(model.card.parts))


def _on_the_sample(folder: Path, paths: Sequence[Path]) -> dict[str, Any]:
    """Errors on the bundled recording, as a table, and what they say."""
    recording = open_recording(resource_path("swipes.sd2"))
    fitted = folder / "sample-fit.zarr"
    if not fitted.exists():
        assert recording.video is not None
        sd2("fit", recording.video, "--out", fitted)
    meshes = {"own mesh": recording.load_mesh(), "fit of the video": load_mesh(fitted)}
    models = [load_model(path) for path in paths]
    radar = doppler_map(recording.load_capture(), axis=OPTIONS.axis, clutter=CLUTTER)
    seen = radar.values.T.copy()
    seen[:, list(OPTIONS.null_bins)] = 0.0
    moving = stands_out(seen, OPTIONS.null_bins)
    errors = {
        name: {
            made: peak_error(one.values.T[moving], seen[moving], OPTIONS.axis).mae_mps
            for made, one in _maps_of(mesh, recording.sensor, models).items()
        }
        for name, mesh in meshes.items()
    }
    return {"sample_frames": int(moving.sum()), **_sample_table(errors)}


def _sample_table(errors: Mapping[str, Mapping[str, float]]) -> dict[str, str]:
    """Errors of the peak velocity by mesh and map, and whether denoising makes them smaller."""
    rows = [["mesh", *next(iter(errors.values()))]]
    changes = []
    for name, found in errors.items():
        none, *denoised = found.values()
        own = [one / none - 1.0 for one in denoised]
        pairs = zip(denoised, own, strict=True)
        cells = [f"{one:.3f} ({100 * change:+.0f} %)" for one, change in pairs]
        rows.append([name, f"{none:.3f}", *cells])
        changes += own
    verdict = "worse" if min(changes) > 0 else "better" if max(changes) < 0 else "worse or better"
    return {"sample": "\n".join(markdown_table(rows)), "verdict": verdict}


def _maps_of(
    mesh: MeshSequence, sensor: VirtualSensor, models: Sequence[TrainedDenoiser]
) -> dict[str, DopplerMap]:
    """The synthetic map and what models make of it, by what these take."""
    synthetic = synthetic_map(Synthesizer(mesh, OPTIONS), sensor, limbs=True)
    return {"none": synthetic} | {one.card.inputs: one.denoise(synthetic) for one in models}


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
