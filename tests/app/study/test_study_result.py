"""Results of studies and evaluations, as the library writes them; no window."""

from __future__ import annotations

import json

import numpy as np
import pytest
from study_results import CLASSES, S4, a_score, some_results

from sd2app.study.result import Spread, read_result
from sd2core.classify.metrics import shares
from sd2core.cli.output import finite
from sd2core.errors import Sd2Error
from sd2core.study.report import totals_of, write_report


@pytest.fixture
def written(tmp_path):
    results = some_results(tmp_path)
    return results, write_report(results, tmp_path), tmp_path


def test_matrices_are_means_over_seeds_with_their_spread(written):
    results, _, folder = written
    result = read_result(folder)
    assert result.path == folder / "study.json"
    assert result.heading == "Frames of a simulated radar, mean ± standard deviation of 3 seeds"
    assert [matrix.title for matrix in result.matrices] == [
        "radar alone", "+ synthetic", "+ denoised", S4.title,
    ]  # fmt: skip
    for seeds, matrix in zip(totals_of(results).values(), result.matrices, strict=True):
        each = [shares(one.frames) for one in seeds]
        np.testing.assert_allclose(matrix.mean, np.mean(each, axis=0))
        np.testing.assert_allclose(matrix.sd, np.std(each, axis=0, ddof=1))
        np.testing.assert_allclose(matrix.mean.sum(axis=1), 1.0)
    plain, _, denoised, _ = result.matrices
    # Of 80, 81 and 82 per cent the mean is 81 and the standard deviation 1.
    assert plain.recall.text() == "81.0 ± 1.0"
    assert plain.gain is None
    assert denoised.gain.mean == pytest.approx(0.05)
    assert denoised.gain.text(signed=True).startswith("+5.0")
    assert Spread(-0.031, 0.002).text(signed=True) == "−3.1 ± 0.2"
    assert plain.cell(0, 0).text() == "81.0 ± 1.0"


def test_curves_and_the_conclusion_are_the_reports(written):
    _, said, folder = written
    result = read_result(folder)
    assert [
        [(one.share, round(one.recall.mean, 6)) for one in curve] for curve in result.curves
    ] == [
        [(0.1, 0.61), (1.0, 0.81)],
        [(0.1, 0.61), (1.0, 0.83)],
        [(0.1, 0.71), (1.0, 0.86)],
    ]
    assert result.summary == said
    assert "+10.0 points" in said


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
    "text", ["", "[]", "{}", '{"totals": []}', '{"classes": ["a"], "frames": [[1, 2]]}', "1"]
)
def test_what_is_no_result_is_refused_in_words(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(Sd2Error, match=r"other.json is (no such result|empty)"):
        read_result(path)


def test_what_is_not_there_is_refused_in_words(tmp_path):
    with pytest.raises(Sd2Error, match=r"gone.json does not exist"):
        read_result(tmp_path / "gone.json")
    with pytest.raises(Sd2Error, match=r"holds no study.json"):
        read_result(tmp_path)
