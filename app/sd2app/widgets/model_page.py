"""The facts of a model file, as rows of a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from sd2core.files.tables import capitalised
from sd2core.sensor import VelocityAxis

_UNITS = {"mps": "m/s", "db": "dB", "s": "s", "hz": "Hz"}


class ModelPage(NamedTuple):
    """Facts of a model file, as rows of a page."""

    title: str
    simulated: bool  # learned without a real radar
    rows: list[tuple[str, str]]  # name and text of each fact
    sections: list[tuple[str, list[tuple[str, str]]]]  # what its makers say, by heading


def model_title(card: Any) -> str:
    """Title of a model in a list, by its card."""
    return str(card.title or card.name)


def map_and_file_rows(
    axis: VelocityAxis, frame_rate_hz: float, path: Path | None
) -> Iterator[tuple[str, str]]:
    """The maps that a model knows, and its file."""
    shown = f"{axis.words}, {frame_rate_hz:g} frames/s"
    yield "Works on", shown
    if path is not None:
        try:
            size_kb = path.stat().st_size / 1000
            yield "File", f"{path} ({size_kb:,.0f} kB)"
        except OSError:
            yield "File", f"{path} (not there any more)"


def about_sections(content: Mapping[str, Any]) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Notes of a model's makers by heading, limits and measurements first."""
    first = [name for name in ("limits", "metrics", "data", "command") if name in content]
    for name in dict.fromkeys([*first, *content]):
        yield capitalised(name.replace("_", " ").strip()), list(_lines(content[name]))


def _lines(value: Any, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Rows of a value from JSON."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            label, unit = _unit_of(str(name))
            full = f"{prefix}, {label}" if prefix else label
            if isinstance(inner, Mapping | list | tuple):
                yield from _lines(inner, full)
            else:
                yield full, f"{_text(inner)} {unit}".rstrip()
    elif isinstance(value, list | tuple):
        if value and all(isinstance(one, str | int | float) for one in value):
            texts = [_text(one) for one in value]
            joined = "\n".join(texts) if any(" " in text for text in texts) else ", ".join(texts)
            yield prefix, joined
        else:
            for one in value:
                yield from _lines(one, prefix)
    else:
        yield prefix, _text(value)


def _unit_of(name: str) -> tuple[str, str]:
    """Name and unit of a measure: ``peak_mae_mps`` is ``peak mae`` in m/s."""
    head, _, tail = name.rpartition("_")
    if head and tail in _UNITS:
        return head.replace("_", " "), _UNITS[tail]
    return name.replace("_", " "), ""


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}".replace("-", "−")
    return "–" if value is None else str(value)
