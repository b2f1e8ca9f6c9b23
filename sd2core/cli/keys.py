"""Keys that are pressed while a command runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

if sys.platform == "win32":
    import msvcrt

    @contextmanager
    def pressed_keys() -> Iterator[Callable[[], str]]:
        """Function that returns the key that was pressed, or an empty text, at once."""

        def key() -> str:
            return msvcrt.getwch() if msvcrt.kbhit() else ""

        yield key if sys.stdin is not None and sys.stdin.isatty() else str
else:
    import os
    import select
    import termios
    import tty

    @contextmanager
    def pressed_keys() -> Iterator[Callable[[], str]]:
        """Function that returns the key that was pressed, or an empty text, at once."""
        if sys.stdin is None or not sys.stdin.isatty() or _in_background(sys.stdin.fileno()):
            yield str
            return
        terminal = sys.stdin.fileno()
        before = termios.tcgetattr(terminal)

        def key() -> str:
            ready = select.select([terminal], [], [], 0)[0]
            return os.read(terminal, 1).decode(errors="replace") if ready else ""

        tty.setcbreak(terminal)  # no Enter is needed; Ctrl-C interrupts as ever
        try:
            yield key
        finally:
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)

    def _in_background(terminal: int) -> bool:
        """True if the shell runs this process in the background: setting the terminal stops it."""
        try:
            return os.tcgetpgrp(terminal) != os.getpgrp()
        except OSError:  # not the terminal that controls this process
            return False
