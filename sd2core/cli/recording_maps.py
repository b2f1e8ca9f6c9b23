"""Doppler maps of a recording, computed where needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.denoise.card import ModelCard
    from sd2core.maps import DopplerMap
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VelocityAxis

MapName = Literal["synthetic", "denoised", "radar"]
MAP_NAMES: tuple[MapName, ...] = get_args(MapName)


def usual_maps(recording: Recording) -> tuple[MapName, ...]:
    """Maps that a recording has without a model: of its mesh and of its radar."""
    there: dict[MapName, object] = {"synthetic": recording.mesh, "radar": recording.radar}
    return tuple(name for name, part in there.items() if part is not None)


def parsed_maps(text: str) -> tuple[MapName, ...]:
    """Parse names such as ``synthetic,radar``; Sd2Error for another name, or none."""
    names = tuple(name for name in MAP_NAMES if name in text.replace(" ", "").split(","))
    if not names or len(names) < len(text.split(",")):
        raise Sd2Error(f"The maps are {text!r}", f"some of {', '.join(MAP_NAMES)}, each once")
    return names


def maps_of(
    recording: Recording,
    names: tuple[MapName, ...],
    mesh: MeshSequence | None = None,
    axis: VelocityAxis | None = None,
) -> dict[MapName, DopplerMap]:
    """Maps on the recording's clock, from top to bottom.

    Parameters
    ----------
    recording : Recording
        Sd2Error if it lacks the source of a map.
    names : tuple of {"synthetic", "denoised", "radar"}
        Maps that are made.
    mesh : MeshSequence, optional
        Its mesh, where that has been read already.
    axis : VelocityAxis, optional
        Of the radar's map; by default its own.
    """
    made: dict[MapName, DopplerMap] = {}
    if {"synthetic", "denoised"} & {*names}:
        if mesh is None:
            with progress_bar("Reading the mesh") as progress:
                mesh = recording.load_mesh(progress)
        model = _model_of(recording, mesh) if "denoised" in names else None
        synthetic = _synthetic(recording, mesh, limbs=model is not None and bool(model.parts))
        if "synthetic" in names:
            made["synthetic"] = synthetic
        if model is not None:
            from sd2core.denoise.files import load_model
            from sd2core.denoise.resample_to_model import check_map

            assert model.path is not None
            check_map(synthetic, model)
            with progress_bar("Denoising") as progress:
                made["denoised"] = load_model(model.path).denoise(synthetic, progress)
    if "radar" in names:
        made["radar"] = _radar(recording, axis)
    return made


def _synthetic(recording: Recording, mesh: MeshSequence, *, limbs: bool) -> DopplerMap:
    from sd2core.body.parts import synthetic_map
    from sd2core.doppler import Synthesizer

    with progress_bar("Synthesising") as progress:
        maker = Synthesizer(mesh, preset="paper")
        return synthetic_map(maker, recording.sensor, limbs=limbs, progress=progress)


def _model_of(recording: Recording, mesh: MeshSequence) -> ModelCard:
    from sd2core.body.parts import splits_everybody
    from sd2core.denoise.files import default_name, describe_model, find_model

    if recording.denoiser is None and recording.bundled_denoiser == "":
        raise Sd2Error(
            f"{recording.title} is set to be shown without a denoiser",
            "a model, for its denoised map",
            "Choose one in the window, or leave the denoised map out",
        )
    path = recording.denoiser
    if path is None:
        name = recording.bundled_denoiser or default_name(limbs=splits_everybody(mesh))
        path = find_model(name)
    return describe_model(path)


def _radar(recording: Recording, axis: VelocityAxis | None) -> DopplerMap:
    from sd2core.datasets.recording_sources import radar_map

    with progress_bar("Processing") as progress:
        return radar_map(recording, axis, progress)
