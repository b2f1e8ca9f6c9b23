"""Files of classifiers: whole or refused, in words."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from classifiers import CLASSES, MAPS, classifier, energies
from safetensors.torch import save

from sd2core.classify.card import ClassifierCard
from sd2core.classify.defaults import MODELS
from sd2core.classify.files import describe_classifier, load_classifier, save_classifier
from sd2core.classify.live import TrainedClassifier
from sd2core.classify.models import build
from sd2core.denoise.files import describe_model
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path

ABOUT = {"data": "six simulated people", "metrics": {"mean_recall": 0.7}}


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "small.safetensors"
    save_classifier(path, classifier(about=ABOUT))
    return path


def change_card(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    content = path.read_bytes()
    (length,) = struct.unpack("<Q", content[:8])
    header = json.loads(content[8 : 8 + length])
    card = json.loads(header["__metadata__"]["sd2"])
    change(card)
    header["__metadata__"]["sd2"] = json.dumps(card)
    packed = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(packed)) + packed + content[8 + length :])


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("kind", ["peak", "columns"])
def test_a_classifier_comes_back_as_it_was(name: str, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "one.safetensors"
    before = classifier(name, kind, about=ABOUT, title="One")
    written = save_classifier(path, before)
    after = load_classifier(path)
    assert after.card == written == describe_classifier(path)
    assert replace(after.card, path=None, parameters=0) == before.card
    assert after.card.parameters == sum(one.numel() for one in after.network.parameters())
    values = energies(60)
    np.testing.assert_array_equal(after.probabilities_of(values), before.probabilities_of(values))


def test_describing_needs_no_torch(model: Path) -> None:
    script = (
        "import sys; from sd2core.classify.files import describe_classifier;"
        f"print(describe_classifier({str(model)!r}).model, 'torch' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).resolve().parents[3],
    )
    assert done.stdout.split() == ["lstm", "False"]


def refused(path: Path, words: str) -> None:
    """Loading says so, naming the file."""
    with pytest.raises(Sd2Error, match=words) as caught:
        load_classifier(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.1, 0.9, 0.9999])
def test_truncated(model: Path, share: float) -> None:
    content = model.read_bytes()
    model.write_bytes(content[: int(share * len(content))])
    refused(model, "cut short|no model file")


def test_a_denoiser_is_no_classifier_and_the_other_way_round(model: Path) -> None:
    refused(resource_path("denoiser.safetensors"), "is a denoiser")
    with pytest.raises(Sd2Error, match="is a classifier"):
        describe_model(model)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda card: card.update(version=99), "of version 99"),
        (lambda card: card.update(format="other"), "has the format 'other'"),
        (lambda card: card.pop("classes"), "damaged"),
        (lambda card: card.update(classes=["a"]), "The classes are a"),
        (lambda card: card.update(classes=["a", "a", "b"]), "The classes are a, a, b"),
        (lambda card: card.update(classes=["a", "b"]), "shape"),
        (lambda card: card.update(features="peak"), "shape"),
        (lambda card: card.update(features="colour"), "features are 'colour'"),
        (lambda card: card.update(frame_rate_hz=0), "frame rate is 0"),
        (lambda card: card.update(model="gru"), "no classifier 'gru'"),
        (lambda card: card.update(options={"width": 10**9}), "1 to 1024"),
        (lambda card: card.update(options={"colour": 1}), "no option 'colour'"),
        (lambda card: card.update(options={"dropout": 1.5}), "a share"),
        (lambda card: card.update(axis={"bins": 32}), "damaged"),
        (lambda card: card.update(delay_frames=-1), "0 to 5 s"),
        (lambda card: card.update(delay_frames=10_000), "0 to 5 s"),
    ],
)
def test_a_changed_description_is_refused(
    model: Path, change: Callable[[dict[str, Any]], None], words: str
) -> None:
    change_card(model, change)
    with pytest.raises(Sd2Error, match=words):
        load_classifier(model)


def test_a_file_of_the_first_version_is_the_same_classifier(tmp_path: Path) -> None:
    """It did not say how wide it is, nor when it answers."""
    path = tmp_path / "old.safetensors"
    network = build("lstm", 32, len(CLASSES), width=16)
    card = ClassifierCard("lstm", {"width": 16}, *MAPS, "columns", CLASSES, ("simulated",))
    save_classifier(path, TrainedClassifier(network, card))
    before = load_classifier(path).probabilities_of(energies(50))

    def aged(told: dict[str, Any]) -> None:
        told.update(version=1, options={})
        del told["delay_frames"]

    change_card(path, aged)
    old = load_classifier(path)
    assert old.card.delay_s == 0.0
    np.testing.assert_array_equal(old.probabilities_of(energies(50)), before)


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.safetensors"
    path.write_bytes(save({}, {"made": "elsewhere"}))
    refused(path, "of another program")
    refused(tmp_path / "nothing.safetensors", "does not exist")
    with pytest.raises(Sd2Error, match="ends in"):
        save_classifier(tmp_path / "one.pt", classifier())


def test_a_card_needs_two_classes_and_options_must_be_numbers() -> None:
    with pytest.raises(Sd2Error, match="two or more"):
        ClassifierCard("lstm", {}, *MAPS, "columns", (), ("real",))
    with pytest.raises(Sd2Error, match="a whole number, 1 to 1024"):
        build("lstm", 2, len(CLASSES), width="wide")
    card = ClassifierCard("lstm", {}, *MAPS, "columns", ("a", "b"), ("real",))
    assert card.background is None
