"""``sd2 warm-up`` and ``sd2 fetch-models``: what is prepared once, after installing."""

from __future__ import annotations

import argparse
from pathlib import Path

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``warm-up`` and ``fetch-models``."""
    add_command(commands, "warm-up", handler=_warm_up)
    parser = add_command(
        commands,
        "fetch-models",
        "fetch the landmark models that `sd2 fit` needs, once",
        handler=_fetch,
        description=(
            "Person detector and full model are part of the Python package mediapipe, the heavy\n"
            "model of the npm package @mediapipe/pose (Apache-2.0). pip and npm download them\n"
            "(36 and 41 MB; without npm pip brings it, 61 MB), nothing is installed, and 37 MB\n"
            "are kept in the user's cache. `sd2 fit` fetches what it needs by itself. Without a\n"
            "connection, fetch them elsewhere:\n\n"
            "  pip download mediapipe==0.10.21 --no-deps --only-binary=:all: \\\n"
            "      --platform manylinux_2_28_x86_64 --python-version 3.11\n"
            "  npm pack @mediapipe/pose@0.5.1675469404"
        ),
        examples="  sd2 fetch-models\n  sd2 fetch-models --from mediapipe-0.10.21-….whl\n"
        "  sd2 fetch-models --from mediapipe-pose-0.5.1675469404.tgz",
    )
    text = "the wheel or the npm archive, a model file out of one, or a folder with them"
    parser.add_value("--from", Path, "PATH", text, dest="source")
    parser.add_flag("--if-missing", "do nothing when they are there already")


def _fetch(options: argparse.Namespace) -> None:
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


def _warm_up(options: argparse.Namespace) -> None:
    """Compile the numerical kernels once, after installing.

    Takes about half a minute the first time and keeps the result on disk. Without
    it everything works as well: the kernels are compiled in the background while
    a slower form serves.
    """
    from sd2core.numerics.compiled import warm_up

    with progress_bar("Compiling", unit="module") as progress:
        warm_up(progress)
