"""``sd2 doctor``: what an installation has and lacks, and how to mend it."""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
from dataclasses import asdict, dataclass
from typing import Any, Literal

from sd2app.displays import how_to_install, missing_libraries, silent_displays
from sd2core.errors import Sd2Error
from sd2core.files.paths import user_cache, user_data
from sd2core.files.resources import resource_path
from sd2core.numerics.compiled import kernels_compiled, kernels_ready, worker_count
from sd2core.plug_ins import Group
from sd2core.version import __version__

_FREE_GB = 2.0
_PROBE_S = 120.0

PROBE = """
import json, sys
from PySide6.QtGui import QFont, QFontDatabase, QFontMetrics
from PySide6.QtWidgets import QApplication
application = QApplication(sys.argv[:1])
# A font may be there that has no letters, such as one of symbols.
letters = all(map(QFontMetrics(QFont()).inFont, "az09"))
families = len(QFontDatabase.families()) if letters else 0
facts = {"platform": application.platformName(), "fonts": families}
try:
    from sd2app.scene.offscreen_backend import ImageBackend
    ImageBackend()
except RuntimeError as error:
    facts["gl"] = str(error)
print(json.dumps(facts))
"""
"""Opens what a window needs, in a process of its own: Qt ends it where something is missing."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    about: str
    state: Literal["ok", "note", "problem"]
    found: str
    remedy: str = ""


def examine() -> list[Finding]:
    """Look at the installation."""
    here = f"{__version__}, Python {platform.python_version()}, {worker_count()} cores"
    return [
        Finding("SD² Studio", "ok", here),
        _libraries(),
        *_window(),
        _kernels(),
        _bundled(),
        _landmark_models(),
        _gpu(),
        *plug_in_findings(),
        *_folders(),
    ]


def _libraries() -> Finding:
    missing = missing_libraries()
    if not missing:
        return Finding("System libraries", "ok", "all there")
    found, remedy = f"{', '.join(missing)} missing", how_to_install(missing.values())
    return Finding("System libraries", "problem", found, remedy)


def _window() -> list[Finding]:
    if silent := silent_displays(sys.platform, os.environ):
        why = f"the display cannot be reached: {', '.join(silent)}"
        return [Finding("Window", "problem", why, "Begin its session again, or unset it")]
    on_screen = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    environment = dict(os.environ)
    if not on_screen and sys.platform.startswith("linux"):
        environment["QT_QPA_PLATFORM"] = "offscreen"
    try:
        run = subprocess.run(
            [sys.executable, "-c", PROBE],
            capture_output=True,
            text=True,
            timeout=_PROBE_S,
            env=environment,
            check=False,
        )
        seen = json.loads(run.stdout.splitlines()[-1])
    except subprocess.TimeoutExpired:
        return [Finding("Window", "problem", f"nothing within {_PROBE_S:.0f} s", "Try once more")]
    except (IndexError, ValueError):
        why = (run.stderr.strip().splitlines() or [f"it ended with code {run.returncode}"])[-1]
        return [Finding("Window", "problem", why, "Install what is missing above, or named here")]
    window = Finding("Window", "ok", f"opens ({seen['platform']})")
    if not on_screen and sys.platform.startswith("linux"):
        remedy = "Pictures can be drawn without: sd2 demo --screenshot window.png"
        window = Finding("Window", "note", "there is no display", remedy)
    view = Finding("3D view", "ok", "OpenGL answers")
    if "gl" in seen:
        view = Finding("3D view", "problem", *seen["gl"].split(". ", 1))
    fonts = Finding("Fonts", "ok", f"{seen['fonts']} families")
    if not seen["fonts"]:
        found, remedy = "none with letters: texts would be boxes", "fonts-dejavu-core"
        fonts = Finding("Fonts", "problem", found, how_to_install([remedy]))
    return [window, view, fonts]


def _kernels() -> Finding:
    if kernels_ready():
        return Finding("Kernels", "ok", "compiled for this processor")
    done, total = kernels_compiled()
    remedy = "sd2 doctor --warm-up (half a minute; otherwise that is done in the background)"
    return Finding("Kernels", "note", f"{done} of {total} compiled", remedy)


def _bundled() -> Finding:
    try:
        for name in ("body.npz", "denoiser.safetensors", "lifter.npz", "swipes.sd2"):
            resource_path(name)
    except Sd2Error as error:
        return Finding("Bundled files", "problem", error.found, error.remedy)
    return Finding("Bundled files", "ok", "body, denoisers, lifter and sample are there")


def _landmark_models() -> Finding:
    from sd2core.body.landmark_models import LANDMARKERS, landmark_models

    try:
        models = [landmark_models(download=False, model=model) for model in LANDMARKERS]
    except Sd2Error as error:
        remedy = "sd2 doctor --fetch-models (some 80 MB, once; only fits of videos need them)"
        return Finding("Landmark models", "note", error.found, remedy)
    names = " and ".join(LANDMARKERS)
    return Finding("Landmark models", "ok", f"{names} in {models[0].detector.parent}")


def _gpu() -> Finding:
    try:
        import torch
    except (ImportError, OSError) as error:
        found = f"torch cannot be loaded ({error})"
        return Finding("Learning", "problem", found, "Install it again")
    if torch.cuda.is_available():
        return Finding("Learning", "ok", f"on {torch.cuda.get_device_name()}")
    return Finding("Learning", "ok", f"torch {torch.__version__} on the processor, no GPU")


def plug_in_findings() -> list[Finding]:
    """Find what other packages add, and what of it cannot be loaded."""
    from sd2core.classify.defaults import CLASSIFIERS
    from sd2core.cli.added_commands import COMMAND_PLUG_INS
    from sd2core.denoise.registry import DENOISERS
    from sd2core.io.readers import MESH_FILES, RADAR_FILES
    from sd2core.labels.formats import LABEL_PLUG_INS
    from sd2core.live.radars import LIVE_RADARS
    from sd2core.radar_profiles import RADAR_PLUG_INS

    groups: tuple[Group[Any], ...] = (
        RADAR_PLUG_INS, RADAR_FILES, MESH_FILES, LABEL_PLUG_INS, DENOISERS, CLASSIFIERS,
        COMMAND_PLUG_INS, LIVE_RADARS,
    )  # fmt: skip
    findings = []
    for plug_in, made in (one for group in groups for one in group.loaded()):
        if isinstance(made, Sd2Error):
            remedy = made.remedy or f"Uninstall {plug_in.package}"
            words = str(Sd2Error(made.found, made.expected))
            finding = Finding("Plug-in", "problem", words, remedy)
        else:
            words = f"{plug_in.name} ({plug_in.group.name}) of {plug_in.package}"
            finding = Finding("Plug-in", "ok", words)
        findings.append(finding)
    return findings or [Finding("Plug-in", "ok", "none is installed")]


def _folders() -> list[Finding]:
    findings = []
    for about, folder in (("Cache", user_cache("")), ("Data", user_data(""))):
        place = next(one for one in (folder, *folder.parents) if one.exists())
        free_gb = shutil.disk_usage(place).free / 1e9
        if not os.access(place, os.W_OK):
            finding = Finding(about, "problem", f"{place} cannot be written to", "Mend its rights")
        elif free_gb < _FREE_GB:
            finding = Finding(about, "problem", f"{free_gb:.1f} GB free at {place}", "Make room")
        else:
            finding = Finding(about, "ok", f"{folder}, {free_gb:,.0f} GB free")
        findings.append(finding)
    return findings


def report(as_json: bool) -> int:
    """Print what was found; returns 1 where something must be mended."""
    findings = examine()
    if as_json:
        print(json.dumps([asdict(one) for one in findings], indent=2, ensure_ascii=False))
    else:
        width = max(len(one.about) for one in findings)
        for one in findings:
            mark = "PROBLEM" if one.state == "problem" else one.state
            print(f"{mark:<8} {one.about:<{width}}  {one.found}")
            if one.remedy:
                print(f"{'':<8} {'':<{width}}  → {one.remedy}")
    return int(any(one.state == "problem" for one in findings))
