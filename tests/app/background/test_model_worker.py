"""Denoising in another process: what comes back, and what happens when it dies."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import psutil
import pytest

from sd2app.background.model_worker.client import (
    COMMAND,
    ModelProcess,
    RemoteClassifier,
    RemoteDenoiser,
)
from sd2core.denoise.card import ModelCard
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.registry import build
from sd2core.denoise.scaling import Compression, Scaling
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase


def trained(kind, **options):
    import torch

    torch.manual_seed(3)
    network = build(kind, 32, **options)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.3 * torch.randn_like(parameter)
    card = ModelCard(
        model=kind,
        options=options,
        scaling=Scaling(Compression(0.01), Compression(1e-4)),
        axis=VelocityAxis(32, 2.0),
        null_bins=(14, 15, 16),
        frame_rate_hz=30.0,
        trained_on="simulated",
    )
    return TrainedDenoiser(network, card)


def a_map(frames=120, rate=30.0, **more):
    values = 0.02 * np.random.default_rng(1).exponential(size=(32, frames)).astype(np.float32)
    values[14:17] = 0.0
    about = {"null_bins": (14, 15, 16), "unit": "share of vertices"} | more
    return DopplerMap(
        values, VelocityAxis(32, 2.0), Timebase.regular(frames, rate, 1.5), "synthetic", **about
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    from sd2core.denoise.files import save_model

    folder = tmp_path_factory.mktemp("models")
    save_model(folder / "gru.safetensors", trained("gru", channels=8))
    save_model(folder / "unet.safetensors", trained("unet", channels=2))
    (folder / "text.safetensors").write_text("no model")
    return folder


@pytest.fixture(scope="module")
def process():
    process = ModelProcess()
    yield process
    process.close()
    children = psutil.Process().children()
    alive = [one for one in children if one.status() != psutil.STATUS_ZOMBIE]
    assert not any(COMMAND[-1] in one.cmdline() for one in alive)


def test_the_answer_is_that_of_the_library(process, folder):
    from sd2core.denoise.files import load_model

    present = np.ones(120, bool)
    present[40:55] = False
    given = a_map(present=present, meta={"sensor": {"position_m": [1, 0, 0]}})
    made = RemoteDenoiser(process, folder / "gru.safetensors").denoise(given)
    expected = load_model(folder / "gru.safetensors").denoise(given)
    np.testing.assert_allclose(made.values, expected.values, rtol=1e-5, atol=1e-10)
    assert made.values.any()
    assert (made.kind, made.unit, made.null_bins) == ("denoised", expected.unit, (14, 15, 16))
    assert made.meta == expected.meta
    np.testing.assert_array_equal(made.present, present)
    np.testing.assert_array_equal(made.times_s, given.times_s)


def test_frame_by_frame_it_is_the_same_where_the_model_is_causal(process, folder):
    given, answers = a_map(), {}
    for name in ("gru", "unet"):
        model = RemoteDenoiser(process, folder / f"{name}.safetensors")
        live = model.live()
        answers[name] = model.equals_batch
        one = np.ones(1, bool)
        stepped = np.stack([live.advance(frame[None], one)[0] for frame in given.values.T], axis=1)
        whole = model.denoise(given).values
        same = np.allclose(stepped, whole, rtol=1e-3, atol=1e-3 * whole.max())
        assert same == model.equals_batch
    assert answers == {"gru": True, "unet": False}


def test_what_is_wrong_is_said_and_the_process_goes_on(process, folder):
    with pytest.raises(Sd2Error, match=r"text.safetensors"):
        RemoteDenoiser(process, folder / "text.safetensors")
    with pytest.raises(Sd2Error, match=r"gone.safetensors"):
        RemoteDenoiser(process, folder / "gone.safetensors")
    model = RemoteDenoiser(process, folder / "gru.safetensors")
    with pytest.raises(Sd2Error, match="500 frames/s"):
        model.denoise(a_map(rate=500.0))
    assert model.denoise(a_map()).values.any()


@pytest.mark.slow
def test_one_that_died_is_started_again(process, folder):
    model = RemoteDenoiser(process, folder / "gru.safetensors")
    before = model.denoise(a_map()).values
    # Other tests of the same process may have others.
    children = psutil.Process().children()
    running = [one for one in children if one.status() != psutil.STATUS_ZOMBIE]
    worker = next(one for one in running if COMMAND[-1] in one.cmdline())
    worker.kill()
    worker.wait()
    np.testing.assert_array_equal(model.denoise(a_map()).values, before)


def test_what_is_closed_stays_closed(folder):
    process = ModelProcess()
    process.close()
    with pytest.raises(Sd2Error, match="closed"):
        RemoteDenoiser(process, folder / "gru.safetensors")


@pytest.mark.slow
def test_a_process_that_ends_at_once_is_an_error_in_words(folder):
    process = ModelProcess([sys.executable, "-c", "pass"])
    with pytest.raises(Sd2Error, match="has ended"):
        RemoteDenoiser(process, folder / "gru.safetensors")
    process.close()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "delay"), [("lstm", 0), ("s4", 9)])
def test_a_classifier_beside_the_denoisers_answers_as_the_library(
    process, folder, tmp_path, kind, delay
):
    import torch

    from sd2core.classify.card import ClassifierCard
    from sd2core.classify.files import load_classifier, save_classifier
    from sd2core.classify.live import TrainedClassifier
    from sd2core.classify.models import build

    torch.manual_seed(5)
    classes = ("background", "horizontal", "vertical")
    maps = VelocityAxis(32, 2.0), (14, 15, 16), 30.0
    card = ClassifierCard(kind, {}, *maps, "columns", classes, ("synthetic",), delay)
    path = tmp_path / "classifier.safetensors"
    save_classifier(path, TrainedClassifier(build(kind, card.features.size, 3), card))
    present = np.ones(120, bool)
    present[40:55] = False
    given = a_map(present=present)
    denoiser = RemoteDenoiser(process, folder / "gru.safetensors")
    classifier = RemoteClassifier(process, path)
    whole = classifier.probabilities(given)
    np.testing.assert_allclose(whole, load_classifier(path).probabilities(given), atol=1e-5)
    assert np.ptp(whole, axis=0).max() > 1e-3  # it does look at the map
    # Frame by frame and in pieces it is the same, with a denoiser asked in between.
    live, found = classifier.live(), []
    for start, stop in ((55, 56), (56, 70), (70, 71), (71, 120)):
        found.append(live.advance(given.values.T[start:stop]))
        denoiser.denoise(a_map())
        owed = live.finish()
    assert len(owed) == delay
    found.append(owed)
    np.testing.assert_allclose(np.concatenate(found), whole[55:], atol=1e-5)
    with pytest.raises(Sd2Error, match="is a denoiser"):
        RemoteClassifier(process, folder / "gru.safetensors")


@pytest.mark.slow
def test_the_window_itself_never_loads_torch():
    code = (
        "import sys\n"
        "import sd2app.shell.wiring\n"
        # It comes last, in a thread: everything else is usable while it loads.
        "assert 'vtkmodules' not in sys.modules, 'vtkmodules'\n"
        "import sd2app.denoise.model\n"
        "import sd2app.background.model_worker.client as library\n"
        "from sd2app.background.model_worker.client import ModelProcess\n"
        "process = ModelProcess()\n"
        "library.core_denoisers(process).available()\n"
        "library.core_classifiers(process).available()\n"
        "assert 'torch' not in sys.modules, 'torch'\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
