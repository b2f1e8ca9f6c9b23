"""Model files: whole or refused, in words."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from denoisers import SMALL, energies, trained
from safetensors.torch import save

from sd2core.denoise import files
from sd2core.denoise.card import VERSION, ModelCard
from sd2core.denoise.files import (
    available_models,
    describe_model,
    find_model,
    load_model,
    save_model,
)
from sd2core.errors import Sd2Error

ABOUT = {"data": "six simulated people", "limits": "indoors", "metrics": {"mae_mps": 0.1}}


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "small.safetensors"
    save_model(path, trained("gru", about=ABOUT, title="Small"))
    return path


def header_of(path: Path) -> tuple[dict[str, Any], bytes]:
    content = path.read_bytes()
    (length,) = struct.unpack("<Q", content[:8])
    return json.loads(content[8 : 8 + length]), content[8 + length :]


def rewrite(path: Path, header: dict[str, Any], data: bytes) -> None:
    packed = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(packed)) + packed + data)


def change_card(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    header, data = header_of(path)
    card = json.loads(header["__metadata__"]["sd2"])
    change(card)
    header["__metadata__"]["sd2"] = json.dumps(card)
    rewrite(path, header, data)


@pytest.mark.parametrize("name", SMALL)
def test_a_model_comes_back_as_it_was(name: str, tmp_path: Path) -> None:
    path = tmp_path / "one.safetensors"
    before = trained(name, about=ABOUT, title="One", unit="dB of nothing")
    written = save_model(path, before)
    after = load_model(path)
    assert after.card == written == describe_model(path)
    assert replace(after.card, path=None, parameters=0) == before.card
    values = energies(100)
    np.testing.assert_array_equal(after.denoise_values(values), before.denoise_values(values))


def test_the_card_counts_what_is_learnt(model: Path) -> None:
    card = describe_model(model)
    assert card.parameters == sum(one.numel() for one in load_model(model).network.parameters())
    assert card.name == "small"


def test_describing_needs_no_torch(model: Path) -> None:
    script = (
        "import sys; from sd2core.denoise.files import describe_model;"
        f"print(describe_model({str(model)!r}).model, 'torch' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).resolve().parents[3],
    )
    assert done.stdout.split() == ["gru", "False"]


@pytest.mark.slow
def test_loading_needs_no_compiler() -> None:
    """Torch's own, with some hundred modules and a computer algebra."""
    code = """
import sys
import sd2core as sd2
sd2.load_model("denoiser-limbs")
print(*{"torch", "torch._dynamo", "sympy"}.intersection(sys.modules))
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.split() == ["torch"]


def test_a_failed_save_leaves_the_old_file(model: Path) -> None:
    before = model.read_bytes()
    with pytest.raises(Sd2Error, match="cannot be written"):
        save_model(model, trained("gru", about={"metrics": float("nan")}))
    with pytest.raises(Sd2Error, match="cannot be written"):
        save_model(model, trained("gru", about={"data": object()}))
    assert model.read_bytes() == before
    assert [entry.name for entry in model.parent.iterdir()] == [model.name]


def refused(path: Path, words: str) -> None:
    """Loading says so, naming the file."""
    with pytest.raises(Sd2Error, match=words) as caught:
        load_model(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("share", [0.0, 0.0005, 0.001, 0.01, 0.2, 0.9, 0.99999])
def test_truncated(model: Path, share: float) -> None:
    content = model.read_bytes()
    model.write_bytes(content[: int(share * len(content))])
    refused(model, "cut short|no model file")


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK\x03\x04 a zip archive with some more bytes",
        b"\xff" * 64,
        struct.pack("<Q", 1 << 62) + b"{}",
        struct.pack("<Q", 2) + b"[]",
        struct.pack("<Q", 2) + b"{}",
        struct.pack("<Q", 3) + b"{x}",
    ],
)
def test_something_else(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "other.safetensors"
    path.write_bytes(content)
    refused(path, "no model file|header is damaged|another program")


def test_weights_of_another_program(tmp_path: Path) -> None:
    path = tmp_path / "other.safetensors"
    path.write_bytes(save({"layer.weight": torch.zeros(3)}, {"format": "pt"}))
    refused(path, "another program")


def test_a_folder_and_nothing(tmp_path: Path) -> None:
    refused(tmp_path, "is a folder")
    (tmp_path / "best.safetensors").touch()
    refused(tmp_path, r"It holds .*best\.safetensors")
    refused(tmp_path / "missing.safetensors", "does not exist")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": VERSION + 1}, f"is of version {VERSION + 1}"),
        ({"version": "one"}, "is of version 'one'"),
        ({"format": "sd2-lifter"}, "has the format 'sd2-lifter'"),
    ],
)
def test_another_format_or_version(model: Path, change: dict[str, Any], words: str) -> None:
    change_card(model, lambda card: card.update(change))
    refused(model, words)


@pytest.mark.parametrize(
    "change",
    [
        lambda card: card.pop("scaling"),
        lambda card: card["scaling"].update(law="log"),
        lambda card: card["scaling"].update(input_reference="much"),
        lambda card: card.update(null_bins=["a"]),
        lambda card: card.update(axis=32),
        lambda card: card.update(options=[1]),
    ],
)
def test_damaged_descriptions(model: Path, change: Callable[[dict[str, Any]], None]) -> None:
    change_card(model, change)
    refused(model, "description is damaged")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda card: card.update(model="oracle"), "no model 'oracle'"),
        (lambda card: card.update(model="unet", options={}), "not those of the model unet"),
        (lambda card: card["options"].update(depth=1), "2 too many|4 too many"),
        (lambda card: card["options"].update(channels=9), "is of shape"),
        (lambda card: card["options"].update(channels=10**9), "channels is 1000000000"),
        (lambda card: card["options"].update(colour="red"), "no option 'colour'"),
        (lambda card: card["axis"].update(bins=16), "null_bins|is of shape"),
    ],
)
def test_weights_that_do_not_fit(
    model: Path, change: Callable[[dict[str, Any]], None], words: str
) -> None:
    change_card(model, change)
    if "null_bins" in words:
        change_card(model, lambda card: card.update(null_bins=[]))
    refused(model, words)


def test_weights_that_are_no_numbers(tmp_path: Path) -> None:
    path = tmp_path / "nan.safetensors"
    spoilt = trained("gru")
    with torch.no_grad():
        spoilt.network.skip.bias[3] = torch.nan
    save_model(path, spoilt)
    refused(path, "NaN")


def test_offsets_that_overlap(model: Path) -> None:
    header, data = header_of(model)
    first = next(name for name in header if name != "__metadata__")
    header[first]["data_offsets"] = [0, 4]
    rewrite(model, header, data)
    refused(model, "weights cannot be read|header is damaged")


def test_only_one_ending(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"ends in \.safetensors"):
        save_model(tmp_path / "model.pt", trained("none"))


class TestNames:
    @pytest.fixture(autouse=True)
    def folders(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.own, self.bundled = tmp_path / "own", tmp_path / "bundled"
        for folder in (self.own, self.bundled):
            folder.mkdir()
        monkeypatch.setattr(files, "user_models_folder", lambda: self.own)
        monkeypatch.setattr(
            files, "bundled_files", lambda pattern: sorted(self.bundled.glob(pattern))
        )

    def test_found_by_name(self, model: Path) -> None:
        save_model(self.bundled / "denoiser.safetensors", trained("none"))
        save_model(self.own / "mine.safetensors", trained("gru"))
        assert [card.name for card in available_models()] == ["denoiser", "mine"]
        assert load_model("mine").card.model == "gru"
        assert find_model(model) == model

    def test_the_users_own_comes_first(self) -> None:
        for folder, name in ((self.bundled, "none"), (self.own, "gru")):
            save_model(folder / "denoiser.safetensors", trained(name))
        assert [card.model for card in available_models()] == ["gru"]
        assert find_model("denoiser") == self.own / "denoiser.safetensors"

    def test_damaged_ones_are_not_offered_but_explained(self) -> None:
        (self.own / "bad.safetensors").write_bytes(b"nothing")
        assert available_models() == []
        with pytest.raises(Sd2Error, match=r"bad\.safetensors is no model file"):
            load_model("bad")

    def test_unknown_names_are_told_which_there_are(self) -> None:
        with pytest.raises(Sd2Error, match="sd2 train"):
            find_model("denoiser")
        save_model(self.own / "mine.safetensors", trained("none"))
        with pytest.raises(Sd2Error, match="one of mine"):
            find_model("denoiser")


def test_a_card_is_checked() -> None:
    card = trained("none").card
    for wrong in ({"frame_rate_hz": 0.0}, {"null_bins": (32,)}, {"trained_on": "dreams"}):
        with pytest.raises(Sd2Error):
            replace(card, **wrong)
    assert ModelCard.from_json(json.loads(json.dumps(card.to_json()))) == card


def test_a_network_larger_than_its_weights_is_not_built(model: Path) -> None:
    """As described it would take 25 GB."""
    change_card(model, lambda card: card["options"].update(channels=1024, depth=1024))
    with pytest.raises(Sd2Error, match=r"small\.safetensors: the weights are not those"):
        load_model(model)


def test_bytes_after_the_weights_are_refused(model: Path) -> None:
    model.write_bytes(model.read_bytes() + b"x")
    with pytest.raises(Sd2Error, match=r"small\.safetensors has .* as its header says"):
        describe_model(model)


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.safetensors")
    with pytest.raises(Sd2Error, match=r"pipe\.safetensors is a named pipe"):
        describe_model(tmp_path / "pipe.safetensors")
