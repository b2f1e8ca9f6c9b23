"""Write the tables of the colour maps of the window: `python -m tools.colour_maps FILE.npz`.

matplotlib has them, but takes a tenth of a second to load that the window's start does not have.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps

from sd2app.session.display import COLOUR_MAPS


def main() -> None:
    """Write 256 colours of every map, uint8 (256, 3) each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    tables: dict[str, Any] = {
        name: colormaps[name](np.arange(256), bytes=True)[:, :3]  # (256, 3)
        for name in COLOUR_MAPS
    }
    np.savez_compressed(parser.parse_args().out, **tables)


if __name__ == "__main__":
    main()
