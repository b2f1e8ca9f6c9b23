"""The kinds of figures that a file chooser offers."""

from __future__ import annotations

from sd2core.figure_files import SUFFIXES

FIGURES = ";;".join(f"{suffix[1:].upper()} (*{suffix})" for suffix in SUFFIXES)
