"""The trials of motion capture: who, what, where, and what each is used for.

The folder is that of ``data/motion`` (its README gives sources and licences). Persons, not trials,
are divided into those learnt from, those that calibrate what the lifter says of its errors, and
those that only measure.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import RATE_HZ, Role
from tools.motion_capture.points import (
    CMU_ASF,
    HAHNE_BVH,
    KOYAMA_BVH,
    POSER_BVH,
    USED_MARKERS,
    points_of,
    points_of_markers,
)
from tools.motion_capture.skeletons import read_amc, read_bvh

Floats = NDArray[np.float64]
MEASURED = frozenset({"cmu02", "cmu08", "cmu09", "cmu12", "cmu49", "ui09", "ui10"})
"""Persons that nothing is learnt from or tuned on."""

CALIBRATED = frozenset({"cmu17", "cmu32", "cmu131", "ui08", "indian"})
"""Persons whose errors calibrate the stated ones."""

_HAHNE_M, _POSER_M = 0.056444, 0.01
_NO_PERSON = frozenset({"127_01"})  # a motorcycle
_MISSING = -32768
_UI_RATE_HZ = 33.0
_REPETITIONS = frozenset({"e02", "e05", "e08"})
"""Of ten that are much alike."""
_UI_KINDS = (
    "deep squat",
    "hurdle step",
    "inline lunge",
    "side lunge",
    "sit to stand",
    "leg raise",
    "shoulder abduction",
    "shoulder extension",
    "shoulder rotation",
    "shoulder scaption",
)


@dataclass(frozen=True)
class Trial:
    """One recording of one person."""

    name: str
    person: str
    what: str  # as its source describes it
    path: Path
    skeleton: Path | None = None  # of an AMC file
    episode: int | None = None  # of a file of UI-PRMD

    @property
    def role(self) -> Role:
        """What the trial may be used for."""
        if self.person in MEASURED:
            return "measure"
        return "calibrate" if self.person in CALIBRATED else "learn"

    def points(self) -> tuple[Floats, float]:
        """The points (T, 20, 3), y up, in metres, and frames per second; Sd2Error if unreadable."""
        if self.episode is not None:
            return _ui_points(self.path, self.episode), _UI_RATE_HZ
        if self.skeleton is not None:
            return points_of(read_amc(self.path, self.skeleton), CMU_ASF), RATE_HZ
        converter = self.path.name.partition("_")[0]
        names = {"francisco": HAHNE_BVH, "yukikoyama": KOYAMA_BVH}.get(converter, POSER_BVH)
        unit_m = _POSER_M if names is POSER_BVH else _HAHNE_M
        motion, rate_hz = read_bvh(self.path, unit_m)
        # The first frame is a pose of the conversion's own.
        return points_of(motion, names)[1:], rate_hz


def trials(folder: Path) -> list[Trial]:
    """All trials of a folder, each motion once, by name; not those without a skeleton (subject 13).

    Raises Sd2Error if the folder is not one of motion capture.
    """
    described = _descriptions(folder)
    by_name: dict[str, Trial] = {}
    for path in sorted((folder / "cmu_amc").glob("*.amc.gz")):
        stem = path.name.partition(".")[0]
        trial, dash, variant = stem.partition("-")  # 07_05-walk is trial 07_05 on 07-walk.asf
        subject = trial.partition("_")[0]
        skeleton = path.parent / f"{subject}{dash}{variant}.asf.gz"
        if skeleton.exists() and trial not in _NO_PERSON:
            what = described.get(path.name, "")
            by_name[trial] = Trial(trial, f"cmu{subject}", what, path, skeleton=skeleton)
    for path in sorted((folder / "cmu_bvh").glob("*.bvh.gz")):
        converter, _, trial = path.name.partition(".")[0].partition("_")
        person = trial.partition("_")[0]
        if converter != "dance":
            person = f"cmu{person}"
        if trial not in by_name:
            what = described.get(f"{trial}.bvh.gz", "dance" if converter == "dance" else "")
            by_name[trial] = Trial(trial, person, what, path)
    for number, kind in enumerate(_UI_KINDS, start=1):
        path = folder / "uiprmd" / f"m{number:02d}_ok.npz"
        if path.exists():
            with np.load(path) as data:
                names = [str(name) for name in data["names"]]
            for episode, name in enumerate(names):
                if name[-3:] not in _REPETITIONS:
                    continue
                trial = f"ui_m{number:02d}_{name}"
                by_name[trial] = Trial(trial, f"ui{name[1:3]}", kind, path, episode=episode)
    if not by_name:
        raise Sd2Error(
            f"{folder} holds no motion capture", "a folder with cmu_amc/, cmu_bvh/ or uiprmd/"
        )
    return [by_name[name] for name in sorted(by_name)]


def _descriptions(folder: Path) -> dict[str, str]:
    path = folder / "trials.csv"
    if not path.exists():
        return {}
    with path.open(encoding="utf-8") as stream:
        return {row["file"]: row["description"] for row in csv.DictReader(stream)}


def _ui_points(path: Path, episode: int) -> Floats:
    """Points of one episode; single lost markers are bridged in a straight line."""
    with np.load(path) as data:
        start, stop = data["start"][episode : episode + 2]
        raw, centre_mm = data["pos"][start:stop], data["center_mm"][episode]
    markers_m = 1e-3 * (0.1 * raw.astype(np.float64) + centre_mm)
    lost = (raw == _MISSING).any(axis=2)
    frames = np.arange(len(raw))
    for marker in np.flatnonzero(lost.any(axis=0)):
        known = ~lost[:, marker]
        if marker not in USED_MARKERS:
            continue
        if not known.any():
            raise Sd2Error(f"{path}: marker {marker} of episode {episode} is never seen")
        for axis in range(3):
            column = markers_m[:, marker, axis]
            column[~known] = np.interp(frames[~known], frames[known], column[known])
    return points_of_markers(markers_m)
