"""Makes ``studies.md`` and its pictures: ``python -m tools.documentation.studies``, an hour.

Pairs and runs stay in ``build/studies``; what is there is not made again.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from sd2core.accuracy.cache import this_machine
from tools.documentation.denoiser import MARS
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, IMAGES, REPOSITORY
from tools.documentation.runs import sd2
from tools.studies.hand_gestures import make_pairs

FOLDER = BUILD / "studies"
PLANS = REPOSITORY / "tools" / "studies"

PAGE = """\
# Do synthetic data help a real classifier?

The paper's claim, tried on **real** radars by [`sd2 study`](formats.md#plan-of-a-study). Made by

```sh
python -m tools.documentation.studies
```

on {machine}. How it is judged: [decision 75](decisions/0075-studies.md).

`tools/studies/mars.toml`: three people do ten exercises before a 77 GHz radar ([decision
27](decisions/0027-real-pairs.md)); a body driven by a Kinect's skeleton stands for the video, so
that errors of fits are not in it. `tools/studies/k60168a.toml`: one person's gestures before a
60 GHz radar, and the same gestures as `tools/studies/hand_gestures.py` **simulates** them.

{studies}

## What this cannot say

- Three people and one, two radars; nothing about bodies fitted to videos.
- MARS: how movements are grouped, what added frames weigh and the speeds at which they are played
  were chosen in view of these people: a fourth person has not been judged.
- K60168A: the program's gestures were made in view of these files, of which nothing says how the
  hand moves.
"""


def study_section(folder: Path, name: str) -> str:
    """Return a study's page as a section of another, its pictures among those of the guide."""
    text = (folder / "study.md").read_text(encoding="utf-8")
    for picture in ("curve", "confusion"):
        shutil.copy(folder / f"{picture}.png", IMAGES / f"study-{name}-{picture}.png")
        text = text.replace(f"({picture}.png)", f"(images/study-{name}-{picture}.png)")
    return re.sub(r"^#", "##", text, flags=re.MULTILINE).strip()


def main() -> None:
    """Make the pairs and the studies, and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    sd2("pairs", "mars", *MARS, "--limbs", "--out", FOLDER / "mars.zarr")
    make_pairs(FOLDER / "hand-gestures.zarr")
    sections = []
    for name in ("mars", "k60168a"):
        sd2("study", PLANS / f"{name}.toml")
        sections.append(study_section(FOLDER / name, name))
    page = PAGE.format(machine=this_machine(), studies="\n\n".join(sections))
    write_page("studies.md", page)


if __name__ == "__main__":
    main()
