"""One ``sd2`` command in a folder of its own, which outlives the window that started it.

Whoever looks into the folder knows what was started, whether it lives, what it said and
how it ended, and can stop it: see :mod:`sd2app.background.run_folder`. Run as
``python -u -m sd2app.background.run_in_folder FOLDER COMMAND …``.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from pathlib import Path

from sd2app.background.run_command import give_way
from sd2app.background.run_folder import CommandFolder

_LOOK_S = 0.2


def main() -> int:
    """Give way, run the command as Ctrl-C would stop it, and note how it ended."""
    folder, command = CommandFolder(Path(sys.argv[1])), sys.argv[2:]
    give_way()
    lock = folder.lock()
    if not lock.take():
        print("sd2: Another process is at this already.", file=sys.stderr)
        return 1
    # Whoever was started in the background of a script has Ctrl-C switched off.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    over = threading.Event()
    threading.Thread(target=_watch, args=(folder, over), daemon=True).start()
    from sd2app.command_line import main as run

    sys.argv[1:] = command  # files say how they were made
    try:
        code = run(command)
    except KeyboardInterrupt:
        code = 130
    except SystemExit as error:  # what was typed wrong
        code = error.code if isinstance(error.code, int) else 1
    over.set()
    folder.note_end(code)
    lock.release()
    return code


def _watch(folder: CommandFolder, over: threading.Event) -> None:
    while not over.wait(_LOOK_S):
        if folder.stop_wanted:
            _thread.interrupt_main()
            return


if __name__ == "__main__":
    sys.exit(main())
