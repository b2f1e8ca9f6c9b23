"""``sd2 warm-up`` and ``sd2 fetch-models``: what is prepared once, after installing."""

from __future__ import annotations

import argparse
from pathlib import Path

from sd2core.cli.options import add_command
from sd2core.cli.output import progress_bar
from sd2core.errors import Sd2Error


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``warm-up`` and ``fetch-models``."""
    add_command(
        commands,
        "warm-up",
        "compile the numerical kernels once, after installing",
        handler=_warm_up,
        description=(
            "Takes about half a minute the first time and keeps the result on disk. Without\n"
            "it everything works as well: the kernels are compiled in the background while\n"
            "a slower form serves."
        ),
    )
    parser = add_command(
        commands,
        "fetch-models",
        "fetch the landmark models that `sd2 fit` needs, once",
        handler=_fetch,
        description=(
            "They are part of the package mediapipe (Apache-2.0), which pip downloads (36 MB) but\n"
            "does not install; 9 MB of it are kept in the user's cache. `sd2 fit` does this by\n"
            "itself at its first use. Without a connection, fetch the wheel elsewhere:\n\n"
            "  pip download mediapipe==0.10.21 --no-deps --only-binary=:all: \\\n"
            "      --platform manylinux_2_28_x86_64 --python-version 3.11"
        ),
        examples="  sd2 fetch-models\n  sd2 fetch-models --from mediapipe-0.10.21-….whl",
    )
    parser.add_argument(
        "--from",
        dest="source",
        type=Path,
        metavar="PATH",
        help="a wheel of mediapipe 0.10.21, or a folder with it or with the two model files",
    )
    parser.add_argument(
        "--if-missing", action="store_true", help="do nothing when they are there already"
    )


def _fetch(options: argparse.Namespace) -> None:
    from sd2core.body.landmark_models import fetch_models, landmark_models

    if options.if_missing:
        try:
            models = landmark_models(download=False)
        except Sd2Error:
            pass
        else:
            print(f"The landmark models are in {models.detector.parent}")
            return
    with progress_bar("Fetching the landmark models", unit="B") as progress:
        models = fetch_models(progress, source=options.source)
    print(f"Fetched the landmark models into {models.detector.parent}")


def _warm_up(options: argparse.Namespace) -> None:
    from sd2core.numerics.compiled import warm_up

    with progress_bar("Compiling", unit="module") as progress:
        warm_up(progress)
