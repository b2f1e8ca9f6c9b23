"""Install this checkout and what it needs into .venv, and say what is being done.

usage: python3 scripts/install.py [EXTRA]      EXTRA: test, docs or dev of pyproject.toml
       python3 scripts/install.py kernels      compile the kernels of what is installed

The versions are those of constraints.txt. uv installs, because it does so in seconds and can be
told to take the CPU build of torch; where it cannot be had or fails, pip does. Either asks the
package index that pip is configured for. ``UV_TORCH_BACKEND=auto make demo`` takes the build of
torch for this machine's GPU. Everything printed is kept in build/install.log.
"""

from __future__ import annotations

import ast
import os
import queue
import re
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = ROOT / ".venv"
PYTHON = ENVIRONMENT / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
BUILD = ROOT / "build"
LOG = BUILD / "install.log"
UV_PARTS = BUILD / "uv"
PACKAGES = BUILD / "packages"
CONSTRAINTS = "constraints.txt"

SILENCE_S = 8.0
"""After so long without a line, what is waited for is said."""
NEEDED_GB = {"program": 3.2, "docs": 1.0, "test": 1.0, "dev": 1.5}
"""Free space that an installation takes, with what is fetched for it and removed again."""

REMEDIES = (
    (r"No space left", "Make room on this disk, then type the same command again"),
    (
        r"resolve host|name resolution|dns error|Connection(Error| refused)|timed out|NewConnection"
        r"|error sending request",
        "Check the connection (and the proxy, if there is one), then type the same command again; "
        "what was fetched is kept",
    ),
    (
        r"ResolutionImpossible|No solution found|Could not find a version",
        "The pinned versions do not fit this Python or this system. Try another Python, e.g. "
        "`make demo PYTHON=python3.12`, and report the lines above",
    ),
)
"""What a failure's text may hold, and what to do then."""


def main() -> int:
    """Install the program, or an extra of it; 1 if neither uv nor pip could."""
    extra = sys.argv[1] if len(sys.argv) > 1 else "program"
    BUILD.mkdir(exist_ok=True)
    if extra == "kernels":
        print("Compiling the kernels (half a minute, once)", flush=True)
        code = run([str(PYTHON.with_name("sd2")), "doctor", "--warm-up"], waiting="the compiler")
        return explain(code) if code else 0
    free_gb = shutil.disk_usage(ROOT).free / 1e9
    if free_gb < NEEDED_GB[extra]:
        print(
            f"{ROOT} has {free_gb:.1f} GB free, and {NEEDED_GB[extra]} GB are needed for a while."
        )
        print("Make room, then type the same command again.")
        return 1
    if not _works(PYTHON, "-m", "pip", "--version"):
        version = ".".join(map(str, sys.version_info[:3]))
        print(f"Making .venv with Python {version}", flush=True)
        shutil.rmtree(ENVIRONMENT, ignore_errors=True)
        if code := run([sys.executable, "-m", "venv", str(ENVIRONMENT)]):
            return explain(code)
    what = "." if extra == "program" else f".[{extra}]"
    wanted = ["--editable", what, "--constraint", CONSTRAINTS]
    print(f"Installing {'the program' if extra == 'program' else 'what ' + extra + ' needs'}")
    began = time.monotonic()
    uv = find_uv()
    code = run_uv(uv, wanted) if uv else 1
    if code and uv:
        explain(code)
        print("Trying once more, with pip; its torch may be the build for GPUs, some GB more")
    if code:
        code = run_pip(wanted)
    if code:
        return explain(code)
    for folder in (UV_PARTS, PACKAGES):
        shutil.rmtree(folder, ignore_errors=True)
    print(
        f"Installed in {time.monotonic() - began:.0f} s; .venv takes {size_gb(ENVIRONMENT):.2f} GB"
    )
    return 0


def find_uv() -> str | None:
    """The uv on the path, or else one that is fetched for this installation."""
    if found := shutil.which("uv"):
        return found
    there = UV_PARTS / ("bin/uv.exe" if os.name == "nt" else "bin/uv")
    if not there.is_file():
        print("Fetching uv, which installs quickly (17 MB)", flush=True)
        into = ["--target", str(UV_PARTS), "--constraint", CONSTRAINTS, "--no-deps"]
        run([str(PYTHON), "-m", "pip", "--no-input", "install", *into, "uv"])
    return str(there) if there.is_file() else None


def run_uv(uv: str, wanted: list[str]) -> int:
    """Install by uv, from the index that pip knows; its exit code."""
    places, cert = pip_places()
    # Only a place of one's own is likely to have torch without CUDA.
    cpu = sys.platform == "linux" and not places and "UV_TORCH_BACKEND" not in os.environ
    command = [uv, "pip", "install", "--python", str(PYTHON), *wanted]
    command += ["--build-constraints", CONSTRAINTS, "--index-strategy", "unsafe-best-match"]
    command += [*places, *(["--torch-backend", "cpu"] * cpu)]
    # Beside .venv, so that files are moved there by links; removed when all is done.
    keep = {"UV_CACHE_DIR": str(PACKAGES)} | ({"SSL_CERT_FILE": cert} if cert else {})
    return run(command, keep)


def run_pip(wanted: list[str]) -> int:
    """Install by pip; its exit code."""
    keep = {"PIP_CONSTRAINT": CONSTRAINTS, "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    return run([str(PYTHON), "-m", "pip", "--no-input", "install", *wanted], keep)


def pip_settings(python: object) -> list[tuple[str, str]]:
    """Names and values of what pip is configured with."""
    listed = subprocess.run(
        [str(python), "-m", "pip", "config", "list"], capture_output=True, text=True, check=False
    )
    found = re.findall(r"^[^\s=]*\.([a-z-]+)=(.*)$", listed.stdout, re.MULTILINE)
    return [(name, str(ast.literal_eval(value))) for name, value in found]


def pip_places() -> tuple[list[str], str]:
    """Where pip is configured to look, as options of uv; and its certificates."""
    options = {
        "index-url": "--default-index", "extra-index-url": "--index", "find-links": "--find-links"
    }  # fmt: skip
    settings = pip_settings(PYTHON)
    places = dict.fromkeys(
        (options[name], place)
        for name, value in settings
        if name in options
        for place in value.split()
    )
    return [word for pair in places for word in pair], dict(settings).get("cert", "")


def run(
    command: list[str], environment: dict[str, str] | None = None, waiting: str = "unpacking"
) -> int:
    """Run a program, print its lines and what is waited for, and keep all of it in the log."""
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        env=os.environ | (environment or {}),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(process, lines), daemon=True).start()
    began = said_s = time.monotonic()
    free = shutil.disk_usage(ROOT).free
    fetched: dict[str, str] = {}  # size by name, of what is on its way
    with LOG.open("w", encoding="utf-8") as log:
        while True:
            try:
                line = lines.get(timeout=max(0.1, said_s + SILENCE_S - time.monotonic()))
            except queue.Empty:
                line = ""
            if line is None:
                return process.wait()
            log.write(line)
            said = _worth_saying(line.strip(), fetched)
            if not said and time.monotonic() < said_s + SILENCE_S:
                continue
            if not said:
                written_mb = max(0, free - shutil.disk_usage(ROOT).free) / 1e6
                names = [f"{name} ({size})" for name, size in fetched.items()]
                said = (
                    f"… {time.monotonic() - began:.0f} s: {written_mb:,.0f} MB written; "
                    f"waiting for {', '.join(names[:3]) or waiting}"
                )
            print("  " + said, flush=True)
            said_s = time.monotonic()


def _read(process: subprocess.Popen[str], lines: queue.SimpleQueue[str | None]) -> None:
    """Hand the lines of a program on, and None at its end."""
    assert process.stdout is not None
    with process.stdout:
        for line in process.stdout:
            lines.put(line)
    lines.put(None)


def _worth_saying(line: str, fetched: dict[str, str]) -> str:
    """A line of uv or pip as it is printed, or nothing; notes what is on its way."""
    if begun := re.match(r"Downloading (\S+) \(([\d.]+ ?\w+)\)", line):
        if line.endswith(")") and "-" in begun[1] and begun[1].endswith((".whl", ".gz")):
            fetched.clear()  # pip fetches one after the other
        fetched[begun[1].split("-")[0]] = begun[2]
        return line
    if done := re.match(r"Downloaded (\S+)", line):
        fetched.pop(done[1], None)
        return ""
    if line.startswith("Installing collected packages"):
        fetched.clear()
        return f"Unpacking {line.count(',') + 1} packages"
    if line.startswith("Successfully installed"):
        return f"{len(line.split()) - 2} packages installed"
    return (
        line if re.match(r"(Resolved|Prepared|Installed|Building|Built|Compiling:?) ", line) else ""
    )


def explain(code: int) -> int:
    """Print the whole reason of a failure and what to do about it; its exit code."""
    lines = LOG.read_text("utf-8").splitlines()
    telling = [at for at, line in enumerate(lines) if re.match(r"\s*(error|ERROR)\b", line)]
    reason = lines[max(0, telling[0] - 10) :] if telling else lines[-40:]
    print("\nThis failed:\n")
    print("\n".join("    " + line for line in reason if "is ignored: it is neither" not in line))
    text = "\n".join(reason)
    remedies = [remedy for pattern, remedy in REMEDIES if re.search(pattern, text, re.IGNORECASE)]
    print(f"\n{remedies[0] if remedies else 'Type the same command again, or report these lines'}.")
    print(f"All that was said is in {LOG.relative_to(ROOT)}.", flush=True)
    return code


def size_gb(folder: Path) -> float:
    """Space that a folder takes on the disk."""
    total = 0
    for parent, _, names in os.walk(folder):
        total += sum(os.lstat(os.path.join(parent, name)).st_blocks for name in names)
    return total * 512 / 1e9


def _works(*command: object) -> bool:
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, check=False)
    except OSError:
        return False
    return done.returncode == 0


if __name__ == "__main__":
    sys.exit(main())
