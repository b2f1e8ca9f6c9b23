"""Keys that are pressed while a command runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

NO_MORE = "\x04"
"""The key where nobody will press another: without a terminal, and at the end of a pipe."""


def _no_key() -> str:
    return NO_MORE


if sys.platform == "win32":
    import msvcrt

    @contextmanager
    def pressed_keys() -> Iterator[Callable[[], str]]:
        """Function that returns the key that was pressed, or an empty text, at once."""

        def key() -> str:
            return msvcrt.getwch() if msvcrt.kbhit() else ""

        yield key if sys.stdin is not None and sys.stdin.isatty() else _no_key
else:
    import os
    import select
    import termios
    import tty

    @contextmanager
    def pressed_keys() -> Iterator[Callable[[], str]]:
        """Function that returns the key that was pressed, or an empty text, at once.

        Another program presses keys by a pipe.
        """
        terminal = _standard_input()
        if terminal is None or (os.isatty(terminal) and _in_background(terminal)):
            yield _no_key
            return

        def key() -> str:
            ready = select.select([terminal], [], [], 0)[0]
            return os.read(terminal, 1).decode(errors="replace") or NO_MORE if ready else ""

        if not os.isatty(terminal):
            yield key
            return
        before = termios.tcgetattr(terminal)
        tty.setcbreak(terminal)  # no Enter is needed; Ctrl-C interrupts as ever
        try:
            yield key
        finally:
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)

    def _standard_input() -> int | None:
        """File descriptor of standard input, None where it is closed or no file."""
        try:
            return None if sys.stdin is None else sys.stdin.fileno()
        except (OSError, ValueError):
            return None

    def _in_background(terminal: int) -> bool:
        """True if the shell runs this process in the background: setting the terminal stops it."""
        try:
            return os.tcgetpgrp(terminal) != os.getpgrp()
        except OSError:  # not the terminal that controls this process
            return False
