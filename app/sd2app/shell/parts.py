"""Parts of the window that may be replaced."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sd2app.accuracy.measurements import Library
    from sd2app.background.model_worker.client import ClassifierLibrary, DenoiserLibrary


@dataclass(frozen=True)
class Parts:
    """Parts that may be replaced, e.g. by faster ones in a test.

    Accuracy functions, denoisers and classifiers are the library's, the commands that fit, train,
    work in batches and listen ``sd2`` itself, and the folders for recovering labels and of pictures
    of recordings are the user's by default. The manual has the commands of ``parser``, those of the
    library by default.
    """

    accuracy: Library | None = None
    fit_command: Sequence[str] | None = None
    denoisers: DenoiserLibrary | None = None
    train_command: Sequence[str] | None = None
    learn_command: Sequence[str] | None = None  # of classifiers and studies, in a folder
    recovery: Path | None = None
    pictures: Path | None = None
    batch_command: Sequence[str] | None = None
    classifiers: ClassifierLibrary | None = None
    listen_command: Sequence[str] | None = None
    parser: Callable[[], ArgumentParser] | None = None
