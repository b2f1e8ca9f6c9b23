from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from tools.motion_capture.catalogue import CALIBRATED, MEASURED, Trial, trials
from tools.motion_capture.skeletons import POINTS


@pytest.fixture(scope="module")
def known(shared_data: Path) -> list[Trial]:
    return trials(shared_data / "motion")


def test_a_person_serves_one_use_and_a_motion_occurs_once(known: list[Trial]) -> None:
    assert not MEASURED & CALIBRATED
    roles = defaultdict(set)
    for trial in known:
        roles[trial.person].add(trial.role)
    assert all(len(role) == 1 for role in roles.values())
    assert {person for person, role in roles.items() if role == {"measure"}} == MEASURED
    assert {person for person, role in roles.items() if role == {"calibrate"}} == CALIBRATED
    names = [trial.name for trial in known]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    "name", ["02_01", "12_01", "131_01", "salsa_05", "10_01", "ui_m01_s09_e05"]
)
def test_people_stand_on_the_floor_with_left_and_right_where_they_are(
    known: list[Trial], name: str
) -> None:
    (trial,) = (one for one in known if one.name == name)
    points_m, rate_hz = trial.points()
    assert np.isfinite(points_m).all()
    assert 25.0 < rate_hz < 40.0
    place = {point: points_m[:, row] for row, point in enumerate(POINTS)}
    height_m = np.percentile(place["ear.L"][:, 1] - points_m[..., 1].min(), 90)
    assert 1.2 < height_m < 1.9
    up = place["ear.L"] + place["ear.R"] - place["hip.L"] - place["hip.R"]
    ahead = np.cross(place["shoulder.L"] - place["shoulder.R"], up)
    for front, back in (("nose", "ear"), ("foot_index", "ankle")):
        sides = [front] if front in place else [f"{front}.L", f"{front}.R"]
        middle = sum(place[side] for side in sides) / len(sides)
        behind = 0.5 * (place[f"{back}.L"] + place[f"{back}.R"])
        assert np.median(((middle - behind) * ahead).sum(axis=1)) > 0.0


def test_a_folder_without_motion_is_named(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="holds no motion capture"):
        trials(tmp_path)
