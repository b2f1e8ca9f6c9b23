"""Displays that a window can open on, asked before Qt, which ends the process if none answers."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path


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
