"""Plans of batches: read strictly, with errors that say where, and written back."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.batch.fitting import fit_choices
from sd2core.batch.plan import BatchPlan, Recordings
from sd2core.batch.plan_file import plan_from_text, plan_text, read_plan, write_plan
from sd2core.doppler.options import PRESETS, chosen_options
from sd2core.errors import Sd2Error
from sd2core.options.exporting import Exporting
from sd2core.options.fitting import Fitting
from sd2core.options.shared import Denoising
from sd2core.options.synthesis import Synthesis
from sd2core.options.toml_files import line_of
from sd2core.sensor import VirtualSensor

FOLDER = Path("/data/study").absolute()
LEAST = 'out = "made"\n[recordings]\nfiles = ["*.sd2"]\n[synthesise]\n'

names = st.text(st.characters(min_codepoint=32, max_codepoint=0x2FF), min_size=1, max_size=8)
subjects = names.filter(lambda name: name.strip())
placements = st.one_of(
    st.just({"kind": "recording"}),
    st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=1, max_size=3).map(
        lambda places: {"kind": "positions", "positions_m": [list(place) for place in places]}
    ),
    st.just({"kind": "grid", "ranges_m": [2.2, 4.0], "azimuths_deg": [-30.0, 0.0, 30.0]}),
    st.just({"kind": "cloud", "count": 7, "range_m": [2.0, 4.0], "seed": 3}),
)
plans = st.builds(
    BatchPlan,
    out=st.just(str(FOLDER / "made")),
    recordings=st.builds(
        Recordings,
        files=st.lists(
            st.sampled_from(["*.sd2", "videos/**/*.mp4", "a.npz"]), min_size=1, max_size=3
        ).map(lambda files: tuple(str(FOLDER / file) for file in files)),
        subjects=st.sampled_from(["recording", "folder"]),
        subject_of=st.dictionaries(subjects, subjects, max_size=3),
    ),
    placements=placements,
    fit=st.none()
    | st.builds(
        Fitting,
        resolution=st.sampled_from(["low", "high"]),
        stature_of=st.dictionaries(subjects, st.floats(1, 2), max_size=2),
    ),
    synthesise=st.builds(
        Synthesis,
        tolerance=st.none() | st.floats(0.001, 0.5),
        bins=st.none() | st.integers(16, 64),
        null_bins=st.none() | st.just((1, 2)),
    ),
    denoise=st.none()
    | st.builds(
        Denoising,
        model=st.sampled_from([None, "denoiser", str(FOLDER / "m.safetensors")]),
        texture=st.none() | st.integers(0, 9),
    ),
    export=st.none() | st.builds(Exporting, segment_frames=st.integers(20, 99)),
)


@given(plans)
def test_a_plan_comes_back_from_its_text(plan: BatchPlan) -> None:
    assert plan_from_text(plan_text(plan, FOLDER), FOLDER) == plan


def test_paths_are_relative_to_the_plan_s_folder(tmp_path: Path) -> None:
    file = tmp_path / "plan.toml"
    file.write_text(LEAST)
    plan = read_plan(file)
    assert plan.out == str(tmp_path / "made")
    assert plan.recordings.files == (str(tmp_path / "*.sd2"),)
    elsewhere = tmp_path / "other"
    elsewhere.mkdir()
    write_plan(elsewhere / "plan.toml", plan)
    assert read_plan(elsewhere / "plan.toml") == plan
    assert 'out = "../made"' in (elsewhere / "plan.toml").read_text()


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        (LEAST + 'visibility = "exakt"\n', 5, ("synthesise.visibility", "'exakt'", "exact")),
        (LEAST + "mask_strid = 2\n", 5, ("synthesise.mask_strid", "not known")),
        (LEAST + 'bins = "32"\n', 5, ("synthesise.bins", "integer")),
        (LEAST + "null_bins = [40]\n", 4, ("synthesise", "null_bins", "40")),
        (LEAST + "tolerance = 2\n", 5, ("synthesise.tolerance", "above 0 and up to 1")),
        (LEAST + "tolerance = 0.02\nvisibility = 'none'\n", 4, ("tolerance", "visibility")),
        (LEAST + "[fit]\nstature_m = 178.0\n", 6, ("fit.stature_m is 178.0", "2.6")),
        (LEAST + "[fit]\n[fit.stature_of]\nanna = 0.4\n", 7, ("fit.stature_of.anna", "0.5")),
        (LEAST + "[fit]\nfield_of_view_deg = 500.0\n", 6, ("fit.field_of_view_deg", "170")),
        (LEAST + "[denoise]\nmodel = ' '\n", 6, ("denoise.model",)),
        (LEAST + "[export]\nsegment_frames = 8\n", 5, ("overlap_frames",)),
        (LEAST + "[export]\nlimbs = true\n", None, ("[synthesise]", "limbs = true")),
        (LEAST + "[export]\nlimbs = true\nkinds = ['real']\n", 5, ("synthetic",)),
        (LEAST + "[export]\nnull_bins = [20]\n", None, ("null_bins is [20]", "[14, 15, 16]")),
        (LEAST + "[export]\nnull_bins = [14, 15, 16, 40]\n", None, ("null_bins", "up to 31")),
        (LEAST + "[export]\nimu = ['left-ear']\n", 5, ("export", "left-ear")),
        (LEAST + "[export]\nkinds = []\n", 5, ("export", "none")),
        (LEAST + "[export]\nlabel_rule = 'most'\n", 6, ("export.label_rule", "majority")),
        (LEAST + "[placements]\nkind = 'ring'\n", 5, ("placements", "ring")),
        (LEAST + "[placements]\nkind = 'positions'\npositions_m = [[1, 2]]\n", 7, ("positions_m",)),
        (LEAST + "[placements]\nkind = 'grid'\nranges_m = []\n", 5, ("ranges",)),
        ('out = "x"\n[synthesise]\n', None, ("recordings", "missing")),
        ('out = "x"\n[recordings]\nfiles = []\n[synthesise]\n', 3, ("recordings.files",)),
        ('out = "x"\n[recordings]\nfiles = ["a"]\n[denoise]\n', None, ("synthesise",)),
        ("out = \n", None, ("line 1",)),
        ("out = 1979-05-27\n", None, ("date",)),
    ],
)
def test_what_is_wrong_is_named_with_file_line_and_key(
    text: str, line: int | None, words: tuple[str, ...], tmp_path: Path
) -> None:
    file = tmp_path / "plan.toml"
    file.write_text(text)
    with pytest.raises(Sd2Error) as caught:
        read_plan(file)
    message = str(caught.value)
    assert str(file) in message
    if line is not None:
        assert f", line {line}:" in message
    for word in words:
        assert word in message


def test_a_missing_plan_is_said(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match="does not exist"):
        read_plan(tmp_path / "none.toml")


def test_the_line_of_a_key_or_of_the_table_around_it() -> None:
    text = 'a = 1\n[b]\nc = 2\n[b.d]\n"x y" = 3\n'
    assert line_of(text, ("a",)) == 1
    assert line_of(text, ("b", "c")) == 3
    assert line_of(text, ("b", "d", "x y")) == 5
    assert line_of(text, ("b", "none")) == 2
    assert line_of(text, ("none",)) is None


def test_options_are_those_of_the_preset_but_for_what_is_given() -> None:
    assert chosen_options(Synthesis()) == PRESETS["paper"]
    options = chosen_options(Synthesis(preset="vid2doppler", bins=64))
    assert options.velocity == "vid2doppler"
    assert options.axis.bins == 64
    # The same velocities are nulled on twice as many bins.
    assert options.null_bins == tuple(range(28, 34))


def test_sensors_of_every_kind_of_placement() -> None:
    own, target = VirtualSensor(position_m=(0.5, 0.0, 0.0)), (0.0, 0.0, 3.0)

    def sensors(text: str) -> dict[int, VirtualSensor]:
        plan = plan_from_text(LEAST + text, FOLDER)
        found = plan.sensors(own, target)
        assert len(found) == plan.placement_count
        return found

    assert sensors("") == {0: own}
    places = "[placements]\nkind = 'positions'\npositions_m = [[0, 0, 1], [1, 0, 0]]\n"
    two = {1: VirtualSensor((0.0, 0.0, 1.0)), 2: VirtualSensor((1.0, 0.0, 0.0))}
    assert sensors(places) == two
    assert sensors(places + "own = true\n") == {0: own} | two
    ring = sensors("[placements]\nkind = 'grid'\nranges_m = [2.0]\nazimuths_deg = [0, 90, 180]\n")
    for one in ring.values():
        away = sum((a - b) ** 2 for a, b in zip(one.position_m, target, strict=True)) ** 0.5
        assert away == pytest.approx(2.0)


def test_nothing_to_do_is_refused() -> None:
    with pytest.raises(Sd2Error, match="nothing is to be done"):
        plan_from_text('out = "x"\n[recordings]\nfiles = ["a"]\n', FOLDER)


def test_the_count_of_a_plan_arrives() -> None:
    assert chosen_options(Synthesis(count="plain", tolerance=0.05)).count == "plain"
    assert chosen_options(Synthesis()).count == "expected"
    assert chosen_options(Synthesis(preset="vid2doppler")).count == "plain"
    with pytest.raises(ValueError, match="vid2doppler"):
        Synthesis(preset="vid2doppler", count="expected")


def test_a_plan_says_how_bodies_are_fitted() -> None:
    told = Fitting(landmark_model="full", stature_m=1.8, stature_of={"anna": 1.6}, focal_px=900.0)
    choices = {"landmark_model": "full", "resolution": "medium", "focal_px": 900.0}
    assert fit_choices(told, "anna", 500.0) == choices | {"stature_m": 1.6}
    assert fit_choices(told, "ben", 500.0) == choices | {"stature_m": 1.8}
    # As before the network could be chosen, so that what was fitted stays.
    usual = {"resolution": "medium"}
    assert fit_choices(Fitting(), "ben", None) == usual
    assert fit_choices(Fitting(), "ben", 500.0) == usual | {"focal_px": 500.0}
    wide = Fitting(field_of_view_deg=60.0)
    assert fit_choices(wide, "ben", 500.0) == usual | {"field_of_view_deg": 60.0}
