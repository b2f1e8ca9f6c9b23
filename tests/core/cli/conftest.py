"""A way to run ``sd2`` inside the test's process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli_outcome import Outcome, Sd2

from sd2app.command_line import main


@pytest.fixture
def sd2(capsys: pytest.CaptureFixture[str]) -> Sd2:
    """``sd2("info", path)`` gives exit code and output."""

    def call(*arguments: object) -> Outcome:
        capsys.readouterr()
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as exit_request:
            code = int(exit_request.code or 0)
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture
def without_sheet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have data sets written without their sheet of pictures, which takes longer than the rest."""
    monkeypatch.setattr("sd2core.datasets.preview.write_preview", lambda path: path)


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    """A square plate of 2 m at z = 3 m that approaches the camera at 1.3 m/s, as plate.npz."""
    path = tmp_path / "plate.npz"
    side = np.linspace(-0.1, 0.1, 9)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    times_s = np.arange(12) / 30.0
    vertices = np.stack(
        [np.stack([x, y, np.full_like(x, 3.0 - 1.3 * time)], axis=1) for time in times_s]
    )
    corner = np.arange(81).reshape(9, 9)[:-1, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 9, corner + 1], axis=1),
            np.stack([corner + 1, corner + 9, corner + 10], axis=1),
        ]
    )
    np.savez(path, vertices=vertices.astype(np.float32), faces=faces, times_s=times_s)
    return path
