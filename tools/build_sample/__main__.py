"""``python -m tools.build_sample make OUT``: the bundled sample recording."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from sd2core.cli.output import progress_bar
from sd2core.options.records import ARGUMENT, OptionRecord
from tools.build_sample.sample import make_sample
from tools.command_line import tool


class Make(OptionRecord):
    """Options of ``make``.

    Parameters
    ----------
    out : OUT
        the recording to make (NAME.sd2)
    """

    out: Annotated[Path, ARGUMENT]


def _make(options: Make) -> None:
    """Make the bundled sample recording.

    A body swipes before a camera and a 60 GHz radar. Takes some minutes, and the landmark models.
    """
    with progress_bar("Simulating", unit="frame") as progress:
        made = make_sample(options.out, progress)
    print(f"Made {made}")


main = tool("build_sample", {"make": (Make, _make)})


if __name__ == "__main__":
    sys.exit(main())
