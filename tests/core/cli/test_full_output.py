"""Where the output of ``sd2`` goes may be full, or closed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FULL = Path("/dev/full")
REPOSITORY = Path(__file__).resolve().parents[3]


@pytest.mark.one_in(2)
@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize("buffered", [True, False])
def test_a_full_disk_is_said_once(plate: Path, buffered: bool) -> None:
    with FULL.open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "sd2app.command_line", "info", str(plate)],
            env=os.environ | {"PYTHONUNBUFFERED": "" if buffered else "1"},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            cwd=REPOSITORY,
        )
    reason = os.strerror(28)
    # Without a buffer nothing tells that it was the output.
    said = f"The output cannot be written ({reason})" if buffered else reason
    assert (done.returncode, done.stderr) == (1, f"sd2: {said}.\n")


@pytest.mark.skipif(sys.platform == "win32", reason="closes the output as a POSIX shell does")
@pytest.mark.parametrize("closed", [">&-", "2>&-"])
def test_a_closed_output_is_no_error(plate: Path, closed: str) -> None:
    command = f'"{sys.executable}" -m sd2app.command_line info "{plate}" {closed}'
    done = subprocess.run(
        ["sh", "-c", command], capture_output=True, text=True, check=False, cwd=REPOSITORY
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert bool(done.stdout) == (closed == "2>&-")


def test_letters_that_the_outputs_encoding_lacks_end_no_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sd2app.command_line", "--help"],
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=False,
        cwd=REPOSITORY,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert r"SD\xb2 Studio" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="closes the output as a POSIX shell does")
def test_work_goes_on_when_nobody_reads_its_progress_any_more(tmp_path: Path) -> None:
    code = (
        "import pathlib, time\n"
        "from sd2core.cli.output import print_event\n"
        "for done in range(3):\n"
        "    print_event('progress', done=done)\n"
        "    time.sleep(0.2)\n"
        "print('the end')\n"
        "pathlib.Path('made').touch()\n"
    )
    command = f'"{sys.executable}" -c "{code}" | head -1'
    done = subprocess.run(
        ["sh", "-c", command],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert (done.stdout, done.stderr) == ('{"event": "progress", "done": 0}\n', "")
    assert (tmp_path / "made").exists()
