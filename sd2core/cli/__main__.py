"""``python -m sd2core.cli``: the library's commands without the window's."""

from __future__ import annotations

import sys

from sd2core.cli import build_parser, run

if __name__ == "__main__":
    sys.exit(run(build_parser()[0], sys.argv[1:]))
