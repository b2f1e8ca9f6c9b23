"""What pages of measurements are put together of: texts in ``texts/``, tables, sections."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.accuracy.cache import this_machine
from sd2core.files.tables import markdown_table
from tools.documentation.measured import write_page

TEXTS = Path(__file__).with_name("texts")


def filled(name: str, **values: object) -> str:
    """A text of ``texts/`` with the values in place of their names."""
    return (TEXTS / name).read_text("utf-8").format(**values)


def write_filled(name: str, **values: object) -> None:
    """Write a page of ``docs/`` whose text has the same name; the machine is this one."""
    write_page(name, filled(name, machine=this_machine(), **values))


def table(rows: Iterable[Sequence[str]], names: int = 1) -> str:
    """Rows in Markdown; the first is the heading, the first ``names`` columns are of words."""
    return "\n".join(markdown_table(list(rows), names))


def spread(values: Mapping[str, Any], digits: int = 3) -> str:
    """Mean over trainings, and their standard deviation where there are several."""
    sd = values["sd"]
    return f"{values['mean']:.{digits}f}" + (f" ± {sd:.{digits}f}" if sd is not None else "")


def spread_of(values: Sequence[float] | np.ndarray, digits: int) -> str:
    """The same of the values themselves."""
    sd = np.std(values, ddof=1) if len(values) > 1 else None
    return spread({"mean": np.mean(values), "sd": sd}, digits)
