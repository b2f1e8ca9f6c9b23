"""One ``sd2`` command with less claim to the processors than the window has.

Run as ``python -u -m sd2app.background.run_command COMMAND …``.
"""

from __future__ import annotations

import os
import sys

_NICE = 10
_BELOW_NORMAL = 0x4000  # Windows' BELOW_NORMAL_PRIORITY_CLASS


def give_way() -> None:
    """Let every other program go first; where that is refused, go on as before."""
    try:
        if sys.platform == "win32":
            import ctypes

            kernel = ctypes.windll.kernel32
            kernel.SetPriorityClass(kernel.GetCurrentProcess(), _BELOW_NORMAL)
        else:
            os.nice(_NICE)
    except OSError:
        pass


def main() -> int:
    """Give way, then run the command."""
    give_way()
    from sd2app.command_line import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
