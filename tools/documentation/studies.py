"""Makes ``studies.md``: ``python -m tools.documentation.studies``, a quarter of an hour.

Pairs and runs stay in ``build/studies``; what is there is not made again.
"""

from __future__ import annotations

import re
import shutil

from sd2core.accuracy.cache import this_machine
from tools.documentation.denoiser import MARS
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, DOCS, REPOSITORY
from tools.documentation.runs import sd2

FOLDER = BUILD / "studies"
PLANS = REPOSITORY / "tools" / "studies"

PAGE = """\
# Do synthetic data help a real classifier?

The paper's claim, tried on a **real** radar by [`sd2 study`](formats.md#plan-of-a-study) with
`tools/studies/mars.toml`. Three people do ten exercises before a 77 GHz radar ([decision
27](decisions/0027-real-pairs.md)); a body driven by a Kinect's skeleton stands for the video, so
that errors of fits are not in it. Made by

```sh
python -m tools.documentation.studies
```

on {machine}. How it is judged: [decision 75](decisions/0075-studies.md).

{study}

## What this cannot say

- Three people, one radar, exercises; nothing about swipes, or about bodies fitted to videos.
- How movements are grouped, what added frames weigh and the speeds at which they are played were
  chosen in view of these people (without other speeds: +4.6 points at 10 %, by denoised maps with
  texture): a fourth person has not been judged.
"""


def main() -> None:
    """Make the pairs and the study, and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    sd2("pairs", "mars", *MARS, "--limbs", "--out", FOLDER / "mars.zarr")
    sd2("study", PLANS / "mars.toml")
    made = FOLDER / "mars"
    shutil.copy(made / "curve.png", DOCS / "images" / "study-mars.png")
    text = (made / "study.md").read_text(encoding="utf-8")
    text = re.sub(r"^#", "##", text, flags=re.MULTILINE)
    text = text.replace("(curve.png)", "(images/study-mars.png)")
    write_page("studies.md", PAGE.format(machine=this_machine(), study=text.strip()))


if __name__ == "__main__":
    main()
