"""Displays and libraries that a window needs, asked before Qt ends the process for want of one."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from sd2core.errors import Sd2Error


def has_display(platform: str, environment: Mapping[str, str]) -> bool:
    """True if Qt finds a screen, or its platform is set explicitly."""
    if not platform.startswith("linux"):
        return True
    names = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    return any(environment.get(name) for name in names)


def silent_displays(platform: str, environment: Mapping[str, str]) -> tuple[str, ...]:
    """Displays that Qt would try, as their variables say, if none of them answers."""
    if not platform.startswith("linux"):
        return ()
    # Several of Qt's platforms may be named, each with options: "wayland;xcb:…".
    chosen = environment.get("QT_QPA_PLATFORM", "")
    plug_ins = [one.partition(":")[0] for one in chosen.split(";")] if chosen else []
    if not all(one.startswith(("wayland", "xcb")) for one in plug_ins):
        return ()
    silent = []
    for name, plug_in, answers in (
        ("WAYLAND_DISPLAY", "wayland", _wayland_answers),
        ("DISPLAY", "xcb", _x11_answers),
    ):
        is_set = bool(environment.get(name))
        if any(one.startswith(plug_in) for one in plug_ins) if plug_ins else is_set:
            if answers(environment):
                return ()
            silent.append(f"{name}={environment.get(name, '')}")
    return tuple(silent)


def _x11_answers(environment: Mapping[str, str]) -> bool:
    import ctypes  # here because most commands ask no display

    try:
        xcb = ctypes.CDLL("libxcb.so.1")
    except OSError:  # it is missing, which is said elsewhere
        return True
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connect.argtypes = (ctypes.c_char_p, ctypes.c_void_p)
    xcb.xcb_connection_has_error.argtypes = xcb.xcb_disconnect.argtypes = (ctypes.c_void_p,)
    connection = xcb.xcb_connect(os.fsencode(environment.get("DISPLAY", "")), None)
    failed = xcb.xcb_connection_has_error(connection)
    xcb.xcb_disconnect(connection)
    return not failed


def _wayland_answers(environment: Mapping[str, str]) -> bool:
    import socket

    folder = Path(environment.get("XDG_RUNTIME_DIR") or "/nonexistent")
    place = folder / (environment.get("WAYLAND_DISPLAY") or "wayland-0")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        try:
            client.connect(str(place))
        except OSError:
            return False
    return True


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

UNDER_X11 = {
    "libX11-xcb.so.1": "libx11-xcb1",
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libxcb-randr.so.0": "libxcb-randr0",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxcb-sync.so.1": "libxcb-sync1",
    "libxcb-xfixes.so.0": "libxcb-xfixes0",
}
"""Those without which Qt ends the process when it opens a window under X11."""

UNDER_WAYLAND = {
    "libwayland-client.so.0": "libwayland-client0",
    "libwayland-cursor.so.0": "libwayland-cursor0",
}
"""The same under Wayland, where there is no X11 for Qt to fall back on."""


def missing_libraries(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Libraries that cannot be loaded, and their packages; only Linux lacks any."""
    if not sys.platform.startswith("linux"):
        return {}
    wanted = wanted_libraries(environment)
    return {library: package for library, package in wanted.items() if not loads(library)}


def wanted_libraries(environment: Mapping[str, str]) -> dict[str, str]:
    """Libraries that a window needs on the display that Qt will choose, and their packages."""
    platform = environment.get("QT_QPA_PLATFORM", "")
    if platform.startswith("xcb") or (not platform and environment.get("DISPLAY")):
        return DRAWING | UNDER_X11
    if platform.startswith("wayland") or (not platform and environment.get("WAYLAND_DISPLAY")):
        return DRAWING | UNDER_WAYLAND
    return DRAWING


def explain_missing(missing: Mapping[str, str]) -> Sd2Error:
    """Error that says how to install what is missing."""
    return Sd2Error(
        f"System libraries are missing that the window draws with: {', '.join(missing)}",
        remedy=how_to_install(missing.values()),
    )


def how_to_install(packages: Iterable[str]) -> str:
    """Words on how to install packages on Debian and Ubuntu."""
    names = " ".join(dict.fromkeys(packages))
    return (
        "On Debian or Ubuntu: sudo apt-get update && sudo apt-get install"
        f" --no-install-recommends {names}"
    )


def loads(library: str) -> bool:
    """True if a shared library is found by its name."""
    import ctypes  # not for commands that need no library

    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
