"""Background process of an ``sd2`` command, at a lower priority.

``python -u -m sd2core.cli.background COMMAND …``; with ``--folder FOLDER`` in front it works in
a :class:`~sd2core.runs.command_folder.CommandFolder`.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from sd2core.cli.parser import build_parser
from sd2core.cli.running import run
from sd2core.errors import Sd2Error
from sd2core.processes import INTERRUPTED, lower_priority
from sd2core.runs.command_folder import CommandFolder

_POLL_S = 0.2


def main() -> int:
    """Run the command of the command line."""
    lower_priority()
    words = sys.argv[1:]
    folder = None
    if words[:1] == ["--folder"]:
        folder, words = CommandFolder(Path(words[1])), words[2:]
    sys.argv[1:] = words  # files say how they were made

    def command() -> int:
        # The library's commands: none of those that open the window is run in the background.
        return run(build_parser(typed=words)[0], words)

    return command() if folder is None else run_in_folder(folder, command)


def run_in_folder(folder: CommandFolder, command: Callable[[], int]) -> int:
    """Run a command as the process of a folder, and note its end."""
    # What was started in the background of a script has Ctrl-C switched off.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        lock = folder.lock()
    except Sd2Error as error:
        print(f"sd2: {error}", file=sys.stderr)
        return 1
    over = threading.Event()
    try:
        folder.set_state("running")
        threading.Thread(target=_watch, args=(folder, over), daemon=True).start()
        code = command()
    except KeyboardInterrupt:
        code = INTERRUPTED
    except SystemExit as error:  # --version, --help
        code = error.code if isinstance(error.code, int) else 1
    over.set()
    folder.note_end(code)
    lock.release()
    return code


def _watch(folder: CommandFolder, over: threading.Event) -> None:
    """Interrupt the command as Ctrl-C does, once it is told to stop."""
    while not over.wait(_POLL_S):
        if folder.stop_wanted:
            if sys.platform == "win32":
                _thread.interrupt_main()
            else:  # wakes it from what it waits for
                signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
            return


if __name__ == "__main__":
    sys.exit(main())
