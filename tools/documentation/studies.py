"""Makes ``studies.md`` and its pictures: ``python -m tools.documentation.studies``, an hour.

``python -m tools.documentation.studies classifier`` makes ``classifier.md`` of simulated campaigns,
an hour, too. Pairs and runs stay in ``build/studies`` and ``build/classifier``; what is there is
not made again.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path
from typing import Any

from sd2core.cli.output import progress_bar
from sd2core.study.certainty import Gain
from sd2core.study.plan import StudyPlan, read_study
from sd2core.study.report import TITLES, findings_of
from sd2core.study.run import run_study
from tools.documentation.denoiser import MARS
from tools.documentation.measured import BUILD, IMAGES, REPOSITORY, table, write_filled
from tools.documentation.runs import sd2
from tools.studies.hand_gestures import make_pairs

FOLDER = BUILD / "studies"
PLANS = REPOSITORY / "tools" / "studies"
CAMPAIGNS = {
    "varied": ("--minutes", 18, "--seed", 2),
    "to-and-fro": ("--minutes", 18, "--protocol", "paper", "--seed", 5),
}
"""Options of ``sd2 simulate campaign`` for the data of a plan of ``classifier.md``."""
_SHARE = 0.1
_VARIANTS = ("places", "shapes", "mirrored")


def study_section(folder: Path, name: str) -> str:
    """Make a study; its page as a section of another, its pictures among those of the guide.

    What its columns mean the other page says once.
    """
    sd2("study", PLANS / f"{name}.toml")
    text = (folder / name / "study.md").read_text(encoding="utf-8")
    for picture in ("curve", "confusion"):
        shutil.copy(folder / name / f"{picture}.png", IMAGES / f"study-{name}-{picture}.png")
        text = text.replace(f"({picture}.png)", f"(images/study-{name}-{picture}.png)")
    text = re.sub(r"^(Points of frames over|Mean recall over) .*\n\n", "", text, flags=re.MULTILINE)
    return re.sub(r"^#", "##", text, flags=re.MULTILINE).strip()


def by_kernel(share: float) -> str:
    """Measure what the simulated gestures give another classifier, and return words."""
    plan = read_study(PLANS / "k60168a.toml")
    kernel = (plan.classifiers[-1],)
    gains = _gains(plan.model_copy(update={"shares": (share,), "classifiers": kernel}))
    return " and ".join(f"by {name} maps {_gain(gain)} points" for name, gain in gains.items())


def _gains(plan: StudyPlan) -> dict[str, Gain]:
    """Gains of frames of a study with one share."""
    with progress_bar("Studying", "run") as progress:
        results = run_study(plan, processes=os.cpu_count() or 1, progress=progress)
    return {one.added: one.frames for one in findings_of(results)}


def augmentations(share: float) -> str:
    """Measure what each kind of added data gives, and return a table."""
    plan = read_study(PLANS / "mars.toml")
    added = tuple(one for one in plan.wanted if one != "radar")
    variants = {name: (str(FOLDER / f"mars-{name}.zarr"),) for name in _VARIANTS}
    tried: dict[str, dict[str, Any]] = {"nothing": {"speeds": ()}, "speeds": {}}
    tried |= {name: {"speeds": (), "video": video} for name, video in variants.items()}
    tried["speeds and all of these"] = {"video": sum(variants.values(), ())}
    rows = [["added besides", *(TITLES[one] for one in added)]]
    for name, changes in tried.items():
        changed = {"shares": (share,), "added": added, **changes}
        gains = _gains(plan.model_copy(update=changed))
        rows.append([name, *(_gain(gains[one]) for one in added)])
    return table(rows)


def _gain(gain: Gain) -> str:
    low, high = (100 * end for end in gain.over_takes)
    return f"{100 * gain.mean:+.1f} ({low:+.1f} to {high:+.1f})"


def studies() -> None:
    """Make the pairs and the studies on recordings, and write the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    sd2("pairs", "mars", *MARS, "--limbs", "--out", FOLDER / "mars.zarr")
    make_pairs(FOLDER / "hand-gestures.zarr")
    sections = [study_section(FOLDER, name) for name in ("mars", "k60168a")]
    for variant in _VARIANTS:
        out = FOLDER / f"mars-{variant}.zarr"
        sd2("pairs", "vary", *MARS, "--by", variant, "--limbs", "--out", out)
    write_filled(
        "studies.md",
        studies="\n\n".join(sections),
        share=_SHARE,
        kernel=by_kernel(_SHARE),
        augmentations=augmentations(_SHARE),
    )


def classifier() -> None:
    """Make the campaigns and the studies on them, and write the page."""
    folder = BUILD / "classifier"
    folder.mkdir(parents=True, exist_ok=True)
    sections = []
    for name, options in CAMPAIGNS.items():
        campaign = folder / f"{name}.zarr"
        sd2("simulate", "campaign", *options, "--workers", 2, "--out", campaign)
        sections.append(study_section(folder, name))
    write_filled("classifier.md", studies="\n\n".join(sections))


if __name__ == "__main__":
    classifier() if sys.argv[1:] == ["classifier"] else studies()
