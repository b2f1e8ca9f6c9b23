"""Folders that the pages are written to and measured from."""

from __future__ import annotations

import os
from pathlib import Path

from sd2core.files.resources import resource_path

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "docs"
IMAGES = DOCS / "images"
BUILD = REPOSITORY / "build"
"""Campaigns, fits and runs that a page is measured on; what is there is not made again."""

SAMPLE = resource_path("swipes.sd2")
BENCHMARKS = REPOSITORY / "tests" / "benchmarks"
SHARED = Path(os.environ.get("SD2_SHARED_DATA", REPOSITORY.parent / "shared" / "data"))
"""Real recordings; pages leave out what needs them where they are missing."""
