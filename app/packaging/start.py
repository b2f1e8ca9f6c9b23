"""What the program in a folder starts with: ``sd2``, or one of its modules in a background process.

The program starts its background processes with ``sys.executable -m MODULE``. In a bundle that is
this very program, so it stands in for the Python interpreter.
"""

from __future__ import annotations

import multiprocessing
import runpy
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str]) -> int:
    """Run ``sd2``, a module (``-m MODULE``) or a script (``-c SCRIPT``); alone, open the window."""
    words = list(arguments)
    if words[:1] == ["-u"]:  # always so: see the recipe
        del words[0]
    if words[:1] == ["-m"]:
        sys.argv = words[1:]
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
        return 0
    if words[:1] == ["-c"]:
        sys.argv = ["-c", *words[2:]]
        exec(compile(words[1], "<script>", "exec"), {"__name__": "__main__"})
        return 0
    from sd2app.command_line import main as sd2

    return sd2(words or ["open"])


if __name__ == "__main__":
    # Workers of a batch are this program as well; in them the call does not return.
    multiprocessing.freeze_support()
    sys.exit(main(sys.argv[1:]))
