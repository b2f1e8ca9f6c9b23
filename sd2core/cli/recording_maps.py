"""Doppler maps of a recording, computed where needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from pathlib import Path

    from sd2core.maps import DopplerMap
    from sd2core.mesh.sequence import MeshSequence
    from sd2core.recording.recording import Recording
    from sd2core.sensor import VelocityAxis

MapName = Literal["synthetic", "denoised", "radar"]
MAP_NAMES: tuple[MapName, ...] = get_args(MapName)


def usual_maps(recording: Recording) -> tuple[MapName, ...]:
    """Maps that a recording has without a model: of its mesh and of its radar."""
    parts: dict[MapName, object] = {"synthetic": recording.mesh, "radar": recording.radar}
    return tuple(name for name, part in parts.items() if part is not None)


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
        from sd2core.datasets.kept_maps import computed_maps
        from sd2core.doppler import Synthesizer

        if mesh is None:
            with progress_bar("Reading the mesh") as progress:
                mesh = recording.load_mesh(progress)
        model = _denoiser_of(recording, mesh) if "denoised" in names else None
        with progress_bar("Synthesising", unit="") as progress:
            synthetic, denoised = computed_maps(
                recording, Synthesizer(mesh), recording.sensor, model, progress=progress
            )
        made |= {"synthetic": synthetic} if "synthetic" in names else {}
        made |= {} if denoised is None else {"denoised": denoised}
    if "radar" in names:
        from sd2core.datasets.recording_sources import radar_map

        with progress_bar("Processing") as progress:
            made["radar"] = radar_map(recording, axis, progress)
    return made


def _denoiser_of(recording: Recording, mesh: MeshSequence) -> Path:
    from sd2core.datasets.recording_sources import denoiser_of

    if (model := denoiser_of(recording, mesh)) is None:
        raise Sd2Error(
            f"{recording.title} is set to be shown without a denoiser",
            "a model, for its denoised map",
            "Choose one in the window, or leave the denoised map out",
        )
    return model
