"""Plans as TOML files, with errors that name file, line and key."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from sd2core.batch.plan import STEPS, BatchPlan
from sd2core.files.atomic import atomic_write_text
from sd2core.files.paths import is_absolute, located_path, stored_path
from sd2core.files.texts import read_text
from sd2core.files.toml import section_lines, toml_lines
from sd2core.options.toml_files import parsed
from sd2core.radar_profiles import RADAR_PLUG_INS


def read_plan(path: Path) -> BatchPlan:
    """Read a TOML file; paths in the plan that is returned are absolute.

    Raises Sd2Error, with file, line and key, if it cannot be read, is no TOML, or holds
    what is not allowed.
    """
    path = Path(path)
    text = read_text(path, "a plan of a batch (.toml)")
    return plan_from_text(text, path.absolute().parent, str(path))


def plan_from_text(text: str, folder: Path, source: str = "The plan") -> BatchPlan:
    """Parse a plan from TOML; paths relative to ``folder`` become absolute.

    Raises Sd2Error as :func:`read_plan`.
    """
    return _with_paths(
        parsed(BatchPlan, text, source), lambda stored: str(located_path(stored, folder))
    )


def plan_text(plan: BatchPlan, folder: Path) -> str:
    """Format a plan as TOML with paths relative to a folder; inverse of :func:`plan_from_text`."""
    plan = _with_paths(plan, lambda path: stored_path(Path(path), folder))
    content = plan.model_dump(mode="json", exclude_defaults=True)
    content = {"format": plan.format, "version": plan.version, **content}
    content["placements"] = dict(plan.placements)
    if plan.fit is not None and plan.fit.models is not None:
        content["fit"]["models"] = plan.fit.models.as_posix()
    lines = ["# Plan of `sd2 batch`; docs/formats.md says what it may hold."]
    lines += toml_lines({k: v for k, v in content.items() if not isinstance(v, dict)}, folder)
    for section in ("recordings", "placements", *STEPS[1:]):
        # A section that is there is done, even with nothing in it.
        if getattr(plan, section) is not None:
            lines += section_lines(section, content.get(section, {}), folder)
    return "\n".join(lines) + "\n"


def write_plan(path: Path, plan: BatchPlan) -> None:
    """Write a plan in one step, with paths relative to the file's folder."""
    path = Path(path)
    atomic_write_text(path, plan_text(plan, path.absolute().parent))


def _with_paths(plan: BatchPlan, changed: Any) -> BatchPlan:
    recordings = plan.recordings.model_copy(
        update={"files": tuple(changed(file) for file in plan.recordings.files)}
    )
    updates: dict[str, Any] = {"out": changed(plan.out), "recordings": recordings}
    if plan.fit is not None and plan.fit.models is not None:
        updates["fit"] = replace(plan.fit, models=Path(changed(str(plan.fit.models))))
    if plan.denoise is not None and plan.denoise.model and _is_path(plan.denoise.model):
        updates["denoise"] = replace(plan.denoise, model=changed(plan.denoise.model))
    radar = None if plan.simulate is None else plan.simulate.radar
    if plan.simulate is not None and radar not in RADAR_PLUG_INS:
        updates["simulate"] = replace(plan.simulate, radar=changed(plan.simulate.radar))
    return plan.model_copy(update=updates)


def _is_path(model: str) -> bool:
    """Tell if a model is named by its file and not by the name of an installed one."""
    return is_absolute(model) or Path(model).name != model or model.endswith(".safetensors")
