"""Makes ``classifier.md`` and its pictures: ``make classifier``, an hour.

Studies on simulated campaigns. Campaigns and runs stay in ``build/classifier``; what is there is
not made again.
"""

from __future__ import annotations

from sd2core.accuracy.cache import this_machine
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD
from tools.documentation.runs import sd2
from tools.documentation.studies import PLANS, study_section

FOLDER = BUILD / "classifier"
CAMPAIGNS = {
    "varied": ("--minutes", 18, "--seed", 2),
    "to-and-fro": ("--minutes", 18, "--protocol", "paper", "--seed", 5),
}
"""Options of ``sd2 simulate campaign`` for the data of a plan."""

PAGE = """\
# The gesture classifier

How well are gestures recognised, and when do synthetic data help? **Every radar here is
simulated**; for real ones see [studies](studies.md) and [real gestures](real-gestures.md). Made by

```sh
make classifier
```

on {machine}, by `sd2 study` of the plans in `tools/studies`, with the bundled denoiser, which
learnt from other people. Features and networks: [decision
37](decisions/0037-gesture-classifiers.md); protocols: [decision 54](decisions/0054-protocols.md).
The paper has 89.5 % on a real radar with 30,000 frames of each class, and gains 3.2 points by
denoised maps; it tells neither its background nor who is judged.

{studies}

## What this cannot say

- Anything about a real radar ([not simulated](decisions/0026-the-simulated-campaign.md)).
- Longer trainings gain less by what is added
  ([decision 37](decisions/0037-gesture-classifiers.md)).
"""


def main() -> None:
    """Make the campaigns and the studies, and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    sections = []
    for name, options in CAMPAIGNS.items():
        campaign = FOLDER / f"{name}.zarr"
        sd2("simulate", "campaign", *options, "--workers", 2, "--out", campaign)
        sd2("study", PLANS / f"{name}.toml")
        sections.append(study_section(FOLDER / name, name))
    page = PAGE.format(machine=this_machine(), studies="\n\n".join(sections))
    write_page("classifier.md", page)


if __name__ == "__main__":
    main()
