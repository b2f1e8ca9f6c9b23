"""Pairs made of recordings beside the window; the making itself is pretended."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from sd2app.training.model import PairMaker, PairRun, usable_recordings
from sd2core.errors import Sd2Error
from sd2core.recording.recording import Recording

SCRIPT = """
import pathlib, sys, time
from sd2core.runs.command_folder import CommandFolder
assert sys.argv[1] == "--folder"
folder, words = CommandFolder(pathlib.Path(sys.argv[2])), sys.argv[3:]
assert words[:2] == ["pairs", "recordings"]
out = pathlib.Path(words[words.index("--out") + 1])
out.mkdir()
(out / "recordings").write_text("\\n".join(words[2 : words.index("--out")]))
"""


END = "lock = folder.lock(); folder.set_state('running'); folder.note_end(0)"


def recording(folder: Path, *, radar: bool = True) -> Path:
    folder.mkdir(parents=True)
    for name in ("mesh.npz", "capture.npz"):
        (folder / name).write_bytes(b"")
    made = Recording.create(
        folder, mesh=folder / "mesh.npz", radar=folder / "capture.npz" if radar else None
    )
    return made.folder


@pytest.fixture
def made(qtbot, tmp_path):
    makers: list[PairMaker] = []

    def make(more: str = END) -> PairMaker:
        maker = PairMaker(tmp_path / "pairs", None, (sys.executable, "-c", SCRIPT + more))
        maker.told = []
        maker.made.connect(maker.told.append)
        maker.failed.connect(maker.told.append)
        makers.append(maker)
        return maker

    yield make
    for maker in makers:
        maker.close()


def test_what_is_of_use_is_found(tmp_path: Path) -> None:
    places = [recording(tmp_path / "study" / name) for name in ("a.sd2", "b.sd2")]
    recording(tmp_path / "study" / "c.sd2", radar=False)
    (tmp_path / "study" / "d.sd2").mkdir()
    (tmp_path / "study" / "notes.txt").write_text("nothing")
    assert usable_recordings(tmp_path / "study") == places
    assert usable_recordings(places[1]) == [places[1]]
    with pytest.raises(Sd2Error, match="no recording with a mesh and a radar"):
        usable_recordings(tmp_path / "study" / "c.sd2")


def test_pairs_are_made_under_a_free_name(made, qtbot, tmp_path) -> None:
    recording(tmp_path / "study" / "a.sd2")
    maker = made()
    for name in ("study.zarr", "study-2.zarr"):
        maker.make(tmp_path / "study")
        assert maker.out == tmp_path / "pairs" / name
        with pytest.raises(Sd2Error, match="being made already"):
            maker.make(tmp_path / "study")
        qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)
        assert maker.told[-1] == tmp_path / "pairs" / name
        assert (maker.told[-1] / "recordings").read_text().endswith("a.sd2")


def test_a_refusal_is_told_and_leaves_nothing(made, qtbot, tmp_path) -> None:
    maker = made("sys.exit('sd2: The disk is full.')")
    maker.make(recording(tmp_path / "a.sd2"))
    qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)
    assert maker.told == ["The disk is full."]
    assert not list((tmp_path / "pairs").iterdir())


def test_cancelling_leaves_nothing_and_says_nothing(made, qtbot, tmp_path) -> None:
    maker = made("time.sleep(3600)")
    maker.make(recording(tmp_path / "a.sd2"))
    out = maker.out
    qtbot.waitUntil(lambda: (out / "recordings").exists(), timeout=10_000)
    maker.tell("stop")
    assert maker.run.phase == "stopping"
    qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)
    assert maker.told == []
    assert not out.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="nothing can refuse there")
def test_one_that_will_not_stop_is_ended(made, qtbot, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(PairRun, "stop_patience_s", 0.05)
    maker = made(
        "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "(out / 'deaf').touch(); time.sleep(3600)"
    )
    maker.make(recording(tmp_path / "a.sd2"))
    qtbot.waitUntil((maker.out / "deaf").exists, timeout=10_000)
    maker.tell("stop")
    qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)
    assert maker.told == []


def test_a_process_that_dies_or_does_not_start_is_told(made, qtbot, tmp_path) -> None:
    place = recording(tmp_path / "a.sd2")
    maker = made("import os; print('ü', file=sys.stderr, flush=True); os.abort()")
    maker.make(place)
    qtbot.waitUntil(lambda: maker.out is None, timeout=10_000)
    assert maker.told == ["ü"]
    maker = PairMaker(tmp_path / "pairs", None, ("/no/such/program",))
    with pytest.raises(Sd2Error, match="cannot be started"):
        maker.make(place)
    assert maker.out is None
    assert not list((tmp_path / "pairs").iterdir())


def test_closing_ends_it_and_says_nothing(made, qtbot, tmp_path) -> None:
    maker = made("time.sleep(3600)")
    maker.make(recording(tmp_path / "a.sd2"))
    out = maker.out
    qtbot.waitUntil(lambda: (out / "recordings").exists(), timeout=10_000)
    maker.close()
    qtbot.wait(20)
    assert maker.told == []
    assert not out.exists()
