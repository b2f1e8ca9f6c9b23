"""Results of comparisons, as the library writes them; no window."""

from __future__ import annotations

import json

import numpy as np
import pytest
from class_tables import CLASSES, a_score, a_table

from sd2app.classify.result import Spread, read_result
from sd2core.classify.comparison_report import as_json, mean_confusion
from sd2core.classify.experiment import Condition
from sd2core.classify.metrics import shares
from sd2core.cli.output import finite
from sd2core.errors import Sd2Error


@pytest.fixture
def written(tmp_path):
    table = a_table()
    (tmp_path / "table.json").write_text(json.dumps(finite(as_json(table))))
    return table, tmp_path


def test_matrices_are_means_over_seeds_with_their_spread(written):
    table, folder = written
    result = read_result(folder)
    assert result.path == folder / "table.json"
    assert result.heading == ("Frames of a simulated radar, mean ± standard deviation of 3 seeds")
    assert [matrix.title for matrix in result.matrices] == [
        "radar only", "+ synthetic", "+ denoised synthetic",
    ]  # fmt: skip
    for condition, matrix in zip(
        (Condition(), Condition(added="synthetic"), Condition(added="denoised")),
        result.matrices,
        strict=True,
    ):
        np.testing.assert_allclose(matrix.mean, mean_confusion(table, condition))
        each = [shares(run.score.frames) for run in table.of(condition)]
        np.testing.assert_allclose(matrix.sd, np.std(each, axis=0, ddof=1))
        np.testing.assert_allclose(matrix.mean.sum(axis=1), 1.0)
    plain, _, denoised = result.matrices
    # Of 80, 81 and 82 per cent the mean is 81 and the standard deviation 1.
    assert plain.recall.text() == "81.0 ± 1.0"
    assert plain.gain is None
    assert denoised.gain.mean == pytest.approx(0.05)
    assert denoised.gain.text(signed=True).startswith("+5.0")
    assert Spread(-0.031, 0.002).text(signed=True) == "−3.1 ± 0.2"
    assert plain.cell(0, 0).text() == "81.0 ± 1.0"


def test_curves_have_the_whole_at_their_end(written):
    result = read_result(written[1])
    assert [
        [(one.share, round(one.recall.mean, 6)) for one in curve] for curve in result.curves
    ] == [
        [(0.1, 0.61), (1.0, 0.81)],
        [(0.1, 0.71), (1.0, 0.86)],
    ]
    assert result.summary == (
        "+ denoised synthetic: +10.0 points with 10 %, +5.0 points with 100 % of the simulated"
        " radar's data."
    )


def test_what_eval_writes_is_shown_as_well(tmp_path):
    found = a_score(0, 70)
    path = tmp_path / "eval.json"
    told = {"maps": ["simulated"], "subjects": ["s3"], "learnt_from": [], **found.to_json()}
    told |= {"latencies_s": [0.1, 0.3], "latency_s": 0.2, "missed": 1}
    path.write_text(json.dumps(finite(told)))
    result = read_result(path)
    assert result.heading == "Judged on simulated maps"
    assert [matrix.title for matrix in result.matrices] == ["Frames", "Gestures"]
    assert result.matrices[0].cell(1, 1) == Spread(0.7, 0.0)
    assert result.matrices[0].recall.text() == "70.0"
    gestures = int(found.gestures.sum())
    assert result.summary == (
        f"People: s3.\nA gesture is recognised after 0.20 s (median); 1 of {gestures} never."
    )
    told |= {"learnt_from": ["s3"], "latency_s": None}
    path.write_text(json.dumps(finite(told)))
    assert read_result(path).summary == (
        "People: s3.\nIt has learnt from s3: this is not what it does for others."
    )


def test_a_class_without_frames_has_no_share(tmp_path):
    path = tmp_path / "eval.json"
    frames = [[5, 5, 0], [0, 0, 0], [0, 0, 4]]
    told = {"maps": ["real"], "classes": CLASSES, "frames": frames, "gestures": frames}
    path.write_text(json.dumps(told))
    matrix = read_result(path).matrices[0]
    assert matrix.cell(1, 1).text() == "–"
    assert matrix.recall.text() == "75.0"


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"conditions": []}', '{"classes": ["a"], "frames": [[1, 2]]}', "1"]
)
def test_what_is_no_result_is_refused_in_words(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(Sd2Error, match=r"other.json is (no such result|empty)"):
        read_result(path)


def test_what_is_not_there_is_refused_in_words(tmp_path):
    with pytest.raises(Sd2Error, match=r"gone.json does not exist"):
        read_result(tmp_path / "gone.json")
    with pytest.raises(Sd2Error, match=r"holds no table.json"):
        read_result(tmp_path)
