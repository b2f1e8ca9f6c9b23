"""Model that a recording is denoised with, as stored in the recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sd2core.files.resources import is_bundled
from sd2core.recording.recording import Recording


@dataclass(frozen=True)
class DenoiserChoice:
    """A file, a bundled model, no model, or no choice."""

    path: Path | None = None  # model file
    bundled: str | None = None  # name of a model that comes with the program; empty for none at all

    @classmethod
    def of(cls, recording: Recording | None) -> DenoiserChoice:
        """Choice stored in a recording."""
        if recording is None:
            return UNSAID
        return cls(recording.denoiser, None if recording.denoiser else recording.bundled_denoiser)

    @classmethod
    def of_file(cls, path: Path) -> DenoiserChoice:
        """A model file; one that comes with the program is kept by its name."""
        path = Path(path)
        return cls(bundled=path.stem) if is_bundled(path) else cls(path=path.absolute())


UNSAID = DenoiserChoice()
"""The bundled default, where there is one."""
NO_MODEL = DenoiserChoice(bundled="")
"""The map is not denoised."""
