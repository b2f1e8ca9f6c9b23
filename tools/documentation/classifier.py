"""Makes ``classifier.md`` and its pictures: ``make classifier``, an hour.

Studies on simulated campaigns. Campaigns and runs stay in ``build/classifier``; what is there is
not made again.
"""

from __future__ import annotations

from tools.documentation.pages import write_filled
from tools.documentation.places import BUILD
from tools.documentation.runs import sd2
from tools.documentation.studies import PLANS, study_section

FOLDER = BUILD / "classifier"
CAMPAIGNS = {
    "varied": ("--minutes", 18, "--seed", 2),
    "to-and-fro": ("--minutes", 18, "--protocol", "paper", "--seed", 5),
}
"""Options of ``sd2 simulate campaign`` for the data of a plan."""


def main() -> None:
    """Make the campaigns and the studies, and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    sections = []
    for name, options in CAMPAIGNS.items():
        campaign = FOLDER / f"{name}.zarr"
        sd2("simulate", "campaign", *options, "--workers", 2, "--out", campaign)
        sd2("study", PLANS / f"{name}.toml")
        sections.append(study_section(FOLDER / name, name))
    write_filled("classifier.md", studies="\n\n".join(sections))


if __name__ == "__main__":
    main()
