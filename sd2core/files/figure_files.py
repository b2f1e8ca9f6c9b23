"""Saving figures, with their provenance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error
from sd2core.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")

_RULES: Any = {"svg.fonttype": "none", "svg.hashsalt": "sd2", "pdf.fonttype": 42}
"""Words are text, and the parts of an SVG are called the same whenever it is written."""


def check_figure(path: Path) -> None:
    """Raise Sd2Error for a name that no figure can have."""
    if path.suffix.lower() not in SUFFIXES:
        raise Sd2Error(f"The figure is to be {path}", f"a name that ends in {', '.join(SUFFIXES)}")
    if not path.absolute().parent.is_dir():
        raise Sd2Error(f"The folder {path.absolute().parent} does not exist", "an existing folder")


def save_figure(
    figure: Figure,
    path: Path,
    provenance: Mapping[str, Any] | None = None,
    pixels_per_inch: float | None = None,
) -> None:
    """Write a figure as PNG, SVG or PDF, by the name's ending.

    Parameters
    ----------
    figure : Figure
    path : Path
        In a folder that exists.
    provenance : mapping, optional
        Fit for JSON. It goes into the file with the version of the program; words of SVG and PDF
        are then text, and the same figure gives the same bytes.
    pixels_per_inch : float, optional
        By default the figure's own.

    Raises
    ------
    Sd2Error
        For another ending, or a folder that does not exist.
    """
    import io

    from matplotlib import rc_context

    from sd2core.files.atomic import atomic_write

    check_figure(path)
    kind = path.suffix.lower()
    settings: dict[str, Any] = {"dpi": pixels_per_inch or "figure"}
    if provenance is not None:
        settings["metadata"] = _metadata(kind, provenance)
    # In memory first: on a full disk Matplotlib fails with an error of its own.
    drawn = io.BytesIO()
    with rc_context(None if provenance is None else _RULES):
        figure.savefig(drawn, format=kind[1:], **settings)
    with atomic_write(path) as stream:
        stream.write(drawn.getbuffer())


def _metadata(kind: str, provenance: Mapping[str, Any]) -> dict[str, Any]:
    import json

    program = f"SD² Studio {__version__}"
    about = {**provenance, "version": __version__}
    description = json.dumps(about, ensure_ascii=False)
    if kind == ".png":
        return {"Software": program, "Description": description}
    # Without a date the same figure gives the same bytes.
    if kind == ".svg":
        return {"Creator": program, "Description": description, "Date": None}
    return {"Creator": program, "Subject": description, "CreationDate": None}
