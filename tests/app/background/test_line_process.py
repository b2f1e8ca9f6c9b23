"""A process beside the window: lines whole, an end told once, stopped when asked."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from sd2app.background.line_process import LineProcess


@pytest.fixture
def process(qtbot):
    process = LineProcess()
    process.lines, process.endings = [], []
    process.line.connect(process.lines.append)
    process.ended.connect(process.endings.append)
    yield process
    process.close()


def run(process, qtbot, script: str) -> None:
    process.start([sys.executable, "-u", "-c", script])
    qtbot.waitUntil(lambda: bool(process.endings), timeout=10_000)


def test_lines_are_put_together_however_they_come(process, qtbot) -> None:
    run(
        process,
        qtbot,
        "import sys, time\n"
        "out = sys.stdout.buffer\n"
        "for part in (b'fir', b'st\\nsec', 'ond – ü'.encode()[:9], 'ond – ü'.encode()[9:],"
        " b'\\n\\nlast'):\n"
        "    out.write(part); out.flush(); time.sleep(0.03)\n",
    )
    assert process.lines == ["first", "second – ü", "", "last"]
    assert process.endings[0].code == 0


def test_much_at_once(process, qtbot) -> None:
    run(process, qtbot, "for k in range(20000): print(k, 'x' * 50)")
    assert [int(line.split()[0]) for line in process.lines] == list(range(20000))


def test_errors_are_kept_apart(process, qtbot) -> None:
    run(
        process,
        qtbot,
        "import sys; print('out'); print('sd2: it failed', file=sys.stderr); sys.exit(1)",
    )
    assert process.lines == ["out"]
    assert process.endings[0].code == 1
    assert process.endings[0].errors == "sd2: it failed"


def test_a_process_that_dies_has_no_code(process, qtbot) -> None:
    run(process, qtbot, "import os; os.abort()")
    assert [ending.code for ending in process.endings] == [None]


def test_a_program_that_is_not_there(process, qtbot) -> None:
    process.start(["/no/such/program"])
    qtbot.waitUntil(lambda: bool(process.endings))
    assert process.endings[0].code is None
    assert process.endings[0].errors


def test_stopping_ends_it(process, qtbot) -> None:
    process.start([sys.executable, "-u", "-c", "import time; print(1); time.sleep(3600)"])
    qtbot.waitUntil(lambda: process.lines == ["1"], timeout=10_000)
    process.stop()
    qtbot.waitUntil(lambda: bool(process.endings), timeout=10_000)


@pytest.mark.skipif(sys.platform == "win32", reason="nothing can refuse there")
def test_one_that_will_not_stop_is_ended(process, qtbot) -> None:
    process._patience.setInterval(50)
    script = (
        "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
        " print(1); time.sleep(3600)"
    )
    process.start([sys.executable, "-u", "-c", script])
    qtbot.waitUntil(lambda: process.lines == ["1"], timeout=10_000)
    process.stop()
    qtbot.waitUntil(lambda: bool(process.endings), timeout=10_000)
    assert process.endings[0].code is None


def test_closing_says_nothing_more(process, qtbot) -> None:
    process.start([sys.executable, "-u", "-c", "import time; print(1); time.sleep(3600)"])
    qtbot.waitUntil(lambda: process.lines == ["1"], timeout=10_000)
    process.close()
    qtbot.wait(20)
    assert process.endings == []


@pytest.mark.skipif(sys.platform == "win32", reason="niceness is a Unix notion")
def test_the_background_gives_way_and_runs_sd2(process, qtbot, tmp_path: Path) -> None:
    process.start([sys.executable, "-u", "-m", "sd2app.background.run_command", "--version"])
    qtbot.waitUntil(lambda: bool(process.endings), timeout=20_000)
    assert process.endings[0].code == 0
    assert process.lines[0].startswith("SD² Studio")
    process.close()
    other = LineProcess()
    lines: list[str] = []
    other.line.connect(lines.append)
    program = "from sd2core.processes import lower_priority"
    script = f"import os; {program}; lower_priority(); print(os.nice(0))"
    with qtbot.waitSignal(other.ended, timeout=20_000):
        other.start([sys.executable, "-u", "-c", script])
    assert int(lines[0]) == min(os.nice(0) + 10, 19)
