"""Type the README's commands on systems that have nothing yet, and write docs/fresh-machine.md.

usage: make fresh-machine [SUITES="bookworm jammy"] [TESTS="bookworm"]

Each system is a folder of its own, made by debootstrap, in which only git, make, Python, its venv
module and certificates are installed. Run as root on Linux, with debootstrap, Xvfb, xdotool and
ImageMagick. What pip is configured for here (a mirror, files at hand) holds there as well. Every
line that was printed, and when, is kept in build/fresh-machine/*.log.
"""

from __future__ import annotations

import datetime
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from install import ROOT, pip_settings

PLACE = ROOT / "build" / "fresh-machine"
PACKAGES = "git,make,python3,python3-venv,ca-certificates"
DEBIAN, UBUNTU = "http://deb.debian.org/debian", "http://archive.ubuntu.com/ubuntu"
SYSTEMS = {
    "bookworm": ("Debian 12", DEBIAN),
    "trixie": ("Debian 13", DEBIAN),
    "noble": ("Ubuntu 24.04", UBUNTU),
    "jammy": ("Ubuntu 22.04", UBUNTU),
}
"""Name and archive by code name; Ubuntu 22.04 has Python 3.10, which is refused in words."""

DISPLAY = ":77"
TITLE = "SD² Studio"
MAPS_S = 6.0  # what the window shows follows the window
WEIGHED = 8  # packages that the page names

PAGE = """\
# On a machine that has nothing yet

`make fresh-machine` makes bare systems (`debootstrap --variant=minbase`, and in them only
`{packages}`), clones this checkout into each and types what the README says. On {date}, commit
`{commit}`, {machine}:

{rows}

Times are from typing to the window, or to the end; MB are what the system's folder grew by, with
system packages and what is fetched.{cuda} Nothing was silent for longer than {silence_s:.0f} s. The
environment, with what tests need where they ran, takes {environment_gb:.2f} GB, of which:

| package | MB |
|---|---|
{weights}
| {others} others | {others_mb:.0f} |
"""

CUDA = """ Where it is some 7 GB, torch's CPU build could not
be reached for that Python, and its build for GPUs came instead."""
WITH_CUDA = re.compile(r" [5-9],\d{3} MB")
STEPS = (
    "`make demo`: the window",
    "`make demo` again",
    "`make test`",
    "`pip install` of the wheel",
    "`sd2 demo` at first",
    "the line that it printed",
    "`sd2 demo` then: the window",
)


@dataclass(frozen=True)
class Outcome:
    """What came of a typed line; ``result`` is empty where it did what the README says."""

    result: str
    seconds: float
    silence_s: float
    written_mb: float

    @property
    def cell(self) -> str:
        """It in the page's table."""
        return self.result or f"{self.seconds:.0f} s, {self.written_mb:,.0f} MB"


def main() -> int:
    """Try all systems; 1 if one of them could not do what the README says."""
    missing = [name for name in ("debootstrap", "Xvfb", "xdotool", "import", "unshare")
               if not shutil.which(name)]  # fmt: skip
    if missing or os.geteuid():
        print(f"Needs root, and these programs: {', '.join(missing) or 'all there'}")
        return 1
    suites = os.environ.get("SUITES", " ".join(SYSTEMS)).split()
    rows, outcomes = [["system", "Python", *STEPS]], list[Outcome]()
    weights: list[tuple[str, float]] = []
    for suite in suites:
        python, tried = try_system(suite)
        cells = [tried[step].cell if step in tried else "" for step in STEPS]
        rows.append([SYSTEMS[suite][0], python, *cells])
        outcomes += tried.values()
        environment = PLACE / suite / "root/sd2/.venv"
        if not weights and environment.is_dir():
            weights = weigh(environment)
        print(" | ".join(rows[-1]), flush=True)
    write_page(rows, max(one.silence_s for one in outcomes), weights)
    return int(any(one.result.startswith("failed") for one in outcomes))


def try_system(suite: str) -> tuple[str, dict[str, Outcome]]:
    """Make a system, type everything there, and say which Python it has and what came of it."""
    demo, again, test, pip, lacking, told_line, window = STEPS
    root = bare_system(suite)
    run = Typist(root, PLACE / f"{suite}.log")
    python = run.output("python3 --version").split()[1]
    if tuple(map(int, python.split(".")[:2])) < (3, 11):
        return python, {demo: run("make demo", printed="is needed")}
    tried = {demo: run("make demo", seen=PLACE / f"{suite}.png"), again: run("make demo")}
    if suite in os.environ.get("TESTS", suite).split():
        tried[test] = run("make test")
    root = bare_system(suite, again="-pip")
    run = Typist(root, PLACE / f"{suite}-pip.log")
    *lines, last = pip_lines()
    tried[pip] = run("\n".join(lines))
    # What a bare system lacks is printed as a line to type.
    open_it = f". sd2-environment/bin/activate\n{last}"
    tried[lacking] = run(open_it, printed="apt-get install", display=True)
    told = re.findall(r"apt-get update.*apt-get install.*[^.\s]", run.log.read_text("utf-8"))
    if told:
        install = told[-1].replace("sudo ", "").replace(" install ", " install --yes ")
        tried[told_line] = run(install)
    tried[window] = run(open_it, seen=PLACE / f"{suite}-pip.png")
    return python, tried


def bare_system(suite: str, again: str = "") -> Path:
    """A system with only PACKAGES and a clone of this checkout in /root/sd2."""
    PLACE.mkdir(parents=True, exist_ok=True)
    base, root = PLACE / f"{suite}-base", PLACE / f"{suite}{again}"
    if not base.is_dir():
        archive = SYSTEMS[suite][1]
        # Ubuntu's keys and code names are not known to Debian's debootstrap.
        own = [] if archive == DEBIAN else ["--no-check-gpg", "--components=main,universe"]
        script = [] if archive == DEBIAN else ["gutsy"]
        made = base.with_suffix(".part")
        shutil.rmtree(made, ignore_errors=True)
        subprocess.run(
            ["debootstrap", "--variant=minbase", f"--include={PACKAGES}", *own, suite, str(made),
             archive, *script],
            check=True, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        own_certificates = Path("/usr/local/share/ca-certificates")
        if own_certificates.is_dir():
            shutil.copytree(own_certificates, made / str(own_certificates)[1:], dirs_exist_ok=True)
            subprocess.run(["chroot", made, "update-ca-certificates"], check=True)
        made.rename(base)
    shutil.rmtree(root, ignore_errors=True)
    subprocess.run(["cp", "-a", base, root], check=True)
    shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")
    subprocess.run(["git", "clone", "--quiet", ROOT, root / "root/sd2"], check=True)
    return root


def inside(root: Path, script: str) -> list[str]:
    """The command that runs a script in a system.

    What it needs of this machine is mounted where that command alone sees it, read only: mounts
    that others see are emptied by whoever removes the folder.
    """
    mounts = ["mount -t proc proc $0/proc"]
    for place in local_places():
        mounts += [f"mkdir -p $0{place}", f"mount --bind -o ro {place} $0{place}"]
    enter = " && ".join([*mounts, 'exec chroot "$0" bash -e -c "$1"'])
    return [
        "unshare",
        "--mount",
        "--propagation",
        "private",
        "bash",
        "-c",
        enter,
        str(root),
        script,
    ]


def local_places() -> list[str]:
    """Folders of this machine that pip looks into."""
    values = [value for name, value in pip_settings(sys.executable) if name == "find-links"]
    return sorted({one for value in values for one in value.split() if Path(one).is_dir()})


class Typist:
    """Types lines into a system, as its root in the clone, and notes when what is printed."""

    def __init__(self, root: Path, log: Path) -> None:
        self._root, self.log = root, log
        self._environment = {
            name: value
            for name, value in os.environ.items()
            if name.startswith(("PIP_", "UV_", "SSL_")) or name.lower().endswith("_proxy")
        } | {"HOME": "/root", "TERM": "dumb", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}
        log.write_text("", "utf-8")

    def output(self, line: str) -> str:
        """What a line prints."""
        return subprocess.run(
            inside(self._root, line),
            env=self._environment,
            check=True,
            capture_output=True,
            text=True,
        ).stdout

    def __call__(
        self,
        line: str,
        *,
        printed: str = "",
        seen: Path | None = None,
        display: bool = False,
    ) -> Outcome:
        """Type a line and wait for its end; it must print a text, or show the window.

        The window is drawn into the file ``seen``, and closed.
        """
        display = display or seen is not None
        environment = self._environment | ({"DISPLAY": DISPLAY} if display else {})
        with virtual_display() if display else nullcontext(), self.log.open("a") as log:
            before = used_mb(self._root)
            began = last = time.monotonic()
            silence_s, found, there = 0.0, False, threading.Event()
            process = subprocess.Popen(
                inside(self._root, f"cd /root/sd2\n{line}"),
                env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
            )  # fmt: skip
            print(f"$ {line}", file=log, flush=True)
            if seen is not None:
                threading.Thread(target=_watch, args=(seen, process, there), daemon=True).start()
            assert process.stdout is not None
            for text in process.stdout:
                now = time.monotonic()
                silence_s, last = max(silence_s, now - last), now
                print(f"{now - began:7.1f} s  {text}", end="", file=log, flush=True)
                found = found or bool(printed and printed in text)
            code = process.wait()
            seconds = time.monotonic() - began
            silence_s = max(silence_s, time.monotonic() - last)
        good = there.is_set() if seen else found if printed else code == 0
        result = f"failed ({code})" if not good else "said what to do" if printed else ""
        return Outcome(result, seconds, silence_s, used_mb(self._root) - before)


def _watch(picture: Path, process: subprocess.Popen[str], there: threading.Event) -> None:
    """Draw the window once it is on the display, and end the process."""
    environment = os.environ | {"DISPLAY": DISPLAY}
    while process.poll() is None:
        time.sleep(0.5)
        found = subprocess.run(
            ["xdotool", "search", "--onlyvisible", "--name", TITLE],
            env=environment, capture_output=True, check=False,
        )  # fmt: skip
        if found.stdout.strip():
            there.set()
            time.sleep(MAPS_S)
            subprocess.run(["import", "-window", "root", picture], env=environment, check=True)
            os.killpg(process.pid, signal.SIGTERM)
            return


@contextmanager
def virtual_display() -> Iterator[None]:
    """A display that the systems reach as well: they share this machine's network."""
    server = subprocess.Popen(
        ["Xvfb", DISPLAY, "-screen", "0", "1600x1000x24", "-noreset"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    time.sleep(1)
    try:
        yield
    finally:
        server.terminate()
        server.wait()


def used_mb(root: Path) -> float:
    """Space that a system takes, without what is mounted into it."""
    done = subprocess.run(["du", "-smx", root], capture_output=True, text=True, check=False)
    return float(done.stdout.split()[0]) * 1.048576


def pip_lines() -> list[str]:
    """The lines of the README for pip."""
    text = (ROOT / "README.md").read_text("utf-8")
    block = re.search(r"```sh\n((?:(?!```).)*pip install.*?)```", text, re.DOTALL)
    assert block is not None
    return [line.split("  #")[0].strip() for line in block[1].splitlines()]


def weigh(environment: Path) -> list[tuple[str, float]]:
    """Packages of an environment and their MB, the heaviest first."""
    code = (
        "import importlib.metadata as m, os\n"
        "for d in m.distributions():\n"
        "    files = [str(d.locate_file(f)) for f in d.files or []]\n"
        "    size = sum(os.path.getsize(f) for f in files if os.path.isfile(f))\n"
        "    print(d.metadata['Name'], size / 1e6)\n"
    )
    root = environment.parents[2]
    inside = f"/{environment.relative_to(root)}/bin/python"
    done = subprocess.run(
        ["chroot", root, inside, "-c", code], check=True, capture_output=True, text=True
    )
    pairs = [line.split() for line in done.stdout.splitlines()]
    return sorted(((name, float(mb)) for name, mb in pairs), key=lambda pair: -pair[1])


def write_page(rows: list[list[str]], silence_s: float, weights: list[tuple[str, float]]) -> None:
    """Write docs/fresh-machine.md."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    model = re.search(r"^model name\s*: (.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    heavy, others = weights[:WEIGHED], weights[WEIGHED:]
    head, *lines = (f"| {' | '.join(row)} |" for row in rows)
    table = "\n".join([head, "|---" * len(rows[0]) + "|", *lines])
    text = PAGE.format(
        packages=PACKAGES.replace(",", " "),
        date=datetime.date.today().isoformat(),
        commit=commit,
        machine=f"{model[1].strip() if model else 'unknown processor'}, {os.cpu_count()} cores",
        rows=table,
        silence_s=silence_s,
        cuda=CUDA if WITH_CUDA.search(table) else "",
        environment_gb=sum(mb for _, mb in weights) / 1e3,
        weights="\n".join(f"| {name} | {mb:.0f} |" for name, mb in heavy),
        others=len(others),
        others_mb=sum(mb for _, mb in others),
    )
    (ROOT / "docs/fresh-machine.md").write_text(text, "utf-8")


if __name__ == "__main__":
    sys.exit(main())
