"""How a test installs a package with one plug-in."""

from __future__ import annotations

from collections.abc import Callable

Install = Callable[..., None]
"""``install("a-package", "mesh_files", "points = added:READER", text of added.py)``."""
