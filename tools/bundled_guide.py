"""Hook of the build backend: a wheel brings the guide's site along where it has been built."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class BundledGuide(BuildHookInterface):
    """Adds ``build/docs`` to a wheel as ``sd2app/docs``; ``make wheel`` builds it before."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Name what is to be added; an installed checkout (editable) reads it where it is."""
        site = Path(self.root) / "build" / "docs"
        if version == "standard" and (site / "index.html").is_file():
            build_data["force_include"][str(site)] = "sd2app/docs"
