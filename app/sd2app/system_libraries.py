"""System libraries that Qt and VTK load, which pip does not bring."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterable, Mapping

from sd2core.errors import Sd2Error

DRAWING = {
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libgthread-2.0.so.0": "libglib2.0-0",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libdbus-1.so.3": "libdbus-1-3",
    "libfontconfig.so.1": "libfontconfig1",
}
"""Libraries without which nothing is drawn, and the packages of Debian and Ubuntu that bring them
(`scripts/system_packages.sh` has the same)."""

ON_A_SCREEN = {
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libxcb-shape.so.0": "libxcb-shape0",
}
"""Those without which Qt ends the process when it opens a window under X11."""


def missing_libraries(on_a_screen: bool) -> dict[str, str]:
    """Libraries that cannot be loaded, and their packages; only Linux lacks any."""
    if not sys.platform.startswith("linux"):
        return {}
    wanted = DRAWING | (ON_A_SCREEN if on_a_screen else {})
    return {library: package for library, package in wanted.items() if not loads(library)}


def uses_x11(environment: Mapping[str, str] = os.environ) -> bool:
    """True if Qt will open its windows under X11."""
    platform = environment.get("QT_QPA_PLATFORM", "")
    return platform.startswith("xcb") or (not platform and bool(environment.get("DISPLAY")))


def explain_missing(missing: Mapping[str, str]) -> Sd2Error:
    """Error that says how to install what is missing."""
    return Sd2Error(
        f"System libraries are missing that the window draws with: {', '.join(missing)}",
        remedy=install_line(missing.values()),
    )


def install_line(packages: Iterable[str]) -> str:
    """Words on how to install packages on Debian and Ubuntu."""
    names = " ".join(dict.fromkeys(packages))
    return (
        "On Debian or Ubuntu: sudo apt-get update && sudo apt-get install"
        f" --no-install-recommends {names}"
    )


def loads(library: str) -> bool:
    """True if a shared library is found by its name."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
