"""Keeps a folder as ``sd2 train`` does, and learns nothing.

``fake_train.py [--epochs-s S] [--die-at E] [--refuse TEXT] [--fail-at E] [--deaf] train DATA…
--model NAME --out RUN …`` or ``… train --resume RUN``.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from pathlib import Path

from sd2core.options.training import DataConfig, ModelConfig, TrainConfig, TrainingConfig
from sd2core.runs.control import Control
from sd2core.runs.progress import ProgressWriter
from sd2core.train.config import config_text, read_config
from sd2core.train.folder import TrainingFolder

STEPS = 4
"""Per epoch."""


class Ended(Exception):
    """By what is in it."""


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--step-s", type=float, default=0.0)
    parser.add_argument("--die-at", type=int, default=0)
    parser.add_argument("--fail-at", type=int, default=0)
    parser.add_argument("--rest-at", type=int, default=0)
    parser.add_argument("--refuse", default="")
    parser.add_argument("--deaf", action="store_true")
    parser.add_argument("--slow-start-s", type=float, default=0.0)
    parser.add_argument("command", choices=["train"])
    parser.add_argument("pairs", type=Path, nargs="*")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--resume", type=Path)
    parser.add_argument("--model", default="s4")
    parser.add_argument("--epochs", type=int, default=500)
    parser.add_argument("--background", action="store_true")
    for name in ("--batch-size", "--seed", "--early-stopping"):
        parser.add_argument(name, type=int)
    for name in ("--learning-rate", "--range-factor"):
        parser.add_argument(name, type=float)
    options = parser.parse_args()
    time.sleep(options.slow_start_s)
    if options.refuse:
        print(f"sd2: {options.refuse}", file=sys.stderr)
        return 1
    return train(options)


def train(options: argparse.Namespace) -> int:
    folder = TrainingFolder(options.resume or options.out)
    if options.resume is None:
        folder.create(options.model)
        config = TrainConfig(
            DataConfig(pairs=tuple(options.pairs)),
            ModelConfig(name=options.model),
            TrainingConfig(epochs=options.epochs, batch_size=options.batch_size or 64),
        )
        folder.config.write_text(config_text(config, folder.path), encoding="utf-8")
    config = read_config(folder.config)
    lock = folder.lock()
    control = Control(folder.control)
    if options.deaf:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    else:
        control.take_signals()
    folder.control.write_text("run\n") if options.resume else None
    first = int(folder.last.read_text()) if options.resume else 0
    writer = ProgressWriter(folder.progress)
    epochs = config.training.epochs
    resumed = {"resumed": True, "steps_done": first * STEPS} if first else {}
    folder.set_state("running")
    writer.say(
        "start", model=config.model.name, parameters=123456, device="cpu", epochs=epochs,
        steps_per_epoch=STEPS, train_segments=200, validation_segments=50,
        unix_s=time.time(), **resumed,
    )  # fmt: skip
    error = None
    try:
        for epoch in range(first + 1, epochs + 1):
            learn(options, folder, control, writer, epoch, epochs)
        outcome = "finished"
    except Ended as ending:
        outcome = str(ending)
    if outcome == "cancelled":
        writer.say("cancelling")
        folder.discard()
        return 0
    if outcome == "failed":
        error = {"found": "The loss is not a number", "expected": "finite errors",
                 "remedy": "Choose a lower learning rate"}  # fmt: skip
    writer.say("end", outcome=outcome, best_epoch=1, validation_rmse=0.1,
               validation_mae_mps=0.2, model="best.safetensors", error=error)  # fmt: skip
    folder.set_state(outcome)  # type: ignore[arg-type]
    lock.release()
    return 0


def learn(options, folder, control, writer, epoch: int, epochs: int) -> None:
    for step in range(1, STEPS + 1):
        done = (epoch - 1) * STEPS + step
        word = "run" if options.deaf else control.word()
        if word == "pause":
            writer.say("paused")
            folder.set_state("paused")
            word, _ = control.wait_while_paused()
            writer.say("resumed")
            folder.set_state("running")
        if word == "stop":
            writer.say("stopping")
            raise Ended("stopped")
        if word == "cancel":
            raise Ended("cancelled")
        time.sleep(options.step_s)
        writer.say(
            "step", epoch=epoch, step=done, steps=epochs * STEPS, train_rmse=1.0 / done,
            learning_rate=1e-3, elapsed_s=0.5 * done, left_s=0.5 * (epochs * STEPS - done),
        )  # fmt: skip
    if epoch == options.fail_at:
        raise Ended("failed")
    folder.best.write_bytes(b"a model")
    folder.last.write_text(str(epoch))
    writer.say(
        "epoch", epoch=epoch, step=epoch * STEPS, train_rmse=1.0 / epoch,
        validation_rmse=1.2 / epoch, validation_mae_mps=0.4 / epoch, best=True,
        elapsed_s=2.0 * epoch, left_s=2.0 * (epochs - epoch),
    )  # fmt: skip
    if epoch == options.die_at:
        os.kill(os.getpid(), signal.SIGKILL)
    if epoch == options.rest_at:
        while options.deaf or control.word() == "run":
            time.sleep(0.02)


if __name__ == "__main__":
    sys.exit(main())
