"""Task that fits a body to a video and writes the mesh."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from sd2core.batch.inputs import MeshInput, mesh_input_of
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import read_json
from sd2core.options.fitting import FIT_CHOICES, Fitting
from sd2core.options.records import given
from sd2core.progress import silent

_FACTS = TypeAdapter(MeshInput)


def fit_choices(fit: Fitting, subject: str, focal_px: float | None) -> dict[str, Any]:
    """Return the options for fitting one video, as JSON can hold them.

    The plan's focal length takes precedence over ``focal_px``, the recording's.
    """
    choices = given(fit, FIT_CHOICES)
    if fit.landmark_model == "heavy":  # of all batches of before it could be said
        del choices["landmark_model"]
    if focal_px is not None and not choices.keys() & {"focal_px", "field_of_view_deg"}:
        choices["focal_px"] = focal_px
    if subject in fit.stature_of:
        choices["stature_m"] = fit.stature_of[subject]
    return choices


def fit_to_video(video: str, choices: dict[str, Any], models: Path | None, out: str) -> None:
    """Fit a body, write the mesh, then a file with the facts that tasks need.

    A fit that was killed goes on where it was; a mesh that is there is not made again.

    Parameters
    ----------
    video : str
        Path of the video.
    choices : dict
        Fields of :class:`~sd2core.body.fit_video.FitChoices`, from :func:`fit_choices`.
    models : Path or None
        Folder of the landmark models, see :func:`~sd2core.body.landmark_models.landmark_models`.
    out : str
        Path of the mesh; the facts are at :func:`facts_path`.
    """
    from sd2core.body.fit_video import FitChoices, FitReport, fit_video

    path = Path(out)
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        quiet = FitReport(lambda _: silent, lambda *_: None, lambda *_: None)
        fit_video(Path(video), path, FitChoices(**choices), quiet, models=models)
    about = asdict(mesh_input_of(path, path.stem))
    atomic_write_text(facts_path(path), json.dumps(about) + "\n")


def facts_path(mesh: Path) -> Path:
    """Return the path of the facts of a fitted mesh; the file exists once the mesh is complete."""
    return mesh.with_suffix(".json")


def fitted(mesh: Path) -> MeshInput | None:
    """Return a fitted mesh; None while it is missing or incomplete."""
    try:
        facts = _FACTS.validate_python(read_json(facts_path(mesh)))
    except (Sd2Error, ValueError):
        return None
    return facts if mesh.exists() else None
